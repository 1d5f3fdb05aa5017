//! Emission of surfaces on which it varies: where a texture multiplies it, or not all of the
//! surface is there.
//!
//! A triangle is cut into congruent subtriangles along the lines of its barycentric coordinates,
//! `side` of them along an edge, so that each is a light that is nearly uniform. Row by row, a
//! subtriangle is followed by the turned one beside it (`shaders/lib/transport/emissive.wesl`).

use std::{collections::BTreeMap, sync::Arc};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    Alpha, Attributes, Material, Scene, Texture, Triangle,
    texel_map::{Channels, Counts, TexelMap},
};

/// Most subtriangles along an edge of a triangle.
const MAX_SIDE: u32 = 16;
/// Most subtriangles of a scene, unless it has more triangles of varied emission.
const MAX_PARTS: u64 = 65_536;
/// Points for each texel along an edge of a subtriangle by which its mean is taken, and their least
/// and greatest number.
const POINTS_PER_TEXEL: f32 = 1.0;
const POINTS: [u32; 2] = [4, 32];

/// Position of a subtriangle in its triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Subtriangle {
    /// Its corner nearest to the triangle's first corner is that many subtriangles along its edges.
    pub column: u32,
    pub row: u32,
    /// Turned by half a turn against the triangle.
    pub is_turned: bool,
}

impl Subtriangle {
    /// The subtriangles of a triangle.
    pub fn all(side: u32) -> impl Iterator<Item = Self> {
        let row = move |row: u32| (0..2 * (side - row) - 1).map(move |i| (i / 2, row, i % 2 == 1));
        (0..side).flat_map(row).map(|(column, row, is_turned)| Self { column, row, is_turned })
    }

    /// Weights of the triangle's second and third corner where those of the subtriangle's are
    /// `weights`.
    pub fn weights(self, side: u32, weights: Vec2) -> Vec2 {
        let corner = Vec2::new(self.column as f32, self.row as f32);
        let scaled = if self.is_turned { corner + 1.0 - weights } else { corner + weights };
        scaled / side as f32
    }
}

/// Emission of a subtriangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Emitted {
    /// Mean over the subtriangle of the factor on the emission of its material.
    pub mean: DVec3,
    /// Whether the factor can be above 0 somewhere.
    pub is_lit: bool,
}

/// A primitive of varied emission, cut into subtriangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Cut {
    /// Parts along an edge; 0 if it emits nothing.
    pub side: u32,
    /// `side` squared.
    pub subtriangles: Vec<Emitted>,
}

impl Cut {
    /// Mean over the primitive of the factor on the emission of its material.
    pub fn mean(&self) -> DVec3 {
        self.subtriangles.iter().map(|subtriangle| subtriangle.mean).sum::<DVec3>()
            / (self.subtriangles.len() as f64).max(1.0)
    }
}

/// Textures on which the emission of a material depends.
#[derive(Default)]
struct Varied<'a> {
    emission: Option<TexelMap<'a>>,
    opacity: Option<TexelMap<'a>>,
}

/// The emissive materials whose emission varies over their surfaces.
pub(crate) struct EmissionMap<'a> {
    scene: &'a Scene,
    materials: Vec<Option<Varied<'a>>>,
}

impl<'a> EmissionMap<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let mut known = BTreeMap::<(u32, Channels), Arc<Counts>>::new();
        let mut map = |texture: Option<Texture>, channels: Channels| {
            let texture = texture?;
            let image = &scene.images[texture.image as usize];
            let counts = known.entry((texture.image, channels)).or_insert_with(|| Counts::new(image, channels).into());
            Some(TexelMap { image, texture, counts: Arc::clone(counts) })
        };
        let mut varied = |material: &Material| {
            let (is_there, textures) = (material.alpha == Alpha::Opaque, &material.textures);
            let is_varied = material.emission != Vec3::ZERO && (!is_there || textures.emission.is_some());
            is_varied.then(|| Varied {
                emission: map(textures.emission, Channels::Color),
                opacity: map(textures.base_color.filter(|_| !is_there), Channels::Alpha),
            })
        };
        Self { scene, materials: scene.materials.iter().map(&mut varied).collect() }
    }

    /// Whether the emission of a material varies.
    pub fn is_varied(&self, material: u32) -> bool {
        self.materials[material as usize].is_some()
    }

    /// All primitives of varied emission, by their indices in the scene.
    pub fn cut(&self) -> BTreeMap<usize, Cut> {
        let (triangles, spheres) = (&self.scene.triangles, &self.scene.spheres);
        let materials = triangles.iter().map(|t| t.material).chain(spheres.iter().map(|s| s.material));
        let varied: Vec<usize> =
            materials.enumerate().filter(|(_, material)| self.is_varied(*material)).map(|(i, _)| i).collect();
        let sides: Vec<u32> = varied.par_iter().map(|primitive| self.side(*primitive)).collect();
        let count = |most: u32| sides.iter().map(|side| u64::from(*side.min(&most)).pow(2)).sum::<u64>();
        let mut most = MAX_SIDE;
        while most > 1 && count(most) > MAX_PARTS {
            most /= 2;
        }
        let cut = |(primitive, side): (&usize, &u32)| {
            let side = (*side).min(most);
            let subtriangles = if side == 0 { Vec::new() } else { self.subtriangles(*primitive, side) };
            (*primitive, Cut { side, subtriangles })
        };
        varied.par_iter().zip(&sides).map(cut).collect()
    }

    /// Number of subtriangles that a primitive of varied emission should be cut into, along an
    /// edge; 0 if it emits nothing.
    fn side(&self, primitive: usize) -> u32 {
        let Some((triangle, own)) = self.triangle(primitive) else {
            return u32::from(self.subtriangles(primitive, 1)[0].is_lit);
        };
        if !self.is_lit(triangle, &own, |weights| weights) {
            return 0;
        }
        // One subtriangle for each texel.
        let wanted = self.extent(triangle, &own).ceil() as u32;
        wanted.clamp(1, MAX_SIDE).next_power_of_two()
    }

    /// Emission of each subtriangle of a primitive. A sphere is one subtriangle.
    fn subtriangles(&self, primitive: usize, side: u32) -> Vec<Emitted> {
        let Some((triangle, own)) = self.triangle(primitive) else {
            let sphere = &self.scene.spheres[primitive - self.scene.triangles.len()];
            let material = &self.scene.materials[sphere.material as usize];
            let mean = DVec3::splat(coverage(material, material.opacity).into());
            return vec![Emitted { mean, is_lit: mean != DVec3::ZERO }];
        };
        let points = (POINTS_PER_TEXEL * self.extent(triangle, &own) / side as f32).ceil() as u32;
        let points = points.clamp(POINTS[0], POINTS[1]);
        let emitted = |subtriangle: Subtriangle| {
            if !self.is_lit(triangle, &own, |weights| subtriangle.weights(side, weights)) {
                return Emitted { mean: DVec3::ZERO, is_lit: false };
            }
            let middle = |point: Subtriangle| subtriangle.weights(side, point.weights(points, Vec2::splat(1.0 / 3.0)));
            let sum: DVec3 =
                Subtriangle::all(points).map(|point| self.factor(triangle, &own, middle(point)).as_dvec3()).sum();
            Emitted { mean: sum / f64::from(points * points), is_lit: true }
        };
        Subtriangle::all(side).map(emitted).collect()
    }

    /// A triangle and what its corners carry; `None` for a sphere.
    fn triangle(&self, primitive: usize) -> Option<(&Triangle, Attributes)> {
        let triangle = self.scene.triangles.get(primitive)?;
        let own = triangle.attributes.checked_sub(1).map(|i| &self.scene.attributes[i as usize]);
        Some((triangle, own.map_or_else(Attributes::default, |own| own.in_order(triangle.is_turned))))
    }

    fn varied(&self, triangle: &Triangle) -> (Option<&TexelMap<'_>>, Option<&TexelMap<'_>>) {
        // Without attributes there are no texture coordinates, and kernels read no texture.
        let varied = self.materials[triangle.material as usize].as_ref().filter(|_| triangle.attributes > 0);
        varied.map_or((None, None), |varied| (varied.emission.as_ref(), varied.opacity.as_ref()))
    }

    /// Largest extent of a triangle on its textures, in texels.
    fn extent(&self, triangle: &Triangle, own: &Attributes) -> f32 {
        let (emission, opacity) = self.varied(triangle);
        let maps = emission.into_iter().chain(opacity);
        maps.map(|map| map.extent(own.uvs[map.texture.uv_set as usize])).fold(0.0, f32::max)
    }

    /// Whether the factor can be above 0 in a subtriangle; `to_triangle` gives weights in the
    /// triangle for those in the subtriangle.
    fn is_lit(&self, triangle: &Triangle, own: &Attributes, to_triangle: impl Fn(Vec2) -> Vec2) -> bool {
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y].map(to_triangle);
        let lit = |map: &TexelMap<'_>| {
            let uvs = own.uvs[map.texture.uv_set as usize];
            map.is_lit(corners.map(|weights| interpolated(uvs, weights)))
        };
        let material = &self.scene.materials[triangle.material as usize];
        let (emission, opacity) = self.varied(triangle);
        let most = own.colors.iter().fold(0.0, |most: f32, color| most.max(color.w)) * material.opacity;
        let least = if opacity.is_none_or(lit) { most } else { 0.0 };
        emission.is_none_or(lit) && coverage(material, least) > 0.0
    }

    /// Factor on the emission at a point.
    fn factor(&self, triangle: &Triangle, own: &Attributes, weights: Vec2) -> Vec3 {
        let material = &self.scene.materials[triangle.material as usize];
        let (emission, opacity) = self.varied(triangle);
        let value = |map: &TexelMap<'_>| map.value(interpolated(own.uvs[map.texture.uv_set as usize], weights));
        let own_opacity = interpolated(own.colors, weights).w * opacity.map_or(1.0, |map| value(map).w);
        let color = emission.map_or(Vec3::ONE, |map| value(map).truncate());
        color * coverage(material, material.opacity * own_opacity)
    }
}

/// Fraction of a surface that is there, by its opacity.
fn coverage(material: &Material, opacity: f32) -> f32 {
    match material.alpha {
        Alpha::Opaque => 1.0,
        Alpha::Mask { cutoff } => f32::from(u8::from(opacity >= cutoff)),
        Alpha::Blend => opacity.clamp(0.0, 1.0),
    }
}

/// Value at a point of what the corners have.
fn interpolated<T>([a, b, c]: [T; 3], weights: Vec2) -> T
where
    T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
{
    a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subtriangles_tile_the_triangle() {
        for side in [1, 2, 16] {
            let subtriangles: Vec<Subtriangle> = Subtriangle::all(side).collect();
            assert_eq!(subtriangles.len(), (side * side) as usize);
            for (i, subtriangle) in subtriangles.iter().enumerate() {
                // The kernels' formula for the number of a subtriangle.
                let before = subtriangle.row * (2 * side - subtriangle.row)
                    + 2 * subtriangle.column
                    + u32::from(subtriangle.is_turned);
                assert_eq!(before, i as u32);
                let middle = subtriangle.weights(side, Vec2::splat(1.0 / 3.0));
                assert!(middle.min_element() > 0.0 && middle.element_sum() < 1.0, "{subtriangle:?} lies outside");
                let scaled = middle * side as f32;
                assert_eq!(
                    (scaled.floor() - Vec2::new(subtriangle.column as f32, subtriangle.row as f32)).length(),
                    0.0
                );
                assert_eq!(scaled.fract().element_sum() > 1.0, subtriangle.is_turned);
            }
        }
    }
}
