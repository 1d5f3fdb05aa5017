//! Search for surfaces that lie in each other.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::{
    Bvh, FILLER,
    build::bounds,
    overlap::{TOLERANCE, coincide},
    plane_tree::{Asked, PlaneTree, plane_tree},
};
use crate::{
    layout::{INSTANCE, MAX_RANK, Primitive, SPHERE_BIT},
    scene::{Bounds, CompleteTree, Visit},
};

/// Steps after which the search for what lies in a primitive is put off, and those of all that were
/// put off together: a step visits a node or compares two primitives.
const FIRST_STEPS: usize = 1 << 10;
const LATER_STEPS: usize = 1 << 26;

/// Patches that are looked for in the surface of a primitive of the scene at most: there are no
/// more ranks to tell them apart.
const MAX_TOUCHED: usize = MAX_RANK as usize + 1;

/// The primitives of a scene as they are searched. `apart` gives the patch, if any, that is not
/// looked for in one.
pub(super) struct Search<'a, A> {
    pub(super) bvh: &'a Bvh,
    /// The patch of each primitive by its index in the scene.
    patches: &'a [u32],
    apart: A,
    /// Indices of the primitives outside of instances, each once, and whether others may lie in it.
    firsts: Vec<(u32, bool)>,
    /// Trees over those in which others may lie.
    triangles: PlaneTree,
    spheres: PlaneTree,
    /// Whether boxes of instances are below each node of the scene's tree.
    pub(super) has_instances: Vec<bool>,
}

/// What lies in a primitive.
#[derive(Debug, Default)]
pub(super) struct Touched {
    /// Patches outside of instances; of a crowd, some.
    pub patches: Vec<u32>,
    /// Indices of primitives of instances.
    pub of_instances: BTreeSet<u32>,
    /// Steps of the search.
    pub steps: usize,
}

impl Touched {
    pub fn is_empty(&self) -> bool {
        self.patches.is_empty() && self.of_instances.is_empty()
    }
}

impl<'a, A: Fn(&Primitive) -> Option<u32> + Sync> Search<'a, A> {
    pub fn new(bvh: &'a Bvh, patches: &'a [u32], apart: A) -> Self {
        let (triangles, spheres) = (plane_tree(&[], &[]), plane_tree(&[], &[]));
        let mut search =
            Self { bvh, patches, apart, firsts: Vec::new(), triangles, spheres, has_instances: Vec::new() };
        search.has_instances = search.has_instances();
        // Primitives in several leaves are asked once.
        let mut listed = vec![false; patches.len()];
        let mut is_first = |p: &Primitive| p.id != FILLER && !std::mem::replace(&mut listed[p.id as usize], true);
        let all = bvh.primitives[..bvh.scene_part().1].iter().zip(0..);
        let firsts: Vec<u32> = all.filter(|(p, _)| is_first(p)).map(|(_, i)| i).collect();
        let near = search.near_others(&firsts);
        search.firsts = firsts.into_iter().zip(near).collect();
        let tree = |is_sphere: bool| {
            let of = |&(i, may_be_touched): &(u32, bool)| {
                let primitive = &bvh.primitives[i as usize];
                let is_one = may_be_touched && (primitive.material & SPHERE_BIT != 0) == is_sphere;
                search.patch(primitive).filter(|_| is_one).map(|patch| (i, patch))
            };
            plane_tree(&bvh.primitives, &search.firsts.iter().filter_map(of).collect::<Vec<_>>())
        };
        (search.triangles, search.spheres) = (tree(false), tree(true));
        search
    }

    pub(super) fn patch(&self, primitive: &Primitive) -> Option<u32> {
        self.patches.get(primitive.id as usize).copied()
    }

    fn has_instances(&self) -> Vec<bool> {
        let nodes = &self.bvh.nodes[..self.bvh.scene_part().0];
        let mut below = vec![false; nodes.len()];
        // Children come after their parents.
        for (i, node) in nodes.iter().enumerate().rev().filter(|_| !self.bvh.instances.is_empty()) {
            below[i] = node.children().any(|child| {
                let leaf = &self.bvh.primitives[child.first as usize..(child.first + child.count) as usize];
                (child.count == 0 && below[child.first as usize]) || leaf.iter().any(|p| p.emitter == INSTANCE)
            });
        }
        below
    }

    /// Whether each primitive meets the box of a patch that is looked for in it.
    fn near_others(&self, firsts: &[u32]) -> Vec<bool> {
        let count = self.patches.iter().max().map_or(0, |last| *last as usize + 1);
        let mut boxes = vec![Bounds::EMPTY; count];
        for primitive in firsts.iter().map(|i| &self.bvh.primitives[*i as usize]) {
            let own = &mut boxes[self.patches[primitive.id as usize] as usize];
            *own = own.union(bounds(primitive));
        }
        // Up to the tolerance.
        let widened = |b: &Bounds| {
            let slack = TOLERANCE as f32 * 4.0 * b.min.abs().max(b.max.abs()).max_element();
            Bounds { min: b.min - slack, max: b.max + slack }
        };
        let boxes: Vec<Bounds> = boxes.iter().map(widened).collect();
        let tree = CompleteTree::of_boxes(&boxes);
        let is_near = |i: &u32| {
            let primitive = &self.bvh.primitives[*i as usize];
            let (apart, its_bounds) = ((self.apart)(primitive), bounds(primitive));
            let mut found = false;
            tree.near(&its_bounds, |patch| {
                found = Some(patch as u32) != apart && boxes[patch].touches(&its_bounds);
                !found
            });
            found
        };
        firsts.par_iter().map(is_near).collect()
    }

    /// The primitives outside of instances in which others lie, each by its index in the scene; and
    /// the number of those that were not compared with all others.
    pub fn among_primitives(&self) -> (Vec<(u32, Touched)>, usize) {
        let search = |some: &[(u32, bool)], most: usize| -> Vec<((u32, bool), Touched)> {
            let of = |first: &(u32, bool)| {
                let touched = self.touching(*first, most);
                (!touched.is_empty() || touched.steps >= most).then_some((*first, touched))
            };
            some.par_iter().filter_map(of).collect()
        };
        let (late, mut found): (Vec<_>, Vec<_>) =
            search(&self.firsts, FIRST_STEPS).into_iter().partition(|(_, touched)| touched.steps >= FIRST_STEPS);
        let late: Vec<(u32, bool)> = late.into_iter().map(|(first, _)| first).collect();
        let most = (LATER_STEPS / late.len().max(1)).max(2 * FIRST_STEPS);
        let later = search(&late, most);
        let unfinished = later.iter().filter(|(_, touched)| touched.steps >= most).count();
        found.extend(later);
        let by_id = |((i, _), touched): ((u32, bool), Touched)| (self.bvh.primitives[i as usize].id, touched);
        (found.into_iter().map(by_id).collect(), unfinished)
    }

    /// What lies in a primitive of the scene, within so many steps.
    fn touching(&self, (index, may_be_touched): (u32, bool), most: usize) -> Touched {
        let primitive = &self.bvh.primitives[index as usize];
        let mut found = Touched::default();
        let Some(asked) = Asked::new(primitive) else { return found };
        let apart = (self.apart)(primitive);
        let is_sphere = primitive.material & SPHERE_BIT != 0;
        if may_be_touched {
            let tree = if is_sphere { &self.spheres } else { &self.triangles };
            tree.visit(|visit| {
                let is_known = |patch: Option<u32>, found: &Touched| {
                    patch.is_some_and(|patch| Some(patch) == apart || found.patches.contains(&patch))
                };
                match visit {
                    Visit::Node(_, node) => {
                        found.steps += 1;
                        !is_known(node.patch, &found) && node.may_touch(&asked)
                    }
                    Visit::Leaf(leaf) => {
                        for other in leaf.iter().map(|i| &self.bvh.primitives[*i as usize]) {
                            let patch = self.patch(other);
                            if is_known(patch, &found) || !asked.meets(other) {
                                continue;
                            }
                            found.steps += 1;
                            if asked.may_touch(other) && coincide(primitive, other) {
                                found.patches.extend(patch);
                            }
                        }
                        found.patches.len() < MAX_TOUCHED && found.steps < most
                    }
                }
            });
        }
        if self.has_instances[0] && !is_sphere {
            self.touching_instances(&asked, most, &mut found);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::{super::overlap::Shape, *};
    use crate::scene::{Material, Scene, Sphere, Surface, Triangle};

    /// Numbers from -1 to 1.
    fn random(mut state: u32) -> impl FnMut() -> f32 {
        move || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        }
    }

    /// Patches that lie in each primitive, sorted, and the steps of the search for all of them.
    fn searched(triangles: Vec<[Vec3; 3]>, spheres: Vec<Sphere>, patches: u32) -> (Bvh, Vec<u32>, Vec<Touched>) {
        let scene = Scene {
            materials: vec![Material::new("", Surface::Diffuse { albedo: Vec3::ONE })],
            triangles: triangles.into_iter().map(|corners| Triangle::new(corners, [Vec3::Y; 3], 0)).collect(),
            spheres,
            ..Scene::default()
        };
        let count = (scene.triangles.len() + scene.spheres.len()) as u32;
        let of_ids: Vec<u32> = (0..count).map(|id| id % patches).collect();
        let bvh = Bvh::build(&scene);
        let search = Search::new(&bvh, &of_ids, |primitive| Some(of_ids[primitive.id as usize]));
        let mut found: Vec<Touched> = (0..count).map(|_| Touched::default()).collect();
        for first in &search.firsts {
            let mut touched = search.touching(*first, usize::MAX);
            touched.patches.sort_unstable();
            found[bvh.primitives[first.0 as usize].id as usize] = touched;
        }
        drop(search);
        (bvh, of_ids, found)
    }

    /// The same by comparing each with each.
    fn compared(bvh: &Bvh, of_ids: &[u32]) -> Vec<Vec<u32>> {
        let mut found = vec![BTreeSet::new(); of_ids.len()];
        let all = || bvh.primitives.iter().filter(|p| p.id != FILLER);
        for a in all() {
            let shape = Shape::new(a);
            let others = all().filter(|b| of_ids[b.id as usize] != of_ids[a.id as usize]);
            let touching = others.filter(|b| shape.meets(&bounds(b)) && shape.is_parallel(b) && coincide(a, b));
            found[a.id as usize].extend(touching.map(|b| of_ids[b.id as usize]));
        }
        found.into_iter().map(|patches| patches.into_iter().collect()).collect()
    }

    #[test]
    fn what_is_found_is_what_comparing_all_finds() {
        // Triangles of many sizes in a few planes, moved and tilted by about the tolerance.
        let mut next = random(3);
        let planes: Vec<[Vec3; 3]> = (0..6)
            .map(|_| {
                let normal = vec3(next(), next(), next()).normalize();
                let (u, v) = normal.any_orthonormal_pair();
                [vec3(next(), next(), next()), u, v]
            })
            .collect();
        let mut triangle = |i: usize| {
            let [origin, u, v] = planes[i % planes.len()];
            let size = 4.0_f32.powf(2.5 * next() - 1.5);
            let middle = origin + next() * u + next() * v;
            let lift = 1e-6 * next() * u.cross(v);
            std::array::from_fn(|_| middle + lift + size * (next() * u + next() * v) + 2e-7 * next() * u.cross(v))
        };
        let triangles: Vec<[Vec3; 3]> = (0..600).map(&mut triangle).collect();
        let mut next = random(5);
        let spheres = (0..200).map(|i| Sphere {
            center: Vec3::splat((i % 5) as f32 * 0.1) + 3e-7 * vec3(next(), next(), next()),
            // Some have a radius of their own.
            radius: 1.0 + 0.1 * (i % 3) as f32 + if i < 20 { 0.001 * i as f32 } else { 0.0 },
            material: 0,
            object: 0,
        });
        let (bvh, of_ids, found) = searched(triangles, spheres.collect(), 13);
        let patches: Vec<Vec<u32>> = found.into_iter().map(|touched| touched.patches).collect();
        let right = compared(&bvh, &of_ids);
        assert_eq!(patches, right);
        let [triangles, spheres] = [&right[..600], &right[600..]];
        for found in [triangles, spheres] {
            let some = found.iter().filter(|patches| !patches.is_empty()).count();
            assert!(some > found.len() / 4 && found.iter().any(Vec::is_empty), "{some} of {}", found.len());
        }
    }

    #[test]
    fn crowds_are_searched_in_few_steps() {
        let corners = [vec3(0.3, 0.4, 0.1), vec3(0.1, 0.9, 0.2), vec3(0.8, 0.1, 0.9)];
        let step = vec3(1.0, 0.7, 0.3) * 2e-6;
        let crowd = |count: usize, step: Vec3| (0..count).map(|i| corners.map(|p| p + i as f32 * step)).collect();
        let steps = |triangles| {
            let (_, of_ids, found) = searched(triangles, Vec::new(), u32::MAX);
            found.iter().map(|touched| touched.steps).sum::<usize>() / of_ids.len()
        };
        let (few, many) = (steps(crowd(500, step)), steps(crowd(4000, step)));
        assert!(many < 2 * few && many < 100, "{few} steps for each of 500, {many} of 4000");
        // Control: what does lie in all others is compared with them.
        let in_one_place = steps(crowd(500, Vec3::ZERO));
        assert!(in_one_place >= MAX_TOUCHED, "{in_one_place}");
    }

    #[test]
    fn neighbours_in_a_plane_take_few_steps() {
        // Squares side by side, of a patch each, in a plane along axes and in an oblique one; then
        // all over again in the same place.
        let grid = |u: Vec3, v: Vec3, lift: Vec3| -> Vec<[Vec3; 3]> {
            let at = |x: u32, y: u32| x as f32 * u + y as f32 * v + lift;
            let square = |i: u32| {
                let (x, y) = (i % 30, i / 30);
                [[at(x, y), at(x + 1, y), at(x + 1, y + 1)], [at(x, y), at(x + 1, y + 1), at(x, y + 1)]]
            };
            (0..900).flat_map(square).collect()
        };
        for (u, v) in [(0.5 * Vec3::X, 0.5 * Vec3::Z), (vec3(0.3, 0.4, 0.1), vec3(-0.2, 0.1, 0.35))] {
            let once = grid(u, v, Vec3::ONE);
            let twice = [once.clone(), once.clone()].concat();
            let found = |triangles| {
                let (bvh, of_ids, found) = searched(triangles, Vec::new(), u32::MAX);
                let patches: Vec<Vec<u32>> = found.iter().map(|touched| touched.patches.clone()).collect();
                assert_eq!(patches, compared(&bvh, &of_ids));
                let steps = found.iter().map(|touched| touched.steps).sum::<usize>() / found.len();
                (patches.iter().map(Vec::len).sum::<usize>(), steps)
            };
            let ((pairs, steps), (all_pairs, _)) = (found(once), found(twice));
            assert_eq!((pairs, all_pairs), (0, 3600));
            assert!(steps < 100, "{steps}");
        }
    }
}
