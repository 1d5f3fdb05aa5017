//! Pictures by three cameras from the same photons:
//! `cargo run --release --example many_cameras [FOLDER]`.

use std::{env, path::PathBuf};

use caustica::{
    Gpu, Result, Scene, Session, Settings, Silent,
    image::{Tonemap, write_png},
    settings::PictureSettings,
};

/// Distance between neighbouring cameras, metres.
const STEP: f32 = 0.1;

fn main() -> Result<()> {
    let folder = PathBuf::from(env::args().nth(1).unwrap_or_else(|| ".".to_string()));
    let mut scene = Scene::load("scenes/mirror-and-glass.gltf".as_ref())?;
    let first = scene.cameras[0].clone();
    for (name, steps) in [("left", -1.0), ("right", 1.0)] {
        let position = first.position + steps * STEP * first.right;
        scene.cameras.push(caustica::scene::Camera { name: name.to_string(), position, ..first.clone() });
    }
    let settings = Settings::default().with(|s| {
        s.photons.global = 20_000;
        s.photons.caustic = 20_000;
        s.picture.size = Some((96, 96));
        s.picture.spp = 1;
    });
    let gpu = Gpu::open(None)?;
    let session = Session::open(&gpu, &scene, &settings.lights, &Silent)?;
    let maps = session.photon_maps(&settings.photons, &Silent)?;
    for camera in &scene.cameras {
        let picture = PictureSettings { camera: Some(camera.name.clone()), ..settings.picture.clone() };
        let made = session.picture(&maps, &settings.estimate, &picture, &Silent)?;
        write_png(&folder.join(format!("{}.png", camera.name)), &made.frame, 0.0, Tonemap::Neutral)?;
        println!("{}: {:.2} s", camera.name, made.stats.seconds.camera);
    }
    Ok(())
}
