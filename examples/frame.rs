//! Draws the stages of one frame, the pictures of `docs/frame.md`, by default of
//! `scenes/mirror-and-glass.gltf`: `cargo run --release --example frame -- OUTDIR [SCENE]`.
//!
//! Exposes all pictures of radiance alike, so that they can be compared.

use std::{error::Error, path::Path};

use caustica::{
    gpu::Gpu,
    image::{Canvas, Frame, Rgb8, Tonemap, srgb_encode, write_file},
    layout::{Gathered, VisiblePoint},
    map_kind::MapKind,
    passes::{Gather, GatherOptions, GatherSettings, PhotonMap, estimate::gather::gathered_buffer},
    progress::Silent,
    renderer::{PhotonMaps, Render, Session},
    scene::{Camera, Scene},
    settings::{ExtraLayers, Mode, Quality, Settings},
};
use glam::Vec3;

/// Pixels along the sides of all pictures.
const SIZE: u32 = 224;
/// Photons of a map that are drawn, at most: more would cover the picture.
const DOTS: usize = 10_000;
/// Largest relative difference between the sum of the stages and the picture of one render: only
/// the order of additions differs.
const TOLERANCE: f32 = 1e-4;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let folder = words.next().ok_or("usage: frame OUTDIR [SCENE]")?;
    let scene = words.next().unwrap_or_else(|| "scenes/mirror-and-glass.gltf".to_owned());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let (gpu, scene) = (Gpu::open(None)?, Scene::load(Path::new(&scene))?);
    let settings = Settings::default().with(|s| s.picture.size = Some((SIZE, SIZE)));
    let mode = |mode| settings.clone().with(|s| s.photons.mode = mode);
    let (direct, indirect) = (mode(Mode::DirectRays), mode(Mode::IndirectPhotons));
    let session = Session::open(&gpu, &scene, &settings.lights, &Silent)?;
    let save = |name: &str, canvas: Canvas| -> Result<()> {
        Ok(write_file(&folder.join(format!("{name}.png")), &canvas.to_png()?)?)
    };

    // One sample at each pixel's centre, for quantities at one point.
    let centers = direct.clone().with(|s| s.picture.spp = 1);
    let no_maps = maps(&session, &direct)?;
    let first_hits = picture(&session, &no_maps, &centers)?.frame;
    save("depth", depth(&first_hits))?;
    save("normals", painted(|i| first_hits.normal()[i].map(|c| byte(0.5 + 0.5 * c))))?;
    save("albedo", painted(|i| first_hits.albedo()[i].map(|c| byte(srgb_encode(c)))))?;

    let by_rays = picture(&session, &no_maps, &direct)?;
    save("direct", radiance(by_rays.frame.radiance()))?;
    let mut sum = by_rays.frame.radiance().to_vec();

    let view = View { camera: scene.camera(None)?, first_hits: &first_hits };
    for (name, kind) in [("global", MapKind::Global), ("caustic", MapKind::Caustic)] {
        let one_map = maps(&session, &indirect)?.only(kind);
        let map = one_map.maps().first().ok_or("the scene leaves this map empty")?;
        save(&format!("{name}-photons"), view.photons(&gpu, map)?)?;
        save(&format!("{name}-radii"), view.radii(&gpu, map, &view.points(&scene), &indirect)?)?;
        let estimate = picture(&session, &one_map, &indirect)?.frame;
        save(&format!("{name}-estimate"), radiance(estimate.radiance()))?;
        add(&mut sum, estimate.radiance());
    }
    save("sum", radiance(&sum))?;
    compare_with_one_go(&session, &settings, &sum)?;

    final_gathering(&session, &save)
}

fn maps(session: &Session, settings: &Settings) -> caustica::Result<PhotonMaps> {
    session.photon_maps(&settings.photons, &Silent)
}

fn picture(session: &Session, maps: &PhotonMaps, settings: &Settings) -> caustica::Result<Render> {
    session.picture(maps, &settings.estimate, &settings.picture, &Silent)
}

/// Adds light to that of each pixel.
fn add(sum: &mut [[f32; 3]], light: &[[f32; 3]]) {
    for (sum, pixel) in sum.iter_mut().zip(light) {
        *sum = (Vec3::from(*sum) + Vec3::from(*pixel)).to_array();
    }
}

/// Compares the sum of the stages with the picture of one render, and prints that render's seconds.
fn compare_with_one_go(session: &Session, settings: &Settings, sum: &[[f32; 3]]) -> Result<()> {
    let Render { frame, stats } = picture(session, &maps(session, settings)?, settings)?;
    println!("photons stored: {} global, {} caustic", stats.photons.global.stored, stats.photons.caustic.stored);
    println!("seconds: {:?}", stats.seconds);
    check_sum(sum, frame.radiance())
}

/// Checks that the stages add up to the picture.
fn check_sum(sum: &[[f32; 3]], whole: &[[f32; 3]]) -> Result<()> {
    let relative = |(a, b): (&[f32; 3], &[f32; 3])| {
        let (a, b) = (Vec3::from(*a), Vec3::from(*b));
        (a - b).abs().max_element() / b.max_element().max(1e-3)
    };
    let difference = sum.iter().zip(whole).map(relative).fold(0.0, f32::max);
    println!("largest relative difference between the sum of the stages and one render: {difference:.1e}");
    if difference > TOLERANCE { Err("the stages do not add up".into()) } else { Ok(()) }
}

/// Draws the light that final gathering finds at points like those of the records, the same
/// filtered for every sample, and the picture with it.
fn final_gathering(session: &Session, save: &dyn Fn(&str, Canvas) -> Result<()>) -> Result<()> {
    let settings = Quality::Normal.settings().with(|s| {
        s.picture.size = Some((SIZE, SIZE));
        s.picture.layers = vec![ExtraLayers::Components];
    });
    let maps = maps(session, &settings)?;
    let spacing = settings.estimate.gather_spacing;
    let side = SIZE.div_ceil(spacing);
    // Without spacing, the light of each point is that of its own rays.
    let coarse = settings.clone().with(|s| {
        (s.picture.size, s.picture.spp) = (Some((side, side)), 1);
        s.estimate.gather_spacing = 0;
    });
    let records = component(&picture(session, &maps, &coarse)?.frame, "global")?;
    let record = |i: u32| records[(i / SIZE / spacing * side + i % SIZE / spacing) as usize];
    let records: Vec<_> = (0..SIZE * SIZE).map(record).collect();
    save("records", radiance(&records))?;

    let Render { frame, stats } = picture(session, &maps, &settings)?;
    save("filtered", radiance(&component(&frame, "global")?))?;
    save("final-gather", radiance(frame.radiance()))?;
    println!("seconds with final gathering: {:?}", stats.seconds);
    let mut sum = component(&frame, "emission")?;
    for name in ["direct", "global", "caustic"] {
        add(&mut sum, &component(&frame, name)?);
    }
    check_sum(&sum, frame.radiance())
}

/// Radiance of a component of the light.
fn component(frame: &Frame, name: &str) -> Result<Vec<[f32; 3]>> {
    let channel = |color: char| {
        let channel = format!("{name}.{color}");
        let found = frame.extras().find(|(other, _)| **other == *channel).map(|(_, numbers)| numbers);
        found.ok_or_else(|| format!("the picture has no {channel}"))
    };
    let (red, green, blue) = (channel('R')?, channel('G')?, channel('B')?);
    Ok((0..frame.pixels()).map(|i| [red[i], green[i], blue[i]]).collect())
}

/// A picture of a colour for each pixel, by its index.
fn painted(color: impl Fn(usize) -> Rgb8) -> Canvas {
    let mut canvas = Canvas::new(SIZE, SIZE, [0; 3]);
    for i in 0..SIZE * SIZE {
        canvas.set(i % SIZE, i / SIZE, color(i as usize));
    }
    canvas
}

fn byte(value: f32) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

/// Radiance as `caustica render` shows it.
fn radiance(pixels: &[[f32; 3]]) -> Canvas {
    painted(|i| Tonemap::Neutral.apply(pixels[i]).map(|c| byte(srgb_encode(c))))
}

/// Depth, the nearest first hit white and the farthest dark.
fn depth(frame: &Frame) -> Canvas {
    let hit = |d: &f32| *d > 0.0;
    let least = frame.depth().iter().copied().filter(hit).fold(f32::INFINITY, f32::min);
    let most = frame.depth().iter().copied().fold(least, f32::max);
    println!("depth: {least:.2} m white to {most:.2} m dark");
    let grey = |d: f32| if hit(&d) { 1.0 - 0.85 * (d - least) / (most - least).max(1e-6) } else { 0.0 };
    painted(|i| [byte(grey(frame.depth()[i])); 3])
}

/// The camera, and the first hits at the centres of pixels.
struct View<'a> {
    camera: &'a Camera,
    first_hits: &'a Frame,
}

impl View<'_> {
    /// Half the height of the picture at distance 1 along the axis. Pictures are square.
    fn half(&self) -> f32 {
        self.camera.half_height_at(1.0, (SIZE, SIZE))
    }

    /// Position that the centre of a pixel sees first.
    fn position(&self, i: usize) -> Vec3 {
        let from_middle = |at: usize| (at as f32 + 0.5) / SIZE as f32 * 2.0 - 1.0;
        let (x, y) = (from_middle(i % SIZE as usize), -from_middle(i / SIZE as usize));
        let Camera { position, right, up, forward, .. } = *self.camera;
        position + self.first_hits.depth()[i] * (forward + self.half() * (x * right + y * up))
    }

    /// Pixel that shows a position, if it is in view and nothing hides it.
    fn pixel(&self, position: Vec3) -> Option<usize> {
        let Camera { position: eye, right, up, forward, .. } = *self.camera;
        let way = position - eye;
        let depth = way.dot(forward);
        let along = |axis: Vec3| (way.dot(axis) / (depth * self.half()) * 0.5 + 0.5) * SIZE as f32;
        let (x, y) = (along(right), along(-up));
        let inside = |v: f32| (0.0..SIZE as f32).contains(&v);
        if depth <= 0.0 || !inside(x) || !inside(y) {
            return None;
        }
        let i = y as usize * SIZE as usize + x as usize;
        // The first hit is that of the pixel's centre, and depth varies within a pixel.
        (depth < 1.02 * self.first_hits.depth()[i]).then_some(i)
    }

    /// Photons as dots, coloured by their flux.
    fn photons(&self, gpu: &Gpu, map: &PhotonMap) -> Result<Canvas> {
        let (photons, fluxes) = map.read(gpu)?;
        let mut dots = vec![None; (SIZE * SIZE) as usize];
        let step = photons.len().div_ceil(DOTS);
        for (photon, flux) in photons.iter().zip(&fluxes).step_by(step) {
            let flux = Vec3::from(flux.flux);
            if let Some(i) = self.pixel(Vec3::from(photon.position)) {
                dots[i] = Some(flux / flux.max_element().max(f32::MIN_POSITIVE));
            }
        }
        println!("photons in a map: {}, of which one in {step} is drawn", photons.len());
        Ok(painted(|i| dots[i].map_or([0; 3], |c: Vec3| c.to_array().map(|c| byte(srgb_encode(c))))))
    }

    /// Queries at the first hits; not valid on mirrors and glass, where no photon is stored.
    fn points(&self, scene: &Scene) -> Vec<VisiblePoint> {
        let on_delta = |p: Vec3| {
            let spheres = scene.spheres.iter().filter(|s| scene.materials[s.material as usize].surface.is_specular());
            spheres.into_iter().any(|s| ((p - s.center).length() / s.radius - 1.0).abs() < 1e-3)
        };
        let point = |i: usize| {
            let (position, normal) = (self.position(i), self.first_hits.normal()[i]);
            let next_map = u32::from(self.first_hits.alpha()[i] > 0.0 && !on_delta(position));
            let position = position.to_array();
            VisiblePoint { position, next_map, weight: [1.0; 3], ng: normal, ns: normal, ..VisiblePoint::default() }
        };
        (0..(SIZE * SIZE) as usize).map(point).collect()
    }

    /// Radius of the raw estimate at each point, on a scale of colours.
    fn radii(&self, gpu: &Gpu, map: &PhotonMap, points: &[VisiblePoint], settings: &Settings) -> Result<Canvas> {
        let count = SIZE * SIZE;
        let asked = gpu.storage_with("points", points)?;
        let radiance = gpu.storage_with("radiance", &vec![[0.0_f32; 4]; points.len()])?;
        let gathered = gathered_buffer(gpu, count)?;
        let estimate = GatherSettings::from(&settings.estimate);
        let mut gather = Gather::new(gpu, GatherOptions::default());
        gather.run(gpu, map, &asked, count, &estimate, (&radiance, &gathered), &Silent)?;
        let found: Vec<Gathered> = gpu.read(&gathered, 0, count.into())?;
        let radius = |i: usize| if points[i].next_map == 0 { 0.0 } else { found[i].radius_squared.sqrt() };
        let valid = (0..points.len()).map(radius).filter(|r| *r > 0.0);
        let (least, most) = valid.fold((f32::INFINITY, 0.0_f32), |(l, m), r| (l.min(r), m.max(r)));
        println!("radii: {least:.4} m dark to {most:.4} m bright, logarithmic");
        // Logarithmic: radii inside and outside of a caustic differ by orders of magnitude.
        let scaled = |r: f32| (r / least).ln() / (most / least).ln();
        Ok(painted(|i| if radius(i) > 0.0 { heat(scaled(radius(i))) } else { [0; 3] }))
    }
}

/// Dark violet at 0 to bright yellow at 1.
fn heat(t: f32) -> Rgb8 {
    let color = colorous::INFERNO.eval_continuous(f64::from(0.15 + 0.85 * t.clamp(0.0, 1.0)));
    [color.r, color.g, color.b]
}
