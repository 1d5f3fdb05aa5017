//! Spheres that photon paths are aimed at since what the camera sees, and what lights that, lies in
//! them (compare Suykens and Willems 2000, "Density Control for Photon Maps").

use glam::{Vec3, vec3};
use rayon::prelude::*;

use super::{
    importance::Importance,
    target_shares::shares_whatever_size,
    targets::{Target, scene_target},
};
use crate::{
    bvh::Bvh,
    scene::{Camera, Material, Projection, Scene, Surface, Texture},
};

/// Maximum number of cameras, taken at equal steps, that have rays.
const MAX_CAMERAS: usize = 16;
/// Camera rays along the longer side of the picture, and cosine-distributed rays from each point
/// that they see.
const RAYS: u32 = 64;
const BOUNCES: u32 = 2;
/// Side of the blocks of rays; and points next to each other whose rays are counted together.
const BLOCK: usize = 8;
const POINTS_TOGETHER: usize = 64;
/// Fraction of what is seen that is less enclosed, or less diffuse, than the block that decides.
const MOST: f64 = 0.9;
/// Maximum number of mirrors and panes that a ray passes.
const MAX_CHAIN: u32 = 12;
/// Number of texels that tell the mean of an image.
const TEXELS: usize = 1 << 12;
/// Minimum number of points that spheres are made of.
const MIN_POINTS: usize = 64;
/// Maximum number of points whose density counts.
const MAX_POINTS: usize = 1 << 14;
/// Fraction of the points within the smallest sphere. The spheres have one centre.
const QUANTILE: f64 = 0.5;
/// Factor on its radius, for what lies at the border.
const MARGIN: f32 = 1.2;
/// Radius of each sphere over that of the next smaller one. The density of paths then falls with
/// the square of the distance, as what a surface far away adds to the light does.
const RATIO: f32 = 3.0;
/// Maximum number of spheres: the last is then smaller than the scene by more than the ratio.
const MAX_SPHERES: usize = 12;
/// Part of the golden ratio behind the point.
const GOLDEN_STEP: f64 = 0.618_033_988_749_894_9;
/// Steps of a low-discrepancy sequence in two dimensions (Roberts 2018, "The Unreasonable
/// Effectiveness of Quasirandom Sequences").
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];

/// Surfaces that the scene's cameras see, as spheres.
#[derive(Clone, Debug)]
pub struct Sight {
    /// Spheres around that and what lies around it, from the smallest to the largest; none if that
    /// is most of the scene.
    pub targets: Vec<Target>,
    /// Density of that and of what lies around it; none without spheres.
    pub importance: Option<Importance>,
    /// Fraction of the paths to mirrors and glass that is aimed at each of their spheres whatever
    /// its size.
    pub shares: Vec<f32>,
}

impl Sight {
    /// `specular`: spheres around mirrors and glass.
    #[must_use]
    pub fn new(scene: &Scene, seen: &[SeenPoint], specular: &[Target]) -> Self {
        let points: Vec<Vec3> = seen.iter().flat_map(SeenPoint::points).map(|(position, _)| position).collect();
        let targets = spheres_around(&points, &scene_target(scene));
        let importance =
            (!targets.is_empty()).then(|| Importance::new(&thinned(points.clone(), MAX_POINTS), scene.bounds()));
        Self { targets, importance, shares: shares_whatever_size(&points, specular) }
    }
}

/// What the scene's cameras see.
#[derive(Clone, Debug)]
pub struct Seen {
    pub points: Vec<SeenPoint>,
    /// Fraction of the light that leaves a diffuse surface, 0 to 1, which meets another one:
    /// exceeded by that of a tenth of what the cameras see. 1 if they see nothing diffuse.
    pub enclosure: f64,
    /// Fraction of a surface that is diffuse, 0 to 1: exceeded by that of a tenth of what the
    /// cameras see. 1 if they see nothing.
    pub diffuse: f64,
}

impl Seen {
    #[must_use]
    pub fn new(scene: &Scene, bvh: &Bvh) -> Self {
        let step = scene.cameras.len().div_ceil(MAX_CAMERAS).max(1);
        let ways: Vec<Way> = scene.materials.iter().map(|material| Way::new(scene, material)).collect();
        let cameras = scene.cameras.iter().step_by(step);
        let blocks: Vec<Block> = cameras.flat_map(|camera| blocks_seen((bvh, &ways), camera)).collect();
        let diffuse = exceeded_by_few(blocks.iter().map(|block| (block.points.len(), block.rays)));
        let points: Vec<SeenPoint> = blocks.into_iter().flat_map(|block| block.points).collect();
        let met = |points: &[SeenPoint]| points.iter().map(|point| point.around.len()).sum();
        let together = points.chunks(POINTS_TOGETHER);
        let enclosure = exceeded_by_few(together.map(|points| (met(points), points.len() * BOUNCES as usize)));
        Self { points, enclosure, diffuse }
    }
}

/// What a block of a camera's rays meets.
struct Block {
    points: Vec<SeenPoint>,
    /// Rays that meet a surface.
    rays: usize,
}

/// A point on a diffuse surface that a camera sees, and those that are seen from there, each with
/// the normal on that side.
#[derive(Clone, Debug)]
pub struct SeenPoint {
    position: Vec3,
    normal: Vec3,
    around: Vec<(Vec3, Vec3)>,
}

impl SeenPoint {
    /// Position and normal of all.
    pub fn points(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        std::iter::once((self.position, self.normal)).chain(self.around.iter().copied())
    }
}

/// About so many of a list, spread over all of it: by a step of the golden ratio, as the list may
/// have a rhythm of its own.
pub(super) fn thinned<T>(list: Vec<T>, most: usize) -> Vec<T> {
    let part = most as f64 / list.len() as f64;
    let is_kept = |i: usize| (i as f64 * GOLDEN_STEP).fract() < part;
    list.into_iter().enumerate().filter(|(i, _)| is_kept(*i)).map(|(_, one)| one).collect()
}

/// Fractions of groups of rays, each given by how many count and how many there are: that which is
/// exceeded by those of a tenth of all rays; 1 without rays.
fn exceeded_by_few(groups: impl Iterator<Item = (usize, usize)>) -> f64 {
    let groups = groups.filter(|(_, rays)| *rays > 0);
    let mut fractions: Vec<(f64, usize)> = groups.map(|(count, rays)| (count as f64 / rays as f64, rays)).collect();
    fractions.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: usize = fractions.iter().map(|(_, rays)| rays).sum();
    let mut before = 0;
    let exceeds = |(_, rays): &&(f64, usize)| {
        before += rays;
        before as f64 > MOST * all as f64
    };
    fractions.iter().find(exceeds).map_or(1.0, |(fraction, _)| *fraction)
}

/// Points that the camera sees, block by block of the picture.
fn blocks_seen(tree: (&Bvh, &[Way]), camera: &Camera) -> Vec<Block> {
    let aspect = camera.aspect.filter(|aspect| *aspect > 0.0).unwrap_or(1.0);
    let side = |fraction: f32| ((RAYS as f32 * fraction) as u32).max(1);
    let size = (side(aspect.min(1.0)), side((1.0 / aspect).min(1.0)));
    let half_height = camera.half_height_at(1.0, size);
    let half = (half_height * size.0 as f32 / size.1 as f32, half_height);
    // Whether a surface is met, and the point.
    let pixel = |(column, row): (u32, u32)| {
        let at = |i: u32, n: u32| (2 * i + 1) as f32 / n as f32 - 1.0;
        let aside = half.0 * at(column, size.0) * camera.right - half.1 * at(row, size.1) * camera.up;
        let (origin, direction) = match camera.projection {
            Projection::Orthographic { .. } => (camera.position + aside, camera.forward),
            Projection::Perspective { .. } => (camera.position, (camera.forward + aside).normalize()),
        };
        let origin = origin + camera.near.min(0.0) * camera.forward;
        let index = row * size.0 + column;
        let (hit, is_met) = diffuse_hit(tree, origin, direction, index);
        let around = |position, normal| {
            let indices = (0..BOUNCES).map(|bounce| BOUNCES * index + bounce);
            let hits = indices.map(|i| diffuse_hit(tree, position, cosine_direction(normal, even_numbers(i)), i).0);
            hits.flatten().collect()
        };
        (is_met, hit.map(|(position, normal)| SeenPoint { position, normal, around: around(position, normal) }))
    };
    let blocks = (0..size.1).step_by(BLOCK).flat_map(|row| (0..size.0).step_by(BLOCK).map(move |column| (column, row)));
    let side = BLOCK as u32;
    let pixels = |(column, row): (u32, u32)| {
        let rows = row..(row + side).min(size.1);
        rows.flat_map(move |y| (column..(column + side).min(size.0)).map(move |x| (x, y)))
    };
    let blocks: Vec<(u32, u32)> = blocks.collect();
    let block = |block| {
        let (met, points): (Vec<bool>, Vec<Option<SeenPoint>>) = pixels(block).map(pixel).unzip();
        Block { points: points.into_iter().flatten().collect(), rays: met.into_iter().filter(|met| *met).count() }
    };
    blocks.into_par_iter().map(block).collect()
}

/// The first surface with a diffuse lobe along a ray, by way of mirrors and straight through glass;
/// and whether it met any surface. `ways`: of rays at each material. `index`: of the ray.
fn diffuse_hit(
    (bvh, ways): (&Bvh, &[Way]),
    mut origin: Vec3,
    mut direction: Vec3,
    index: u32,
) -> (Option<(Vec3, Vec3)>, bool) {
    for step in 0..MAX_CHAIN {
        let Some(hit) = bvh.nearest_hit(origin, direction) else { return (None, step > 0) };
        let number = (0.5 + GOLDEN_STEP * (f64::from(index) * f64::from(MAX_CHAIN) + f64::from(step))).fract() as f32;
        let way = ways[hit.material as usize];
        if number < way.ends {
            return (Some((hit.position, hit.normal)), true);
        }
        if number < way.ends + way.reflected {
            direction = (direction - 2.0 * direction.dot(hit.normal) * hit.normal).normalize();
        }
        origin = hit.position;
    }
    (None, true)
}

/// What becomes of rays at a material; those that neither end nor are reflected go straight on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Way {
    /// Fraction that ends: the surface is diffuse there.
    ends: f32,
    reflected: f32,
}

impl Way {
    /// By the mean of textures: most files have a factor of 1 where a texture says what is metal.
    fn new(scene: &Scene, material: &Material) -> Self {
        let metal = |factor: f32| factor * mean_of(scene, material.textures.metallic_roughness, 2);
        match material.surface {
            Surface::Diffuse { .. } => Self { ends: 1.0, reflected: 0.0 },
            Surface::Mirror { .. } => Self { ends: 0.0, reflected: 1.0 },
            Surface::Layered { metallic, .. } => {
                let reflected = metal(metallic);
                Self { ends: 1.0 - reflected, reflected }
            }
            Surface::Glass { .. } | Surface::Pane { .. } => {
                let reflected = metal(material.metallic);
                let through = material.transmission * mean_of(scene, material.textures.transmission, 0);
                Self { ends: (1.0 - reflected) * (1.0 - through), reflected }
            }
        }
    }
}

/// Mean of a channel of a texture, 0 to 1, by a part of its texels; 1 without one.
fn mean_of(scene: &Scene, texture: Option<Texture>, channel: usize) -> f32 {
    let Some(image) = texture.and_then(|texture| scene.images.get(texture.image as usize)) else { return 1.0 };
    let at = |i: usize| ((0.5 + GOLDEN_STEP * i as f64).fract() * image.texels.len() as f64) as usize;
    let values = (0..TEXELS).filter_map(|i| image.texels.get(at(i))).map(|texel| f32::from(texel[channel]));
    values.sum::<f32>() / (255.0 * TEXELS as f32)
}

/// The `i`-th point of a low-discrepancy sequence in the unit square.
fn even_numbers(i: u32) -> [f32; 2] {
    STEPS.map(|step| (0.5 + step * f64::from(i)).fract() as f32)
}

/// Cosine-distributed direction about `normal`, by two numbers from 0 to 1.
pub(super) fn cosine_direction(normal: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    let (right, up) = normal.any_orthonormal_pair();
    let (sine, cosine) = (std::f32::consts::TAU * v).sin_cos();
    let local = vec3(u.sqrt() * cosine, u.sqrt() * sine, (1.0 - u).max(1e-6).sqrt());
    (local.x * right + local.y * up + local.z * normal).normalize()
}

/// Spheres about the middle of the points, up to one that is not much smaller than the scene.
fn spheres_around(points: &[Vec3], whole: &Target) -> Vec<Target> {
    if points.len() < MIN_POINTS {
        return Vec::new();
    }
    let median = |axis: usize| {
        let mut all: Vec<f32> = points.iter().map(|p| p[axis]).collect();
        *all.select_nth_unstable_by(points.len() / 2, f32::total_cmp).1
    };
    let center = vec3(median(0), median(1), median(2));
    let mut distances: Vec<f32> = points.iter().map(|p| p.distance(center)).collect();
    distances.sort_by(f32::total_cmp);
    let smallest = MARGIN * distances[(QUANTILE * distances.len() as f64) as usize];
    let radii = std::iter::successors(Some(smallest), |radius| Some(RATIO * radius)).take(MAX_SPHERES);
    let radii = radii.take_while(|radius| *radius > 0.0 && RATIO * radius <= whole.radius);
    radii.map(|radius| Target { center, radius }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Sphere, Triangle};

    /// A ball of radius 1 on a floor of half side `reach`, seen from 6 m.
    fn seen(reach: f32) -> (Sight, f64) {
        let corner = |x: f32, z: f32| vec3(x * reach, 0.0, z * reach);
        let triangle = |corners| Triangle::new(corners, [Vec3::Y; 3], 0);
        let floor = [
            triangle([corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)]),
            triangle([corner(-1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)]),
        ];
        let mut scene = Scene {
            materials: vec![Material::new("", Surface::Diffuse { albedo: Vec3::splat(0.5) })],
            triangles: floor.to_vec(),
            spheres: vec![Sphere { center: Vec3::Y, radius: 1.0, material: 0, object: 0 }],
            ..Scene::default()
        };
        let forward = vec3(0.0, -0.4, -1.0).normalize();
        let right = Vec3::X;
        scene.cameras = vec![Camera {
            position: vec3(0.0, 3.4, 6.0),
            forward,
            right,
            up: right.cross(forward),
            projection: Projection::Perspective { yfov: 0.7 },
            ..Camera::framing(scene.bounds())
        }];
        let seen = Seen::new(&scene, &Bvh::build(&scene));
        (Sight::new(&scene, &seen.points, &[]), seen.enclosure)
    }

    #[test]
    fn what_is_seen_of_a_wide_floor_has_spheres() {
        let spheres = seen(1000.0).0.targets;
        assert!(!spheres.is_empty());
        let smallest = spheres.first().expect("a sphere");
        assert!(smallest.radius < 8.0 && smallest.center.length() < 4.0, "{spheres:?}");
        let largest = spheres.last().expect("a sphere");
        assert!(largest.radius > 100.0 && spheres.len() < 8, "{spheres:?}");
    }

    #[test]
    fn a_scene_that_is_seen_whole_has_none() {
        assert_eq!(seen(3.0).0.targets, Vec::new());
    }

    #[test]
    fn a_ball_on_a_floor_is_little_enclosed_and_a_box_is_wholly() {
        // The ball's lower half sees the floor: at most a half of what leaves it.
        let open = seen(1000.0).1;
        assert!(open > 0.05 && open < 0.7, "{open}");
        let corner = |i: u32| vec3((i & 1) as f32, ((i >> 1) & 1) as f32, (i >> 2) as f32);
        let sides = [
            [0, 1, 2],
            [1, 2, 3],
            [4, 5, 6],
            [5, 6, 7],
            [0, 1, 4],
            [1, 4, 5],
            [2, 3, 6],
            [3, 6, 7],
            [0, 2, 4],
            [2, 4, 6],
            [1, 3, 5],
            [3, 5, 7],
        ];
        let mut scene = Scene {
            materials: vec![Material::new("", Surface::Diffuse { albedo: Vec3::splat(0.5) })],
            triangles: sides.map(|side| Triangle::new(side.map(corner), [Vec3::Y; 3], 0)).to_vec(),
            ..Scene::default()
        };
        scene.cameras = vec![Camera { position: Vec3::splat(0.5), ..Camera::framing(scene.bounds()) }];
        let closed = Seen::new(&scene, &Bvh::build(&scene)).enclosure;
        assert!(closed > 0.95, "{closed}");
        assert_eq!(exceeded_by_few(std::iter::empty()), 1.0);
        // A tenth of the rays decides, not a tenth of the groups.
        assert_eq!(exceeded_by_few([(0, 60), (15, 30), (10, 10)].into_iter()), 1.0);
        assert_eq!(exceeded_by_few([(0, 60), (15, 31), (9, 9)].into_iter()), 15.0 / 31.0);
    }
}
