//! Passes with seeds of their own, merged:
//! `cargo run --release --example merged_passes [PICTURE.png]`.
//!
//! The photons of each pass are gone before the next, so that memory does not grow with the passes.

use std::{env, path::Path};

use caustica::{
    Gpu, Result, Scene, Session, Settings, Silent,
    image::{Tonemap, write_png},
    settings::PhotonSettings,
};

const PASSES: u32 = 4;

fn main() -> Result<()> {
    let path = env::args().nth(1).unwrap_or_else(|| "merged-passes.png".to_string());
    let scene = Scene::load("scenes/mirror-and-glass.gltf".as_ref())?;
    let settings = Settings::default().with(|s| {
        s.photons.global = 20_000;
        s.photons.caustic = 20_000;
        s.picture.size = Some((96, 96));
        s.picture.spp = 1;
    });
    let gpu = Gpu::open(None)?;
    let session = Session::open(&gpu, &scene, &settings.lights, &Silent)?;
    let pass = |seed: u32| {
        let photons = PhotonSettings { seed, ..settings.photons.clone() };
        let maps = session.photon_maps(&photons, &Silent)?;
        session.film(&maps, &settings.estimate, &settings.picture, &Silent)
    };
    let (mut film, _) = pass(0)?;
    for seed in 1..PASSES {
        film.merge(&pass(seed)?.0)?;
    }
    println!("{} passes, {} samples a pixel", film.passes(), film.samples());
    write_png(Path::new(&path), &film.finish(), 0.0, Tonemap::Neutral)
}
