//! Small bright places from which much of a picture's indirect light comes: the wall behind a lamp,
//! a caustic. Rays of final gathering are aimed at them, for few of those by the cosine find one,
//! and each brings much. Rays of rough lobes are too, and at gleams: mirrors, metal and glass that
//! show a light.

use std::collections::BTreeMap;

use glam::{DMat2, DVec2, DVec3, Vec3};

use crate::{
    emitters::lamps_in_glass::MAX_LAMP_PATCHES,
    layout::{BrightPatch, MAX_PATCHES},
};

/// Patches of places and of gleams at most.
const PATCHES: usize = MAX_PATCHES - MAX_LAMP_PATCHES - GLEAMS;
const GLEAMS: usize = 32;
/// Fraction of the rays' mean square that a patch must cause: every ray reads them all.
const LEAST_OF_PATCH: f64 = 0.005;
/// Radiance of a bright end, in units of the mean over all rays.
const BRIGHT: f64 = 8.0;
/// Fraction of the rays' variance that bright ends must cause for any ray to be aimed.
const LEAST_PART: f64 = 0.3;
/// Widths of cells that are tried, in units of the narrowest: few ends are spread over few wide
/// cells, and so is what is long. The narrowest is taken of which the places cause this part of the
/// most that those of any do.
const WIDTHS: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
const NEAR_MOST: f64 = 0.9;
/// Mean square of the radiance over the square of its mean, above which few rays bring most of the
/// light: more rays tell more about where they find it.
const UNEVEN: f64 = 30.0;
/// Ends that make a patch.
const MIN_ENDS: usize = 3;
/// Length of a way, as a fraction of what is straight, from which on it has a corner.
const STRAIGHT: f32 = 1.0001;

/// The first leg of a ray. At its end, mirrors and glass may send the ray another way.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    pub start: Vec3,
    /// Unit.
    pub direction: Vec3,
    /// Metres.
    pub length: f32,
}

/// The end of a ray that was drawn by the cosine.
#[derive(Clone, Copy, Debug)]
pub struct RayEnd {
    pub leg: Leg,
    /// Metres.
    pub position: Vec3,
    /// Geometric.
    pub normal: Vec3,
    /// Radiance towards the start of the ray.
    pub radiance: f64,
}

/// Bright patches, and the irradiance by all else on average, in units of their power.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BrightPlaces {
    pub patches: Vec<BrightPatch>,
    /// Mirrors, metal and glass that show lights, for rays of rough lobes alone: of diffuse
    /// surfaces, this light is a caustic.
    pub gleams: Vec<BrightPatch>,
    pub other_light: f32,
    /// Few of the rays bring most of the light: more of them tell more.
    pub is_uneven: bool,
}

/// A place at which rays can be aimed to meet the end of one.
#[derive(Clone, Copy, Debug)]
struct Aim {
    position: Vec3,
    /// 0: it looks the same from all sides.
    normal: Vec3,
}

/// Bright ends in a cell.
#[derive(Clone, Debug, Default)]
struct Cell {
    /// Index of the end, and where it is aimed at.
    ends: Vec<(usize, Aim)>,
    /// Sum of the squares of their radiance, and their number, without those of patches.
    squares: f64,
    left: usize,
}

/// Patches of some ends, and what these are of all light.
#[derive(Debug, Default)]
struct Patches {
    patches: Vec<BrightPatch>,
    /// Sum of the radiance of their ends.
    light: f64,
    /// Sum of the squares of the radiance of their ends, and of all ends.
    squares: f64,
    all: f64,
}

/// Light besides that of the ends among which patches are looked for.
#[derive(Clone, Copy, Debug, Default)]
struct OtherLight {
    /// Mean radiance.
    mean: f64,
    /// Mean of its square.
    squares: f64,
}

impl BrightPlaces {
    /// Finds places and gleams in cells of at least that width by the ends of `rays` rays from all
    /// over the picture each; those that met nothing are left out.
    #[must_use]
    pub fn find((ends, of_gleams): (&[RayEnd], &[RayEnd]), rays: [f64; 2], width: f32) -> Self {
        let mean = mean_radiance(ends, rays[0]);
        let places = Patches::find(ends, (rays[0], OtherLight::default()), (width, PATCHES));
        let squares = (places.all - places.squares) / rays[0].max(1.0);
        let gleams = Patches::find(of_gleams, (rays[1], OtherLight { mean, squares }), (width, GLEAMS));
        Self {
            other_light: irradiance(mean - places.light / rays[0].max(1.0)),
            is_uneven: is_uneven([(ends, rays[0]), (of_gleams, rays[1])]),
            patches: places.patches,
            gleams: gleams.patches,
        }
    }
}

impl Patches {
    /// So many patches at most, in the narrowest cells that serve.
    fn find(ends: &[RayEnd], (rays, other): (f64, OtherLight), (width, most): (f32, usize)) -> Self {
        let in_cells = |factor: &f32| Self::in_cells(ends, (rays, other), (width * factor, most));
        let found: Vec<Self> = WIDTHS.iter().map(in_cells).collect();
        let part = |found: &Self| found.squares / (found.all + rays * other.squares).max(f64::MIN_POSITIVE);
        let least = LEAST_PART.max(NEAR_MOST * found.iter().map(part).fold(0.0, f64::max));
        let all = found[0].all;
        found.into_iter().find(|found| part(found) > least).unwrap_or(Self { all, ..Self::default() })
    }

    /// The same by cells of one width.
    fn in_cells(ends: &[RayEnd], (rays, other): (f64, OtherLight), (width, most): (f32, usize)) -> Self {
        let mean = mean_radiance(ends, rays) + other.mean;
        let mut cells: Vec<Cell> = Vec::new();
        let mut of_keys: BTreeMap<[i32; 5], usize> = BTreeMap::new();
        let mut of_ends: Vec<[Option<usize>; 2]> = vec![[None; 2]; ends.len()];
        for (i, end) in ends.iter().enumerate().filter(|(_, end)| end.radiance > BRIGHT * mean) {
            for ((kind, aim), own) in (0..).zip(end.aims()).zip(&mut of_ends[i]) {
                let Some(aim) = aim else { continue };
                // Surfaces that face other ways are other patches.
                let axis = aim.normal.abs().max_position();
                let side = 2 * axis as i32 + i32::from(aim.normal[axis] < 0.0);
                let [x, y, z] = (aim.position / width).floor().as_ivec3().to_array();
                let cell = *of_keys.entry([x, y, z, side, kind]).or_insert(cells.len());
                *own = Some(cell);
                cells.resize_with(cells.len().max(cell + 1), Cell::default);
                cells[cell].ends.push((i, aim));
                cells[cell].squares += end.radiance.powi(2);
                cells[cell].left += 1;
            }
        }
        let (mut patches, mut light, mut squares) = (Vec::new(), 0.0, 0.0);
        let mut is_left = vec![true; ends.len()];
        let all = ends.iter().map(|end| end.radiance.powi(2)).sum::<f64>();
        while patches.len() < most {
            let brightest = (0..cells.len())
                .filter(|i| cells[*i].left >= MIN_ENDS)
                .max_by(|a, b| cells[*a].squares.total_cmp(&cells[*b].squares).then(b.cmp(a)));
            let Some(brightest) =
                brightest.filter(|i| cells[*i].squares > LEAST_OF_PATCH * (all + rays * other.squares))
            else {
                break;
            };
            let taken: Vec<(usize, Aim)> =
                std::mem::take(&mut cells[brightest].ends).into_iter().filter(|(i, _)| is_left[*i]).collect();
            for (i, _) in &taken {
                is_left[*i] = false;
                light += ends[*i].radiance;
                squares += ends[*i].radiance.powi(2);
                for cell in of_ends[*i].iter().flatten() {
                    cells[*cell].left -= 1;
                    cells[*cell].squares -= ends[*i].radiance.powi(2);
                }
            }
            patches.extend(patch(&taken.iter().map(|(i, aim)| (*aim, ends[*i].radiance)).collect::<Vec<_>>()));
        }
        Self { patches: in_a_row(patches), light, squares, all }
    }
}

/// Each patch behind the one that it is nearest to: they are drawn in this order, and numbers near
/// each other stay so.
fn in_a_row(mut patches: Vec<BrightPatch>) -> Vec<BrightPatch> {
    let position = |patch: &BrightPatch| Vec3::from(patch.position);
    for last in 1..patches.len() {
        let here = position(&patches[last - 1]);
        let distance = |i: &usize| here.distance_squared(position(&patches[*i]));
        let next = (last..patches.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        patches.swap(last, next.unwrap_or(last));
    }
    patches
}

/// Over all rays, of which those that met nothing are left out.
fn mean_radiance(ends: &[RayEnd], rays: f64) -> f64 {
    ends.iter().map(|end| end.radiance).sum::<f64>() / rays.max(1.0)
}

/// Of light of that radiance from all over the half sphere.
fn irradiance(radiance: f64) -> f32 {
    (std::f64::consts::PI * radiance.max(0.0)) as f32
}

/// Whether few rays bring most of the light of ends of so many rays each.
fn is_uneven(light: [(&[RayEnd], f64); 2]) -> bool {
    let squares = |ends: &[RayEnd]| ends.iter().map(|end| end.radiance * end.radiance).sum::<f64>();
    let mean_square: f64 = light.iter().map(|(ends, rays)| squares(ends) / rays.max(1.0)).sum();
    let mean: f64 = light.iter().map(|(ends, rays)| mean_radiance(ends, *rays)).sum();
    mean_square > UNEVEN * mean.powi(2)
}

impl RayEnd {
    /// Of light that a ray found by way of what its first leg ends at. It is aimed at that, which
    /// faces those who see it.
    #[must_use]
    pub fn of_gleam(leg: Leg, radiance: f64) -> Self {
        Self { leg, position: leg.start + leg.length * leg.direction, normal: -leg.direction, radiance }
    }

    /// Where other rays are aimed to meet what is there. By way of a plane mirror or of a pane,
    /// that is its image, as far behind the mirror as the way goes on; a ball shows it in itself.
    fn aims(&self) -> [Option<Aim>; 2] {
        let Leg { start, direction, length: first } = self.leg;
        let corner = start + first * direction;
        let after = self.position - corner;
        let length = first + after.length();
        let is_straight = length <= STRAIGHT * self.position.distance(start);
        // What shines through a surface has the normal of its other side, and is seen on this one.
        let arrives = if is_straight { direction } else { after };
        let normal = if self.normal.dot(arrives) > 0.0 { -self.normal } else { self.normal };
        if is_straight {
            return [Some(Aim { position: self.position, normal }), None];
        }
        // The reflection that turns the way back into one line turns the surface as well.
        let turned = match (direction - after.normalize_or_zero()).try_normalize() {
            Some(mirror) => normal - 2.0 * normal.dot(mirror) * mirror,
            None => normal,
        };
        let image = Aim { position: start + length * direction, normal: turned };
        [Some(image), Some(Aim { position: corner, normal: Vec3::ZERO })]
    }
}

/// The ellipse about what is aimed at, by radiance; a disc where it looks the same from all sides.
fn patch(ends: &[(Aim, f64)]) -> Option<BrightPatch> {
    let light: f64 = ends.iter().map(|(_, radiance)| radiance).sum();
    let mean = |of: &dyn Fn(&Aim) -> Vec3| {
        ends.iter().map(|(aim, radiance)| of(aim).as_dvec3() * (radiance / light)).sum::<DVec3>()
    };
    let position = mean(&|aim| aim.position);
    let normal = mean(&|aim| aim.normal).normalize_or_zero();
    // Covariance in the plane, and what lies off it, which is added all around.
    let (x, y) = normal.try_normalize().unwrap_or(DVec3::Z).any_orthonormal_pair();
    let mut covariance = DMat2::ZERO;
    let mut off = 0.0;
    for (aim, radiance) in ends {
        let aside = aim.position.as_dvec3() - position;
        let in_plane = DVec2::new(aside.dot(x), aside.dot(y));
        covariance += DMat2::from_cols(in_plane.x * in_plane, in_plane.y * in_plane) * (radiance / light);
        off += (aside.length_squared() - in_plane.length_squared()).max(0.0) * radiance / light;
    }
    covariance += DMat2::from_diagonal(DVec2::splat(0.5 * off));
    let half = 0.5 * (covariance.x_axis.x - covariance.y_axis.y);
    let skew = covariance.x_axis.y;
    let (middle, apart) = (0.5 * (covariance.x_axis.x + covariance.y_axis.y), half.hypot(skew));
    let is_round = normal == DVec3::ZERO;
    let [long, wide] = if is_round { [middle; 2] } else { [middle + apart, (middle - apart).max(0.0)] };
    let (sin, cos) = (0.5 * skew.atan2(half)).sin_cos();
    let tangent = if is_round { DVec3::ZERO } else { cos * x + sin * y };
    let count = ends.len() as f64;
    // The variance along an axis of an even ellipse is a quarter of its squared radius. Twice that
    // is taken, for what is darker at the rim. Few ends may lie in a line by chance.
    let radius = |variance: f64| (8.0 * (variance + long / count)).sqrt() as f32;
    let power = (light / count * 4.0 * std::f64::consts::PI * (long * (wide + long / count)).sqrt()) as f32;
    let [position, normal, tangent] = [position, normal, tangent].map(|v| v.as_vec3().to_array());
    Some(BrightPatch { position, radius: radius(long), normal, power, tangent, narrow: radius(wide) })
        .filter(|patch| patch.narrow > 0.0 && patch.power.is_finite())
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    /// Ends all over a floor, of which those within a tenth of a metre are brighter.
    fn ends(bright: f64) -> Vec<RayEnd> {
        let at = |i: u32| Vec3::new((i % 100) as f32 / 50.0 - 1.0, 0.0, (i / 100) as f32 / 50.0 - 1.0);
        let radiance = |p: Vec3| if (p - Vec3::new(0.31, 0.0, 0.29)).length() < 0.1 { bright } else { 1.0 };
        let start = Vec3::new(0.0, 1.0, 0.0);
        let end = |p: Vec3| RayEnd {
            leg: Leg { start, direction: (p - start).normalize(), length: p.distance(start) },
            position: p,
            normal: Vec3::Y,
            radiance: radiance(p),
        };
        (0..10_000).map(|i| end(at(i))).collect()
    }

    /// Places by ends of 10,000 rays without gleams.
    fn find(ends: &[RayEnd], width: f32) -> BrightPlaces {
        BrightPlaces::find((ends, &[]), [10_000.0; 2], width)
    }

    #[test]
    fn a_bright_place_is_found_where_it_is() {
        let bright = find(&ends(500.0), 1.0);
        let [patch] = bright.patches[..] else { panic!("one patch: {bright:?}") };
        assert!((Vec3::from(patch.position) - Vec3::new(0.31, 0.0, 0.29)).length() < 0.01, "{patch:?}");
        assert!(patch.radius > 0.1 && patch.radius < 0.16 && patch.normal == [0.0, 1.0, 0.0], "{patch:?}");
        assert!((patch.power / (500.0 * 0.01 * std::f32::consts::PI) - 1.0).abs() < 0.1, "{patch:?}");
        assert!((bright.other_light / std::f32::consts::PI - 1.0).abs() < 0.02, "{bright:?}");
        let narrow = find(&ends(500.0), 0.1).patches;
        assert!(narrow.len() > 3 && narrow.len() <= PATCHES, "{narrow:?}");
    }

    #[test]
    fn a_long_bright_place_has_long_patches() {
        // A strip of 2 cm along a diagonal of the floor.
        let along = vec3(1.0, 0.0, 1.0).normalize();
        let on_strip = |end: &RayEnd| end.position.dot(vec3(along.x, 0.0, -along.z)).abs() < 0.01;
        let shine = |end: RayEnd| RayEnd { radiance: if on_strip(&end) { 500.0 } else { 1.0 }, ..end };
        let strip: Vec<RayEnd> = ends(1.0).into_iter().map(shine).collect();
        let long = find(&strip, 0.5).patches;
        assert!(long.len() > 2 && long.len() < 10, "{long:?}");
        for patch in &long {
            assert!(Vec3::from(patch.tangent).dot(along).abs() > 0.99, "{patch:?}");
            assert!(patch.narrow < 0.4 * patch.radius, "{patch:?}");
        }
        let round = find(&ends(500.0), 1.0).patches;
        assert!(round[0].narrow > 0.8 * round[0].radius, "control: {round:?}");
    }

    #[test]
    fn what_shines_through_faces_those_who_see_it() {
        let lit_from_below = |end: RayEnd| RayEnd { normal: Vec3::NEG_Y, ..end };
        let seen_from_below = |end: RayEnd| {
            let turned = |v: Vec3| v * vec3(1.0, -1.0, 1.0);
            RayEnd { leg: Leg { start: turned(end.leg.start), direction: turned(end.leg.direction), ..end.leg }, ..end }
        };
        let normal = |change: &dyn Fn(RayEnd) -> RayEnd| {
            let ends: Vec<RayEnd> = ends(500.0).into_iter().map(change).collect();
            find(&ends, 1.0).patches[0].normal
        };
        assert_eq!(normal(&lit_from_below), [0.0, 1.0, 0.0]);
        assert_eq!(normal(&seen_from_below), [0.0, -1.0, 0.0]);
        assert_eq!(normal(&|end| end), [0.0, 1.0, 0.0], "control: lit where it is seen");
    }

    #[test]
    fn what_mirrors_and_balls_show_is_aimed_at_in_them() {
        // A lamp at x = 1.1, seen in a mirror at x = -1.
        let lamp = |i: usize| Vec3::new(1.1, 0.01 * (i % 5) as f32, 0.01 * (i / 5) as f32);
        let end = |start: Vec3, corner: Vec3, position: Vec3| RayEnd {
            leg: Leg { start, direction: (corner - start).normalize(), length: corner.distance(start) },
            position,
            normal: Vec3::NEG_X,
            radiance: 1.0,
        };
        let start = |i: usize| Vec3::new(0.2 * (i % 3) as f32, -1.0, 0.1 * i as f32);
        let in_mirror: Vec<RayEnd> = (0..25)
            .map(|i| {
                let image = Vec3::new(-2.0 - lamp(i).x, lamp(i).y, lamp(i).z);
                let part = (-1.0 - start(i).x) / (image.x - start(i).x);
                end(start(i), start(i).lerp(image, part), lamp(i))
            })
            .collect();
        let bright = find(&in_mirror, 0.5);
        let [patch] = bright.patches[..] else { panic!("one image: {bright:?}") };
        assert!((Vec3::from(patch.position) - Vec3::new(-3.1, 0.02, 0.02)).length() < 0.01, "{patch:?}");
        assert!((Vec3::from(patch.normal) - Vec3::X).length() < 1e-3, "{patch:?}");
        // By way of a small ball, whose images lie anywhere.
        let in_ball: Vec<RayEnd> = (0..25)
            .map(|i| end(start(i), Vec3::new(0.01 * (i % 4) as f32, 2.0, 0.01 * (i % 7) as f32), lamp(i)))
            .collect();
        let bright = find(&in_ball, 0.5);
        let [patch] = bright.patches[..] else { panic!("the ball: {bright:?}") };
        assert!((Vec3::from(patch.position) - Vec3::new(0.015, 2.0, 0.03)).length() < 0.01, "{patch:?}");
        assert_eq!(patch.normal, [0.0; 3], "it faces all sides");
    }

    #[test]
    fn light_of_few_rays_is_uneven() {
        // A place of a fourhundredth of the floor.
        let uneven = |ends: &[RayEnd], gleams: &[RayEnd]| is_uneven([(ends, 10_000.0), (gleams, 10_000.0)]);
        assert!(uneven(&ends(500.0), &[]));
        assert!(!uneven(&ends(10.0), &[]) && !uneven(&[], &[]));
        // And a lamp that one of a thousand rays sees in a metal shade.
        let gleam = |radiance| [RayEnd { radiance, ..ends(1.0)[0] }; 10];
        assert!(uneven(&ends(1.0), &gleam(300.0)) && !uneven(&ends(1.0), &gleam(100.0)));
    }

    #[test]
    fn even_light_has_none() {
        let even = find(&ends(7.0), 1.0);
        assert!(even.patches.is_empty() && even.other_light > std::f32::consts::PI, "{even:?}");
        assert_eq!(BrightPlaces::find((&[], &[]), [0.0; 2], 1.0), BrightPlaces::default());
    }
}
