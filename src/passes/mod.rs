//! The passes: host code that owns kernels and runs them, one folder per stage.

pub mod camera;
pub mod estimate;
pub mod lists;
pub mod maps;
pub mod photons;
pub mod wavefront;

pub use camera::{
    BrightPlaces, CameraKernels, CameraTracer, FinalGather, FinalRays, Further, Leg, RayEnd, StepCount, Tile,
    morton_number,
};
pub use estimate::{
    EstimateRequest, EstimateSharing, Gather, GatherOptions, GatherSettings, IrradianceCache, IrradianceRecords,
    PointEstimate, QueryThinning, Records, SharedPoints, filter_footprint, record_spacing,
};
pub use maps::{MapKernels, PhotonMap, PhotonStore};
pub use photons::{PathRange, PathRanges, PhotonTracer, RawMap, TracedPhotons};
