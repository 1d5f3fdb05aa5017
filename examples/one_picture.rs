//! One picture, and how far it is:
//! `cargo run --release --example one_picture [SCENE [PICTURE.exr]]`.

use std::{env, path::Path};

use caustica::{Gpu, Progress, Result, Scene, Settings, Stage, image::write_exr, render};

/// Prints each stage once it is done.
struct Print;

impl Progress for Print {
    fn report(&self, stage: Stage, done: u64, total: u64) {
        if done > 0 && done == total {
            println!("{stage:?}: {done}");
        }
    }

    fn stop_requested(&self) -> bool {
        false
    }
}

fn main() -> Result<()> {
    let mut arguments = env::args().skip(1);
    let scene = arguments.next().unwrap_or_else(|| "scenes/mirror-and-glass.gltf".to_string());
    let picture = arguments.next().unwrap_or_else(|| "one-picture.exr".to_string());
    let scene = Scene::load(Path::new(&scene))?;
    let settings = Settings::default().with(|s| {
        s.photons.global = 20_000;
        s.photons.caustic = 20_000;
        s.picture.size = Some((96, 96));
        s.picture.spp = 1;
    });
    let gpu = Gpu::open(None)?;
    println!("{} ({})", gpu.name, gpu.driver);
    let made = render(&gpu, &scene, &settings, &Print)?;
    for warning in &made.stats.warnings {
        println!("warning: {warning}");
    }
    write_exr(Path::new(&picture), &made.frame, &scene.origin(&settings, &made.stats))
}
