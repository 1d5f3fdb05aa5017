//! Single rays through the kernel that traces camera paths.

use caustica::{
    bvh::Bvh,
    layout::{CameraTile, Counters, FirstHit, LobePoint, NOTHING_LEFT, Path, VisiblePoint},
    scene::Scene,
    settings::LightSettings,
    upload::SceneBuffers,
};
use glam::Vec3;

use crate::gpu;

/// Traces one step of rays (origin and direction) with these override constants. Returns the
/// counters and the first hit of each ray.
pub fn trace(scene: &Scene, constants: &[(&str, f64)], rays: &[(Vec3, Vec3)]) -> (Counters, Vec<FirstHit>) {
    let gpu = gpu();
    let count = rays.len() as u64;
    let buffers = SceneBuffers::new(gpu, scene, &Bvh::build(scene), &LightSettings::default()).expect("the scene fits");
    let kernel = buffers.kernel_with(gpu, "trace_camera", constants);
    let path = |&(origin, direction): &(Vec3, Vec3)| Path {
        origin: origin.to_array(),
        direction: direction.normalize().to_array(),
        beta: [1.0; 3],
        left: NOTHING_LEFT,
        ..Path::default()
    };
    let paths = gpu.storage_with("paths", &rays.iter().map(path).collect::<Vec<_>>()).expect("fits");
    let (all, none) = (0..rays.len() as u32, vec![0; rays.len()]);
    let queues = gpu.storage_with("queues", &all.chain(none).collect::<Vec<_>>()).expect("fits");
    let start = Counters { current: rays.len() as u32, ..Counters::default() };
    let counters = gpu.storage_with("counters", &[start]).expect("fits");
    let points = gpu.storage::<VisiblePoint>("points", count).expect("fits");
    let first_hits = gpu.storage::<FirstHit>("first hits", count).expect("fits");
    let radiance = gpu.storage::<[f32; 4]>("radiance", count).expect("fits");
    let lobe_points = gpu.storage::<LobePoint>("lit lobes", 1).expect("fits");
    let tile = gpu.uniform("tile", &CameraTile { samples: 1, branches: 1, ..CameraTile::default() });
    let own = [
        ("tile", &tile),
        ("paths", &paths),
        ("queues", &queues),
        ("counters", &counters),
        ("points", &points),
        ("first_hits", &first_hits),
        ("radiance", &radiance),
        ("lobe_points", &lobe_points),
    ];
    let bindings = kernel.bind(gpu, &buffers.with(&own));
    let mut commands = gpu.encoder();
    kernel.dispatch(&mut commands, &bindings, count);
    gpu.submit(commands);
    let counted = gpu.read(&counters, 0, 1).expect("counters read back")[0];
    (counted, gpu.read(&first_hits, 0, count).expect("hits read back"))
}
