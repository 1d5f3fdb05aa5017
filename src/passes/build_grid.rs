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

    /// The cells of `count` photons, which lie in windows of `window` each, and their number.
    pub(super) fn build(&self, gpu: &Gpu, places: &[Buffer], window: u32, count: u32) -> Result<(Buffer, u32)> {
        let finest = count.div_ceil(CELL_PHOTONS);
        let sizes = level_sizes(finest);
        let total = sizes.iter().sum();
        let cells = gpu.storage::<Cell>("cells", u64::from(total))?;
        let mut encoder = gpu.encoder();
        let mut steps = Vec::new();
        for (&size, level) in sizes.iter().zip(0..) {
            // The finest level reads photons, window by window; the others read cells.
            let windows = if level == 0 { places.len() } else { 1 };
            let per_window = if level == 0 { window / CELL_PHOTONS } else { size };
            for (place, w) in places[..windows].iter().zip(0..) {
                let first_cell = w * per_window;
                let cell_count = per_window.min(size - first_cell);
                let levels = sizes.len() as u32;
                let step = GridStep { photons: count, finest, level, levels, first_cell, cell_count };
                let step = gpu.uniform("grid step", &step);
                let buffers = [("places", place), ("grid_cells", &cells), ("grid_step", &step)];
                self.0.dispatch(&mut encoder, &self.0.bind(gpu, &buffers), cell_count.into());
                steps.push(step);
            }
        }
        gpu.submit(encoder);
        Ok((cells, total))
    }
}

/// Cells of each level, finest first, up to a single one; none for no photons.
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
        assert_eq!(level_sizes(4), [4, 1]);
        assert_eq!(level_sizes(5), [5, 2, 1]);
    }
}
