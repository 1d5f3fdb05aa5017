//! Limits of a scene's size, checked before allocation.

use super::fault::{Read, fault};
use crate::memory::available;
use crate::scene::Attributes;

/// Maximum number of triangles, with which indices of nodes and primitives fit into 28 bits, and
/// those of corners into 32.
const MAX_TRIANGLES: usize = 100_000_000;

/// Memory per triangle from mesh to hierarchy, bytes.
const BYTES_PER_TRIANGLE: u64 = 400;

/// Memory per triangle that has attributes, bytes: those of its corners, a copy of them where
/// triangles are left out, and one on the way to the device.
const BYTES_PER_ATTRIBUTES: u64 = 3 * size_of::<Attributes>() as u64;

/// Refuses more triangles than the limits permit, some of them with attributes.
pub(super) fn check(triangles: usize, with_attributes: usize) -> Read<()> {
    if triangles > MAX_TRIANGLES {
        return fault("scene", format!("{triangles} triangles, at most {MAX_TRIANGLES} are read"));
    }
    let needed = triangles as u64 * BYTES_PER_TRIANGLE + with_attributes as u64 * BYTES_PER_ATTRIBUTES;
    match available() {
        Some(bytes) if needed > bytes => {
            let (needed, bytes) = (needed >> 20, bytes >> 20);
            fault("scene", format!("{triangles} triangles need about {needed} MiB of memory, {bytes} MiB are free"))
        }
        _ => Ok(()),
    }
}

/// Maximum number of triangles with those of all instances, so that each has a number of 28 bits;
/// boxes that splitting adds are left room for.
const MAX_SHOWN: usize = 260_000_000;

/// Refuses more triangles, those of each instance counted, than can be numbered.
pub(super) fn check_shown(triangles: usize) -> Read<()> {
    if triangles > MAX_SHOWN {
        return fault(
            "scene",
            format!("{triangles} triangles with those of all instances, at most {MAX_SHOWN} are read"),
        );
    }
    Ok(())
}

/// Memory per texel, bytes: RGBA, a copy with smaller versions on the way to the device, and there
/// where the device has no memory of its own.
const BYTES_PER_TEXEL: u64 = 4 + 6 + 6;
/// Memory per texel while an image is decoded, bytes: of 16 bits a channel at most.
const BYTES_PER_DECODED_TEXEL: u64 = 12;

/// Refuses images of those sizes for which there is no memory. Sides longer than `longest` are
/// halved when they have been decoded.
pub(super) fn check_images(sizes: &[[u32; 2]], longest: Option<u32>) -> Read<()> {
    let texels =
        |[width, height]: [u32; 2], halvings: u32| u64::from(width >> halvings) * u64::from(height >> halvings);
    let halvings = |size: [u32; 2]| {
        let side = size[0].max(size[1]);
        (0..).find(|n| longest.is_none_or(|longest| side >> n <= longest)).unwrap_or(0)
    };
    let kept: u64 = sizes.iter().map(|size| texels(*size, halvings(*size))).sum();
    let mut decoded: Vec<u64> = sizes.iter().map(|size| texels(*size, 0)).collect();
    decoded.sort_unstable();
    let at_once: u64 = decoded.iter().rev().take(rayon::current_num_threads()).sum();
    let needed = BYTES_PER_TEXEL * kept + BYTES_PER_DECODED_TEXEL * at_once;
    match available() {
        Some(bytes) if needed > bytes => {
            let (needed, bytes) = (needed >> 20, bytes >> 20);
            let advice = "`load.texture_size` makes them smaller";
            let problem = format!("{kept} texels need about {needed} MiB of memory, {bytes} MiB are free; {advice}");
            fault("images", problem)
        }
        _ => Ok(()),
    }
}
