//! Meshes transformed to the world by their nodes, in f64 until the scene's centre is subtracted.

use std::{collections::HashMap, ops::Range};

use glam::{DMat3, DMat4, DVec3, Vec3, Vec4};

use super::fault::{Notes, Read, fault};
use super::memory;
use super::mesh_cache::MeshInstance;
use super::meshes::MeshPrimitive;
use super::shared_meshes::{Lists, Shared};
use crate::scene::{Attributes, Bounds, Triangle, vertex_bits};

/// Maximum size of a scene, metres.
pub(super) const MAX_EXTENT: f64 = 1e18;

/// Error message for a larger scene.
pub(super) const TOO_FAR: &str = "lies too far away to compute with: more than 1e18 m from the rest";

/// Bounding box of points, world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldBounds {
    pub(super) min: DVec3,
    pub(super) max: DVec3,
}

impl WorldBounds {
    pub(super) const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    pub(super) fn add(&mut self, point: DVec3, radius: f64) {
        let point = if point.is_finite() { point } else { DVec3::INFINITY };
        self.min = self.min.min(point - radius);
        self.max = self.max.max(point + radius);
    }

    pub(super) fn hold(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Whether areas within the box are representable in f32.
    pub(super) fn fits(&self) -> bool {
        let extent = self.max - self.min;
        self.min.x > self.max.x || extent.max_element() < MAX_EXTENT
    }

    /// Centre of the box; the origin if it is empty.
    pub(super) fn center(&self) -> DVec3 {
        if self.min.x <= self.max.x { 0.5 * (self.min + self.max) } else { DVec3::ZERO }
    }
}

/// Adds the vertices of all shown triangles to `bounds`.
pub(super) fn measure(instances: &[MeshInstance<'_>], bounds: &mut WorldBounds) -> Read<()> {
    for instance in instances {
        let boxes: Vec<[DVec3; 8]> = instance.primitives.iter().map(corners_of_box).collect();
        for i in 0..instance.copies() {
            let to_world = instance.world(i)?;
            for (primitive, corners) in instance.primitives.iter().zip(&boxes) {
                // What lies in a box that is within the bounds adds nothing.
                if primitive.influences.is_empty() && corners.iter().all(|c| bounds.hold(to_world.transform_point3(*c)))
                {
                    continue;
                }
                (0..primitive.positions.len()).for_each(|v| {
                    bounds.add(
                        instance.matrix(primitive, v, to_world).transform_point3(primitive.positions[v].as_dvec3()),
                        0.0,
                    )
                });
            }
            if !bounds.fits() {
                return fault(format!("nodes[{}]", instance.node), TOO_FAR);
            }
        }
    }
    Ok(())
}

/// Corners of the box around a primitive.
pub(super) fn corners_of_box(primitive: &MeshPrimitive) -> [DVec3; 8] {
    let Bounds { min, max } = Bounds::around(primitive.positions.iter().copied());
    std::array::from_fn(|i| {
        let side = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Vec3::new(side(0), side(1), side(2)).as_dvec3()
    })
}

/// The triangles of a copy of a mesh, with the node that shows it.
pub(super) type PlacedMesh = (Range<usize>, usize);

/// Triangles relative to the scene's centre.
#[derive(Debug, Default)]
pub(super) struct Placed {
    pub(super) triangles: Vec<Triangle>,
    /// Attributes, to which the triangles refer by index plus one.
    pub(super) attributes: Vec<Attributes>,
    /// Copies of meshes to which the triangles belong, in their order.
    pub(super) meshes: Vec<PlacedMesh>,
    pub(super) shared: Shared,
}

/// All shown triangles relative to `center`. Their objects are the indices of nodes.
pub(super) fn place(instances: &[MeshInstance<'_>], center: DVec3, notes: &mut Notes) -> Read<Placed> {
    let sum = |of: fn(&MeshPrimitive, bool) -> usize| -> usize {
        let total =
            |copy: &MeshInstance<'_>| copy.primitives.iter().zip(copy.shared).map(|(p, s)| of(p, *s)).sum::<usize>();
        instances.iter().map(|instance| instance.copies() * total(instance)).sum()
    };
    let claimed = sum(|primitive, _| primitive.claimed);
    let mut placed = Placed::default();
    placed.triangles.reserve_exact(sum(|p, shared| if shared { 0 } else { p.corners.len() }));
    placed
        .attributes
        .reserve_exact(sum(|p, shared| if p.attributes.is_some() && !shared { p.corners.len() } else { 0 }));
    let (mut of_instances, mut behind) = (0, 0);
    for instance in instances {
        for i in 0..instance.copies() {
            let to_scene = DMat4::from_translation(-center) * instance.world(i)?;
            behind += instance.primitives.iter().map(|primitive| primitive.behind).sum::<usize>();
            let first = placed.triangles.len();
            let is_shared = instance.shared.contains(&true);
            let added = if is_shared { placed.shared.add(instance, to_scene, &place_rigid) } else { None };
            of_instances += added.unwrap_or(0);
            if is_shared && added.is_none() {
                check_copy(instance, &placed)?;
            }
            for (primitive, shared) in instance.primitives.iter().zip(instance.shared) {
                if *shared && added.is_some() {
                    continue;
                }
                if primitive.influences.is_empty() {
                    place_rigid(primitive, to_scene, (&mut placed.triangles, &mut placed.attributes));
                } else {
                    place_skinned(instance, primitive, center, (&mut placed.triangles, &mut placed.attributes));
                }
            }
            placed.triangles[first..].iter_mut().for_each(|triangle| triangle.object = instance.node as u32);
            if first < placed.triangles.len() {
                placed.meshes.push((first..placed.triangles.len(), instance.node));
            }
        }
    }
    let dropped = claimed - placed.triangles.len() - of_instances;
    if dropped > 0 {
        notes.add(format!("{dropped} of {claimed} triangles have no area and are not drawn"));
    }
    // A few are slivers at sharp edges.
    if 100 * behind > claimed {
        notes.add(format!("the normals of {behind} of {claimed} triangles point behind them and are turned"));
    }
    Ok(placed.without_copies(notes))
}

/// Refuses a copy of a shared mesh that has to have triangles of its own, if there is no memory for
/// them: room was made for the others alone.
fn check_copy(copy: &MeshInstance<'_>, placed: &Placed) -> Read<()> {
    let sum = |of: fn(&MeshPrimitive) -> bool| -> usize {
        copy.primitives.iter().filter(|p| of(p)).map(|p| p.corners.len()).sum()
    };
    let triangles = placed.triangles.len() + sum(|_| true);
    if triangles <= placed.triangles.capacity() {
        return Ok(());
    }
    memory::check(triangles, placed.attributes.len() + sum(|p| p.attributes.is_some()))
}

impl Placed {
    /// Leaves out meshes whose triangles all are those of an earlier one: the same lamp twice
    /// shines once, and no ray has to visit thousands of copies in one place.
    fn without_copies(self, notes: &mut Notes) -> Self {
        let Self { triangles, attributes, meshes, shared } = self;
        let corners = |triangle: &Triangle| triangle.positions.map(vertex_bits);
        // Each triangle has attributes of its own: equal ones have different indices.
        let values = |triangle: &Triangle| {
            let own = attributes.get((triangle.attributes as usize).wrapping_sub(1));
            (Triangle { attributes: 0, object: 0, ..*triangle }, own)
        };
        let alike = |a: &[Triangle], b: &[Triangle]| a.iter().map(values).eq(b.iter().map(values));
        let mut known: HashMap<_, Vec<Range<usize>>> = HashMap::new();
        let mut is_copy = |range: &Range<usize>| {
            let own = &triangles[range.clone()];
            let Some((first, last)) = own.first().zip(own.last()) else { return false };
            let others = known.entry((own.len(), corners(first), corners(last))).or_default();
            let found = others.iter().any(|other| alike(&triangles[other.clone()], own));
            if !found {
                others.push(range.clone());
            }
            found
        };
        let copies: Vec<bool> = meshes.iter().map(|(range, _)| is_copy(range)).collect();
        let count = copies.iter().filter(|copy| **copy).count();
        if count + shared.copies > 0 {
            let count = count + shared.copies;
            notes.add(format!("{count} copies of meshes lie exactly where others do and are not drawn"));
        }
        if count == 0 {
            return Self { triangles, attributes, meshes, shared };
        }
        let (mut kept, mut ranges) = (Vec::new(), Vec::new());
        for ((range, node), _) in meshes.into_iter().zip(copies).filter(|(_, copy)| !*copy) {
            let first = kept.len();
            kept.extend_from_slice(&triangles[range]);
            ranges.push((first..kept.len(), node));
        }
        Self { triangles: kept, attributes, meshes: ranges, shared }
    }
}

/// Lets normal maps of faces that were turned stand out to the other side: with the opposite
/// normal, tangent and sign, the normal that the map gives is the opposite one.
pub(super) fn turn_tangents(triangles: &[Triangle], attributes: &mut [Attributes]) {
    for triangle in triangles.iter().filter(|triangle| triangle.is_turned && triangle.attributes > 0) {
        let tangents = &mut attributes[triangle.attributes as usize - 1].tangents;
        *tangents = tangents.map(|tangent| -tangent);
    }
}

/// Leaves out the attributes of triangles that are no longer there.
pub(super) fn keep_attributes_in_use(triangles: &mut [Triangle], attributes: &mut Vec<Attributes>) {
    let used = triangles.iter().filter(|triangle| triangle.attributes > 0).count();
    if used == attributes.len() {
        return;
    }
    let mut kept = Vec::with_capacity(used);
    for triangle in triangles.iter_mut().filter(|triangle| triangle.attributes > 0) {
        kept.push(attributes[triangle.attributes as usize - 1]);
        triangle.attributes = kept.len() as u32;
    }
    *attributes = kept;
}

/// Motion of the vertices of a primitive to the scene.
struct Move {
    to_scene: DMat4,
    to_normal: DMat3,
    mirrored: bool,
}

impl Move {
    fn new(to_scene: DMat4) -> Self {
        let linear = DMat3::from_mat4(to_scene);
        let mirrored = linear.determinant() < 0.0;
        Self { to_scene, to_normal: cofactors(linear, mirrored), mirrored }
    }

    fn position(&self, position: Vec3) -> Vec3 {
        self.to_scene.transform_point3(position.as_dvec3()).as_vec3()
    }

    fn normal(&self, normal: Vec3) -> Vec3 {
        (self.to_normal * normal.as_dvec3()).normalize_or_zero().as_vec3()
    }

    /// Unit tangent at a unit normal. A mirrored bitangent is on the other side of both.
    fn tangent(&self, tangent: Vec4, normal: Vec3) -> Vec4 {
        let moved = self.to_scene.transform_vector3(tangent.truncate().as_dvec3()).normalize_or_zero().as_vec3();
        let sign = if (tangent.w < 0.0) == self.mirrored { 1.0 } else { -1.0 };
        let along = if moved == Vec3::ZERO { normal.any_orthonormal_vector() } else { moved };
        along.extend(sign)
    }
}

/// Triangles of one primitive with non-zero area.
fn place_rigid(primitive: &MeshPrimitive, to_scene: DMat4, into: Lists<'_>) {
    let all = Move::new(to_scene);
    let positions: Vec<Vec3> = primitive.positions.iter().map(|position| all.position(*position)).collect();
    let normals: Option<Vec<Vec3>> =
        primitive.normals.as_ref().map(|normals| normals.iter().map(|normal| all.normal(*normal)).collect());
    let of = |corners: [usize; 3]| {
        let normals = normals.as_ref();
        (corners.map(|corner| positions[corner]), normals.map(|normals| corners.map(|corner| normals[corner])))
    };
    add_triangles(primitive, |_| &all, of, into);
}

/// The same for a skin, whose joints transform each vertex separately.
fn place_skinned(instance: &MeshInstance<'_>, primitive: &MeshPrimitive, center: DVec3, into: Lists<'_>) {
    let vertices = 0..primitive.positions.len();
    let to_scene = |v| DMat4::from_translation(-center) * instance.matrix(primitive, v, DMat4::IDENTITY);
    let moves: Vec<Move> = vertices.map(|v| Move::new(to_scene(v))).collect();
    let position = |v: usize| moves[v].position(primitive.positions[v]);
    let of = |corners: [usize; 3]| {
        let normals = primitive.normals.as_deref();
        (corners.map(position), normals.map(|normals| corners.map(|v| moves[v].normal(normals[v]))))
    };
    add_triangles(primitive, |v| &moves[v], of, into);
}

/// Adds the triangles of a primitive with non-zero area. `of` gives their corners' positions and
/// normals.
fn add_triangles<'m>(
    primitive: &MeshPrimitive,
    moved: impl Fn(usize) -> &'m Move,
    of: impl Fn([usize; 3]) -> ([Vec3; 3], Option<[Vec3; 3]>),
    (triangles, attributes_of_corners): Lists<'_>,
) {
    for (i, corners) in primitive.corners.iter().enumerate() {
        // A mirroring transform reverses the winding; swapping two corners preserves the front
        // side.
        let order = if moved(corners[0] as usize).mirrored { [0, 2, 1] } else { [0, 1, 2] };
        let corners = order.map(|corner| corners[corner] as usize);
        let (positions, normals) = of(corners);
        let mut triangle = Triangle::new(positions, [Vec3::ZERO; 3], primitive.material);
        let flat = triangle.geometric_normal();
        if flat == Vec3::ZERO {
            continue;
        }
        let normals = normals.unwrap_or([Vec3::ZERO; 3]);
        triangle.normals = normals.map(|normal| if normal == Vec3::ZERO { flat } else { normal });
        // With the opposite normal, tangent and sign, a normal map gives the opposite normal.
        let sign = if triangle.has_normals_behind() { -1.0 } else { 1.0 };
        triangle.normals = triangle.normals.map(|normal| sign * normal);
        if let Some(own) = &primitive.attributes {
            let mut attributes = own.of(corners);
            if let Some(tangents) = own.tangents(i, corners, order) {
                attributes.tangents =
                    [0, 1, 2].map(|k| sign * moved(corners[k]).tangent(tangents[k], triangle.normals[k]));
            }
            attributes_of_corners.push(attributes);
            triangle.attributes = attributes_of_corners.len() as u32;
        }
        triangles.push(triangle);
    }
}

/// Normal matrix: the inverse transpose up to a positive factor, defined also for singular
/// matrices.
fn cofactors(m: DMat3, mirrored: bool) -> DMat3 {
    let sign = if mirrored { -1.0 } else { 1.0 };
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign
}
