//! Concave corners between two visible surfaces. There the nearest photons lie on both surfaces,
//! and an estimate that assumes one plane is too bright.

use glam::Vec3;

use crate::{
    image::Frame,
    scene::{Camera, Projection},
};

/// Cosine between normals below which two surfaces form a corner and not a curve.
const BENT: f32 = 0.7;
/// Half of the region's width relative to the picture's height.
const REACH: f32 = 1.0 / 48.0;

/// Pixels near concave corners.
pub(super) fn corner_region(frame: &Frame, camera: &Camera) -> Vec<bool> {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let points = Points::new(frame, camera);
    let reach = ((height as f32 * REACH).ceil() as usize).max(1);
    let mut region = vec![false; width * height];
    for y in 0..height {
        for x in 0..width {
            let here = y * width + x;
            for step in 1..=reach {
                let across = (x + step < width).then_some(here + step);
                let down = (y + step < height).then_some(here + step * width);
                for there in [across, down].into_iter().flatten() {
                    if points.meet(here, there, step) {
                        region[here] = true;
                        region[there] = true;
                    }
                }
            }
        }
    }
    region
}

/// First hits, world space, metres.
struct Points<'a> {
    frame: &'a Frame,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// Width of each pixel at the distance of its first hit, metres.
    widths: Vec<f32>,
}

impl<'a> Points<'a> {
    fn new(frame: &'a Frame, camera: &Camera) -> Self {
        let (width, height) = (frame.width as usize, frame.height as f32);
        let size = (frame.width, frame.height);
        let widths: Vec<f32> =
            frame.depth().iter().map(|&depth| 2.0 * camera.half_height_at(depth, size) / height).collect();
        let across = |i: usize| {
            let x = ((i % width) as f32 + 0.5 - width as f32 / 2.0) * widths[i];
            let y = (height / 2.0 - (i / width) as f32 - 0.5) * widths[i];
            camera.right * x + camera.up * y
        };
        let position = |i: usize| camera.position + across(i) + camera.forward * frame.depth()[i];
        let positions: Vec<_> = (0..frame.pixels()).map(position).collect();
        let view = |i: usize| match camera.projection {
            Projection::Perspective { .. } => positions[i] - camera.position,
            Projection::Orthographic { .. } => camera.forward,
        };
        let towards_viewer = |i: usize| {
            let normal = Vec3::from(frame.normal()[i]);
            if normal.dot(view(i)) > 0.0 { -normal } else { normal }
        };
        let normals = (0..frame.pixels()).map(towards_viewer).collect();
        Self { frame, positions, normals, widths }
    }

    /// Whether the surfaces at two pixels, `step` apart, form one concave corner: neither occludes
    /// the other, and each lies in front of the other's plane.
    fn meet(&self, a: usize, b: usize, step: usize) -> bool {
        // The normals of a pixel that shows more than one surface are averaged to less than unit
        // length.
        let whole = |i: usize| self.frame.alpha()[i] > 0.99 && self.normals[i].length_squared() > 0.98;
        let (na, nb, between) = (self.normals[a], self.normals[b], self.positions[b] - self.positions[a]);
        let near = 8.0 * step as f32 * self.widths[a].min(self.widths[b]);
        let slack = 0.05 * between.length();
        whole(a)
            && whole(b)
            && na.dot(nb) < BENT
            && between.length() < near
            && between.dot(na) > slack
            && -between.dot(nb) > slack
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: u32 = 48;

    /// Layers of two planes that meet on the axis of a camera at the origin at depth 2; `depth`
    /// maps the tangent of the view angle to the depth.
    fn wedge(sign: f32) -> (Frame, Camera) {
        let camera = Camera {
            name: String::new(),
            position: Vec3::ZERO,
            right: Vec3::X,
            up: Vec3::Y,
            forward: -Vec3::Z,
            projection: Projection::Perspective { yfov: std::f32::consts::FRAC_PI_2 },
            aspect: None,
            near: 0.0,
            far: f32::INFINITY,
            keeps_width: false,
        };
        let mut frame = Frame::new(SIZE, SIZE, &[[1.0; 3]; (SIZE * SIZE) as usize]);
        for i in 0..(SIZE * SIZE) as usize {
            let tangent = ((i as u32 % SIZE) as f32 + 0.5) / SIZE as f32 * 2.0 - 1.0;
            // |x| = sign (2 - depth): a corner, or an edge that points at the viewer.
            frame.layer_mut("depth")[i] = 2.0 / (1.0 + sign * tangent.abs());
            let normal = Vec3::new(-sign * tangent.signum(), 0.0, 1.0).normalize().to_array();
            frame.layer_mut("normal")[3 * i..][..3].copy_from_slice(&normal);
            frame.layer_mut("alpha")[i] = 1.0;
        }
        (frame, camera)
    }

    #[test]
    fn a_corner_is_found_where_the_planes_meet() {
        let (frame, camera) = wedge(1.0);
        let region = corner_region(&frame, &camera);
        let row: Vec<usize> = (0..SIZE as usize).filter(|&x| region[5 * SIZE as usize + x]).collect();
        assert_eq!(row, [23, 24]);
    }

    #[test]
    fn an_orthographic_camera_finds_it_too() {
        let camera = Camera { projection: Projection::Orthographic { ymag: 2.0 }, ..wedge(1.0).1 };
        let mut frame = wedge(1.0).0;
        for (i, depth) in frame.layer_mut("depth").iter_mut().enumerate() {
            *depth = 2.0 - 2.0 * (((i % SIZE as usize) as f32 + 0.5) / SIZE as f32 * 2.0 - 1.0).abs();
        }
        let region = corner_region(&frame, &camera);
        let row: Vec<usize> = (0..SIZE as usize).filter(|&x| region[5 * SIZE as usize + x]).collect();
        assert_eq!(row, [23, 24]);
    }

    #[test]
    fn an_edge_towards_the_viewer_is_none_nor_is_a_wall_behind_another() {
        let (edge, camera) = wedge(-0.5);
        assert!(corner_region(&edge, &camera).iter().all(|found| !found));
        let (mut apart, camera) = wedge(1.0);
        for (i, depth) in apart.layer_mut("depth").iter_mut().enumerate() {
            *depth *= if i % SIZE as usize >= 24 { 10.0 } else { 1.0 };
        }
        assert!(corner_region(&apart, &camera).iter().all(|found| !found));
    }
}
