//! Keys of the random numbers of rays of final gathering: by the point that they start from, so
//! that a pixel does not depend on which others are rendered beside it.

use super::{
    camera_tracer::CameraTracer,
    tile::{Tile, morton_number},
};
use crate::layout::CameraTile;

/// How the points of a picture share sets of numbers. The rays of a point always follow each other
/// in one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RaySets {
    /// A set for each pixel: the rays of its samples, and of its passes, follow each other.
    #[default]
    OfPixels,
    /// One set for a sample of all pixels: those of neighbours follow each other, so that they are
    /// spread as evenly as the rays of one point.
    OfPicture,
}

/// A point that rays start from.
#[derive(Clone, Copy, Debug)]
struct Start {
    /// Column and row in the picture.
    pixel: (u32, u32),
    /// Index of the sample of the pixel, and branch of its paths.
    sample: u32,
    branch: u32,
}

impl CameraTracer {
    /// For each of the chosen points of a tile the number of its first ray in a set, and that set.
    pub(super) fn ray_keys(&self, tile: &Tile, chosen: &[u32], rays: u32, sets: RaySets) -> Vec<[u32; 2]> {
        let view = &self.view;
        let start = |slot: u32| {
            let sample = slot / view.branches;
            let (column, row) = Self::place(tile, sample / tile.samples);
            let every = view.left_out + 1;
            let in_picture = |along: u32, other: u32| along * every + other * view.shift % every;
            Start {
                pixel: (in_picture(column, row), in_picture(row, column)),
                sample: tile.first_sample + sample % tile.samples,
                branch: slot % view.branches,
            }
        };
        chosen.iter().map(|&slot| key(view, start(slot), rays, sets)).collect()
    }
}

fn key(view: &CameraTile, start: Start, rays: u32, sets: RaySets) -> [u32; 2] {
    let (column, row) = start.pixel;
    let (point, set) = match sets {
        RaySets::OfPixels => (u64::from(start.sample), u64::from(row) * u64::from(view.width) + u64::from(column)),
        RaySets::OfPicture => (u64::from(morton_number(column, row)), u64::from(start.sample)),
    };
    let number = point * u64::from(rays);
    let set = set * u64::from(view.branches) + u64::from(start.branch);
    // Of large pictures, a set has the numbers of 32 bits several times, each for a set of its own.
    [number as u32, (set as u32) ^ ((number >> 32) as u32 ^ (set >> 32) as u32).reverse_bits()]
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    const RAYS: u32 = 16;

    fn keys(view: &CameraTile, sets: RaySets, columns: std::ops::Range<u32>) -> Vec<[u32; 2]> {
        let starts = columns.flat_map(|column| {
            let of_pixel = move |i: u32| Start { pixel: (column, 7), sample: i / 4, branch: i % 4 };
            (0..32).map(of_pixel)
        });
        starts.map(|start| key(view, start, RAYS, sets)).collect()
    }

    #[test]
    fn no_two_rays_have_one_key() {
        let view = CameraTile { width: 65_535, branches: 4, ..CameraTile::default() };
        for sets in [RaySets::OfPixels, RaySets::OfPicture] {
            for columns in [0..300, 65_000..65_535] {
                let keys = keys(&view, sets, columns);
                let rays = |key: &[u32; 2]| (0..RAYS).map(|ray| [key[0] + ray, key[1]]).collect::<Vec<_>>();
                let all: HashSet<[u32; 2]> = keys.iter().flat_map(rays).collect();
                assert_eq!(all.len(), keys.len() * RAYS as usize, "{sets:?}");
            }
        }
    }

    #[test]
    fn rays_that_are_averaged_follow_each_other() {
        let view = CameraTile { width: 256, branches: 1, ..CameraTile::default() };
        let at = |pixel, sample, sets| key(&view, Start { pixel, sample, branch: 0 }, RAYS, sets);
        let samples = [0, 1, 2].map(|sample| at((3, 5), sample, RaySets::OfPixels));
        assert_eq!(samples.map(|key| key[0]), [0, RAYS, 2 * RAYS]);
        assert!(samples.iter().all(|key| key[1] == samples[0][1]));
        let pixels = [(4, 4), (5, 4), (4, 5), (5, 5)].map(|pixel| at(pixel, 2, RaySets::OfPicture));
        assert_eq!(pixels.map(|key| key[0] / RAYS - pixels[0][0] / RAYS), [0, 1, 2, 3]);
        assert!(pixels.iter().all(|key| key[1] == pixels[0][1]));
        // Control: sets of pixels have no numbers in common.
        assert_ne!(at((4, 4), 0, RaySets::OfPixels)[1], at((5, 4), 0, RaySets::OfPixels)[1]);
    }
}
