//! How the lanes of a subgroup share the work of a search; see `shaders/lib/core/lanes.wesl`.

use super::adapter::NEEDED_SUBGROUP;
use crate::layout::{CELL_FAN, CELL_PHOTONS};

/// The kernels' overrides of these names, for an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lanes {
    /// `LANES`: lanes that walk together.
    pub group: u32,
    /// `HAS_SEVERAL_GROUPS`.
    pub several_groups: bool,
    /// `PACKET_LANES`: lanes that answer a packet of queries together. Where each lane has a packet
    /// of its own, some are searched ahead of the others: `HAS_PILOTS`.
    pub of_packet: u32,
    /// Invocations of a subgroup, at least and at most.
    subgroup: (u32, u32),
}

impl Lanes {
    /// Lanes of software, each of which has a packet of its own, or of a GPU, where the photons of
    /// a packet are spread over lanes if there are enough: one for each photon of a cell.
    pub fn new(subgroup: (u32, u32), is_software: bool) -> Self {
        let (least, most) = subgroup;
        let of_packet = if !is_software && least >= CELL_FAN { least.min(CELL_PHOTONS) } else { 1 };
        // Smaller groups are faster where a subgroup has several: queries of few share less, and
        // wait for fewer others.
        let group = if most > CELL_FAN && of_packet == 1 { NEEDED_SUBGROUP } else { least.min(CELL_FAN) };
        Self { group, several_groups: most > group, of_packet, subgroup }
    }

    /// Spreads packets as on a GPU.
    pub fn spread(self) -> Self {
        Self::new(self.subgroup, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_of_a_packet_fit_into_the_smallest_subgroup() {
        let of = |subgroup, is_software| {
            let lanes = Lanes::new(subgroup, is_software);
            (lanes.group, lanes.several_groups, lanes.of_packet)
        };
        assert_eq!(of((8, 8), true), (8, false, 1), "software");
        assert_eq!(of((16, 16), true), (4, true, 1), "software with wide registers");
        assert_eq!(of((4, 4), true), (4, false, 1), "and with narrow ones");
        assert_eq!(of((32, 32), false), (8, true, 16), "a GPU");
        assert_eq!(of((8, 32), false), (8, true, 8), "one whose driver chooses");
        assert_eq!(of((4, 16), false), (4, true, 1), "one that may choose too few");
        assert_eq!(Lanes::new((8, 8), true).spread(), Lanes::new((8, 8), false));
    }
}
