//! Triangles of lists, strips and fans (glTF 2.0, 3.7.2.1).

use gltf::json::mesh::Mode;

/// Number of triangles of `count` vertices; none for points and lines.
pub(super) fn triangle_count(mode: Mode, count: usize) -> Option<usize> {
    match mode {
        Mode::Triangles => Some(count / 3),
        Mode::TriangleStrip | Mode::TriangleFan => Some(count.saturating_sub(2)),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

/// Vertices of triangle `i`, in an order that preserves its front side.
pub(super) fn corners(mode: Mode, i: usize) -> [usize; 3] {
    match mode {
        Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
        Mode::TriangleFan => [i + 1, i + 2, 0],
        _ => [3 * i, 3 * i + 1, 3 * i + 2],
    }
}
