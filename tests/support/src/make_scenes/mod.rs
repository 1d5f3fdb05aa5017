//! The repository's scenes; `cargo run --release --example make_scenes` writes them.

use glam::Vec3;

mod builder;
mod json;
mod room;
pub mod sky;
mod water;

use builder::Builder;
use room::{Quad, add_block, add_quads, add_room};

/// Name and content of every file.
pub fn files() -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<(String, Vec<u8>)> = [
        ("mirror-and-glass", mirror_and_glass()),
        ("diffuse", diffuse()),
        ("diffuse-in-glass", diffuse_in_glass()),
        ("one-light", lit_room(&[Vec3::new(0.0, 1.7, 0.0)])),
        ("area-light", area_light()),
        ("spot", spot()),
        ("sky", sky::scene()),
        ("three-lights", lit_room(&[Vec3::new(0.0, 1.7, 0.0), Vec3::new(-0.7, 1.4, 0.6), Vec3::new(0.7, 1.0, 0.7)])),
    ]
    .into_iter()
    .map(|(name, builder)| (format!("{name}.gltf"), builder.finish(None).0))
    .collect();
    let (gltf, bin) = water::scene().finish(Some("water.bin"));
    files.extend([("water.gltf".to_owned(), gltf), ("water.bin".to_owned(), bin)]);
    files.push(("sky.hdr".to_owned(), sky::picture()));
    files
}

/// Mirror sphere and glass sphere in the room.
fn mirror_and_glass() -> Builder {
    let mut b = Builder::new("mirror and glass");
    add_room(&mut b);
    let (mirror, glass) = (b.mirror("mirror"), b.glass("glass", 1.5));
    b.sphere("mirror ball", Vec3::new(-0.45, 0.4, -0.4), 0.4, mirror);
    b.sphere("glass ball", Vec3::new(0.45, 0.4, 0.35), 0.4, glass);
    b.light("light", Vec3::new(0.0, 1.7, 0.0), 1.5);
    b
}

/// A block and a ball, all diffuse.
fn diffuse() -> Builder {
    let mut b = Builder::new("diffuse");
    let white = add_room(&mut b);
    add_block(&mut b, white);
    b.sphere("ball", Vec3::new(0.42, 0.35, 0.3), 0.35, white);
    b.light("light", Vec3::new(0.0, 1.7, 0.0), 1.5);
    b
}

/// A diffuse ball inside a glass ball.
fn diffuse_in_glass() -> Builder {
    let mut b = Builder::new("diffuse in glass");
    add_room(&mut b);
    let (glass, blue) = (b.glass("glass", 1.5), b.diffuse("blue", [0.2, 0.35, 0.7]));
    b.sphere("glass ball", Vec3::new(0.0, 0.6, 0.0), 0.55, glass);
    b.sphere("inner ball", Vec3::new(0.0, 0.6, 0.0), 0.3, blue);
    b.light("light", Vec3::new(-0.3, 1.75, 0.3), 1.5);
    b
}

/// A glass ball and a block in the room, under an emissive square of 0.25 m² that faces down from
/// the ceiling.
fn area_light() -> Builder {
    let mut b = Builder::new("area light");
    let white = add_room(&mut b);
    add_block(&mut b, white);
    let (glass, lamp) = (b.glass("glass", 1.5), b.emissive("lamp", 0.8, [1.0, 0.85, 0.6], 30.0));
    b.sphere("glass ball", Vec3::new(0.42, 0.35, 0.3), 0.35, glass);
    let corner = Vec3::new(-0.25, 1.98, -0.25);
    add_quads(&mut b, "lamp", &[Quad(corner, 0.5 * Vec3::X, 0.5 * Vec3::Z)], lamp);
    b
}

/// A warm spot from the ceiling onto a glass ball, and a cool sun through the room's open front.
fn spot() -> Builder {
    let mut b = Builder::new("spot");
    let white = add_room(&mut b);
    add_block(&mut b, white);
    let (glass, ball) = (b.glass("glass", 1.5), Vec3::new(0.42, 0.35, 0.3));
    b.sphere("glass ball", ball, 0.35, glass);
    b.spot("spot", [Vec3::new(-0.5, 1.95, 0.6), ball], 12.0, [1.0, 0.8, 0.5], [14.0, 24.0]);
    b.sun("sun", Vec3::new(-0.5, -0.5, -0.8), 2.5, [0.6, 0.75, 1.0]);
    b
}

/// The same room under any number of lights of the same power.
fn lit_room(lights: &[Vec3]) -> Builder {
    let mut b = Builder::new(if lights.len() == 1 { "one light" } else { "three lights" });
    let white = add_room(&mut b);
    add_block(&mut b, white);
    let glass = b.glass("glass", 1.5);
    b.sphere("glass ball", Vec3::new(0.42, 0.35, 0.3), 0.35, glass);
    for (i, light) in lights.iter().enumerate() {
        b.light(&format!("light {}", i + 1), *light, 0.8);
    }
    b
}
