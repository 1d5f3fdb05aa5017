//! Instances as the tree of a scene and the device have them, and the way between the scene's
//! coordinates and those of a mesh.

use glam::{Vec3, Vec4};

use super::node::FILLER;
use crate::{
    layout::{INSTANCE, Instance, NOTHING_LEFT, Primitive},
    scene::{self, Bounds},
};

impl Instance {
    /// Where the mesh's origin lies in the scene.
    pub(super) fn offset(&self) -> Vec3 {
        self.to_scene.map(|row| row[3]).into()
    }

    /// Rows of the inverse of the linear part.
    pub(super) fn inverse_rows(&self) -> [Vec3; 3] {
        [self.from_scene_x, self.from_scene_y, self.from_scene_z].map(Vec3::from)
    }

    /// A vector of the scene in the mesh's coordinates.
    pub(super) fn vector_from_scene(&self, v: Vec3) -> Vec3 {
        self.inverse_rows().map(|row| row.dot(v)).into()
    }

    /// A normal of the mesh in the scene, by the inverse transpose, not of unit length.
    pub(super) fn normal_to_scene(&self, n: Vec3) -> Vec3 {
        let [x, y, z] = self.inverse_rows();
        n.x * x + n.y * y + n.z * z
    }

    /// A primitive of the mesh as the instance shows it.
    pub(super) fn primitive(&self, stored: &Primitive) -> Primitive {
        let rows = self.to_scene.map(Vec4::from);
        let vector = |v: [f32; 3]| rows.map(|row| row.truncate().dot(v.into()));
        let v0 = Vec3::from(vector(stored.v0)) + self.offset();
        Primitive { v0: v0.to_array(), e1: vector(stored.e1), e2: vector(stored.e2), ..*stored }
    }
}

/// Where the tree of a shared mesh lies among all, and the number of its primitives.
pub(super) struct Place {
    pub root: u32,
    pub stored: u32,
    pub primitives: u32,
}

/// Instances in device layout, whose primitives are numbered after the `stored` ones.
pub(super) fn instances(instances: &[scene::Instance], places: &[Place], stored: usize) -> Vec<Instance> {
    if instances.is_empty() {
        return Vec::new();
    }
    let mut next = u32::try_from(stored).expect("fewer than 2^28 primitives");
    let head = Instance { first: next, stored: instances.len() as u32, ..Instance::default() };
    let instance = |instance: &scene::Instance| {
        let Place { root, stored, primitives } = places[instance.mesh as usize];
        let first = next;
        next += primitives;
        assert!(next < NOTHING_LEFT, "2^28 primitives or more with those of all instances");
        let (rows, inverse) = (instance.linear.transpose(), instance.linear.inverse().transpose());
        let row = |axis: usize| rows.col(axis).extend(instance.offset[axis]).to_array();
        let [from_scene_x, from_scene_y, from_scene_z] = [0, 1, 2].map(|axis| inverse.col(axis).to_array());
        Instance { to_scene: [row(0), row(1), row(2)], from_scene_x, first, from_scene_y, stored, from_scene_z, root }
    };
    let of_all: Vec<Instance> = instances.iter().map(instance).collect();
    [vec![head], of_all].concat()
}

/// Stands in a tree for instance `number`, counted from 1.
pub(super) fn instance_primitive(bounds: &Bounds, number: u32) -> Primitive {
    Primitive {
        v0: bounds.min.to_array(),
        material: number,
        e1: (bounds.max - bounds.min).to_array(),
        id: FILLER,
        emitter: INSTANCE,
        ..Primitive::default()
    }
}
