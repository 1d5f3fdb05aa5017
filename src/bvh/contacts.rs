//! Contacts: surfaces that lie in each other, of which a ray meets all at once, and the order in
//! which it does.
//!
//! The kernels compare distances of these alone with a tolerance, so that nothing else loses
//! precision.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;

use super::{
    Bvh, FILLER,
    contact_search::{Search, Touched},
    overlap::{Shape, coincide},
};
use crate::{
    layout::{MAX_RANK, Primitive, SPHERE_BIT},
    scene::{Alpha, Scene, SharedMesh},
};

/// Warning where instances are not compared.
const TOO_MANY: &str = "there are too many instances in each other's boxes to compare: where surfaces of two of them \
                        lie in each other, either is seen";

/// Warning where primitives are not compared with all others, after their number.
const CROWDED: &str = "surfaces have too many others around them to compare with each: where one of these lies in them, \
                       either is seen";

/// Pairs of emissive primitives that are compared to tell whether they face the same way.
const MOST_COMPARED: usize = 1 << 22;

/// Surfaces that lie in each other.
#[derive(Clone, Debug)]
pub struct Contacts {
    /// The rank of each primitive of the hierarchy that is in contact with another one; `None` for
    /// others. Of opaque surfaces in one place the one of the lowest rank is seen, 0 to
    /// [`MAX_RANK`]: one with holes before one without, then that of the smaller object, as a
    /// picture on a wall, then the first of the scene.
    pub ranks: Vec<Option<u32>>,
    /// Warning for lamps that lie in each other.
    pub warning: Option<String>,
}

/// The triangles of one material in one object, or its spheres.
struct Patch {
    object: u32,
    material: u32,
    area: f64,
}

/// The patches of a scene, numbered in its order, and that of each primitive by its index there.
struct Patches {
    all: Vec<Patch>,
    of_ids: Vec<u32>,
}

impl Patches {
    fn new(scene: &Scene) -> Self {
        let triangles = scene.triangles.iter().map(|t| ((t.object, t.material), t.area()));
        let spheres = scene.spheres.iter().map(|s| ((s.object, s.material), s.area()));
        let (mut all, mut known) = (Vec::new(), HashMap::new());
        // Those of a mesh follow each other.
        let mut last = None;
        let number = |(key, area): ((u32, u32), f64)| {
            let number = match last {
                Some((same, number)) if same == key => number,
                _ => *known.entry(key).or_insert(all.len()),
            };
            last = Some((key, number));
            if number == all.len() {
                all.push(Patch { object: key.0, material: key.1, area: 0.0 });
            }
            all[number].area += area;
            number as u32
        };
        // Those of a mesh that instances share belong to no object.
        let of_mesh = |(mesh, first): (&SharedMesh, u32)| {
            mesh.triangles.iter().map(move |t| ((u32::MAX - first, t.material), t.area())).collect::<Vec<_>>()
        };
        let shared = scene.meshes.iter().zip(0..).flat_map(of_mesh);
        let of_ids = triangles.chain(spheres).chain(shared).map(number).collect();
        Self { all, of_ids }
    }

    fn of(&self, primitive: &Primitive) -> Option<u32> {
        self.of_ids.get(primitive.id as usize).copied()
    }

    /// Warning for the first pair of lamps that lie in each other and shine the same way: one is
    /// seen there, but both send out light.
    fn warning(&self, scene: &Scene, bvh: &Bvh, pairs: &BTreeSet<(u32, u32)>) -> Option<String> {
        let material = |patch: u32| &scene.materials[self.all[patch as usize].material as usize];
        let shines = |patch: u32| material(patch).emission != Vec3::ZERO;
        let both_ways = |(a, b): &(u32, u32)| material(*a).double_sided || material(*b).double_sided;
        let is_double = |pair: &&(u32, u32)| both_ways(pair) || self.face_alike(bvh, **pair);
        let mut lamps = pairs.iter().filter(|(a, b)| a <= b && shines(*a) && shines(*b)).filter(is_double);
        let (a, b) = lamps.next()?;
        let name = |patch: &u32| {
            let object = scene.objects.get(self.all[*patch as usize].object as usize);
            object.map_or_else(|| material(*patch).name.clone(), Clone::clone)
        };
        let others = lamps.count();
        let more = if others > 0 { format!(", and {others} more such pairs") } else { String::new() };
        Some(format!(
            "{} and {}{more}: their emissive surfaces lie in each other in part; there one is seen, but both send out light",
            name(a),
            name(b)
        ))
    }

    /// Whether any of the primitives of two patches that lie in each other face the same way, and
    /// not all are back to back; true where there are too many to tell.
    fn face_alike(&self, bvh: &Bvh, (a, b): (u32, u32)) -> bool {
        let [a, b] = [a, b].map(|patch| {
            let all = bvh.primitives.iter().filter(|p| p.id != FILLER);
            all.filter(|p| self.of(p) == Some(patch)).collect::<Vec<_>>()
        });
        let normal = |p: &Primitive| Vec3::from(p.e1).as_dvec3().cross(Vec3::from(p.e2).as_dvec3());
        let alike = |p: &Primitive, q: &Primitive| {
            let is_sphere = p.material & SPHERE_BIT != 0;
            (is_sphere || normal(p).dot(normal(q)) > 0.0) && Shape::new(p).is_parallel(q) && coincide(p, q)
        };
        a.len() * b.len() > MOST_COMPARED || a.iter().any(|p| b.iter().any(|q| alike(p, q)))
    }

    /// Ranks of patches that lie in each other, given in both orders: one more than the highest
    /// rank among those that come before.
    fn ranks(&self, scene: &Scene, pairs: &BTreeSet<(u32, u32)>) -> BTreeMap<u32, u32> {
        let touched: BTreeSet<u32> = pairs.iter().map(|(patch, _)| *patch).collect();
        let mut order: Vec<u32> = touched.into_iter().collect();
        order.sort_by_key(|number| {
            let patch = &self.all[*number as usize];
            let is_whole = scene.materials[patch.material as usize].alpha == Alpha::Opaque;
            // Areas that differ by rounding are one.
            (is_whole, (1024.0 * patch.area.ln()) as i64, *number)
        });
        let mut ranks: BTreeMap<u32, u32> = BTreeMap::new();
        for patch in order {
            let others = pairs.range((patch, 0)..=(patch, u32::MAX));
            let before = others.filter_map(|(_, other)| ranks.get(other)).max();
            ranks.insert(patch, before.map_or(0, |rank| (rank + 1).min(MAX_RANK)));
        }
        ranks
    }
}

/// Finds the contacts of a scene's surfaces.
#[must_use]
pub fn contacts(scene: &Scene, bvh: &Bvh) -> Contacts {
    let patches = Patches::new(scene);
    // A patch that neither shines nor lets light through may be met in any of its parts.
    let is_plain = |patch: u32| {
        let material = &scene.materials[patches.all[patch as usize].material as usize];
        material.emission == Vec3::ZERO && !material.surface.transmits()
    };
    if bvh.instances.is_empty() && patches.all.len() < 2 && patches.all.iter().zip(0..).all(|(_, i)| is_plain(i)) {
        return Contacts { ranks: vec![None; bvh.primitives.len()], warning: None };
    }
    let apart = |primitive: &Primitive| patches.of(primitive).filter(|patch| is_plain(*patch));
    let search = Search::new(bvh, &patches.of_ids, apart);
    let (mut found, unfinished) = search.among_primitives();
    let among_instances = search.among_instances();
    let unasked = among_instances.is_none().then(|| TOO_MANY.to_owned());
    let crowded = (unfinished > 0).then(|| format!("{unfinished} {CROWDED}"));
    found.extend(among_instances.unwrap_or_default());
    let patch_of = |id: u32| patches.of_ids[id as usize];
    // The primitives of instances are not asked themselves: both orders.
    let pair = |(id, touched): &(u32, Touched)| {
        let own = patch_of(*id);
        let of_instances = touched.of_instances.iter().map(|id| patch_of(*id));
        let others = touched.patches.iter().copied().chain(of_instances);
        others.flat_map(|other| [(own, other), (other, own)]).collect::<Vec<_>>()
    };
    let pairs: BTreeSet<(u32, u32)> = found.iter().flat_map(pair).collect();
    let ranks = patches.ranks(scene, &pairs);
    let mut of_ids = vec![None; patches.of_ids.len()];
    let touched = found.iter().flat_map(|(_, touched)| touched.of_instances.iter().copied());
    let in_contact = found.iter().map(|(id, _)| *id).chain(touched);
    in_contact.for_each(|id| of_ids[id as usize] = ranks.get(&patch_of(id)).copied());
    let ranks = bvh.primitives.iter().map(|p| of_ids.get(p.id as usize).copied().flatten()).collect();
    Contacts { ranks, warning: patches.warning(scene, bvh, &pairs).or(unasked).or(crowded) }
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::scene::{Material, Sphere, Surface, Triangle};

    /// Contacts of triangles and spheres, in the order of the scene; material 0 is glass, 1
    /// diffuse.
    fn found(triangles: &[([Vec3; 3], u32)], spheres: &[(f32, u32)]) -> Vec<bool> {
        let surfaces = [Surface::Glass { ior: 1.5, tint: Vec3::ONE }, Surface::Diffuse { albedo: Vec3::ONE }];
        let material = |surface| Material::new("", surface);
        let triangle = |(positions, material): &([Vec3; 3], u32)| Triangle::new(*positions, [Vec3::Y; 3], *material);
        let sphere = |(radius, material): &(f32, u32)| Sphere {
            center: Vec3::ONE,
            radius: *radius,
            material: *material,
            object: 0,
        };
        let scene = Scene {
            materials: surfaces.map(material).to_vec(),
            triangles: triangles.iter().map(triangle).collect(),
            spheres: spheres.iter().map(sphere).collect(),
            ..Scene::default()
        };
        let bvh = Bvh::build(&scene);
        let marks = contacts(&scene, &bvh).ranks;
        let mut by_id = vec![false; triangles.len() + spheres.len()];
        let listed = bvh.primitives.iter().zip(marks).filter(|(p, _)| p.id != FILLER);
        listed.for_each(|(p, rank)| by_id[p.id as usize] = rank.is_some());
        by_id
    }

    fn flat(x: f32, y: f32, size: f32) -> [Vec3; 3] {
        [vec3(x, y, 0.0), vec3(x, y, size), vec3(x + size, y, 0.0)]
    }

    #[test]
    fn surfaces_in_one_plane_are_found_and_neighbours_are_not() {
        let floor = (flat(-5.0, 0.0, 20.0), 1);
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 0), floor], &[]), [true, true]);
        assert_eq!(found(&[(flat(0.0, 1e-6, 1.0), 0), floor], &[]), [true, true], "up to rounding");
        assert_eq!(found(&[(flat(0.0, 1e-3, 1.0), 0), floor], &[]), [false, false], "control: a millimetre above");
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 1), floor], &[]), [false, false], "control: one diffuse object");
        // Halves of a rectangle share an edge alone.
        let other = [vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 1.0)];
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 0), (other, 0)], &[]), [false, false]);
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 0), (flat(0.2, 0.0, 0.3), 0)], &[]), [true, true]);
    }

    #[test]
    fn equal_spheres_are_in_contact() {
        assert_eq!(found(&[], &[(1.0, 0), (1.0, 0), (1.1, 0)]), [true, true, false]);
    }

    /// The scene of triangles of a plane, each of an object and a material (0 is cut out).
    fn ranked(triangles: &[([Vec3; 3], u32, u32)]) -> Vec<Option<u32>> {
        let mut materials = vec![Material::new("", Surface::Diffuse { albedo: Vec3::ONE }); 4];
        materials[0].alpha = Alpha::Blend;
        let triangle = |(positions, object, material): &([Vec3; 3], u32, u32)| Triangle {
            object: *object,
            ..Triangle::new(*positions, [Vec3::Y; 3], *material)
        };
        let scene = Scene { materials, triangles: triangles.iter().map(triangle).collect(), ..Scene::default() };
        let bvh = Bvh::build(&scene);
        let mut by_id = vec![None; triangles.len()];
        let listed = bvh.primitives.iter().zip(contacts(&scene, &bvh).ranks).filter(|(p, _)| p.id != FILLER);
        listed.for_each(|(p, rank)| by_id[p.id as usize] = rank);
        by_id
    }

    #[test]
    fn the_smaller_of_opaque_surfaces_comes_first() {
        let (floor, rug, coin) = (flat(-5.0, 0.0, 20.0), flat(0.0, 0.0, 3.0), flat(0.2, 0.0, 0.3));
        assert_eq!(ranked(&[(floor, 0, 1), (rug, 1, 2), (coin, 2, 3)]), [Some(2), Some(1), Some(0)]);
        assert_eq!(ranked(&[(coin, 2, 1), (floor, 0, 1), (rug, 1, 1)]), [Some(0), Some(2), Some(1)]);
        assert_eq!(ranked(&[(floor, 0, 1), (rug, 0, 2)]), [Some(1), Some(0)], "materials of one object");
        assert_eq!(ranked(&[(rug, 1, 2), (rug, 0, 1)]), [Some(0), Some(1)], "equals in order of the scene");
        assert_eq!(ranked(&[(rug, 1, 1), (floor, 0, 0)]), [Some(1), Some(0)], "what has holes lies above");
        assert_eq!(ranked(&[(floor, 0, 1), (flat(0.0, 1e-3, 3.0), 1, 2)]), [None, None], "control: a millimetre");
    }

    #[test]
    fn needles_of_one_object_are_not_compared() {
        // Split into thirty pieces each, which all meet in the middle: 20,000² comparisons.
        let count = 20_000;
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let mut needles: Vec<([Vec3; 3], u32, u32)> = (0..count)
            .map(|_| {
                let mut direction = || vec3(next(), next(), next()).normalize();
                let (along, across) = (direction(), 0.003 * direction());
                ([-along, along + across, along - across], 0, 1)
            })
            .collect();
        needles.push((needles[7].0, 1, 2));
        let ranks = ranked(&needles);
        assert_eq!((ranks[7], ranks[count]), (Some(1), Some(0)));
        assert!(ranks.iter().flatten().count() < 10);
    }
}
