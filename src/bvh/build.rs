//! Building: primitives in the order of the tree over them.

use glam::Vec3;
use rayon::prelude::*;

use super::instance::{Place, instance_primitive, instances};
use super::node::{FILLER, MAX_LEAF};
use super::parallel::Watch;
use super::{convert, parallel, split, widen};
use crate::error::Result;
use crate::layout::{
    BVH_STACK, BvhNode, INSTANCED_STACK, Instance, Normals, Primitive, SPHERE_BIT, TREE_HEIGHTS, even_height,
    octahedral,
};
use crate::progress::{Progress, Silent};
use crate::scene::{Bounds, Scene, SharedMesh, Sphere, Triangle, instance_bounds};

/// Nodes and primitives in device layout.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    /// Interior nodes, parents before children. Node 0 is the root.
    pub nodes: Vec<BvhNode>,
    /// Primitives in leaf order.
    pub primitives: Vec<Primitive>,
    /// Normals of each primitive, parallel to `primitives`.
    pub normals: Vec<Normals>,
    /// Instances, behind one that holds what concerns all; empty in a scene without.
    pub instances: Vec<Instance>,
}

impl Bvh {
    /// [`Self::build_watched`] without a listener.
    ///
    /// # Panics
    /// If there are 2^28 triangles and spheres or more. The loader refuses such files earlier.
    #[must_use]
    pub fn build(scene: &Scene) -> Self {
        Self::build_watched(scene, &Silent).expect("nothing stops this")
    }

    /// Builds the tree over all triangles and spheres: PLOC with reinsertion (Meister and Bittner
    /// 2018, 2021). Large primitives among many that cross are listed several times, in smaller
    /// boxes. Large scenes are divided into parts that are built on all cores. Equal scenes give
    /// equal trees on any number of threads.
    ///
    /// A mesh that instances share has a tree of its own, in its own coordinates, and instances are
    /// boxes in the tree of the scene (Wald et al. 2003, "Distributed Interactive Ray Tracing of
    /// Dynamic Scenes"): see [`INSTANCE`](crate::layout::INSTANCE).
    ///
    /// # Errors
    /// [`Error::Stopped`](crate::error::Error::Stopped) if the listener asks for that.
    ///
    /// # Panics
    /// As [`Self::build`].
    pub fn build_watched(scene: &Scene, progress: &dyn Progress) -> Result<Self> {
        let triangles = scene.triangles.par_iter().map(triangle_primitive);
        let primitives = triangles.chain(scene.spheres.par_iter().map(sphere_primitive)).enumerate();
        let mut primitives: Vec<Primitive> =
            primitives.map(|(id, primitive)| Primitive { id: id as u32, ..primitive }).collect();
        let boxes = instance_bounds(&scene.meshes, &scene.instances);
        primitives.extend(boxes.iter().zip(1..).map(|(bounds, number)| instance_primitive(bounds, number)));
        let heights = Heights::new(primitives.len(), scene);
        let of_meshes: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        let watch = Watch::new(progress, primitives.len() + of_meshes);
        let mut bvh = Self::of(primitives, &scene.triangles, heights.scene, &watch)?;
        let mut first_of_mesh = (scene.triangles.len() + scene.spheres.len()) as u32;
        let firsts = scene.meshes.iter().map(|mesh| {
            first_of_mesh += mesh.triangles.len() as u32;
            first_of_mesh - mesh.triangles.len() as u32
        });
        let firsts: Vec<u32> = firsts.collect();
        let of_mesh = |(mesh, first): (&SharedMesh, &u32)| {
            let numbered = mesh.triangles.iter().zip(*first..);
            let primitives = numbered.map(|(triangle, id)| Primitive { id, ..triangle_primitive(triangle) });
            Self::of(primitives.collect(), &mesh.triangles, heights.mesh, &watch)
        };
        let meshes: Vec<Self> = scene.meshes.par_iter().zip(&firsts).map(of_mesh).collect::<Result<_>>()?;
        let places: Vec<Place> = meshes.into_iter().map(|mesh| bvh.append(mesh)).collect();
        bvh.instances = instances(&scene.instances, &places, bvh.primitives.len());
        Ok(bvh)
    }

    /// A tree over primitives, whose triangles are those, the first of which is the first
    /// primitive.
    fn of(mut primitives: Vec<Primitive>, triangles: &[Triangle], max_height: u32, watch: &Watch<'_>) -> Result<Self> {
        let first = primitives.first().map_or(0, |primitive| primitive.id);
        primitives.resize(primitives.len().max(2), Primitive { id: FILLER, ..Primitive::default() });
        let whole: Vec<Bounds> = primitives.par_iter().map(bounds).collect();
        let (bounds, of_bounds) = match split::pieces(&primitives, whole.clone()) {
            pieces if even_height(pieces.0.len()) <= max_height => pieces,
            _ => (whole, (0..primitives.len() as u32).collect()),
        };
        let (nodes, order) = widen::widen(&parallel::tree(&bounds, max_height, watch)?, max_height);
        let normals = |primitive: &Primitive| {
            triangles.get(primitive.id.wrapping_sub(first) as usize).map_or(Normals::default(), corner_normals)
        };
        let primitives: Vec<Primitive> =
            order.par_iter().map(|i| primitives[of_bounds[*i as usize] as usize]).collect();
        Ok(Self { normals: primitives.par_iter().map(normals).collect(), nodes, primitives, instances: Vec::new() })
    }

    /// Appends the tree of a shared mesh.
    fn append(&mut self, mesh: Self) -> Place {
        let place = Place {
            root: self.nodes.len() as u32,
            stored: self.primitives.len() as u32,
            primitives: mesh.primitives.len() as u32,
        };
        self.nodes.extend(mesh.nodes.iter().map(|node| node.moved(place.root, place.stored)));
        self.primitives.extend(mesh.primitives);
        self.normals.extend(mesh.normals);
        place
    }

    /// Number of nodes and of primitives of the tree of the scene, before those of shared meshes.
    #[must_use]
    pub fn scene_part(&self) -> (usize, usize) {
        let of_instances = self.instances.iter().skip(1);
        let firsts = of_instances.map(|instance| (instance.root as usize, instance.stored as usize));
        firsts.min().unwrap_or((self.nodes.len(), self.primitives.len()))
    }

    /// Maximum number of children that a traversal holds on its stack.
    #[must_use]
    pub fn max_stack_depth(&self) -> usize {
        // Deferred children on the stack when the traversal enters each node.
        let mut deferred = vec![0_usize; self.nodes.len()];
        let mut most = 0;
        let (scene, _) = self.scene_part();
        for (i, node) in self.nodes.iter().enumerate() {
            if i == scene {
                // Up to all boxes of a leaf are deferred, and the way back.
                let below = most + MAX_LEAF as usize + 1;
                self.instances.iter().skip(1).for_each(|instance| deferred[instance.root as usize] = below);
            }
            let here = deferred[i] + node.children().count() - 1;
            node.children().filter(|child| child.count == 0).for_each(|child| deferred[child.first as usize] = here);
            most = most.max(here);
        }
        debug_assert!(most <= if self.instances.is_empty() { BVH_STACK } else { INSTANCED_STACK });
        most
    }
}

/// Maximum heights of the binary trees of a scene and of the meshes in it that instances share.
struct Heights {
    scene: u32,
    mesh: u32,
}

impl Heights {
    fn new(primitives: usize, scene: &Scene) -> Self {
        let Some(largest) = scene.meshes.iter().map(|mesh| mesh.triangles.len()).max() else {
            return Self { scene: convert::MAX_HEIGHT, mesh: 0 };
        };
        let [top, mesh] = [primitives, largest].map(|count| even_height(count).max(1).next_multiple_of(2));
        let spare = TREE_HEIGHTS.checked_sub(top + mesh).expect("the loader shares no mesh of a tree that is too high");
        let mesh = (mesh + (spare / 2).next_multiple_of(2)).min(convert::MAX_HEIGHT);
        Self { scene: (TREE_HEIGHTS - mesh).min(convert::MAX_HEIGHT), mesh }
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
