//! Limits of a scene's size, checked before allocation.

use super::fault::{Read, fault};
use crate::memory::available;

/// Maximum number of triangles, with which indices of nodes and primitives fit into 28 bits, and
/// those of corners into 32.
const MAX_TRIANGLES: usize = 100_000_000;

/// Memory per triangle from mesh to hierarchy, bytes.
const BYTES_PER_TRIANGLE: u64 = 400;

/// Refuses more triangles than the limits permit.
pub(super) fn check(triangles: usize) -> Read<()> {
    if triangles > MAX_TRIANGLES {
        return fault("scene", format!("{triangles} triangles, at most {MAX_TRIANGLES} are read"));
    }
    let needed = triangles as u64 * BYTES_PER_TRIANGLE;
    match available() {
        Some(bytes) if needed > bytes => {
            let (needed, bytes) = (needed >> 20, bytes >> 20);
            fault("scene", format!("{triangles} triangles need about {needed} MiB of memory, {bytes} MiB are free"))
        }
        _ => Ok(()),
    }
}
