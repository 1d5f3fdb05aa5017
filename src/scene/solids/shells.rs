//! Shells: connected parts of the surfaces of glass, and what they enclose.

use std::{collections::HashMap, mem};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    solid::{COVER_BIT, NONE},
    surfaces::distance_along,
};
use crate::scene::{Bounds, Triangle, vertex_bits};

/// A connected part of a mesh: its triangles share vertices.
#[derive(Clone, Debug)]
pub(super) struct Shell {
    /// Indices of its triangles.
    pub triangles: Vec<u32>,
    /// The group that they are of, by its index.
    pub group: usize,
    pub bounds: Bounds,
    /// Enclosed volume, m³; negative if the faces look inwards.
    pub volume: f64,
    /// Area of what is missing to close it over that of its triangles.
    pub openness: f64,
    /// Edges of the largest hole.
    pub hole_edges: usize,
    /// Faces meet along parts of edges.
    pub has_t_junctions: bool,
    /// Vertices at holes.
    pub rim: Vec<Vec3>,
    /// An open sheet that ends at opaque surfaces, and stands for a solid behind it.
    pub is_cover: bool,
    /// The solid that it is a cavity of, as in [`Scene::shells`](crate::scene::Scene::shells).
    pub cavity_of: Option<u32>,
}

/// The shells of several meshes.
#[derive(Debug, Default)]
pub(super) struct Shells {
    pub shells: Vec<Shell>,
    triangles: usize,
}

/// Holes smaller than this fraction of the surface are cracks of rounding.
const CLOSED: f64 = 1e-4;

/// Points at which a shell is probed at most, triangles visited for those of all shells, and their
/// largest depth below a face over its size.
const MAX_PROBES: usize = 256;
const PROBE_COST: usize = 20_000_000;
const PROBE_DEPTH: f64 = 1e-3;

impl Shells {
    /// The shells of the triangles of each group.
    pub(super) fn new(triangles: &[Triangle], groups: &[Vec<u32>]) -> Self {
        let mut found = Self { shells: Vec::new(), triangles: triangles.len() };
        for (index, group) in groups.iter().enumerate() {
            found.shells.extend(connected(triangles, group).into_iter().map(|part| measure(triangles, part, index)));
        }
        found
    }

    /// Joins open shells that share vertices: halves of a solid that are meshes of their own. Those
    /// that are closed together replace their parts; `alike` decides which materials may meet.
    pub(super) fn join(&mut self, triangles: &[Triangle], alike: impl Fn(u32, u32) -> bool) {
        let (closed, open): (Vec<Shell>, Vec<Shell>) =
            mem::take(&mut self.shells).into_iter().partition(Shell::is_closed);
        self.shells = closed;
        let of_first: HashMap<u32, usize> = open.iter().enumerate().map(|(i, shell)| (shell.triangles[0], i)).collect();
        let mut left: Vec<Vec<u32>> = open.iter().map(|shell| shell.triangles.clone()).collect();
        while let Some(first) = left.first().map(|part| triangles[part[0] as usize].material) {
            let (group, rest): (Vec<_>, Vec<_>) =
                left.into_iter().partition(|part| alike(first, triangles[part[0] as usize].material));
            left = rest;
            for part in connected(triangles, &group.concat()) {
                let first = of_first.get(&part[0]).map_or(0, |i| open[*i].group);
                let whole = measure(triangles, part, first);
                if whole.is_closed() {
                    self.shells.push(whole);
                } else {
                    let mut parts: Vec<usize> =
                        whole.triangles.iter().filter_map(|i| of_first.get(i).copied()).collect();
                    parts.sort_unstable();
                    self.shells.extend(parts.into_iter().map(|i| open[i].clone()));
                }
            }
        }
    }

    /// For each shell, whether it is closed and crosses itself.
    pub(super) fn crossing(&self, triangles: &[Triangle]) -> Vec<bool> {
        let visited: usize = self.shells.iter().map(|shell| shell.triangles.len()).sum();
        let probes = (PROBE_COST / visited.max(1)).clamp(1, MAX_PROBES);
        let crosses = |(i, shell): (usize, &Shell)| {
            !shell.is_cover && shell.is_closed() && shell.crosses_itself(triangles, probes, i)
        };
        self.shells.par_iter().enumerate().map(crosses).collect()
    }

    /// The solid of each triangle: a shell with faces outwards and the cavities in it.
    pub(super) fn solids(&self) -> Vec<u32> {
        let mut of = vec![NONE; self.triangles];
        for (shell, i) in self.shells.iter().zip(0..) {
            let own = if shell.is_cover { i | COVER_BIT } else { i };
            let solid = shell.cavity_of.unwrap_or(own);
            shell.triangles.iter().for_each(|triangle| of[*triangle as usize] = solid);
        }
        of
    }
}

impl Shell {
    /// Whether faces lie inside of the shell, which then crosses itself; by some points just below
    /// its faces, with others for another `number`.
    fn crosses_itself(&self, triangles: &[Triangle], probes: usize, number: usize) -> bool {
        let step = (self.triangles.len() / probes).max(1);
        self.triangles.iter().skip(number % step).step_by(step).any(|i| {
            let triangle = &triangles[*i as usize];
            let [a, b, c] = triangle.positions.map(Vec3::as_dvec3);
            let (middle, inwards) = ((a + b + c) / 3.0, -triangle.geometric_normal().as_dvec3());
            // Glass may be thinner than that: its other face is not passed.
            let others = self.triangles.iter().filter(|other| *other != i).map(|other| &triangles[*other as usize]);
            let next = others.filter_map(|other| distance_along(other, middle, inwards)).fold(f64::INFINITY, f64::min);
            let below = middle + (PROBE_DEPTH * triangle.area().sqrt()).min(0.5 * next) * inwards;
            // Below the faces of a hollow lies the glass around it, which is outside of this shell.
            let expected = self.volume.signum().max(0.0);
            (winding(triangles, self, below) - expected).abs() > 0.5
        })
    }

    /// Nothing is missing but for rounding.
    pub(super) fn is_closed(&self) -> bool {
        self.openness < CLOSED
    }
}

/// Winding number of a shell around a point: the solid angle over 4π (van Oosterom and Strackee
/// 1983).
pub(super) fn winding(triangles: &[Triangle], shell: &Shell, point: DVec3) -> f64 {
    let angle = |i: &u32| {
        let [a, b, c] = triangles[*i as usize].positions.map(|p| p.as_dvec3() - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(denominator)
    };
    shell.triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// A vertex by its bits.
pub(super) type Key = [u32; 3];

/// An edge between two vertices in the order of their keys, relative to the first vertex of its
/// shell, metres.
#[derive(Clone, Copy, Debug)]
struct Edge {
    /// Faces that run along it, less those that run against it.
    count: i32,
    from: DVec3,
    to: DVec3,
}

/// Parts of a group whose triangles share vertices, in the order of their first triangles.
fn connected(triangles: &[Triangle], group: &[u32]) -> Vec<Vec<u32>> {
    let mut ids: HashMap<Key, u32> = HashMap::new();
    let mut parent: Vec<u32> = Vec::new();
    let mut corner_ids = Vec::with_capacity(group.len());
    for &triangle in group {
        let corners = triangles[triangle as usize].positions.map(|p| {
            *ids.entry(vertex_bits(p)).or_insert_with(|| {
                parent.push(parent.len() as u32);
                parent.len() as u32 - 1
            })
        });
        for corner in &corners[1..] {
            let (a, b) = (find(&mut parent, corners[0]), find(&mut parent, *corner));
            parent[a.max(b) as usize] = a.min(b);
        }
        corner_ids.push(corners[0]);
    }
    let mut parts: Vec<Vec<u32>> = Vec::new();
    let mut part_of: HashMap<u32, usize> = HashMap::new();
    for (&triangle, &corner) in group.iter().zip(&corner_ids) {
        let root = find(&mut parent, corner);
        let part = *part_of.entry(root).or_insert_with(|| {
            parts.push(Vec::new());
            parts.len() - 1
        });
        parts[part].push(triangle);
    }
    parts
}

pub(super) fn find(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

/// Volume and holes of a connected part of a group.
pub(super) fn measure(triangles: &[Triangle], part: Vec<u32>, group: usize) -> Shell {
    let origin = triangles[part[0] as usize].positions[0].as_dvec3();
    let (mut volume, mut area) = (0.0, 0.0);
    let bounds = part.iter().map(|i| Bounds::from(&triangles[*i as usize])).fold(Bounds::EMPTY, Bounds::union);
    // Directed edges without a partner in the other direction.
    let mut edges: HashMap<(Key, Key), Edge> = HashMap::new();
    for &triangle in &part {
        let positions = triangles[triangle as usize].positions;
        let [a, b, c] = positions.map(|p| p.as_dvec3() - origin);
        volume += a.dot(b.cross(c)) / 6.0;
        area += 0.5 * (b - a).cross(c - a).length();
        for (p, q, from, to) in
            [(0, 1, a, b), (1, 2, b, c), (2, 0, c, a)].map(|(i, j, from, to)| (positions[i], positions[j], from, to))
        {
            let (p, q) = (vertex_bits(p), vertex_bits(q));
            let (edge, direction) = if p < q { ((p, q), 1) } else { ((q, p), -1) };
            let (from, to) = if p < q { (from, to) } else { (to, from) };
            edges.entry(edge).or_insert(Edge { count: 0, from, to }).count += direction;
        }
    }
    let open: Vec<((Key, Key), Edge)> = edges.into_iter().filter(|(_, edge)| edge.count != 0).collect();
    let loops = boundary(&open);
    let rim =
        open.iter().flat_map(|((p, q), _)| [*p, *q].map(|bits| Vec3::from_array(bits.map(f32::from_bits)))).collect();
    let missing: f64 = loops.iter().map(|(vector, _)| vector.length()).sum();
    Shell {
        triangles: part,
        group,
        bounds,
        volume,
        openness: missing / area.max(f64::MIN_POSITIVE),
        hole_edges: loops.iter().filter(|(v, _)| v.length() > CLOSED * area).map(|(_, n)| *n).max().unwrap_or(0),
        has_t_junctions: !open.is_empty() && loops.iter().any(|(v, _)| v.length() <= CLOSED * area),
        rim,
        is_cover: false,
        cavity_of: None,
    }
}

/// Vector area and number of edges of each connected part of a boundary.
fn boundary(open: &[((Key, Key), Edge)]) -> Vec<(DVec3, usize)> {
    let mut sorted: Vec<_> = open.iter().collect();
    sorted.sort_by_key(|(edge, _)| *edge);
    let mut ids: HashMap<Key, u32> = HashMap::new();
    let mut parent: Vec<u32> = Vec::new();
    for ((p, q), _) in &sorted {
        let [a, b] = [p, q].map(|corner| {
            let id = *ids.entry(*corner).or_insert_with(|| {
                parent.push(parent.len() as u32);
                parent.len() as u32 - 1
            });
            find(&mut parent, id)
        });
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut parts: HashMap<u32, (DVec3, usize)> = HashMap::new();
    for ((p, _), edge) in sorted {
        let root = find(&mut parent, ids[p]);
        let part = parts.entry(root).or_default();
        // The hole's outline runs against the faces' edges.
        part.0 -= 0.5 * f64::from(edge.count) * edge.from.cross(edge.to);
        part.1 += 1;
    }
    let mut found: Vec<_> = parts.into_iter().collect();
    found.sort_by_key(|(root, _)| *root);
    found.into_iter().map(|(_, part)| part).collect()
}
