//! A texture of colours on the host: its value at a point, as the kernels sample it, and whether a
//! region of it is zero. Twin of `shaders/lib/transport/texture.wesl`.

use std::sync::{Arc, LazyLock};

use glam::{Vec2, Vec3, Vec4};

use super::{Image, Texture, Wrap};
use crate::image::srgb_decode;

/// Slack for the rounding of texture coordinates, in texels.
const ROUNDING: f32 = 0.01;

/// Channels that count in a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Channels {
    /// The colour.
    Color,
    /// The opacity.
    Alpha,
}

/// Number of texels of an image that are not zero, above and to the left of each corner of its
/// grid: the sum over any rectangle is four of them.
pub(super) struct Counts(Vec<u32>);

impl Counts {
    pub fn new(image: &Image, channels: Channels) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let columns = width + 1;
        let mut sums = vec![0; columns * (height + 1)];
        for y in 0..height {
            let mut row = 0;
            for x in 0..width {
                let [r, g, b, a] = image.texels[y * width + x];
                row += u32::from(match channels {
                    Channels::Color => [r, g, b] != [0; 3],
                    Channels::Alpha => a != 0,
                });
                sums[(y + 1) * columns + x + 1] = sums[y * columns + x + 1] + row;
            }
        }
        Self(sums)
    }
}

/// A texture, and where it is not zero.
pub(super) struct TexelMap<'a> {
    pub image: &'a Image,
    pub texture: Texture,
    pub counts: Arc<Counts>,
}

impl TexelMap<'_> {
    /// Transformed texture coordinates.
    fn placed(&self, uv: Vec2) -> Vec2 {
        let [u, v] = self.texture.transform.map(|row| Vec3::from_array(row).dot(uv.extend(1.0)));
        Vec2::new(u, v)
    }

    fn size(&self) -> Vec2 {
        Vec2::new(self.image.width as f32, self.image.height as f32)
    }

    /// Largest extent of these texture coordinates, in texels.
    pub fn extent(&self, uvs: [Vec2; 3]) -> f32 {
        let [a, b, c] = uvs.map(|uv| self.placed(uv) * self.size());
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    /// Colour, linear, and opacity at a point.
    pub fn value(&self, uv: Vec2) -> Vec4 {
        let uv = self.placed(uv);
        let [wide, high] = self.texture.wrap;
        let folded = Vec2::new(folded(uv.x, wide), folded(uv.y, high)) * self.size();
        let corner = folded - if self.texture.is_linear { 0.5 } else { 0.0 };
        let low = corner.floor();
        let column = |dx: i64| wrapped(low.x as i64 + dx, self.image.width, wide);
        let row = |dy: i64| wrapped(low.y as i64 + dy, self.image.height, high) * self.image.width as usize;
        let texel = |column: usize, row: usize| decoded(self.image.texels[row + column]);
        if !self.texture.is_linear {
            return texel(column(0), row(0));
        }
        let (fraction, [left, right]) = (corner - low, [column(0), column(1)]);
        let between = |row: usize| texel(left, row).lerp(texel(right, row), fraction.x);
        between(row(0)).lerp(between(row(1)), fraction.y)
    }

    /// Whether the texture may be other than zero within a triangle of texture coordinates: some
    /// texel of its bounding box is.
    pub fn is_lit(&self, uvs: [Vec2; 3]) -> bool {
        let corners = uvs.map(|uv| self.placed(uv) * self.size());
        // Interpolation reaches half a texel farther.
        let reach = Vec2::splat(ROUNDING + if self.texture.is_linear { 0.5 } else { 0.0 });
        let [low, high] = [
            corners.into_iter().fold(Vec2::INFINITY, Vec2::min) - reach,
            corners.into_iter().fold(Vec2::NEG_INFINITY, Vec2::max) + reach,
        ];
        if !(low.is_finite() && high.is_finite()) {
            return true;
        }
        let columns = spans(low.x, high.x, i64::from(self.image.width), self.texture.wrap[0]);
        let rows = spans(low.y, high.y, i64::from(self.image.height), self.texture.wrap[1]);
        let stride = self.image.width as usize + 1;
        let at = |x: usize, y: usize| self.counts.0[y * stride + x];
        let lit = |&[left, right]: &[usize; 2], &[top, bottom]: &[usize; 2]| {
            at(right, bottom) + at(left, top) > at(left, bottom) + at(right, top)
        };
        rows.iter().any(|row| columns.iter().any(|column| lit(column, row)))
    }
}

/// Texels of an image of size `n` that cover `low` to `high`, as ranges from the first to behind
/// the last.
fn spans(low: f32, high: f32, n: i64, wrap: Wrap) -> Vec<[usize; 2]> {
    let [first, last] = [low, high].map(|x| x.floor() as i64);
    let range = |first: i64, last: i64| [first as usize, last as usize + 1];
    if wrap == Wrap::Clamp {
        return vec![range(first.clamp(0, n - 1), last.clamp(0, n - 1))];
    }
    if last.saturating_sub(first) >= n {
        return vec![range(0, n - 1)];
    }
    let tile = |k: i64| {
        let (from, to) = ((first - k * n).max(0), (last - k * n).min(n - 1));
        if wrap == Wrap::Mirror && k.rem_euclid(2) == 1 { range(n - 1 - to, n - 1 - from) } else { range(from, to) }
    };
    (first.div_euclid(n)..=last.div_euclid(n)).map(tile).collect()
}

/// Texture coordinate within the period of its wrapping.
fn folded(x: f32, wrap: Wrap) -> f32 {
    let period = match wrap {
        Wrap::Clamp => return x.clamp(0.0, 1.0),
        Wrap::Repeat => 1.0,
        Wrap::Mirror => 2.0,
    };
    let within = period * (x / period - (x / period).floor());
    if within >= 0.0 { within } else { 0.0 }
}

/// Column or row of an image of size `n`.
fn wrapped(i: i64, n: u32, wrap: Wrap) -> usize {
    let n = i64::from(n);
    // Nearly all are, and need no division.
    if (0..n).contains(&i) {
        return i as usize;
    }
    let within = match wrap {
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let within = i.rem_euclid(2 * n);
            if within >= n { 2 * n - 1 - within } else { within }
        }
    };
    within as usize
}

fn decoded([r, g, b, a]: [u8; 4]) -> Vec4 {
    static LINEAR: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_decode(byte as f32 / 255.0)));
    let [r, g, b] = [r, g, b].map(|byte| LINEAR[usize::from(byte)]);
    Vec4::new(r, g, b, f32::from(a) / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec2;

    /// An image of 11 by 7 texels of which few are not black.
    fn image() -> Image {
        let texel = |i: usize| if i % 23 == 5 { [0, 200, 3, 255] } else { [0, 0, 0, 255] };
        Image { name: String::new(), width: 11, height: 7, texels: (0..77).map(texel).collect() }
    }

    /// Regions of a texture that are reported as dark but have a bright point, that are reported as
    /// dark, and that have a bright point.
    fn regions(map: &TexelMap<'_>) -> [usize; 3] {
        let part = |k: usize, step: f32| (k as f32 * step).fract();
        let mut counts = [0; 3];
        for k in 0..900 {
            let (a, size) = (vec2(3.0 * part(k, 0.618) - 1.0, 3.0 * part(k, 0.414) - 1.0), 0.02 + 0.2 * part(k, 0.37));
            let uvs = [a, a + vec2(size, 0.1 * size), a + vec2(-0.2 * size, size)];
            let points = (0..400).map(|i| [(i % 20) as f32 / 19.0, (i / 20) as f32 / 19.0]);
            let shines = |[u, v]: [f32; 2]| map.value(a + u * (uvs[1] - a) + v * (uvs[2] - a)).y > 0.0;
            let (is_dark, is_bright) = (!map.is_lit(uvs), points.filter(|[u, v]| u + v <= 1.0).any(shines));
            [is_dark && is_bright, is_dark, is_bright]
                .iter()
                .zip(&mut counts)
                .for_each(|(is, n)| *n += usize::from(*is));
        }
        counts
    }

    #[test]
    fn a_region_is_dark_only_where_all_its_points_are() {
        let image = image();
        let mut other = image.clone();
        other.texels.rotate_right(13);
        for (i, wrap) in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].into_iter().enumerate() {
            let texture = Texture {
                image: 0,
                wrap: [wrap, [Wrap::Clamp, Wrap::Repeat, Wrap::Mirror][i]],
                is_linear: i != 1,
                is_mipmapped: false,
                uv_set: 0,
                transform: [[0.8, 0.3, -0.2], [-0.2, 1.4, 0.1]],
            };
            let map = |of: &Image| TexelMap { image: &image, texture, counts: Counts::new(of, Channels::Color).into() };
            let [wrong, dark, bright] = regions(&map(&image));
            assert!(wrong == 0 && dark > 50 && bright > 50, "{wrong} of {dark} dark regions have a bright point");
            assert!(regions(&map(&other))[0] > 0, "control: where another image is dark");
            let boundless = [vec2(-1e30, 0.0), vec2(1e30, 9.0), Vec2::ZERO];
            assert!(map(&image).is_lit([vec2(f32::NAN, 0.0); 3]) && map(&image).is_lit(boundless));
        }
    }
}
