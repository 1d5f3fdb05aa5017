//! Meshes in object space: the triangles that a node shows, with its morph targets applied.

use glam::Vec3;
use gltf::json;
use json::mesh::{Primitive, Semantic};

use super::accessor::{Column, Document};
use super::attributes::{self, Triangles, VertexAttributes};
use super::fault::{Notes, Read, fault};
use super::material_table::MaterialTable;
use super::primitives::{Checker, Shape, attribute, joint_sets};
use super::topology::corners;
use crate::scene::Triangle;

/// Triangles that share vertices and a material.
#[derive(Debug, Default)]
pub(super) struct MeshPrimitive {
    /// Positions of the vertices in use; all finite.
    pub(super) positions: Vec<Vec3>,
    /// Normals, one per position, of any length; `None` if the file has none.
    pub(super) normals: Option<Vec<Vec3>>,
    /// Indices into the positions, all valid.
    pub(super) corners: Vec<[u32; 3]>,
    /// Number of triangles in the file, including those left out because two of their corners
    /// coincide.
    pub(super) claimed: usize,
    /// Index into the scene's materials.
    pub(super) material: u32,
    /// Attributes of each position that textures and colours need.
    pub(super) attributes: Option<VertexAttributes>,
    /// Number of triangles whose normals point behind them.
    pub(super) behind: usize,
    /// Joint influences per position; empty without a skin.
    pub(super) influences: Vec<Vec<Influence>>,
}

/// Influence of a joint on a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Influence {
    /// Index into the joints of the skin, valid.
    pub(super) joint: u32,
    /// Weight > 0; the weights of a vertex sum to 1.
    pub(super) weight: f64,
}

/// Deformation of a mesh by a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Deformation<'a> {
    /// Weights of the morph targets; all 0 if empty.
    pub(super) weights: &'a [f32],
    /// Number of joints, if the node has a skin.
    pub(super) joints: Option<usize>,
}

/// Primitives with triangles of all meshes, by mesh and primitive; those that no node shows are
/// checked too.
pub(super) fn check(document: &Document<'_>, notes: &mut Notes) -> Read<Vec<Vec<Option<Shape>>>> {
    let mut checker = Checker::new(document);
    let mut meshes = Vec::with_capacity(document.root.meshes.len());
    for (i, mesh) in document.root.meshes.iter().enumerate() {
        let mut shapes = Vec::with_capacity(mesh.primitives.len());
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            shapes.push(checker.check(primitive, &format!("meshes[{i}].primitives[{j}]"), notes)?);
            check_weights(primitive, mesh.weights.as_deref(), &format!("meshes[{i}].weights"))?;
        }
        meshes.push(shapes);
    }
    Ok(meshes)
}

/// Checks that there are as many weights as morph targets, if there are weights.
pub(super) fn check_weights(primitive: &Primitive, weights: Option<&[f32]>, place: &str) -> Read<()> {
    let targets = primitive.targets.as_ref().map_or(0, Vec::len);
    match weights {
        Some(weights) if weights.len() != targets => {
            fault(place, format!("{} of them for {targets} morph targets", weights.len()))
        }
        Some(weights) if weights.iter().any(|weight| !weight.is_finite()) => fault(place, "one is not finite"),
        _ => Ok(()),
    }
}

/// The triangles of a mesh. Needs [`check`], whose `shapes` are the mesh's.
pub(super) fn read(
    document: &Document<'_>,
    mesh: usize,
    shapes: &[Option<Shape>],
    deformation: Deformation<'_>,
    materials: &MaterialTable,
) -> Read<Vec<MeshPrimitive>> {
    let mut primitives = Vec::new();
    for (j, (primitive, shape)) in document.root.meshes[mesh].primitives.iter().zip(shapes).enumerate() {
        if let Some(shape) = shape {
            primitives.push(read_part(
                document,
                primitive,
                *shape,
                deformation,
                materials,
                &format!("meshes[{mesh}].primitives[{j}]"),
            )?);
        }
    }
    Ok(primitives)
}

fn read_part(
    document: &Document<'_>,
    primitive: &Primitive,
    shape: Shape,
    deformation: Deformation<'_>,
    materials: &MaterialTable,
    place: &str,
) -> Read<MeshPrimitive> {
    let column = |accessor: Option<usize>| accessor.map(|accessor| document.column(accessor, place)).transpose();
    let slot = materials.slot(primitive.material.map(|material| material.value()), &attributes::sets(primitive));
    let nothing = MeshPrimitive { claimed: shape.triangles, material: slot.index, ..MeshPrimitive::default() };
    let Some(positions) = column(attribute(primitive, Semantic::Positions))? else { return Ok(nothing) };
    let morphs = morphs(document, primitive, deformation.weights, place)?;
    let indices = column(primitive.indices.map(|indices| indices.value()))?;
    let still = positions.is_zero() && morphs.is_empty();
    if still || indices.is_some_and(|indices| indices.is_zero()) {
        return Ok(nothing);
    }
    let normals = column(attribute(primitive, Semantic::Normals))?;
    let position = |vertex: u32| morphed(&positions, &morphs, vertex, |morph| morph.positions.as_ref());
    let index = |i: usize| indices.map_or(i as u32, |indices| indices.unsigned(i, 0));
    let mut vertices = Vertices { slots: vec![0; positions.count], used: Vec::new() };
    let mut part = nothing;
    for triangle in 0..shape.triangles {
        let corners = corners(shape.mode, triangle).map(index);
        let [a, b, c] = corners.map(position);
        if a != b && b != c && c != a {
            part.corners.push(corners.map(|corner| vertices.slot(corner)));
        }
    }
    part.positions = vertices.used.iter().map(|vertex| position(*vertex)).collect();
    if let Some(at) = part.positions.iter().position(|position| !position.is_finite()) {
        return fault(place, format!("its morph targets move vertex {} beyond all numbers", vertices.used[at]));
    }
    part.normals = normals.map(|normals| {
        let normal = |vertex: &u32| morphed(&normals, &morphs, *vertex, |morph| morph.normals.as_ref());
        vertices.used.iter().map(normal).collect()
    });
    part.behind = part.count_behind();
    let triangles = Triangles {
        vertices: &vertices.used,
        positions: &part.positions,
        normals: part.normals.as_deref(),
        corners: &part.corners,
        is_morphed: !morphs.is_empty(),
    };
    part.attributes = attributes::read(document, primitive, slot, triangles, place)?;
    if let Some(joints) = deformation.joints {
        part.influences = influences(document, primitive, &vertices.used, joints, place)?;
    }
    Ok(part)
}

impl MeshPrimitive {
    fn count_behind(&self) -> usize {
        let Some(normals) = &self.normals else { return 0 };
        let is_behind = |corners: &&[u32; 3]| {
            let [positions, normals] = [&self.positions, normals].map(|of| corners.map(|i| of[i as usize]));
            Triangle::new(positions, normals, 0).has_normals_behind()
        };
        self.corners.iter().filter(is_behind).count()
    }
}

/// Vertices in use, in the order of their first appearance.
struct Vertices {
    /// For each vertex its index among those in use plus one; 0 for unused vertices. Pages of zeros
    /// that are never written take no memory, however many vertices the file claims.
    slots: Vec<u32>,
    used: Vec<u32>,
}

impl Vertices {
    fn slot(&mut self, vertex: u32) -> u32 {
        let slot = &mut self.slots[vertex as usize];
        if *slot == 0 {
            self.used.push(vertex);
            *slot = self.used.len() as u32;
        }
        *slot - 1
    }
}

/// A morph target and its weight.
struct Morph<'a> {
    weight: f32,
    positions: Option<Column<'a>>,
    normals: Option<Column<'a>>,
}

/// Morph targets of non-zero weight that displace the attribute.
fn morphs<'d>(document: &'d Document<'_>, primitive: &Primitive, weights: &[f32], place: &str) -> Read<Vec<Morph<'d>>> {
    let mut morphs = Vec::new();
    for (target, weight) in primitive.targets.iter().flatten().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let column = |accessor: Option<json::Index<json::Accessor>>| {
            accessor.map(|accessor| document.column(accessor.value(), place)).transpose()
        };
        morphs.push(Morph { weight: *weight, positions: column(target.positions)?, normals: column(target.normals)? });
    }
    Ok(morphs)
}

/// Vertex attribute plus its morph displacements (glTF 2.0, 3.7.2.2).
fn morphed<'d>(
    base: &Column<'_>,
    morphs: &'d [Morph<'d>],
    vertex: u32,
    of: impl Fn(&'d Morph<'d>) -> Option<&'d Column<'d>>,
) -> Vec3 {
    let vertex = vertex as usize;
    morphs
        .iter()
        .filter_map(|morph| Some(morph.weight * of(morph)?.vector(vertex)))
        .fold(base.vector(vertex), |sum, added| sum + added)
}

/// Joint influences of each of the vertices, with weights that sum to 1.
fn influences(
    document: &Document<'_>,
    primitive: &Primitive,
    vertices: &[u32],
    joints: usize,
    place: &str,
) -> Read<Vec<Vec<Influence>>> {
    let sets = joint_sets(document, primitive, place)?;
    if sets.is_empty() {
        return fault(format!("{place}.attributes"), "has no JOINTS_0 and WEIGHTS_0, but a skin is to move it");
    }
    let mut all = Vec::with_capacity(vertices.len());
    for vertex in vertices {
        let pairs = sets.iter().flat_map(|(joints, weights)| {
            let vertex = *vertex as usize;
            (0..4).map(move |c| (joints.unsigned(vertex, c), f64::from(weights.number(vertex, c))))
        });
        let mut influences: Vec<Influence> =
            pairs.filter(|(_, weight)| *weight > 0.0).map(|(joint, weight)| Influence { joint, weight }).collect();
        if influences.is_empty() {
            // Zero weights are invalid but common: the vertex follows its first joint, as in other
            // renderers.
            influences.push(Influence { joint: sets[0].0.unsigned(*vertex as usize, 0), weight: 1.0 });
        }
        if let Some(beyond) = influences.iter().find(|influence| influence.joint as usize >= joints) {
            let problem = format!("joint {} of {joints} at vertex {vertex}", beyond.joint);
            return fault(format!("{place}.attributes.JOINTS_0"), problem);
        }
        let sum: f64 = influences.iter().map(|influence| influence.weight).sum();
        influences.iter_mut().for_each(|influence| influence.weight /= sum);
        all.push(influences);
    }
    Ok(all)
}
