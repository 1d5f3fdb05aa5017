//! What each option of the estimate costs and brings, in one run: `cargo bench --bench estimators`.
//!
//! First the seconds of the gather and the relMSE of S1 and S2 (tests/references, 128 x 128, 4 samples per pixel, 200,000 photons
//! a map, k = 100), each option against the defaults; then the errors where surfaces end, meet or curve, against closed forms.

#[path = "../tests/photons/mod.rs"]
mod photons;
#[path = "../tests/surfaces/mod.rs"]
mod surfaces;

use std::path::Path;

use caustica::{
    density::DensityKernel,
    gpu::Gpu,
    image::{difference::rel_mse, read_exr},
    progress::Silent,
    renderer::render,
    scene::Scene,
    settings::{Search, Settings},
};

fn main() {
    let gpu = Gpu::open(None).expect("an adapter");
    println!("{} ({})", gpu.name, gpu.driver);
    options(&gpu);
    places(&gpu);
}

/// Name and settings of each row.
fn rows() -> Vec<(String, Settings)> {
    let base =
        Settings { global_photons: 200_000, caustic_photons: 200_000, size: Some((128, 128)), ..Settings::default() };
    let mut rows = vec![
        ("defaults".to_string(), base.clone()),
        ("--raw-estimate".to_string(), Settings { raw_estimate: true, ..base.clone() }),
    ];
    rows.extend(
        DensityKernel::ALL
            .into_iter()
            .skip(1)
            .map(|kernel| (format!("--kernel {}", kernel.name()), Settings { kernel, ..base.clone() })),
    );
    let radius = Settings { search: Search::Radius, radius: Some(0.06), ..base.clone() };
    rows.push(("--search radius --radius 0.06".to_string(), radius));
    rows.push(("--share 0".to_string(), Settings { share_reach: 0.0, ..base.clone() }));
    let raw = Settings { share_reach: 0.0, raw_estimate: true, ..base.clone() };
    rows.push(("--share 0 --raw-estimate".to_string(), raw));
    rows.push(("--final-gather 16".to_string(), Settings { final_gather: 16, ..base }));
    rows
}

fn options(gpu: &Gpu) {
    println!("{:<30} {:>9} {:>9} {:>9} {:>9}", "", "S1 s", "S1 relMSE", "S2 s", "S2 relMSE");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    for (name, settings) in rows() {
        let cells = ["S1", "S2"].map(|scene| {
            let reference = read_exr(&folder.join(format!("{scene}_128.exr"))).expect("the reference reads");
            let scene = Scene::load(&folder.join(format!("{scene}.glb"))).expect("the scene loads");
            // Drivers compile a kernel when it first runs: a small picture first.
            let small = Settings { size: Some((16, 16)), ..settings.clone() };
            render(gpu, &scene, &small, &Silent).expect("it renders");
            let done = render(gpu, &scene, &settings, &Silent).expect("it renders");
            let error = rel_mse(&done.frame.radiance, &reference.radiance, None);
            format!("{:>9.2} {error:>9.5}", done.stats.seconds.gather)
        });
        println!("{name:<30} {}", cells.join(" "));
    }
}

fn places(gpu: &Gpu) {
    let ways = surfaces::ways().map(|(name, _)| name);
    println!("\n{:<26} {}", "error of the mean, %", ways.map(|way| format!("{way:>16}")).join(""));
    for place in surfaces::places(400) {
        let errors = surfaces::estimates(gpu, &place, 8).map(|found| 100.0 * surfaces::bias(&place, &found));
        println!("{:<26} {}", place.name, errors.map(|error| format!("{error:>16.1}")).join(""));
    }
}
