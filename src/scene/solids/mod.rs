//! Solids: which closed surfaces bound glass and liquids, and which of them fills the space that
//! several claim.
//!
//! A path is inside of a set of solids. One of them fills the space: the one of the highest rank.
//! Ranks follow `priority` of the material, then the size: the smaller solid is taken to lie in the
//! larger one, or to displace it. The set is a bit mask, in which solids that never meet share a
//! bit, a slot.

mod cavities;
mod closed_lamps;
mod covers;
mod dividers;
mod plates;
mod rank;
mod repair;
mod shells;
mod solid;
mod surfaces;
mod table;

pub(crate) use closed_lamps::hidden_backs;
pub(crate) use repair::{MeshRange, Surroundings, repair};
pub use solid::NO_SLOT;
pub(crate) use surfaces::Surfaces;
pub use table::Solids;
