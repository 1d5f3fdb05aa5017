//! Light that a coat or a sheen leaves to a diffuse base below, as the kernels have it: twins
//! of functions in `shaders/lib/transport/coat.wesl` and `sheen.wesl`.

use glam::Vec3;

use crate::layout::VisiblePoint;

/// Mean fraction of the light from all directions, by the cosine, that what lies above leaves to
/// the diffuse lobe of `point`: twin of `mean_transmittance` in
/// `shaders/lib/camera/visible_point.wesl`.
#[must_use]
pub fn mean_transmittance(point: &VisiblePoint) -> f32 {
    if point.above == 0 {
        return 1.0;
    }
    let [normal, grazing, sheen, roughness] = point.above.to_le_bytes().map(|byte| f32::from(byte) / 255.0);
    let mu = Vec3::from(point.ns).dot(point.view.into()).max(0.0);
    let transmittance = mean_coat_transmittance(normal * normal, grazing * grazing, mu);
    if sheen == 0.0 {
        return transmittance;
    }
    // Four directions, each for a quarter of the flux.
    let below = |i: u8| {
        let cosine = ((f32::from(i) + 0.5) / 4.0).sqrt();
        1.0 - sheen * sheen_albedo(mu, roughness).max(sheen_albedo(cosine, roughness))
    };
    transmittance * (0..4).map(below).sum::<f32>() / 4.0
}

/// Twin of `mean_coat_transmittance`.
fn mean_coat_transmittance(f0: f32, f90: f32, mu: f32) -> f32 {
    let mean = 0.02809 + mu * (-0.07754 + mu * (0.0751 - 0.02563 * mu));
    1.0 - f0 - (f90 - f0) * mean
}

/// Twin of `sheen_albedo`.
fn sheen_albedo(mu: f32, roughness: f32) -> f32 {
    const ROWS: [[f32; 4]; 5] = [
        [5.352, -25.361, 23.314, -5.173],
        [-2.023, 12.342, 15.374, -20.712],
        [-9.165, 31.625, -73.383, 45.352],
        [4.927, -18.211, 36.509, -21.076],
        [0.819, -0.315, -0.578, 0.78],
    ];
    let r = roughness.max(0.2);
    let x = mu.max(0.0).sqrt().sqrt();
    let root = ROWS.iter().fold(0.0, |root, [a, b, c, d]| root * x + a + r * (b + r * (c + r * d)));
    (root * root.max(0.0)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coat_and_sheen_take_their_part() {
        let point =
            |above: u32| VisiblePoint { ns: [0.0, 1.0, 0.0], view: [0.0, 1.0, 0.0], above, ..Default::default() };
        assert_eq!(mean_transmittance(&point(0)), 1.0);
        // Roots of 0.04 and 1, in 255ths.
        let coat = mean_transmittance(&point(51 | 255 << 8));
        assert!((coat - 0.96).abs() < 1e-3, "{coat}");
        let both = mean_transmittance(&point(51 | 255 << 8 | 255 << 16 | 128 << 24));
        assert!(both < 0.9 * coat && both > 0.3, "control: sheen takes nothing, or all: {both}");
    }
}
