//! The radiance estimate: the search for the nearest photons, their sum, estimates that visible
//! points share, and those kept for the ends of rays.

mod cell_table;
pub mod gather;
mod gather_kernels;
pub mod irradiance_cache;
pub mod irradiance_records;
mod query_order;
mod record_walls;
pub mod share_estimates;
pub mod thin_queries;

#[doc(hidden)]
pub use cell_table::{PointEstimate, cell_hash};
pub use gather::{Gather, GatherOptions, GatherSettings};
pub use irradiance_cache::IrradianceCache;
pub use irradiance_records::{IrradianceRecords, Records, filter_footprint, record_spacing};
pub use share_estimates::{EstimateRequest, EstimateSharing, SharedPoints};
pub use thin_queries::QueryThinning;
