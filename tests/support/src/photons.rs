//! Photons and query points from a fixed generator, shared by the test and the benchmark of the
//! search.

use caustica::layout::{Photon, VisiblePoint, octahedral};
use glam::Vec3;

/// SplitMix64 (Steele et al. 2014).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vector() * 2.0 - 1.0;
            if v.length_squared() > 0.01 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }
}

fn photon(random: &mut Random, position: Vec3) -> Photon {
    let flux = random.vector() + 0.1;
    Photon { position: position.into(), wi: octahedral(random.direction()), flux: flux.into(), normal: 0 }
}

/// A point of the walls of the unit box.
pub fn on_walls(random: &mut Random) -> Vec3 {
    let mut position = random.vector();
    position[random.bits() as usize % 3] = (random.bits() % 2) as f32;
    position
}

/// Photons uniform in the unit box.
pub fn uniform_box(random: &mut Random, count: usize) -> Vec<Photon> {
    (0..count).map(|_| random.vector()).collect::<Vec<_>>().into_iter().map(|p| photon(random, p)).collect()
}

/// Photons on the walls of the unit box, a fraction of them in a spot on its floor, `width` wide.
pub fn caustic_box(random: &mut Random, count: usize, fraction: f32, width: f32) -> Vec<Photon> {
    let sampled = |random: &mut Random| {
        if random.unit() < fraction { in_caustic(random, width) } else { on_walls(random) }
    };
    (0..count)
        .map(|_| {
            let position = sampled(random);
            photon(random, position)
        })
        .collect()
}

/// A point of the dense spot on the floor.
pub fn in_caustic(random: &mut Random, width: f32) -> Vec3 {
    Vec3::new(0.37 + width * random.unit(), 0.0, 0.61 + width * random.unit())
}

/// `spread` photons uniform in the box, then the rest at one position.
pub fn coincident(random: &mut Random, count: usize, spread: usize) -> Vec<Photon> {
    let mut photons = uniform_box(random, spread);
    photons.extend((spread..count).map(|_| photon(random, Vec3::new(0.3, 0.4, 0.5))));
    photons
}

/// A point in the box, in no map if `invalid`; its shading normal leans a little.
pub fn point(random: &mut Random, invalid: bool) -> VisiblePoint {
    let ng = random.direction();
    VisiblePoint {
        position: random.vector().into(),
        next_map: u32::from(!invalid),
        weight: (random.vector() + 0.1).into(),
        ng: ng.into(),
        ns: (ng + 0.3 * random.direction()).normalize().into(),
        ..VisiblePoint::default()
    }
}
