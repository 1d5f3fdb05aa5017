//! The centre of a scene, from which its coordinates in 32 bits count.

use glam::DVec3;

use super::fault::Read;
use super::mesh_cache::MeshInstance;
use super::placing::{WorldBounds, corners_of_box};

/// Cameras that may move the centre of a scene.
const MOST_EYES: usize = 8;
/// Distance of a camera from the centre of a scene over that from what is nearest to it, above
/// which the centre is where the camera is: numbers of 32 bits would round what it sees.
const FAR_FROM_CENTER: f64 = 4096.0;

/// The centre of the box around a scene, or a camera that looks at small things far away from it,
/// as at a product before mountains.
pub(super) fn center(bounds: &WorldBounds, instances: &[MeshInstance<'_>], eyes: &[DVec3]) -> Read<DVec3> {
    let middle = bounds.center();
    let mut center = (FAR_FROM_CENTER, middle);
    for eye in &eyes[..eyes.len().min(MOST_EYES)] {
        let mut nearest = f64::INFINITY;
        for instance in instances {
            let boxes: Vec<[DVec3; 8]> = instance.primitives.iter().map(corners_of_box).collect();
            for i in 0..instance.copies() {
                let to_world = instance.world(i)?;
                for (primitive, corners) in instance.primitives.iter().zip(&boxes) {
                    let mut around = WorldBounds::EMPTY;
                    corners.iter().for_each(|corner| around.add(to_world.transform_point3(*corner), 0.0));
                    let vertices = primitive.positions.iter().map(|p| to_world.transform_point3(p.as_dvec3()));
                    let distance = match around.hold(*eye) {
                        true => vertices.map(|vertex| vertex.distance(*eye)).fold(f64::INFINITY, f64::min),
                        false => eye.clamp(around.min, around.max).distance(*eye),
                    };
                    nearest = nearest.min(distance);
                }
            }
        }
        let far = eye.distance(middle) / nearest;
        if far > center.0 {
            center = (far, *eye);
        }
    }
    Ok(center.1)
}
