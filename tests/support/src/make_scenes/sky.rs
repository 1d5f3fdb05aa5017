//! Balls and a block in the open, and the sky as an environment map of its own for `--env`.

use glam::Vec3;
use image::{Rgb, codecs::hdr::HdrEncoder};

use super::{
    builder::Builder,
    room::{Quad, add_block, add_quads},
};

/// Size of the map, pixels.
const WIDTH: u32 = 128;
const HEIGHT: u32 = 64;
/// Pixel of the sun: 32 degrees above the horizon, behind the camera on its right.
const SUN: (u32, u32) = (86, 20);
/// Radiance of the sun's pixel, W/(m² sr).
const SUN_RADIANCE: [f32; 3] = [1200.0, 1050.0, 800.0];

/// A mirror ball, a glass ball and a block on a square of ground.
pub fn scene() -> Builder {
    let mut b = Builder::new("sky");
    let (ground, white) = (b.diffuse("ground", [0.5, 0.46, 0.4]), b.diffuse("white", [0.725, 0.71, 0.68]));
    let (mirror, glass) = (b.mirror("mirror"), b.glass("glass", 1.5));
    add_quads(&mut b, "ground", &[Quad(Vec3::new(-2.5, 0.0, -2.5), 5.0 * Vec3::Z, 5.0 * Vec3::X)], ground);
    add_block(&mut b, white);
    b.sphere("mirror ball", Vec3::new(-0.7, 0.35, 0.55), 0.35, mirror);
    b.sphere("glass ball", Vec3::new(0.55, 0.4, 0.35), 0.4, glass);
    b.camera(Vec3::new(0.0, 1.3, 4.5), -9.0, 36.0, 1.0);
    b
}

/// Unit vector to the centre of the sun's pixel: u = 0.5 + atan2(z, x)/2π, v = acos(y)/π.
pub fn sun_direction() -> Vec3 {
    let (u, v) = ((SUN.0 as f32 + 0.5) / WIDTH as f32, (SUN.1 as f32 + 0.5) / HEIGHT as f32);
    let (sin, cos) = (std::f32::consts::TAU * (u - 0.5)).sin_cos();
    let (radius, height) = (std::f32::consts::PI * v).sin_cos();
    Vec3::new(radius * cos, height, radius * sin)
}

/// The sky as a Radiance file: blue above, bright at the horizon, brown below, and the sun.
pub fn picture() -> Vec<u8> {
    let row = |y: u32| {
        let height = (std::f32::consts::PI * (y as f32 + 0.5) / HEIGHT as f32).cos();
        let (zenith, horizon, ground) =
            (Vec3::new(0.15, 0.3, 0.65), Vec3::new(0.75, 0.8, 0.85), Vec3::new(0.16, 0.13, 0.1));
        if height > 0.0 { horizon.lerp(zenith, height.sqrt()) } else { ground }
    };
    let pixel = |i: u32| if (i % WIDTH, i / WIDTH) == SUN { SUN_RADIANCE } else { row(i / WIDTH).to_array() };
    let pixels: Vec<_> = (0..WIDTH * HEIGHT).map(|i| Rgb(pixel(i))).collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(&pixels, WIDTH as usize, HEIGHT as usize).expect("a Vec can be written");
    bytes
}
