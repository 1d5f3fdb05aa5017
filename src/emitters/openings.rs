//! Openings through which the sky lights what the cameras see: windows, doors, gaps between houses.
//!
//! What is seen is divided into regions by place and normal. Rays from points of a region tell from
//! which directions light of the environment arrives there. Where surfaces keep most of it away,
//! the region has a histogram of these directions, of which direct light takes a part of its
//! samples (compare Müller, Gross and Novák 2017, "Practical Path Guiding for Efficient
//! Light-Transport Simulation"). Wherever the sky is, the environment's own samples fall as well.

use std::f32::consts::{FRAC_PI_4, PI};

use glam::{Vec3, vec2};
use rayon::prelude::*;

use super::{
    cumulative::cumulative,
    direction_bins::{BIN_SOLID_ANGLE, BINS, SIDE, Sphere, bin_of, direction_of, middle_of},
    environment_map::EnvironmentMap,
    sight::{SeenPoint, cosine_direction, thinned},
};
use crate::{
    bvh::Bvh,
    scene::{Alpha, Bounds, Environment, Material, Scene, Surface},
};

/// Maximum number of points, and of those of a region; minimum number of these.
const MAX_POINTS: usize = 1 << 13;
const POINTS: usize = 32;
const FEWEST: usize = 8;
/// Fraction of the extent of points from which on a gap divides them, in halvings up to this depth.
const WIDE_GAP: f32 = 0.5;
const MAX_GAPS: u32 = 10;
/// Rays of a region: towards the environment by its luminance, by the cosine, and into bins that
/// light came from in one round.
const TOWARDS_SKY: u32 = 256;
const BY_COSINE: u32 = 512;
const INTO_BINS: u32 = 384;
/// Rounds of the latter, each into bins that light came from in the one before, and into those
/// beside.
const ROUNDS: u32 = 4;
/// Fraction of the light that environment's own samples find, above which they are good enough;
/// part of the samples by the histogram where they find nothing, and least part.
const ENOUGH: f32 = 0.4;
const MOST: f32 = 0.9;
const LEAST: f32 = 0.1;
/// Part of the samples by the histogram from which on a region counts as enclosed.
const ENCLOSED: f32 = 0.6;
/// How far the bounds of a region reach beyond its points, in its largest extent: points lie that
/// far apart.
const MARGIN: f32 = 0.25;
/// Maximum number of rays by the cosine that are kept of a region.
const FEW_RAYS: usize = 32;
/// Least light from a bin, in units of the mean of those that light may come from.
const FLOOR: f64 = 0.3;
/// Rays beside which edges of openings are looked for, at most; and how far beside, radians.
const MAX_EDGES: usize = 32;
const EDGE: f32 = 0.15;
/// Minimum radius of a sphere that shows openings, in those of the region.
const CLEARANCE: f32 = 1.3;
/// Words before the nodes: the roots of the trees, one for each of the normals' six directions.
const HEAD: usize = 6;
/// Words of a region before its distributions: bounds, the part of the samples, and the sphere.
const REGION_HEAD: usize = 12;
/// In place of an axis: a leaf.
const LEAF: u32 = 3;
/// Steps of low-discrepancy sequences in four dimensions (Roberts 2018, "The Unreasonable
/// Effectiveness of Quasirandom Sequences").
const STEPS: [f64; 4] = [0.856_674_883_854_503, 0.733_891_856_627_126, 0.628_706_721_039_774, 0.538_596_908_569_094];

/// The regions, in a tree for each of the six directions that normals are closest to.
#[derive(Clone, Debug, PartialEq)]
pub struct Openings {
    roots: [u32; HEAD],
    nodes: Vec<Node>,
    regions: Vec<Region>,
    open: f32,
}

/// Half spaces at a plane perpendicular to an axis, or a region.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Node {
    /// Two nodes follow each other, the one below `at` first.
    Inner { axis: u32, at: f32, first: u32 },
    /// Index of a region; none: the sky is sampled as if nothing hid it.
    Leaf(Option<u32>),
}

/// Surfaces near each other that face about the same way.
#[derive(Clone, Debug, PartialEq)]
struct Region {
    low: Vec3,
    high: Vec3,
    /// Part of the samples that the histogram draws, 0 to 1.
    part: f32,
    sphere: Sphere,
    /// A few of the rays that light arrived along.
    rays: Vec<(Vec3, Vec3)>,
    /// Light from each bin of directions from the middle of the sphere, in units of its own.
    bins: Vec<f64>,
}

/// What points near each other get of the sky.
enum Sky {
    /// Much: its own samples find it.
    Open,
    /// Nothing, as far as is known.
    Dark,
    Through(Region),
}

/// What rays from points need.
struct Surroundings<'a> {
    bvh: &'a Bvh,
    environment: &'a Environment,
    map: &'a EnvironmentMap,
    /// Materials that light of the sky may pass straight.
    passes: Vec<bool>,
}

impl Openings {
    /// The openings before the points that cameras see; none if there is no region that needs them.
    #[must_use]
    pub fn new(scene: &Scene, bvh: &Bvh, seen: &[SeenPoint], map: Option<&EnvironmentMap>) -> Option<Self> {
        let around = Surroundings {
            bvh,
            environment: scene.environment.as_ref().filter(|environment| !environment.is_dark())?,
            map: map?,
            passes: scene.materials.iter().map(may_pass).collect(),
        };
        let points = thinned(seen.iter().flat_map(SeenPoint::points).collect(), MAX_POINTS);
        let mut sides: [Vec<(Vec3, Vec3)>; HEAD] = Default::default();
        points.into_iter().for_each(|point| sides[side_of(point.1)].push(point));
        let (mut nodes, mut groups, mut roots) = (Vec::new(), Vec::new(), [0; HEAD]);
        for (root, points) in roots.iter_mut().zip(sides) {
            *root = nodes.len() as u32;
            nodes.push(Node::Leaf(None));
            split((*root as usize, 0), points, &mut nodes, &mut groups);
        }
        let found: Vec<Sky> = groups.par_iter().map(|(_, points)| around.sky(points)).collect();
        let is_open = |sky: &&Sky| match sky {
            Sky::Open => true,
            Sky::Dark => false,
            Sky::Through(region) => !region.is_enclosed(),
        };
        let open = found.iter().filter(is_open).count() as f32 / groups.len() as f32;
        let mut regions = Vec::new();
        for ((leaf, _), sky) in groups.into_iter().zip(found) {
            if let Sky::Through(region) = sky {
                nodes[leaf] = Node::Leaf(Some(regions.len() as u32));
                regions.push(region);
            }
        }
        (!regions.is_empty()).then_some(Self { roots, nodes, regions, open })
    }

    /// Fraction of what is seen that much of the sky lights, 0 to 1.
    #[must_use]
    pub fn open(&self) -> f32 {
        self.open
    }

    /// Rays from surfaces that see little of the sky through the openings: origins and directions.
    pub fn rays(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        self.regions.iter().filter(|region| region.is_enclosed()).flat_map(|region| region.rays.iter().copied())
    }

    /// The regions as `shaders/lib/transport/openings.wesl` reads them.
    #[must_use]
    pub fn words(&self) -> Vec<u32> {
        let first_region = (HEAD + 2 * self.nodes.len()) as u32;
        let stride = (REGION_HEAD + SIDE + BINS) as u32;
        let node = |node: &Node| match *node {
            Node::Inner { axis, at, first } => [at.to_bits(), axis << 30 | first],
            Node::Leaf(region) => [region.map_or(0, |region| first_region + stride * region), LEAF << 30],
        };
        let nodes = self.nodes.iter().flat_map(node);
        self.roots.into_iter().chain(nodes).chain(self.regions.iter().flat_map(Region::words)).collect()
    }
}

impl Region {
    /// Whether little of the sky reaches it: not a house front, but what is behind a window.
    fn is_enclosed(&self) -> bool {
        self.part > ENCLOSED
    }

    fn words(&self) -> Vec<u32> {
        let rows: Vec<f64> = self.bins.chunks(SIDE).map(|row| row.iter().sum()).collect();
        let Self { low, high, part, sphere: Sphere { center, radius }, .. } = *self;
        let head = [low.x, low.y, low.z, part, high.x, high.y, high.z, 1.0 / radius, center.x, center.y, center.z, 0.0];
        let columns = self.bins.chunks(SIDE).flat_map(cumulative);
        head.into_iter().chain(cumulative(&rows)).chain(columns).map(f32::to_bits).collect()
    }
}

impl Surroundings<'_> {
    fn sky(&self, points: &[(Vec3, Vec3)]) -> Sky {
        if points.len() < FEWEST {
            return Sky::Dark;
        }
        let point = |ray: u32| points[ray as usize % points.len()];
        let (mut found, mut all, mut arrived) = (0.0, 0.0, Vec::new());
        for ray in 0..TOWARDS_SKY {
            let ray = self.ray(point(ray), self.map.direction(numbers(ray)));
            all += ray.cosine.max(0.0);
            if ray.light > 0.0 {
                found += ray.cosine;
                arrived.push(ray);
            }
        }
        let part = MOST * (1.0 - found / (ENOUGH * all));
        // NaN: nothing of the sky lies above.
        if part.is_nan() || part < LEAST {
            return if part < LEAST { Sky::Open } else { Sky::Dark };
        }
        let by_sky = arrived.len();
        let by_cosine = (0..BY_COSINE).map(|ray| {
            let [u, v, ..] = numbers(ray);
            self.ray(point(ray), cosine_direction(point(ray).1, [u, v]))
        });
        arrived.extend(by_cosine.filter(|ray| ray.light > 0.0));
        let Bounds { min: low, max: high } = Bounds::around(points.iter().map(|point| point.0));
        let margin = Vec3::splat(MARGIN * (high - low).max_element());
        let (low, high) = (low - margin, high + margin);
        let few = arrived.iter().skip(by_sky).step_by((arrived.len() - by_sky).div_ceil(FEW_RAYS).max(1));
        let rays = few.map(|ray| (ray.origin, ray.direction)).collect();
        let sphere = self.sphere(0.5 * (low + high), 0.5 * (high - low).length(), &arrived);
        let mut into = Vec::new();
        let mut rays_into = vec![0_u32; BINS];
        for round in 0..ROUNDS {
            let lit = widened(&lit_bins(&arrived, &sphere));
            into = (0..BINS).filter(|bin| lit[*bin]).collect();
            let number = if into.is_empty() { 0 } else { INTO_BINS };
            for ray in round * INTO_BINS..round * INTO_BINS + number {
                let (from, [x, y, ..]) = (point(ray), numbers(ray));
                // All points send rays into all bins: their numbers may have a common divisor.
                let bin = into[(ray as usize + ray as usize / points.len()) % into.len()];
                let place = vec2((bin % SIDE) as f32 + x, (bin / SIDE) as f32 + y) / SIDE as f32;
                rays_into[bin] += 1;
                let ray = self.ray(from, sphere.direction(from.0, direction_of(place)));
                arrived.extend((ray.light > 0.0).then_some(ray));
            }
        }
        // Balance heuristic: Veach 1997, section 9.2.
        let mut bins = vec![0.0; BINS];
        for ray in &arrived[by_sky..] {
            let (on_sphere, stretch) = sphere.seen(ray.origin, ray.direction);
            let bin = bin_of(on_sphere);
            let density = BY_COSINE as f32 * ray.cosine / PI + rays_into[bin] as f32 / BIN_SOLID_ANGLE * stretch;
            bins[bin] += f64::from(ray.light / density);
        }
        // What no ray found in a bin that light may come from after all would be a white dot.
        let least = FLOOR * bins.iter().sum::<f64>() / into.len().max(1) as f64;
        into.iter().for_each(|bin| bins[*bin] = bins[*bin].max(least));
        match bins.iter().any(|bin| *bin > 0.0) {
            true => Sky::Through(Region { low, high, part, sphere, rays, bins }),
            false => Sky::Dark,
        }
    }

    fn ray(&self, (origin, normal): (Vec3, Vec3), direction: Vec3) -> Ray {
        let cosine = normal.dot(direction);
        let is_lit = cosine > 0.0 && !self.bvh.is_blocked(origin, direction, &|m| self.passes[m as usize]);
        let light = if is_lit { cosine * self.environment.radiance(direction).element_sum() } else { 0.0 };
        Ray { origin, direction, cosine, light }
    }

    /// The sphere through the edges of the openings that light arrives by: of those through what
    /// is met beside such rays and the one without bounds, that on which light comes from the
    /// fewest bins. `radius`: that of the region.
    fn sphere(&self, center: Vec3, radius: f32, arrived: &[Ray]) -> Sphere {
        let far = Sphere { center, radius: f32::INFINITY };
        let mut distances = Vec::new();
        for ray in arrived.iter().step_by(arrived.len().div_ceil(MAX_EDGES).max(1)) {
            let (right, up) = ray.direction.any_orthonormal_pair();
            for aside in [right, -right, up, -up] {
                let direction = (ray.direction + EDGE * aside).normalize();
                distances.extend(self.bvh.nearest_hit(ray.origin, direction).map(|hit| hit.position.distance(center)));
            }
        }
        distances.retain(|distance| *distance > CLEARANCE * radius);
        distances.sort_by(f32::total_cmp);
        let quantile = |q: usize| distances.get(q * distances.len() / 4).copied();
        let near = [1, 2, 3].into_iter().filter_map(quantile).map(|radius| Sphere { center, radius });
        let bins = |sphere: &Sphere| lit_bins(arrived, sphere).into_iter().filter(|is_lit| *is_lit).count();
        std::iter::once(far).chain(near).min_by_key(bins).unwrap_or(far)
    }
}

/// A ray from a surface, and the light of the sky that arrives along it, times the cosine.
struct Ray {
    origin: Vec3,
    direction: Vec3,
    cosine: f32,
    light: f32,
}

fn lit_bins(arrived: &[Ray], sphere: &Sphere) -> Vec<bool> {
    let mut lit = vec![false; BINS];
    arrived.iter().for_each(|ray| lit[bin_of(sphere.seen(ray.origin, ray.direction).0)] = true);
    lit
}

/// Whether light may go straight on through a surface of the material, as far as a guess goes.
pub(super) fn may_pass(material: &Material) -> bool {
    matches!(material.surface, Surface::Glass { .. } | Surface::Pane { .. }) || material.alpha != Alpha::Opaque
}

/// Divides points along their longest extent until few are left: where a wide gap is, else at their
/// middle.
fn split(
    (node, depth): (usize, u32),
    mut points: Vec<(Vec3, Vec3)>,
    nodes: &mut Vec<Node>,
    groups: &mut Vec<(usize, Vec<(Vec3, Vec3)>)>,
) {
    let Bounds { min, max } = Bounds::around(points.iter().map(|point| point.0));
    let axis = (max - min).max_position();
    points.sort_by(|(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
    let gap = |i: usize| points[i].0[axis] - points[i - 1].0[axis];
    let widest = (1..points.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b)));
    let widest = widest.filter(|i| depth < MAX_GAPS && gap(*i) > WIDE_GAP * (max - min)[axis]);
    if points.len() <= POINTS && widest.is_none() {
        groups.push((node, points));
        return;
    }
    let upper = points.split_off(widest.unwrap_or(points.len() / 2));
    let first = nodes.len();
    nodes[node] = Node::Inner { axis: axis as u32, at: upper[0].0[axis], first: first as u32 };
    nodes.extend([Node::Leaf(None); 2]);
    split((first, depth + 1), points, nodes, groups);
    split((first + 1, depth + 1), upper, nodes, groups);
}

/// Number of the direction of an axis that a normal is closest to.
fn side_of(normal: Vec3) -> usize {
    let axis = normal.abs().max_position();
    2 * axis + usize::from(normal[axis] < 0.0)
}

fn numbers(i: u32) -> [f32; 4] {
    STEPS.map(|step| (0.5 + step * f64::from(i)).fract() as f32)
}

/// Bins that are lit, and those beside them.
fn widened(lit: &[bool]) -> Vec<bool> {
    let mut wide = lit.to_vec();
    let side = BIN_SOLID_ANGLE.sqrt();
    for bin in (0..BINS).filter(|bin| lit[*bin]) {
        let middle = middle_of(bin);
        let (right, up) = middle.any_orthonormal_pair();
        for turn in 0..8 {
            let (sine, cosine) = (turn as f32 * FRAC_PI_4).sin_cos();
            wide[bin_of((middle + side * (cosine * right + sine * up)).normalize())] = true;
        }
    }
    wide
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    #[test]
    fn gaps_divide_points() {
        let points = |offset: f32| (0..16).map(move |i| (vec3(0.1 * i as f32 + offset, 0.0, 0.0), Vec3::Y));
        let groups = |points: Vec<(Vec3, Vec3)>| {
            let (mut nodes, mut groups) = (vec![Node::Leaf(None)], Vec::new());
            split((0, 0), points, &mut nodes, &mut groups);
            groups.len()
        };
        assert_eq!(groups(points(0.0).collect()), 1);
        assert_eq!(groups(points(0.0).chain(points(10.0)).collect()), 2);
    }
}
