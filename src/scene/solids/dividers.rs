//! Faces in glass that have the same glass on both sides: what a divider of a tank, or a cut that
//! was left in a solid, looks like where three faces meet at an edge.

use std::collections::{BTreeMap, HashMap};

use super::shells::{Key, Shell, Shells, find, measure, winding};
use crate::scene::{Triangle, vertex_bits};

/// Parts between edges of more than two faces that a shell has at most to be looked at: each choice
/// of them is tried.
const MOST_PARTS: usize = 12;

/// A part of a shell without the edges at which more than two of its faces meet.
#[derive(Clone, Debug, Default)]
struct Part {
    triangles: Vec<u32>,
    /// Signed volume between it and the first vertex of the shell, m³.
    volume: f64,
}

/// The triangles of open shells that lie in what the others of the shell enclose.
pub(super) fn dividers(triangles: &[Triangle], shells: &Shells) -> Vec<u32> {
    shells.shells.iter().filter(|shell| !shell.is_closed()).flat_map(|shell| within(triangles, shell)).collect()
}

fn within(triangles: &[Triangle], shell: &Shell) -> Vec<u32> {
    let Some((parts, edges)) = parts(triangles, shell) else { return Vec::new() };
    let volume = |kept: usize| of_choice(&parts, kept).map(|part| part.volume).sum::<f64>();
    // The faces along each edge and against it are as many: nothing is missing.
    let is_closed = |kept: usize| {
        edges
            .iter()
            .all(|edge| edge.iter().filter(|(part, _)| kept >> **part & 1 == 1).map(|(_, n)| n).sum::<i32>() == 0)
    };
    // Each side of a divider is closed by it as well: the whole is the largest.
    let closed = (1..1_usize << parts.len()).filter(|kept| is_closed(*kept));
    let Some(skin) = closed.max_by(|a, b| volume(*a).abs().total_cmp(&volume(*b).abs())) else { return Vec::new() };
    let all = |kept: usize| of_choice(&parts, kept).flat_map(|part| &part.triangles).copied().collect::<Vec<_>>();
    let whole = measure(triangles, all(skin), shell.group);
    let left: Vec<u32> = all(!skin);
    let middle = |i: &u32| triangles[*i as usize].positions.iter().map(|p| p.as_dvec3()).sum::<glam::DVec3>() / 3.0;
    let is_inside = |i: &u32| winding(triangles, &whole, middle(i)).abs() > 0.5;
    if left.iter().all(is_inside) { left } else { Vec::new() }
}

/// Faces of each part that run along an edge, less those that run against it.
type Faces = BTreeMap<usize, i32>;

fn of_choice(parts: &[Part], kept: usize) -> impl Iterator<Item = &Part> {
    parts.iter().enumerate().filter(move |(i, _)| kept >> i & 1 == 1).map(|(_, part)| part)
}

/// The parts of a shell, and for each edge that has another number of faces than two, those that
/// run along it less those against it, by part. `None` if no edge has more than two, or there are
/// too many parts.
fn parts(triangles: &[Triangle], shell: &Shell) -> Option<(Vec<Part>, Vec<Faces>)> {
    let mut edges: HashMap<(Key, Key), Vec<(u32, i32)>> = HashMap::new();
    for (face, i) in (0..).zip(&shell.triangles) {
        let corners = triangles[*i as usize].positions.map(vertex_bits);
        for (p, q) in [(0, 1), (1, 2), (2, 0)].map(|(p, q)| (corners[p], corners[q])) {
            let (edge, direction) = if p < q { ((p, q), 1) } else { ((q, p), -1) };
            edges.entry(edge).or_default().push((face, direction));
        }
    }
    if edges.values().all(|faces| faces.len() <= 2) {
        return None;
    }
    let mut parent: Vec<u32> = (0..shell.triangles.len() as u32).collect();
    for faces in edges.values().filter(|faces| faces.len() == 2) {
        let (a, b) = (find(&mut parent, faces[0].0), find(&mut parent, faces[1].0));
        parent[a.max(b) as usize] = a.min(b);
    }
    let origin = triangles[shell.triangles[0] as usize].positions[0].as_dvec3();
    let (mut parts, mut part_of): (Vec<Part>, HashMap<u32, usize>) = Default::default();
    let mut part_of_face = Vec::with_capacity(parent.len());
    for (face, i) in (0..).zip(&shell.triangles) {
        let number = *part_of.entry(find(&mut parent, face)).or_insert_with(|| {
            parts.push(Part::default());
            parts.len() - 1
        });
        let [a, b, c] = triangles[*i as usize].positions.map(|p| p.as_dvec3() - origin);
        parts[number].volume += a.dot(b.cross(c)) / 6.0;
        parts[number].triangles.push(*i);
        part_of_face.push(number);
    }
    let counts = |faces: &Vec<(u32, i32)>| {
        let mut of_parts = Faces::new();
        faces.iter().for_each(|(face, n)| *of_parts.entry(part_of_face[*face as usize]).or_default() += n);
        of_parts
    };
    let unlike = edges.values().filter(|faces| faces.len() != 2 || faces[0].1 == faces[1].1).map(counts);
    (parts.len() <= MOST_PARTS).then(|| (parts, unlike.collect()))
}
