//! Unit vectors in a word.

/// Octahedral encoding of a unit vector in two 16-bit signed normalised numbers (Cigolle et al.
/// 2014, "A Survey of Efficient Representations for Independent Unit Vectors"); x in the low half.
/// Twin of `encode_octahedral` in `shaders/lib/core/octahedral.wesl`.
#[must_use]
pub fn octahedral(v: glam::Vec3) -> u32 {
    let p = v / (v.x.abs() + v.y.abs() + v.z.abs());
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = if p.z < 0.0 { ((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)) } else { (p.x, p.y) };
    let pack = |x: f32| u32::from(((x.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16);
    pack(x) | (pack(y) << 16)
}

/// Inverse of [`octahedral`]: a unit vector.
#[must_use]
pub fn from_octahedral(packed: u32) -> glam::Vec3 {
    let unpack = |u: u32| f32::max(f32::from(u as u16 as i16) / 32767.0, -1.0);
    let (x, y) = (unpack(packed & 0xffff), unpack(packed >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    let push = |x: f32| if x >= 0.0 { x - t } else { x + t };
    glam::Vec3::new(push(x), push(y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octahedral_keeps_directions() {
        for i in 0..1000 {
            let (a, z) = (i as f32 * 2.399_963, (i as f32 + 0.5) / 500.0 - 1.0);
            let r = (1.0 - z * z).sqrt();
            let v = glam::Vec3::new(r * a.cos(), r * a.sin(), z);
            assert!((from_octahedral(octahedral(v)) - v).length() < 1e-4, "{v}");
        }
    }
}
