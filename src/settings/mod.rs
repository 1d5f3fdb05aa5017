//! Settings of a render, by stage. Every value has a unit, a range and a default.

mod estimate;
mod layers;
mod lights;
mod loading;
mod passes;
mod photons;
mod picture;
mod pixel_grid;
mod quality;
mod range;
mod render_settings;

pub use estimate::{EstimateSettings, Search};
pub use layers::ExtraLayers;
pub use lights::{LightSampling, LightSettings, LightUnit};
pub use loading::LoadOptions;
pub use passes::{PassRange, PassSettings};
pub use photons::{Emission, MAX_BOUNCES, Mode, PhotonSettings, Sampler};
pub use picture::{Crop, PictureSettings};
pub use pixel_grid::PixelGrid;
pub use quality::Quality;
pub use range::{Number, Range};
pub use render_settings::Settings;
pub(crate) use render_settings::{check_samples, first_extra_sample, square_bits};
