//! Pictures of materials against references of another renderer's geometry and its own formulas,
//! see `tests/references/README.md`: a wrong formula shows.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | P1 | relMSE in blocks of 8x8 pixels of metal, dielectrics, textures and mapped normals | without further reflections in metal |
//! | P2 | the same of rough and absorbing glass | rougher |

use std::path::Path;

use caustica::{
    image::{difference::rel_mse, read_exr},
    scene::{LoadOptions, Scene},
    settings::Mode,
};
use support::*;

/// Pixels along a side of a block, over which noise is averaged.
const BLOCK: usize = 8;
const SIZE: usize = 64;

/// relMSE of blocks of a picture of `name`, with its materials as many times as rough, against the
/// reference `reference`. The worst block does not count: it may have one bright sample.
fn error(name: &str, reference: &str, options: &LoadOptions, rougher: f32) -> f64 {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let mut scene = Scene::load_with(&folder.join(format!("{name}.glb")), options).expect("the scene loads");
    scene.materials.iter_mut().for_each(|material| material.roughness = (rougher * material.roughness).min(1.0));
    let settings = settings(Mode::Hybrid, 120_000, SIZE as u32).with(|s| s.picture.spp = 16);
    let picture = blocks(render_scene(&scene, &settings).frame.radiance(), BLOCK);
    let reference = read_exr(&folder.join(format!("{reference}_128.exr"))).expect("the reference reads");
    let reference = blocks(reference.radiance(), BLOCK * 128 / SIZE);
    let mut errors: Vec<f64> = picture.iter().zip(&reference).map(|(a, b)| rel_mse(&[*a], &[*b], None)).collect();
    errors.sort_by(f64::total_cmp);
    errors.pop();
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn metal_dielectrics_and_textures() {
    let of = |single_scattering: bool| {
        error("P1", "P1hcms", &LoadOptions { single_scattering, ..LoadOptions::default() }, 1.0)
    };
    let (right, single) = (of(false), of(true));
    assert!(right < 2e-4, "relMSE {right}");
    assert!(single > 3e-4, "control: without further reflections the relMSE is {single}");
}

#[test]
fn rough_and_absorbing_glass() {
    let of = |rougher: f32| error("P2", "P2", &LoadOptions::default(), rougher);
    let right = of(1.0);
    assert!(right < 1.8e-4, "relMSE {right}");
    let rougher = of(1.5);
    assert!(rougher > 5e-4, "control: 1.5 times as rough it is {rougher}");
}
