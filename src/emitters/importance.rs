//! How much pictures need the photons of a place: the density of points that the cameras see, and
//! of those that are seen from there, in an octree. Photons are stored by it (compare Keller and
//! Wald 2000, "Efficient Importance Sampling Techniques for the Photon Map").

use glam::{UVec3, Vec3, uvec3};

use crate::{layout::IMPORTANCE_CHILDREN, scene::Bounds};

/// Maximum number of points in a cell, and of halvings of the side of the whole.
const POINTS: usize = 16;
const MAX_DEPTH: u32 = 16;
/// Halvings between cells that share a face, at most.
const STEP: u32 = 1;
/// Fraction of a cell's density that its neighbours have at least, so that a surface that enters a
/// cell by a corner is not forgotten there; and how far it is passed on, in cells.
const NEIGHBORS: f32 = 0.25;
const ROUNDS: usize = 3;
/// Side of the whole over the extent of the points, and where the extent lies in it: planes of
/// scenes are seldom planes of cells.
const MARGIN: f32 = 1.17;
const SHIFT: Vec3 = Vec3::new(0.0371, 0.0513, 0.0297);

/// Density of points, 1/m², by place.
#[derive(Clone, Debug, PartialEq)]
pub struct Importance {
    /// Least corner of the root, metres, and its side.
    corner: Vec3,
    side: f32,
    nodes: Vec<Node>,
}

/// A cube.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Node {
    /// Index of the first of eight children.
    Inner(u32),
    /// Density.
    Leaf(f32),
}

/// A leaf while the tree is built: its place in units of its own side.
#[derive(Clone, Copy)]
struct Place {
    at: UVec3,
    depth: u32,
    node: usize,
}

impl Importance {
    /// The density of points in a scene of that extent. Without points, it is 0 everywhere.
    #[must_use]
    pub fn new(points: &[Vec3], scene: Bounds) -> Self {
        let side = MARGIN * (scene.max - scene.min).max_element().max(f32::MIN_POSITIVE);
        let corner = 0.5 * (scene.min + scene.max) - 0.5 * side * (Vec3::ONE + SHIFT);
        let mut tree = Self { corner, side, nodes: vec![Node::Leaf(0.0)] };
        let root = Place { at: UVec3::ZERO, depth: 0, node: 0 };
        let mut leaves = Vec::new();
        tree.split(root, points.to_vec(), &mut leaves);
        tree.grade(&mut leaves);
        tree.spread(&leaves);
        tree
    }

    /// Density at a place.
    #[must_use]
    pub fn at(&self, position: Vec3) -> f32 {
        match self.nodes[self.find(position).node] {
            Node::Leaf(density) => density,
            Node::Inner(_) => unreachable!("the search ends at leaves"),
        }
    }

    /// The tree as `shaders/lib/transport/importance.wesl` reads it.
    #[must_use]
    pub fn words(&self) -> Vec<u32> {
        let head = [self.corner.x, self.corner.y, self.corner.z, self.side].map(f32::to_bits);
        let word = |node: &Node| match *node {
            Node::Inner(first) => IMPORTANCE_CHILDREN | first,
            Node::Leaf(density) => density.to_bits(),
        };
        head.into_iter().chain(self.nodes.iter().map(word)).collect()
    }

    /// The leaf at a place; of places outside, that of the border.
    fn find(&self, position: Vec3) -> Place {
        let (mut low, mut side) = (self.corner, self.side);
        let mut place = Place { at: UVec3::ZERO, depth: 0, node: 0 };
        while let Node::Inner(first) = self.nodes[place.node] {
            side *= 0.5;
            let upper = position.cmpge(low + side);
            low = Vec3::select(upper, low + side, low);
            place = child(place, first, uvec3(upper.x.into(), upper.y.into(), upper.z.into()));
        }
        place
    }

    fn side_at(&self, depth: u32) -> f32 {
        self.side / (1_u32 << depth) as f32
    }

    /// Splits a leaf until its parts have few points, and lists them.
    fn split(&mut self, place: Place, points: Vec<Vec3>, leaves: &mut Vec<Place>) {
        if points.len() <= POINTS || place.depth >= MAX_DEPTH {
            self.nodes[place.node] = Node::Leaf(points.len() as f32 / self.side_at(place.depth).powi(2));
            leaves.push(place);
            return;
        }
        let side = self.side_at(place.depth + 1);
        let middle = self.corner + side * (2 * place.at + 1).as_vec3();
        let mut parts: [Vec<Vec3>; 8] = Default::default();
        points.into_iter().for_each(|point| parts[octant(point, middle)].push(point));
        let first = self.divide(place, Node::Leaf(0.0));
        for (i, part) in (0..).zip(parts) {
            self.split(child(place, first, octant_at(i)), part, leaves);
        }
    }

    /// Gives a leaf eight children.
    fn divide(&mut self, place: Place, like: Node) -> u32 {
        let first = self.nodes.len() as u32;
        self.nodes[place.node] = Node::Inner(first);
        self.nodes.extend([like; 8]);
        first
    }

    /// Divides leaves beside much smaller ones. `leaves` then has all.
    fn grade(&mut self, leaves: &mut Vec<Place>) {
        let mut next = 0;
        while next < leaves.len() {
            let place = leaves[next];
            next += 1;
            for beside in self.beside(place) {
                let mut neighbor = self.find(beside);
                while neighbor.depth + STEP < place.depth {
                    let density = self.nodes[neighbor.node];
                    let first = self.divide(neighbor, density);
                    leaves.extend((0..8).map(|i| child(neighbor, first, octant_at(i))));
                    neighbor = self.find(beside);
                }
            }
        }
        leaves.retain(|place| matches!(self.nodes[place.node], Node::Leaf(_)));
    }

    /// Points in the middle beyond each of the faces.
    fn beside(&self, place: Place) -> impl Iterator<Item = Vec3> + use<> {
        let side = self.side_at(place.depth);
        let middle = self.corner + side * (place.at.as_vec3() + 0.5);
        [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(move |axis| [middle - side * axis, middle + side * axis])
    }

    /// Gives the neighbours of each leaf a part of its density.
    fn spread(&mut self, leaves: &[Place]) {
        for _ in 0..ROUNDS {
            let before = self.nodes.clone();
            for place in leaves {
                let Node::Leaf(density) = before[place.node] else { continue };
                for beside in self.beside(*place) {
                    let node = self.find(beside).node;
                    if let Node::Leaf(own) = &mut self.nodes[node] {
                        *own = own.max(NEIGHBORS * density);
                    }
                }
            }
        }
    }
}

fn child(parent: Place, first: u32, octant: UVec3) -> Place {
    let index = octant.x + 2 * octant.y + 4 * octant.z;
    Place { at: 2 * parent.at + octant, depth: parent.depth + 1, node: (first + index) as usize }
}

fn octant_at(i: u32) -> UVec3 {
    uvec3(i & 1, (i >> 1) & 1, i >> 2)
}

fn octant(point: Vec3, middle: Vec3) -> usize {
    let upper = point.cmpge(middle);
    usize::from(upper.x) + 2 * usize::from(upper.y) + 4 * usize::from(upper.z)
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    /// Points on a square of 1 m in a scene of 100 m.
    fn square() -> Importance {
        let points: Vec<Vec3> = (0..4096).map(|i| vec3((i % 64) as f32 / 64.0, 0.0, (i / 64) as f32 / 64.0)).collect();
        let half = Vec3::splat(50.0);
        Importance::new(&points, Bounds { min: -half, max: half })
    }

    #[test]
    fn densities_are_those_of_the_points() {
        let tree = square();
        for i in 0..100 {
            let density = tree.at(vec3(0.05 + 0.09 * (i % 10) as f32, 0.0, 0.05 + 0.09 * (i / 10) as f32));
            assert!(density > 4096.0 / 8.0 && density < 4.0 * 4096.0, "{density}");
        }
        let far = tree.at(vec3(30.0, 0.0, -20.0));
        assert!(far < 0.001 * 4096.0, "{far}");
        let [near, less] = [0.3, 3.0].map(|x| tree.at(vec3(1.0 + x, 0.0, 0.5)));
        assert!(near > less && less >= far, "{near}, {less}, {far}");
    }

    #[test]
    fn neighbours_differ_little() {
        let tree = square();
        for i in 0..2000 {
            let x = 0.001 * i as f32;
            let [a, b] = [x, x + 1e-6].map(|x| tree.at(vec3(x, 1e-4, 0.4)));
            assert!(a <= 1.01 * b / NEIGHBORS && b <= 1.01 * a / NEIGHBORS, "{a} and {b} at {x}");
        }
        assert_eq!(Importance::new(&[], Bounds { min: Vec3::ZERO, max: Vec3::ONE }).at(Vec3::ZERO), 0.0);
    }

    #[test]
    fn many_points_in_one_place_end_the_search() {
        let tree = Importance::new(&[Vec3::ONE; 1000], Bounds { min: Vec3::ZERO, max: 2.0 * Vec3::ONE });
        assert!(tree.at(Vec3::ONE) > 1e6 && tree.words().len() < 100_000);
    }
}
