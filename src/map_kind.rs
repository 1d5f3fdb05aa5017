//! The kinds of photon maps.

use std::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

use crate::layout::{CAUSTIC_MAP, GLOBAL_MAP};

/// Kind of the photons that a map holds. The number of a kind is that in the photons' keys on the
/// device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MapKind {
    /// All photons that the mode stores, except caustics.
    Global = GLOBAL_MAP as isize,
    /// Photons that come from a specular surface: L S+ D.
    Caustic = CAUSTIC_MAP as isize,
}

impl MapKind {
    /// All kinds, in the order in which maps are gathered.
    pub const ALL: [Self; 2] = [Self::Global, Self::Caustic];

    /// Name in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["global", "caustic"][self as usize]
    }
}

/// A value for each kind of map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ByKind<T> {
    /// Value of the global map.
    pub global: T,
    /// Value of the caustic map.
    pub caustic: T,
}

impl<T> Index<MapKind> for ByKind<T> {
    type Output = T;

    fn index(&self, kind: MapKind) -> &T {
        match kind {
            MapKind::Global => &self.global,
            MapKind::Caustic => &self.caustic,
        }
    }
}

impl<T> IndexMut<MapKind> for ByKind<T> {
    fn index_mut(&mut self, kind: MapKind) -> &mut T {
        match kind {
            MapKind::Global => &mut self.global,
            MapKind::Caustic => &mut self.caustic,
        }
    }
}

impl<T> ByKind<T> {
    /// The values with their kinds, in the order of [`MapKind::ALL`].
    pub fn into_pairs(self) -> [(MapKind, T); 2] {
        [(MapKind::Global, self.global), (MapKind::Caustic, self.caustic)]
    }
}
