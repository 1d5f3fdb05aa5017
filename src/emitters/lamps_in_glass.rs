//! Lamps in glass: the filament of a bulb, a candle in a jar. No ray to a light passes the
//! glass, so that of the rays that rough lobes send on, few would show them, and brightly. These
//! are aimed at such lamps instead, or at glass that is rough itself.

use std::f32::consts::TAU;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    light_table::LightTable,
    targets::{Item, Target, connected, parts, scene_target, sphere_around, spheres_around},
};
use crate::{
    layout::{self, BrightPatch},
    scene::{Bounds, Material, Scene, SharedMesh, instance_bounds},
};

/// Patches of lamps in glass at most.
pub const MAX_LAMP_PATCHES: usize = 64;
/// Roughness from which on glass is what is seen of a lamp in it.
const ROUGH: f32 = 0.05;
/// Lamps times parts of glass that are compared at most.
const MOST_COMPARED: usize = 50_000_000;
/// Pieces into which the triangles of lamps are cut at most, so that spheres can follow long ones,
/// and lengths that are tried for their edges, as fractions of the extent of all.
const MOST_PIECES: usize = 8192;
const LENGTHS: [f32; 6] = [0.01, 0.03, 0.1, 0.3, 1.0, f32::INFINITY];

/// Lamps in glass, for rays to be aimed at.
#[derive(Clone, Debug, Default)]
pub struct LampsInGlass {
    pub patches: Vec<BrightPatch>,
    /// Irradiance by all lights if they were spread evenly over the sphere around the scene, in the
    /// units of [`BrightPatch::power`].
    pub mean_light: f32,
}

impl LampsInGlass {
    /// The emissive surfaces that lie within the bounds of one part of glass, other than of panes
    /// that rays to lights pass.
    #[must_use]
    pub fn new(scene: &Scene, table: &LightTable) -> Self {
        // Parts of large meshes take long to find, and most scenes have no lamp near glass.
        let all = GlassPart::bounds_of_all(scene);
        let may_be = |light: &layout::Light| shape(light).is_some_and(|item| holds(&all, item));
        if !table.lights.par_iter().any(may_be) {
            return Self::default();
        }
        let glass: Vec<GlassPart> = [false, true].into_iter().flat_map(|rough| GlassPart::of(scene, rough)).collect();
        if glass.len().saturating_mul(table.lights.len()) > MOST_COMPARED {
            return Self::default();
        }
        // The widest, rough ones before others.
        let part_around = |item: Item| {
            let around = glass.iter().filter(|part| holds(&part.bounds, item));
            around.max_by(|a, b| a.is_rough.cmp(&b.is_rough).then(a.sphere.radius.total_cmp(&b.sphere.radius)))
        };
        let lamp = |i: usize| {
            let (item, power) = (shape(&table.lights[i])?, table.power_of(i as u32));
            (power > 0.0).then_some(())?;
            Some((item, power, part_around(item)?))
        };
        let lamps: Vec<(Item, f64, &GlassPart)> = (0..table.lights.len()).into_par_iter().filter_map(lamp).collect();
        let (rough, clear): (Vec<_>, Vec<_>) = lamps.into_iter().partition(|(.., part)| part.is_rough);
        let within = |part: &GlassPart| -> f64 {
            rough.iter().filter(|(.., own)| std::ptr::eq(*own, part)).map(|(_, power, _)| power).sum()
        };
        let rough_parts = glass.iter().filter(|part| part.is_rough);
        let mut patches: Vec<BrightPatch> = rough_parts.filter_map(|part| patch(part.sphere, within(part))).collect();
        patches.sort_by(|a, b| b.power.total_cmp(&a.power));
        patches.truncate(MAX_LAMP_PATCHES / 2);
        let lamps: Vec<(Item, f64)> = clear.into_iter().map(|(item, power, _)| (item, power)).collect();
        patches.extend(patches_of(&lamps, (MAX_LAMP_PATCHES - patches.len()) as u32));
        let around = f64::from(scene_target(scene).radius);
        let mean_light = 3.0 * table.power() / (2.0 * f64::from(TAU) * around * around);
        Self { patches, mean_light: mean_light as f32 }
    }
}

/// A part of glass that rays to lights do not pass.
struct GlassPart {
    sphere: Target,
    bounds: Bounds,
    is_rough: bool,
}

impl GlassPart {
    fn of(scene: &Scene, is_rough: bool) -> impl Iterator<Item = Self> {
        let wanted = |material: u32| {
            let material = &scene.materials[material as usize];
            stops_light(material) && (material.roughness > ROUGH) == is_rough
        };
        parts(scene, wanted).into_iter().map(move |part| {
            let bounds = part.iter().map(Item::bounds).fold(Bounds::EMPTY, Bounds::union);
            Self { sphere: sphere_around(&part), bounds, is_rough }
        })
    }

    fn bounds_of_all(scene: &Scene) -> Bounds {
        let wanted: Vec<bool> = scene.materials.iter().map(stops_light).collect();
        let triangles = scene.triangles.iter().filter(|t| wanted[t.material as usize]).map(Bounds::from);
        let spheres = scene.spheres.iter().filter(|s| wanted[s.material as usize]).map(Bounds::from);
        let has = |mesh: &SharedMesh| mesh.triangles.iter().any(|t| wanted[t.material as usize]);
        let meshes: Vec<bool> = scene.meshes.iter().map(has).collect();
        let boxes = scene.instances.iter().zip(instance_bounds(&scene.meshes, &scene.instances));
        let instances = boxes.filter(|(instance, _)| meshes[instance.mesh as usize]).map(|(_, bounds)| {
            // As wide as the sphere that stands for an instance among parts.
            let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * bounds.diagonal());
            Bounds { min: middle - half, max: middle + half }
        });
        triangles.chain(spheres).chain(instances).fold(Bounds::EMPTY, Bounds::union)
    }
}

fn stops_light(material: &Material) -> bool {
    material.surface.transmits() && !material.is_clear_pane()
}

fn holds(bounds: &Bounds, item: Item) -> bool {
    let Bounds { min, max } = item.bounds();
    bounds.min.cmple(min).all() && bounds.max.cmpge(max).all()
}

/// What emits, of a light that rays may meet.
fn shape(light: &layout::Light) -> Option<Item> {
    let [position, e1, e2] = [light.position, light.e1, light.e2].map(Vec3::from_array);
    match light.kind {
        layout::TRIANGLE_LIGHT => Some(Item::Triangle([position, position + e1, position + e2])),
        layout::SPHERE_LIGHT => Some(Item::Sphere(position, e1.x)),
        _ => None,
    }
}

/// Spheres around the lamps, at most so many.
fn patches_of(lamps: &[(Item, f64)], most: u32) -> Vec<BrightPatch> {
    let Bounds { min, max } = lamps.iter().map(|(item, _)| item.bounds()).fold(Bounds::EMPTY, Bounds::union);
    let extent = (max - min).max_element();
    let count = |length: &f32| lamps.iter().map(|(item, _)| cuts(*item, *length).pow(2) as usize).sum::<usize>();
    let length = LENGTHS.map(|part| part * extent).into_iter().find(|length| count(length) <= MOST_PIECES);
    let length = length.unwrap_or(f32::INFINITY);
    let pieces: Vec<(Item, f64)> = lamps.iter().flat_map(|(item, power)| pieces(*item, *power, length)).collect();
    let triangle = |item: &Item| if let Item::Triangle(corners) = item { Some(*corners) } else { None };
    let triangles: Vec<[Vec3; 3]> = pieces.iter().filter_map(|(item, _)| triangle(item)).collect();
    let balls = pieces.iter().filter(|(item, _)| triangle(item).is_none()).map(|(item, _)| vec![*item]);
    let spheres = spheres_around(connected(&triangles).into_iter().chain(balls).collect(), most);
    let mut powers = vec![0.0; spheres.len()];
    for (item, power) in &pieces {
        let out = |sphere: &Target| item.reach(sphere.center) - sphere.radius;
        let own = (0..spheres.len()).min_by(|a, b| out(&spheres[*a]).total_cmp(&out(&spheres[*b])));
        own.into_iter().for_each(|own| powers[own] += power);
    }
    spheres.into_iter().zip(powers).filter_map(|(sphere, power)| patch(sphere, power)).collect()
}

/// Parts into which each edge of a triangle is cut, for none to be longer.
fn cuts(item: Item, length: f32) -> u32 {
    match item {
        Item::Triangle([a, b, c]) => {
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            ((longest / length).ceil().min(MOST_PIECES as f32) as u32).max(1)
        }
        Item::Sphere(..) => 1,
    }
}

/// Similar triangles that make up one, with equal parts of its power.
fn pieces(item: Item, power: f64, length: f32) -> Vec<(Item, f64)> {
    let n = cuts(item, length);
    let Item::Triangle([a, b, c]) = item else { return vec![(item, power)] };
    let at = |i: u32, j: u32| a + (i as f32 / n as f32) * (b - a) + (j as f32 / n as f32) * (c - a);
    let of_square = |(i, j): (u32, u32)| {
        let upright = [at(i, j), at(i + 1, j), at(i, j + 1)];
        let turned = [at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)];
        [Some(upright), (i + j + 1 < n).then_some(turned)].into_iter().flatten()
    };
    let squares = (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j)));
    squares.flat_map(of_square).map(|corners| (Item::Triangle(corners), power / f64::from(n * n))).collect()
}

/// A lamp that sends its power, W, the mean of the channels, to all sides.
fn patch(Target { center, radius }: Target, power: f64) -> Option<BrightPatch> {
    // Intensity, the sum of the channels.
    let power = (3.0 * power / (2.0 * f64::from(TAU))) as f32;
    let is_one = (radius * radius).is_normal() && power.is_normal();
    let of_all_sides = BrightPatch { normal: [0.0; 3], tangent: [0.0; 3], narrow: radius, ..BrightPatch::default() };
    is_one.then(|| BrightPatch { position: center.to_array(), radius, power, ..of_all_sides })
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::{
        scene::{Sphere, Surface, Triangle},
        settings::LightSettings,
    };

    /// Two lamps, and a ball about the first.
    fn lamps(globe: Surface, roughness: f32) -> LampsInGlass {
        let glowing =
            |name| Material { emission: Vec3::ONE, ..Material::new(name, Surface::Diffuse { albedo: Vec3::ZERO }) };
        let ball = |center: Vec3, radius: f32, material: u32| Sphere { center, radius, material, object: 0 };
        let scene = Scene {
            materials: vec![
                Material { roughness, ..Material::new("globe", globe) },
                glowing("first"),
                glowing("second"),
            ],
            spheres: vec![ball(Vec3::X, 0.1, 0), ball(Vec3::X, 0.02, 1), ball(3.0 * Vec3::X, 0.02, 2)],
            ..Scene::default()
        };
        LampsInGlass::new(&scene, &table(&scene))
    }

    fn table(scene: &Scene) -> LightTable {
        LightTable::new(scene, None, &scene_target(scene), &LightSettings::default()).expect("few lights")
    }

    #[test]
    fn a_lamp_in_clear_glass_is_aimed_at_and_one_in_rough_glass_by_that() {
        let glass = Surface::Glass { ior: 1.5, tint: Vec3::ONE };
        for (roughness, radius) in [(0.0, 0.02), (0.5, 0.1)] {
            let found = lamps(glass, roughness).patches;
            let [patch] = found[..] else { panic!("the first lamp: {found:?}") };
            assert!((patch.radius / radius - 1.0).abs() < 1e-3 && patch.position == [1.0, 0.0, 0.0], "{patch:?}");
            // Radiance times the area of a disc, in three channels.
            let right = 3.0 * std::f32::consts::PI * 0.02_f32.powi(2);
            assert!((patch.power / right - 1.0).abs() < 1e-3, "{patch:?} for {right}");
        }
        let pane = Surface::Pane { ior: 1.5, tint: Vec3::ONE };
        assert!(lamps(pane, 0.0).patches.is_empty(), "rays to lights pass a clear pane");
        assert_eq!(lamps(pane, 0.5).patches.len(), 1);
        assert!(lamps(Surface::Mirror { tint: Vec3::ONE }, 0.0).patches.is_empty(), "nothing passes a mirror");
    }

    #[test]
    fn spheres_follow_a_long_lamp() {
        let glow = Material { emission: Vec3::ONE, ..Material::new("", Surface::Diffuse { albedo: Vec3::ZERO }) };
        let corners = [Vec3::ZERO, vec3(2.0, 0.0, 0.0), vec3(2.0, 0.01, 0.0)];
        let glass = Material::new("", Surface::Glass { ior: 1.5, tint: Vec3::ONE });
        let scene = Scene {
            materials: vec![glass, glow],
            spheres: vec![Sphere { center: Vec3::X, radius: 1.2, material: 0, object: 0 }],
            triangles: vec![Triangle::new(corners, [Vec3::Z; 3], 1)],
            ..Scene::default()
        };
        let found = LampsInGlass::new(&scene, &table(&scene)).patches;
        assert!(found.len() > 20 && found.len() <= MAX_LAMP_PATCHES, "{found:?}");
        assert!(found.iter().all(|patch| patch.radius < 0.1), "{found:?}");
        let sum: f32 = found.iter().map(|patch| patch.power).sum();
        let whole = (table(&scene).power() * 3.0 / (2.0 * f64::from(TAU))) as f32;
        assert!((sum / whole - 1.0).abs() < 1e-3, "{sum} of {whole}");
    }
}
