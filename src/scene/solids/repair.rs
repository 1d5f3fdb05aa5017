//! Meshes of glass that are not clean solids: what is amiss, and what is assumed instead.

use std::{
    collections::{HashMap, HashSet},
    ops::Range,
};

use super::{
    cavities::spheres_of_glass,
    covers::cover,
    dividers::dividers,
    shells::{Shell, Shells},
    solid::{COVER_BIT, NONE, SPHERE_BIT, glass},
    surfaces::Opaque,
};
use glam::Vec3;
use rayon::prelude::*;

use crate::scene::{Bounds, Instance, Material, SharedMesh, Sphere, Surface, Triangle, vertex_bits};

/// Fraction of the surface below which a hole of few edges counts as a missing triangle.
const SMALL_HOLE: f64 = 0.05;
/// Edges of the largest hole that counts as missing triangles.
const HOLE_EDGES: usize = 6;

/// Mean thickness below which both faces of a solid are one to a ray, over its largest coordinate
/// or size: 2^-21, as of surfaces in contact.
const THINNEST: f64 = 1.0 / (1 << 21) as f64;

/// The triangles of one copy of a mesh, as a node shows it.
#[derive(Clone, Debug)]
pub(crate) struct MeshRange {
    pub triangles: Range<usize>,
    /// Name for messages.
    pub name: String,
}

/// What stands around meshes with triangles of their own.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surroundings<'a> {
    /// Meshes that are opaque, and their places.
    pub shared: &'a [SharedMesh],
    pub instances: &'a [Instance],
    pub spheres: &'a [Sphere],
    /// Where cameras are.
    pub eyes: &'a [Vec3],
}

/// Faults found in the shells of a mesh, each with the number of shells or triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Faults {
    doubled: usize,
    dividers: usize,
    open: usize,
    thin: usize,
    covers: usize,
    turned: usize,
    turned_covers: usize,
    holes: usize,
    t_junctions: usize,
    crossings: usize,
}

/// Repairs the glass of a scene: doubled faces count once, open sheets become thin panes, and
/// outermost shells with faces inwards are turned. Returns the solid of each triangle, as
/// [`Scene::shells`](crate::scene::Scene::shells), and one warning for each mesh that is not clean.
pub(crate) fn repair(
    triangles: &mut Vec<Triangle>,
    materials: &mut Vec<Material>,
    meshes: &[MeshRange],
    around: &Surroundings<'_>,
) -> (Vec<u32>, Vec<String>) {
    let is_glass = glass(materials);
    if !triangles.iter().any(|triangle| is_glass[triangle.material as usize]) {
        return (vec![NONE; triangles.len()], Vec::new());
    }
    let mut faults: Vec<Faults> = vec![Faults::default(); meshes.len()];
    let mut mesh_of = vec![0_usize; triangles.len()];
    for (m, mesh) in meshes.iter().enumerate() {
        mesh_of[mesh.triangles.clone()].fill(m);
    }
    let kept = without_doubles(triangles, &mesh_of, &is_glass, &mut faults);
    retain((triangles, &mut mesh_of), &kept);
    let mut found = Shells::new(triangles, &groups(triangles, &mesh_of, &is_glass));
    let inner = dividers(triangles, &found);
    if !inner.is_empty() {
        let mut kept = vec![true; triangles.len()];
        for i in inner {
            kept[i as usize] = false;
            faults[mesh_of[i as usize]].dividers += 1;
        }
        retain((triangles, &mut mesh_of), &kept);
        found = Shells::new(triangles, &groups(triangles, &mesh_of, &is_glass));
    }
    // First halves of one glass, then parts of several.
    found.join(triangles, |a, b| a == b);
    found.join(triangles, |_, _| true);
    let mesh = |shell: &Shell| mesh_of[shell.triangles[0] as usize];
    let (sheets, solids): (Vec<Shell>, Vec<Shell>) =
        found.shells.into_iter().partition(|shell| is_sheet(shell) || is_too_thin(shell, triangles));
    let opaque = match sheets.is_empty() {
        true => Opaque::none(),
        false => Opaque::new(triangles, materials, around.shared, around.instances),
    };
    let of_sheets: Vec<Option<bool>> =
        sheets.par_iter().map(|shell| cover(shell, triangles, materials, &opaque, around.eyes)).collect();
    let (mut covers, mut panes) = (Vec::new(), Vec::new());
    for (shell, cover) in sheets.into_iter().zip(of_sheets) {
        if cover == Some(true) {
            faults[mesh(&shell)].turned_covers += 1;
            shell.triangles.iter().for_each(|i| turn(&mut triangles[*i as usize]));
        }
        if cover.is_some() { covers.push(Shell { is_cover: true, ..shell }) } else { panes.push(shell) }
    }
    covers.iter().for_each(|shell| faults[mesh(shell)].covers += 1);
    let sheets = panes;
    found.shells = solids.into_iter().chain(covers).collect();
    for shell in &sheets {
        let fault = &mut faults[mesh(shell)];
        fault.open += usize::from(is_sheet(shell));
        fault.thin += usize::from(!is_sheet(shell));
        let solid = triangles[shell.triangles[0] as usize].material;
        let pane = pane_of(materials, solid);
        shell.triangles.iter().for_each(|i| triangles[*i as usize].material = pane);
    }
    for (shell, crosses_itself) in found.shells.iter().zip(found.crossing(triangles)) {
        if shell.is_cover {
            continue;
        }
        let fault = &mut faults[mesh(shell)];
        fault.holes += usize::from(!shell.is_closed());
        fault.t_junctions += usize::from(shell.has_t_junctions);
        fault.crossings += usize::from(crosses_itself);
    }
    for i in found.find_cavities(triangles, &spheres_of_glass(around.spheres, &is_glass), &opaque) {
        faults[mesh(&found.shells[i])].turned += 1;
        found.shells[i].triangles.iter().for_each(|i| turn(&mut triangles[*i as usize]));
    }
    // A bubble is of the glass around it, whatever its own material.
    for (shell, solid) in found.shells.iter().filter_map(|shell| Some((shell, shell.cavity_of?))) {
        let glass = match solid & SPHERE_BIT != 0 {
            true => around.spheres[(solid & !SPHERE_BIT) as usize].material,
            false => triangles[found.shells[(solid & !COVER_BIT) as usize].triangles[0] as usize].material,
        };
        shell.triangles.iter().for_each(|i| triangles[*i as usize].material = glass);
    }
    let warnings = meshes.iter().zip(&faults).filter_map(|(mesh, faults)| warning(&mesh.name, faults));
    (found.solids(), merged(warnings.collect()))
}

/// Leaves out triangles, and the meshes that they are of.
fn retain((triangles, mesh_of): (&mut Vec<Triangle>, &mut Vec<usize>), kept: &[bool]) {
    let mut flags = kept.iter();
    triangles.retain(|_| flags.next() == Some(&true));
    let mut flags = kept.iter();
    mesh_of.retain(|_| flags.next() == Some(&true));
}

/// A sheet encloses nothing: light goes through it as through a thin pane.
fn is_sheet(shell: &Shell) -> bool {
    !(shell.is_closed() || shell.openness < SMALL_HOLE && shell.hole_edges <= HOLE_EDGES)
}

/// Whether a closed shell is thinner than rounding: to a ray, both of its faces are one.
fn is_too_thin(shell: &Shell, triangles: &[Triangle]) -> bool {
    let area: f64 = shell.triangles.iter().map(|i| triangles[*i as usize].area()).sum();
    let Bounds { min, max } = shell.bounds;
    let reach = min.abs().max(max.abs()).max(max - min).max_element();
    2.0 * shell.volume.abs() < THINNEST * f64::from(reach) * area
}

/// Triangles to keep: of glass that lies in one place several times the first, whichever way
/// its faces look.
fn without_doubles(triangles: &[Triangle], mesh_of: &[usize], is_glass: &[bool], faults: &mut [Faults]) -> Vec<bool> {
    let corners = |triangle: &Triangle| {
        let mut keys = triangle.positions.map(vertex_bits);
        keys.sort_unstable();
        keys
    };
    // Two triangles of a solid that look away from each other are a wall in it, unless all are
    // doubled.
    let mut known: HashMap<(u32, [[u32; 3]; 3]), Vec<usize>> = HashMap::new();
    for (i, triangle) in triangles.iter().enumerate().filter(|(_, t)| is_glass[t.material as usize]) {
        known.entry((triangle.material, corners(triangle))).or_default().push(i);
    }
    let mut kept = vec![true; triangles.len()];
    let mut doubled: HashMap<(usize, u32), (usize, usize)> = HashMap::new();
    for ((material, _), same) in &known {
        for &i in same {
            let counts = doubled.entry((mesh_of[i], *material)).or_default();
            counts.0 += 1;
            counts.1 += usize::from(same.iter().any(|j| *j != i && mesh_of[*j] == mesh_of[i]));
        }
    }
    for ((material, _), same) in known.iter().filter(|(_, same)| same.len() > 1) {
        let first = same[0];
        for &i in &same[1..] {
            let aligned = triangles[first].geometric_normal().dot(triangles[i].geometric_normal()) > 0.0;
            let (all, twice) = doubled[&(mesh_of[i], *material)];
            if aligned || (mesh_of[first] == mesh_of[i] && 10 * twice >= 9 * all) {
                kept[i] = false;
                faults[mesh_of[i]].doubled += 1;
            }
        }
    }
    kept
}

/// Triangles of glass by mesh and material.
fn groups(triangles: &[Triangle], mesh_of: &[usize], is_glass: &[bool]) -> Vec<Vec<u32>> {
    let mut groups: Vec<Vec<u32>> = Vec::new();
    let mut known: HashMap<(usize, u32), usize> = HashMap::new();
    for (i, triangle) in triangles.iter().enumerate().filter(|(_, t)| is_glass[t.material as usize]) {
        let group = *known.entry((mesh_of[i], triangle.material)).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(i as u32);
    }
    groups
}

/// The thin pane of the same glass; added where there is none yet.
fn pane_of(materials: &mut Vec<Material>, solid: u32) -> u32 {
    let glass = materials[solid as usize].clone();
    let Surface::Glass { ior, tint } = glass.surface else { return solid };
    let pane = Material { name: format!("{} (thin)", glass.name), surface: Surface::Pane { ior, tint }, ..glass };
    let known = materials.iter().position(|material| *material == pane);
    known.unwrap_or_else(|| {
        materials.push(pane);
        materials.len() - 1
    }) as u32
}

/// Lets the face look the other way.
fn turn(triangle: &mut Triangle) {
    triangle.positions.swap(1, 2);
    triangle.normals.swap(1, 2);
    triangle.is_turned = !triangle.is_turned;
    triangle.normals = triangle.normals.map(|normal| -normal);
}

fn warning(name: &str, faults: &Faults) -> Option<String> {
    let parts = [
        (faults.doubled > 0, "has doubled faces, which count once"),
        (
            faults.dividers > 0,
            "has faces inside that divide it, which are left out (it is the same glass on both sides)",
        ),
        (faults.open > 0, "is an open sheet, taken for a thin pane (a solid has to be closed)"),
        (faults.thin > 0, "is thinner than rounding, taken for a thin pane"),
        (
            faults.covers > 0,
            "is an open sheet that ends at opaque surfaces, taken for the face of a solid that fills what lies behind",
        ),
        (faults.turned_covers > 0, "faces what lies before it and was turned"),
        (faults.turned > 0, "is wound inside out and was turned"),
        (faults.holes > 0, "has holes, but is taken for a solid"),
        (faults.crossings > 0, "crosses itself: where it lies in itself, light may be bent too little"),
        (faults.t_junctions > 0, "has T-junctions, but is taken for closed"),
    ];
    let said: Vec<&str> = parts.into_iter().filter(|(holds, _)| *holds).map(|(_, text)| text).collect();
    (!said.is_empty()).then(|| format!("{name}: its glass {}", said.join("; ")))
}

/// Each line once, in order.
fn merged(lines: Vec<String>) -> Vec<String> {
    let mut known = HashSet::new();
    lines.into_iter().filter(|line| known.insert(line.clone())).collect()
}
