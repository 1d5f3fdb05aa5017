//! Which photons the camera sees, by rays on the host: a measure of how well the emission knows
//! where light is needed.

use glam::Vec3;

use super::obstacles::Obstacles;
use crate::{
    error::Result,
    gpu::Gpu,
    layout::{Photon, from_octahedral},
    passes::RawMap,
    scene::{Camera, Projection},
    stats::SeenStats,
};

/// Photons of a map that are looked at, at most.
const SAMPLE: u32 = 1 << 13;
/// What a camera sees of a scene in a picture of some size, the whole of it whatever the crop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Viewer<'a> {
    pub obstacles: Obstacles<'a>,
    pub camera: &'a Camera,
    pub size: (u32, u32),
}

impl Viewer<'_> {
    /// Counts the first photons of a map that are seen.
    pub fn count(&self, gpu: &Gpu, map: &RawMap) -> Result<SeenStats> {
        let photons = match map.photons.filled(map.stored as u32).next() {
            Some((segment, _, count)) => gpu.read::<Photon>(segment, 0, count.min(SAMPLE).into())?,
            None => Vec::new(),
        };
        let seen = photons.iter().filter(|p| self.sees(p.position.into(), from_octahedral(p.normal))).count();
        Ok(SeenStats { sampled: photons.len() as u64, seen: seen as u64 })
    }

    /// Whether the side of a surface with that normal is seen at a point.
    fn sees(&self, point: Vec3, normal: Vec3) -> bool {
        let camera = self.camera;
        let from = point - camera.position;
        let depth = from.dot(camera.forward);
        let (half_height, to_camera) = match camera.projection {
            Projection::Perspective { .. } => (camera.half_height_at(depth, self.size), -from),
            Projection::Orthographic { .. } => (camera.half_height_at(1.0, self.size), -depth * camera.forward),
        };
        let half_width = half_height * self.size.0 as f32 / self.size.1 as f32;
        let is_before = matches!(camera.projection, Projection::Perspective { .. }) && depth <= 0.0;
        let in_picture = from.dot(camera.right).abs() <= half_width && from.dot(camera.up).abs() <= half_height;
        if is_before || !in_picture || depth < camera.near || depth > camera.far || normal.dot(to_camera) <= 0.0 {
            return false;
        }
        // From the near plane on, surfaces hide what lies behind them.
        let reach = to_camera.length() * (1.0 - camera.near / depth).clamp(0.0, 1.0);
        self.obstacles.first_between(point, point + reach * to_camera.normalize()).is_none()
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::{
        bvh::Bvh,
        scene::{Bounds, Material, Scene, Sphere, Surface},
    };

    #[test]
    fn what_is_hidden_or_outside_of_the_picture_is_not_seen() {
        let surfaces = [Surface::Diffuse { albedo: Vec3::ONE }, Surface::Pane { ior: 1.5, tint: Vec3::ONE }];
        let ball = |z: f32, material| Sphere { center: vec3(0.0, 0.0, z), radius: 0.5, material, object: 0 };
        let scene = Scene {
            materials: surfaces.map(|surface| Material::new("", surface)).to_vec(),
            spheres: vec![ball(0.0, 0), ball(-4.0, 0), ball(2.0, 1)],
            ..Scene::default()
        };
        let bvh = Bvh::build(&scene);
        let view = Camera {
            position: vec3(0.0, 0.0, 5.0),
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::NEG_Z,
            projection: Projection::Perspective { yfov: 0.5 },
            keeps_width: false,
            ..Camera::framing(Bounds { min: Vec3::ZERO, max: Vec3::ONE })
        };
        let sees = |camera: &Camera, point: Vec3, normal: Vec3| {
            let obstacles = Obstacles { scene: &scene, bvh: &bvh };
            Viewer { obstacles, camera, size: (64, 64) }.sees(point, normal)
        };
        assert!(sees(&view, vec3(0.0, 0.0, 0.5), Vec3::Z), "through the pane");
        assert!(!sees(&view, vec3(0.0, 0.0, -0.5), Vec3::NEG_Z), "its back");
        assert!(!sees(&view, vec3(0.0, 0.0, -3.5), Vec3::Z), "behind it");
        assert!(!sees(&view, vec3(2.0, 0.0, 0.0), Vec3::Z), "beside the picture");
        assert!(!sees(&view, vec3(0.0, 0.0, 7.0), Vec3::NEG_Z), "behind the camera");
        let cut = Camera { near: 6.0, ..view.clone() };
        assert!(sees(&cut, vec3(0.0, 0.0, -3.5), Vec3::Z), "what lies before the near plane hides nothing");
        assert!(!sees(&cut, vec3(0.0, 0.0, 0.5), Vec3::Z), "nor is it seen");
        let parallel = Camera { projection: Projection::Orthographic { ymag: 1.0 }, ..view };
        assert!(sees(&parallel, vec3(0.9, 0.0, 0.0), Vec3::Z) && !sees(&parallel, vec3(1.1, 0.0, 0.0), Vec3::Z));
        assert!(!sees(&parallel, vec3(0.1, 0.0, -3.5), Vec3::Z), "behind the ball");
    }
}
