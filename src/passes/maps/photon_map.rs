//! A photon map on the device: bind group 1 of every kernel that reads one
//! (`shaders/bindings/photon_map.wesl`).
//!
//! Photons come unsorted in a [`PhotonStore`]: segments of `array<Photon>`, each within one binding
//! (4,194,304 photons where a binding holds 128 MiB, so that up to that number there is one
//! segment). [`PhotonMap::build`] sorts them along a Hilbert curve of 20 bits per axis. It splits
//! each photon into the data that a search reads (`positions`: position and direction, 16 bytes)
//! and the data that only an estimate reads (`fluxes`, 16 bytes). Arrays that exceed a binding are
//! split into two segments.
//!
//! The grid is built over the sorted photons. A cell of the finest level holds 16 consecutive
//! photons of the curve, a coarser cell eight finer cells. Each has its exact bounds. Cells thus
//! follow the density of the photons at every scale: a caustic has small cells, an empty region
//! none, and photons at one point have cells of size zero.

use super::{
    build_grid::BuildGrid,
    photon_store::{MAX_SEGMENTS, PhotonStore, segment_elements, too_many},
    radix_sort::RadixSort,
    sort_photons::SortPhotons,
};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Table},
    layout::{MapInfo, PhotonFlux, PhotonPosition},
};

/// The kernels that build a map.
#[derive(Debug)]
pub struct MapKernels {
    sort: SortPhotons,
    radix: RadixSort,
    grid: BuildGrid,
    /// Photons per segment of the sorted map.
    segment: u32,
}

impl MapKernels {
    /// Compiles them.
    #[must_use]
    pub fn new(gpu: &Gpu) -> Self {
        Self::segmented(gpu, segment_elements::<PhotonPosition>(gpu))
    }

    /// Has them compiled ahead of their use.
    pub fn prefetch(gpu: &Gpu) {
        let _ = Self::new(gpu);
    }

    /// Compiles them for sorted maps in segments of `segment` photons, a power of two ≥ 64.
    #[must_use]
    pub fn segmented(gpu: &Gpu, segment: u32) -> Self {
        Self { sort: SortPhotons::new(gpu), radix: RadixSort::new(gpu), grid: BuildGrid::new(gpu), segment }
    }
}

/// Sorted photons and the grid over them.
#[derive(Debug)]
pub struct PhotonMap {
    count: u32,
    emitted: u64,
    info: Buffer,
    stored: Stored,
}

/// Where the arrays of a map lie: in buffers, or in tables where kernels read these faster.
#[derive(Debug)]
struct Stored {
    cells: Buffer,
    /// Segments of the photons.
    positions: Vec<Buffer>,
    fluxes: Vec<Buffer>,
    /// Cells, positions and fluxes.
    tables: [Table; 3],
}

impl Stored {
    fn new(gpu: &Gpu, cells: Buffer, positions: Vec<Buffer>, fluxes: Vec<Buffer>) -> Result<Self> {
        if !gpu.reads_images {
            let none = Table::new::<[u32; 4]>(gpu, "no table", &[])?;
            return Ok(Self { cells, positions, fluxes, tables: [none.clone(), none.clone(), none] });
        }
        let tables = [
            Table::copied(gpu, "cells", &[cells])?,
            Table::copied(gpu, "photon places", &positions)?,
            Table::copied(gpu, "photon fluxes", &fluxes)?,
        ];
        let none = || gpu.storage::<[u32; 4]>("no buffer", 1);
        Ok(Self { cells: none()?, positions: vec![none()?], fluxes: vec![none()?], tables })
    }
}

impl PhotonMap {
    /// Sorts the first `count` photons of `photons` and builds the grid. `emitted`: number of paths
    /// that they come from. The same photons give the same bits, whatever the device's schedule.
    ///
    /// # Errors
    /// [`crate::Error::Limit`] if the map does not fit the device, [`crate::Error::Gpu`] if the
    /// driver fails.
    pub fn build(gpu: &Gpu, kernels: &MapKernels, photons: PhotonStore, count: u32, emitted: u64) -> Result<Self> {
        let segment = kernels.segment;
        if count.div_ceil(segment) as usize > MAX_SEGMENTS {
            return Err(too_many(gpu, count.into()));
        }
        let entries = kernels.sort.order(gpu, &kernels.radix, &photons, count)?;
        let (mut positions, mut fluxes) = (Vec::new(), Vec::new());
        for first in (0..count.max(1)).step_by(segment as usize) {
            let size = u64::from(segment.min(count - first));
            positions.push(gpu.storage::<PhotonPosition>("photon places", size)?);
            fluxes.push(gpu.storage::<PhotonFlux>("photon fluxes", size)?);
        }
        kernels.sort.fetch(gpu, &entries, &photons, count, (&positions, &fluxes, segment));
        drop(entries);
        drop(photons);
        let (cells, levels) = kernels.grid.build(gpu, &positions, segment, count)?;
        let info = gpu.uniform("map info", &MapInfo { count, levels, split: segment, pad: 0 });
        let stored = Stored::new(gpu, cells, positions, fluxes)?;
        gpu.wait()?;
        Ok(Self { count, emitted, info, stored })
    }

    /// Photons in the map.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Paths that the flux is divided by.
    #[must_use]
    pub fn emitted(&self) -> u64 {
        self.emitted
    }

    /// Segments that the photons lie in, 1 or 2: the kernels' override `SEGMENTS`.
    #[must_use]
    pub fn segments(&self) -> u32 {
        self.stored.positions.len() as u32
    }

    /// The buffers of bind group 1 by name.
    #[must_use]
    pub fn bindings(&self) -> [(&'static str, &Buffer); 6] {
        let Stored { cells, positions, fluxes, .. } = &self.stored;
        let high = positions.len() - 1;
        [
            ("map_info", &self.info),
            ("cells", cells),
            ("positions_low", &positions[0]),
            ("positions_high", &positions[high]),
            ("fluxes_low", &fluxes[0]),
            ("fluxes_high", &fluxes[high]),
        ]
    }

    /// The tables of bind group 1 by name.
    #[must_use]
    pub fn tables(&self) -> [(&'static str, &Table); 3] {
        let [cells, positions, fluxes] = &self.stored.tables;
        [("cell_table", cells), ("position_table", positions), ("flux_table", fluxes)]
    }

    /// Device memory that it takes, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let Stored { cells, positions, fluxes, tables } = &self.stored;
        let buffers = positions.iter().chain(fluxes).chain([cells, &self.info]);
        buffers.map(|buffer| buffer.size()).sum::<u64>() + tables.iter().map(Table::bytes).sum::<u64>()
    }

    /// Reads the sorted photons back.
    ///
    /// # Errors
    /// [`crate::Error::Gpu`] if the driver fails.
    pub fn read(&self, gpu: &Gpu) -> Result<(Vec<PhotonPosition>, Vec<PhotonFlux>)> {
        let [_, positions, fluxes] = &self.stored.tables;
        if gpu.reads_images {
            return Ok((positions.read(gpu, self.count.into())?, fluxes.read(gpu, self.count.into())?));
        }
        let (mut positions, mut fluxes) = (Vec::new(), Vec::new());
        for (position, flux) in self.stored.positions.iter().zip(&self.stored.fluxes) {
            let left = u64::from(self.count) - positions.len() as u64;
            let size = left.min(position.size() / size_of::<PhotonPosition>() as u64);
            positions.extend(gpu.read::<PhotonPosition>(position, 0, size)?);
            fluxes.extend(gpu.read::<PhotonFlux>(flux, 0, size)?);
        }
        Ok((positions, fluxes))
    }
}
