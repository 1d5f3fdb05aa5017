//! Cavities: shells with faces inwards, and the solids that they lie in.

use glam::Vec3;

use super::{
    shells::{Shell, Shells, winding},
    solid::{COVER_BIT, SPHERE_BIT},
    surfaces::{Opaque, Surfaces},
};
use crate::scene::{Bounds, CompleteTree, Sphere, Triangle};

/// The spheres of glass, with their indices in the scene.
pub(super) fn spheres_of_glass<'a>(spheres: &'a [Sphere], is_glass: &[bool]) -> Vec<(u32, &'a Sphere)> {
    (0..).zip(spheres).filter(|(_, sphere)| is_glass[sphere.material as usize]).collect()
}

impl Shells {
    /// The shells of scenes that no file describes, with their cavities: a group for each material
    /// of glass.
    pub(super) fn of_materials(triangles: &[Triangle], spheres: &[Sphere], is_glass: &[bool]) -> Self {
        let mut groups = vec![Vec::new(); is_glass.len()];
        for (triangle, i) in triangles.iter().zip(0..).filter(|(t, _)| is_glass[t.material as usize]) {
            groups[triangle.material as usize].push(i);
        }
        let mut found = Self::new(triangles, &groups);
        found.find_cavities(triangles, &spheres_of_glass(spheres, is_glass), &Opaque::none());
        found
    }

    /// Notes for each shell with faces inwards the solid that it lies in: the smallest closed one
    /// of its own mesh and material, else of all and of spheres, else the nearest cover. Those that
    /// lie in none are taken to face outwards, and are returned.
    pub(super) fn find_cavities(
        &mut self,
        triangles: &[Triangle],
        spheres: &[(u32, &Sphere)],
        opaque: &Opaque,
    ) -> Vec<usize> {
        let is_inward = |shell: &Shell| !shell.is_cover && shell.volume < 0.0;
        let inward: Vec<usize> = (0..self.shells.len()).filter(|i| is_inward(&self.shells[*i])).collect();
        if inward.is_empty() {
            return inward;
        }
        let of_shells = self.shells.iter().map(|shell| shell.bounds);
        let boxes = CompleteTree::of_boxes(
            &of_shells.chain(spheres.iter().map(|(_, sphere)| Bounds::from(*sphere))).collect::<Vec<_>>(),
        );
        let covers = self.shells.iter().enumerate().filter(|(_, shell)| shell.is_cover);
        let sheet =
            |shell: &Shell| Surfaces::new(shell.triangles.iter().map(|i| triangles[*i as usize]).collect::<Vec<_>>());
        let covers: Vec<(usize, Surfaces)> = covers.map(|(i, shell)| (i, sheet(shell))).collect();
        let mut alone = Vec::new();
        for i in inward {
            let corner = triangles[self.shells[i].triangles[0] as usize].positions[0];
            let closed = self.closed_around(triangles, i, spheres, &boxes);
            let behind = || {
                let nearest = |a: &usize, b: &usize| {
                    let [a, b] = [a, b].map(|i| self.shells[*i].bounds.distance(corner));
                    a.total_cmp(&b)
                };
                let is_behind =
                    |sheet: &Surfaces| sheet.side(corner, |along, most| opaque.is_free(corner, along, most)) > 0;
                let found = covers.iter().filter(|(_, sheet)| is_behind(sheet)).map(|(i, _)| *i).min_by(nearest);
                found.map(|i| i as u32 | COVER_BIT)
            };
            self.shells[i].cavity_of = closed.or_else(behind);
            if self.shells[i].cavity_of.is_none() {
                self.shells[i].volume *= -1.0;
                alone.push(i);
            }
        }
        alone
    }

    /// The smallest shell with faces outwards, or sphere, that a shell lies in, of its own group
    /// rather than of another: what fills a vessel may reach into its wall. `boxes` are those of
    /// all shells, then of spheres.
    fn closed_around(
        &self,
        triangles: &[Triangle],
        inner: usize,
        spheres: &[(u32, &Sphere)],
        boxes: &CompleteTree<Bounds>,
    ) -> Option<u32> {
        let inner = &self.shells[inner];
        let corner: Vec3 = triangles[inner.triangles[0] as usize].positions[0];
        let mut found: Option<(bool, f64, u32)> = None;
        boxes.near(&Bounds { min: corner, max: corner }, |i| {
            let (is_other, volume, solid) = match self.shells.get(i) {
                Some(shell) => (shell.group != inner.group, shell.volume, i as u32),
                None => {
                    let (k, sphere) = spheres[i - self.shells.len()];
                    (true, 4.0 / 3.0 * std::f64::consts::PI * f64::from(sphere.radius).powi(3), k | SPHERE_BIT)
                }
            };
            let holds = || match self.shells.get(i) {
                // It may be one that is to be turned.
                Some(shell) => {
                    !shell.is_cover
                        && shell.bounds.distance(corner) == 0.0
                        && winding(triangles, shell, corner.as_dvec3()).abs() > 0.5
                }
                None => {
                    let sphere = spheres[i - self.shells.len()].1;
                    sphere.center.distance(corner) < sphere.radius
                }
            };
            let is_better = found.is_none_or(|(other, least, at)| {
                is_other.cmp(&other).then(volume.total_cmp(&least)).then(solid.cmp(&at)).is_lt()
            });
            if is_better && volume > inner.volume.abs() && holds() {
                found = Some((is_other, volume, solid));
            }
            true
        });
        found.map(|(.., solid)| solid)
    }
}
