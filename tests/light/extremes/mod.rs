//! Numbers and scenes at the limits of single precision, or beyond: the picture stays finite.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | media: camera | from inside of nested glass, radiance n² L and total reflection as Bouguer's invariant says | other glass |
//! | media: light | from inside of nested glass all power leaves that is not trapped | nearer to the centre |
//! | media: emitters | paths from bulbs, panels and emissive glass start in the medium around them | a bulb beside the glass |
//! | media: final gathering | in nested glass it gives what the map holds there | half the light |
//! | media: shared | object, light and camera in the same glass: rays and photons agree | half the light |
//! | numbers: overflow | lights of 3e38: numbers out of range are counted by stage, the film is finite | an ordinary light counts none |
//! | numbers: strength | lights of 1e-6, 1e9 and 1e30 give the same picture times a factor | another seed |
//! | numbers: albedo | 0, and exactly 1: paths end, no energy is made or lost | an albedo of 0.9 |
//! | geometry: edges | no ray slips between triangles | a mesh with one missing |
//! | geometry: diagonal | a quad's diagonal does not show at any magnification | a gap of 10 µm does |
//! | geometry: degenerate | triangles without area, needles and specks leave no trace | a real triangle does |
//! | geometry: coincident | of like quads always the same one is seen; glass on a floor does not leak | glass without a floor |
//! | geometry: grazing | lights on surfaces and along walls | – |
//! | geometry: scale | of 2⁻⁷ and 2¹³: the same bits; of 7 mm and 10 km: the same picture | light not scaled |
//! | geometry: far | a scene 1,000 km away has the same bits; vertices there only the file's rounding | 100 m aside |

mod geometry;
mod media;
mod numbers;

use caustica::{
    bvh::Bvh,
    passes::{PhotonTracer, RawMap, TracedPhotons},
    progress::Silent,
    renderer::Render,
    scene::Scene,
    settings::Settings,
    upload::SceneBuffers,
};
use support::gpu;

/// The first pass alone.
fn traced(scene: &Scene, settings: &Settings) -> TracedPhotons {
    let buffers = SceneBuffers::new(gpu(), scene, &Bvh::build(scene), &settings.lights).expect("the scene fits");
    let tracer = PhotonTracer::new(gpu(), &buffers, settings.photons.sampler);
    tracer.trace(gpu(), &buffers, &settings.photons, scene.has_specular(), &Silent).expect("photons trace")
}

/// Flux of a map's photons, W in the first channel.
fn flux(map: &RawMap) -> f64 {
    let photons = map.read(gpu()).expect("photons read back");
    photons.iter().map(|photon| f64::from(photon.flux[0])).sum::<f64>() / map.emitted as f64
}

/// Whether all numbers of the picture are finite.
fn is_finite(render: &Render) -> bool {
    let frame = &render.frame;
    let mut triples = frame.radiance().iter().chain(frame.normal()).chain(frame.albedo()).flatten();
    triples.all(|x| x.is_finite()) && frame.alpha().iter().chain(frame.depth()).all(|x| x.is_finite())
}
