//! Progressive passes, summed in the order that makes the bits independent of who renders which:
//! `cargo run --release --example merged_passes [PICTURE.png]`.
//!
//! The photons of each pass are gone before the next, so that memory grows only with the logarithm
//! of the number of passes.

use std::{env, path::Path};

use caustica::{
    Gpu, Progressive, Result, Scene, Session, Settings, Silent,
    image::{ErrorEstimate, PassBlock, PassSum, Tonemap, write_png},
    settings::PassSettings,
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
    let progressive = Progressive::new(&session, &settings, PassSettings::default())?;
    let mut sum = PassSum::default();
    for index in 0..PASSES {
        let (film, stats) = progressive.render(index, &Silent)?;
        sum.push(PassBlock::of_pass(index, film, &stats))?;
    }
    let total = sum.total()?.expect("there are passes");
    let error = ErrorEstimate::of(total.film(), None).expect("there are several passes");
    println!("{PASSES} passes, estimated error {:.1} %", 100.0 * error.total());
    write_png(Path::new(&path), &total.film().finish(), 0.0, Tonemap::Neutral)
}
