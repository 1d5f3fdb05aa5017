//! The camera pass: tiles, visible points, lobes, first hits, rays of final gathering.

use bytemuck::{Pod, Zeroable};

use super::limits::MEDIA_WORDS;

/// [`VisiblePoint::next_map`] of a point for which irradiance kept in cells will do.
pub const BY_CELL: u32 = 1 << 16;

/// A visible point: where a camera path hit a diffuse surface, and the outgoing light is sought.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VisiblePoint {
    /// Metres.
    pub position: [f32; 3],
    /// 0: no point. Otherwise the first map, from 1, that is not gathered here yet, or [`BY_CELL`].
    pub next_map: u32,
    /// Weight of the camera path times the BRDF, albedo/π: multiplies irradiance.
    pub weight: [f32; 3],
    /// Distance along `ng` by which the origin of a ray must be moved off the surface, metres.
    pub offset: f32,
    /// Geometric normal, unit, on the viewer's side.
    pub ng: [f32; 3],
    /// Media around the point: up to eight slots plus one, 8 bits each; 0 and 0 for none. All bits
    /// are set where there are more.
    pub media_low: u32,
    /// Interpolated normal, unit, on the viewer's side of the geometric one.
    pub ns: [f32; 3],
    pub media_high: u32,
    /// Unit, to the viewer.
    pub view: [f32; 3],
    /// Layers above the diffuse lobe, eight bits each: roots of the reflectances of a coat along
    /// the normal and at grazing angles, strongest colour of the sheen and its roughness. 0 for
    /// nothing.
    pub above: u32,
}

/// Vertex of a camera path at which rough lobes are lit. Unit vectors are octahedral, see
/// [`octahedral`](super::octahedral()); `ng` and `ns` as in [`VisiblePoint`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LobePoint {
    /// Metres.
    pub position: [f32; 3],
    /// Same as in [`VisiblePoint`].
    pub offset: f32,
    /// Weight of the path before the lobe.
    pub beta: [f32; 3],
    /// n_b/n_a of rough glass, negative for a sheet of it; 0 for lobes that only reflect.
    pub eta: f32,
    pub ng: u32,
    pub ns: u32,
    /// Direction to the viewer.
    pub view: u32,
    pub tangent: u32,
    /// Halves, as all that follow: reflectance along the normal; of rough glass the tint of what is
    /// transmitted.
    pub f0: [u32; 2],
    /// Reflectance at grazing angles; of rough glass the members of its film.
    pub f90: [u32; 2],
    /// Factor of light that is reflected more than once.
    pub compensation: [u32; 2],
    /// Colour and roughness of the sheen.
    pub sheen: [u32; 2],
    /// Widths of GGX along the tangent and across it.
    pub alpha: u32,
    /// Strength of the clear coat and its width.
    pub clearcoat: u32,
    /// Octahedral, as the others.
    pub clearcoat_normal: u32,
    pub pad: u32,
}

/// A camera, and the samples of one tile; see `shaders/lib/camera/camera_tile.wesl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CameraTile {
    pub position: [f32; 3],
    pub seed: u32,
    /// Vector from the centre of the picture, at distance 1, to its right edge.
    pub right: [f32; 3],
    pub width: u32,
    /// Vector from the centre of the picture, at distance 1, to its upper edge.
    pub up: [f32; 3],
    pub height: u32,
    /// Unit direction of view.
    pub forward: [f32; 3],
    /// Samples per pixel of the whole picture.
    pub spp: u32,
    /// Pixel of the tile's upper left corner.
    pub first_column: u32,
    pub first_row: u32,
    /// First sample of each pixel, and samples of each pixel, in this tile. Of rays of final
    /// gathering, the first of each point, and how many of each follow each other.
    pub first_sample: u32,
    pub samples: u32,
    /// 0: paths start at the camera. 1: they are rays of final gathering; 2: such rays that see
    /// gleams as well, lights by way of mirrors, metal and glass.
    pub gathers: u32,
    /// Path slots per sample, a power of 2: where a path may go on in two ways, both are followed
    /// while it has slots for them.
    pub branches: u32,
    /// Pixels of the tile, in Morton order.
    pub pixels: u32,
    /// 1: rays are parallel and `right`, `up` are in metres; 0: they start from `position`.
    pub parallel: u32,
    /// Radius of the lens, metres; 0 for a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane of focus along the camera's axis, metres.
    pub focus: f32,
    /// Entries of the pixel filter's table, less 1.
    pub filter_steps: u32,
    /// Samples in the tile's margin. They follow those of its pixels.
    pub margin: u32,
    /// Media around the start of the rays, as in [`Light::media`](super::Light::media).
    pub media: [u32; MEDIA_WORDS],
    /// Depths along the axis between which the camera sees, metres.
    pub near_depth: f32,
    pub far_depth: f32,
    /// Depth at which parallel rays start, metres, at most 0.
    pub start_depth: f32,
    /// Width of what a sample sees by rough lobes, metres, from which on irradiance kept in cells
    /// will do; 0: nowhere.
    pub cells_from: f32,
    /// 0: the tile's pixels are all of a square. 1: a list of some of them.
    pub listed: u32,
    /// Where that list begins; of rays, the list of keys of their points.
    pub listed_at: u32,
    /// Of a picture of one pixel of each square cell, [`PixelGrid`](crate::settings::PixelGrid):
    /// the side of a cell less 1, and pixels by which that of the next cell is shifted.
    /// `first_column` and `first_row` then count cells.
    pub left_out: u32,
    pub shift: u32,
    /// Binary logarithm of the side of squares of pixels whose samples are one set of random
    /// numbers, pixels in Morton order; 0: the samples of each pixel are a set. Those from
    /// [`Self::spp`] on always are.
    pub square_bits: u32,
    /// Bright patches that rays of final gathering are aimed at.
    pub patches: u32,
    /// Irradiance by all but these patches on average, in the units of [`BrightPatch::power`].
    pub other_light: f32,
    /// 1: paths that show them blurred see a base and what lies above it as one diffuse lobe.
    pub merges_layers: u32,
    /// Bright patches that rays of rough lobes are aimed at: the same, gleams, and lamps in glass.
    pub lobe_patches: u32,
    /// 1: glass beyond wide lobes is as narrow as it is, for these aim at lamps in it.
    pub sharp_glass: u32,
    /// Of wide coats, rays of final gathering of their point bring the light. 0: no; 1: but for
    /// lights by way of mirrors and glass, see `GATHERED_COAT`; 2: there are no such.
    pub gathers_coats: u32,
    pub pad2: u32,
}

/// Veils, surfaces of an opacity between 0 and 1, that a camera path passes at most before it draws
/// which of the others it meets.
pub const MOST_VEILS: u32 = 16;

/// [`FirstHit::material`] where nothing is seen.
pub const NO_MATERIAL: u32 = u32::MAX;

/// First hit of a camera sample. Behind veils there are several: numbers are their means, weighted
/// by what each covers of those behind it, the primitive and its material those of one that is
/// drawn by these weights.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FirstHit {
    /// Interpolated normal towards the viewer; 0 if nothing was hit.
    pub normal: [f32; 3],
    /// Distance along the camera's axis, metres.
    pub depth: f32,
    pub albedo: [f32; 3],
    /// Sum of the weights: 1 if something was hit that covers all behind it.
    pub alpha: f32,
    /// Relative to the scene's centre, metres.
    pub position: [f32; 3],
    /// Index of the primitive in the scene, unless `instance` is above 0; no number to add up, as
    /// those below `uv`.
    pub id: u32,
    /// First set of texture coordinates; 0 without textures.
    pub uv: [f32; 2],
    /// Index of its instance plus one; 0 for none.
    pub instance: u32,
    pub material: u32,
}

/// Rows of four numbers that a camera sample writes for the output layers: those of [`FirstHit`].
pub const LAYER_ROWS: usize = 4;

/// Arguments of `start_final_gather` and `sum_final_gather`: some rays of the chosen points.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FinalStep {
    /// Index of the first ray of each point, how many follow each other in this step, and how many
    /// each point has in all.
    pub first_ray: u32,
    pub rays_now: u32,
    pub rays: u32,
    /// Chosen points.
    pub chosen: u32,
    /// Of the directions in which they start.
    pub seed: u32,
    /// 1: they bring irradiance by the geometric normal, and what the point's coat reflects of it.
    pub for_records: u32,
    pub pad1: u32,
    pub pad2: u32,
}

/// [`CameraTile::gathers`] of rays of final gathering that see gleams.
pub const SEES_GLEAMS: u32 = 2;

/// [`CameraTile::gathers_coats`] where no light comes by way of mirrors and glass.
pub const NO_LIGHTS_LEFT: u32 = 2;

/// Bright patches of a picture at most, gleams and lamps in glass among them.
pub const MAX_PATCHES: usize = 160;

/// A small part of a surface from which much light comes: an ellipse, or a disc that faces all
/// points.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BrightPatch {
    /// Centre, metres.
    pub position: [f32; 3],
    /// The greatest, metres.
    pub radius: f32,
    /// Unit, on the bright side; 0: it faces all points.
    pub normal: [f32; 3],
    /// Radiance times area.
    pub power: f32,
    /// Unit, the direction of the greatest radius.
    pub tangent: [f32; 3],
    /// The least, metres.
    pub narrow: f32,
}

/// Sums over the rays of final gathering of a point, by the directions from which light of each
/// colour arrives.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ArrivingLight {
    /// Directions weighted by radiance, and 1 by irradiance.
    pub red: [f32; 4],
    pub green: [f32; 4],
    pub blue: [f32; 4],
    /// Radiance from all directions alike, of each colour.
    pub fluence: [f32; 3],
    /// Inverse distances to what was hit, 1/m.
    pub nearness: f32,
    /// Of a coat, over its albedo: radiance that it reflects to the viewer, W/(m² sr), and inverse
    /// distances to what was hit, as it sees them, 1/m. The latter is 0 where there is no such
    /// coat.
    pub coat: [f32; 4],
}

/// Sums over a tile's samples of one pixel, by rows. The first row is the radiance, and the number
/// of samples left out of it because the sum would not be finite with them. Then follow the rows of
/// the samples, and the squares of their radiance.
pub type PixelSums = [[f32; 4]; LAYER_ROWS + 2];
