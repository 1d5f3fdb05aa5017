//! Building: primitives in the order of the tree over them.

use glam::Vec3;
use rayon::prelude::*;

use super::{parallel, split, widen};
use crate::layout::{BVH_STACK, BvhNode, Normals, Primitive, SPHERE_BIT, octahedral};
use crate::scene::{Bounds, Scene, Sphere, Triangle};

/// [`Primitive::id`] of a padding triangle.
pub const FILLER: u32 = u32::MAX;

/// Nodes and primitives in device layout.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    /// Interior nodes, parents before children. Node 0 is the root.
    pub nodes: Vec<BvhNode>,
    /// Primitives in leaf order.
    pub primitives: Vec<Primitive>,
    /// Normals of each primitive, parallel to `primitives`.
    pub normals: Vec<Normals>,
}

impl Bvh {
    /// Builds the tree over all triangles and spheres: PLOC with reinsertion (Meister and Bittner
    /// 2018, 2021). Large primitives among many that cross are listed several times, in smaller
    /// boxes. Large scenes are divided into parts that are built on all cores. Equal scenes give
    /// equal trees on any number of threads.
    ///
    /// # Panics
    /// If there are 2^28 triangles and spheres or more. The loader refuses such files earlier.
    #[must_use]
    pub fn build(scene: &Scene) -> Self {
        let triangles = scene.triangles.par_iter().map(triangle_primitive);
        let primitives = triangles.chain(scene.spheres.par_iter().map(sphere_primitive)).enumerate();
        let mut primitives: Vec<Primitive> =
            primitives.map(|(id, primitive)| Primitive { id: id as u32, ..primitive }).collect();
        primitives.resize(primitives.len().max(2), Primitive { id: FILLER, ..Primitive::default() });
        let (bounds, of_bounds) = split::pieces(&primitives, primitives.par_iter().map(bounds).collect());
        let (nodes, order) = widen::widen(&parallel::tree(&bounds));
        let normals = |primitive: &Primitive| {
            scene.triangles.get(primitive.id as usize).map_or(Normals::default(), corner_normals)
        };
        let primitives: Vec<Primitive> =
            order.par_iter().map(|i| primitives[of_bounds[*i as usize] as usize]).collect();
        Self { normals: primitives.par_iter().map(normals).collect(), nodes, primitives }
    }

    /// Maximum number of children that a traversal holds on its stack.
    #[must_use]
    pub fn max_stack_depth(&self) -> usize {
        // Deferred children on the stack when the traversal enters each node.
        let mut deferred = vec![0_usize; self.nodes.len()];
        let mut most = 0;
        for (i, node) in self.nodes.iter().enumerate() {
            let here = deferred[i] + node.children().count() - 1;
            node.children().filter(|child| child.count == 0).for_each(|child| deferred[child.first as usize] = here);
            most = most.max(here);
        }
        debug_assert!(most <= BVH_STACK);
        most
    }
}

fn triangle_primitive(triangle: &Triangle) -> Primitive {
    let [a, b, c] = triangle.positions;
    Primitive {
        v0: a.to_array(),
        material: triangle.material,
        e1: (b - a).to_array(),
        e2: (c - a).to_array(),
        ..Primitive::default()
    }
}

fn sphere_primitive(sphere: &Sphere) -> Primitive {
    Primitive {
        v0: sphere.center.to_array(),
        material: sphere.material | SPHERE_BIT,
        e1: [sphere.radius, 0.0, 0.0],
        ..Primitive::default()
    }
}

/// Bounding box of a primitive as the shaders see it.
pub(super) fn bounds(primitive: &Primitive) -> Bounds {
    let [v0, e1, e2] = [primitive.v0, primitive.e1, primitive.e2].map(Vec3::from_array);
    if primitive.material & SPHERE_BIT != 0 {
        return Bounds { min: v0 - e1.x, max: v0 + e1.x };
    }
    let (v1, v2) = (v0 + e1, v0 + e2);
    Bounds { min: v0.min(v1).min(v2), max: v0.max(v1).max(v2) }
}

/// Largest length of (corner normal − geometric normal) that still counts as flat: below the
/// precision of the encoding.
const FLAT_TOLERANCE: f32 = 1e-4;

fn corner_normals(triangle: &Triangle) -> Normals {
    let flat = triangle.geometric_normal();
    let [n0, n1, n2] = triangle.normals.map(octahedral);
    let is_flat = triangle.normals.iter().all(|normal| (*normal - flat).length() < FLAT_TOLERANCE);
    Normals { n0, n1, n2, attributes: (triangle.attributes << 1) | u32::from(is_flat) }
}
