//! Meshes in their own coordinates: the triangles that a node shows, with its morph targets applied.

use glam::Vec3;
use gltf::json;
use json::mesh::{Primitive, Semantic};

use super::accessor::{Column, Document};
use super::fault::{Notes, Read, fault};
use super::primitives::{Checker, Shape, attribute, joint_sets};
use super::topology::corners;

/// Triangles that share vertices and a material.
#[derive(Debug, Default)]
pub(super) struct MeshPrimitive {
    /// Those that a corner is at; all finite.
    pub(super) positions: Vec<Vec3>,
    /// One for each position, of any length; `None` where the file has none.
    pub(super) normals: Option<Vec<Vec3>>,
    /// Indices into the positions, all valid.
    pub(super) corners: Vec<[u32; 3]>,
    /// Triangles that the file has, also those left out because two of their corners are at one place.
    pub(super) claimed: usize,
    /// Index into the file's materials, valid; `None` for the default one.
    pub(super) material: Option<usize>,
    /// What moves each position, where a skin does; else empty.
    pub(super) influences: Vec<Vec<Influence>>,
}

/// A joint's hold on a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Influence {
    /// Index into the joints of the skin, valid.
    pub(super) joint: u32,
    /// > 0; those of a vertex sum to 1.
    pub(super) weight: f64,
}

/// What a node makes of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Deformation<'a> {
    /// A factor for each morph target; all 0 if empty.
    pub(super) weights: &'a [f32],
    /// Number of joints, where a skin moves it.
    pub(super) joints: Option<usize>,
}

/// The primitives of all meshes that have triangles, by mesh and primitive; those that no node shows are checked too.
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

/// As many weights as morph targets, where there are any.
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
) -> Read<Vec<MeshPrimitive>> {
    let mut primitives = Vec::new();
    for (j, (primitive, shape)) in document.root.meshes[mesh].primitives.iter().zip(shapes).enumerate() {
        if let Some(shape) = shape {
            primitives.push(read_part(
                document,
                primitive,
                *shape,
                deformation,
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
    place: &str,
) -> Read<MeshPrimitive> {
    let column = |accessor: Option<usize>| accessor.map(|accessor| document.column(accessor, place)).transpose();
    let material = primitive.material.map(|material| material.value());
    let nothing = MeshPrimitive { claimed: shape.triangles, material, ..MeshPrimitive::default() };
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
    if let Some(joints) = deformation.joints {
        part.influences = influences(document, primitive, &vertices.used, joints, place)?;
    }
    Ok(part)
}

/// The vertices that some corner is at, in the order of their first appearance.
struct Vertices {
    /// For each vertex its number among the used ones plus one; 0 for the others. A list of zeros costs no memory where it
    /// is not written, however many vertices the file claims.
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

/// A morph target and its factor.
struct Morph<'a> {
    weight: f32,
    positions: Option<Column<'a>>,
    normals: Option<Column<'a>>,
}

/// The targets that move something.
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

/// A vector of a vertex plus what the morph targets add to it (glTF 2.0, 3.7.2.2).
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

/// The joints that move each of the vertices, with weights that sum to 1.
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
            // Illegal, but common: such a vertex goes with its first joint, as in other renderers.
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
