//! Builds the cells over sorted photons, finest level first. Kernel: `build_grid`.

use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{CELL_FAN, CELL_PHOTONS, Cell, GridStep},
};

/// The compiled kernel.
#[derive(Debug)]
pub struct BuildGrid(Kernel);

impl BuildGrid {
    /// Compiles it.
    #[must_use]
    pub fn new(gpu: &Gpu) -> Self {
        Self(Kernel::new(gpu, "build_grid", &[]))
    }

    /// Builds the cells of `count` photons, which lie in segments of `segment` photons. Returns the
    /// cells and the number of levels.
    pub(crate) fn build(&self, gpu: &Gpu, positions: &[Buffer], segment: u32, count: u32) -> Result<(Buffer, u32)> {
        let sizes = level_sizes(count.div_ceil(CELL_PHOTONS));
        let base = |level: usize| sizes.iter().skip(level + 1).sum::<u32>();
        let cells = gpu.storage::<Cell>("cells", sizes.iter().map(|&n| u64::from(n)).sum())?;
        let mut encoder = gpu.encoder();
        for (level, &size) in sizes.iter().enumerate() {
            // The finest level reads photons, segment by segment; the others read cells.
            let segments = if level == 0 { positions.len() } else { 1 };
            let per_segment = if level == 0 { segment / CELL_PHOTONS } else { size };
            for (position, w) in positions[..segments].iter().zip(0..) {
                let first_cell = w * per_segment;
                let finer = level.checked_sub(1);
                let step = GridStep {
                    photons: count,
                    level: level as u32,
                    base: base(level),
                    finer_base: finer.map_or(0, base),
                    finer_count: finer.map_or(0, |l| sizes[l]),
                    first_cell,
                    cell_count: per_segment.min(size - first_cell),
                    pad: 0,
                };
                let uniform = gpu.uniform("grid step", &step);
                let buffers = [("positions", position), ("grid_cells", &cells), ("grid_step", &uniform)];
                self.0.dispatch(&mut encoder, &self.0.bind(gpu, &buffers), step.cell_count.into());
            }
        }
        gpu.submit(encoder);
        Ok((cells, sizes.len() as u32))
    }
}

/// Number of cells of each level, from the finest to the single coarsest cell; empty without
/// photons.
fn level_sizes(finest: u32) -> Vec<u32> {
    let coarser = |&n: &u32| (n > 1).then(|| n.div_ceil(CELL_FAN));
    std::iter::successors((finest > 0).then_some(finest), coarser).collect()
}

#[cfg(test)]
mod tests {
    use super::level_sizes;

    #[test]
    fn levels_end_in_one_cell() {
        assert!(level_sizes(0).is_empty());
        assert_eq!(level_sizes(1), [1]);
        assert_eq!(level_sizes(8), [8, 1]);
        assert_eq!(level_sizes(9), [9, 2, 1]);
    }
}
