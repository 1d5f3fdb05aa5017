//! Fuzz target: the bytes of a .gltf or .glb file are read, or refused with a message of one line.
//! Mutations keep the JSON well formed; otherwise few inputs would pass its parser.
#![no_main]

use libfuzzer_sys::{fuzz_mutator, fuzz_target};

#[path = "../src/gltf_mutator.rs"]
mod gltf_mutator;

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    gltf_mutator::mutate(data, size, max_size, seed)
});

fuzz_target!(|bytes: &[u8]| {
    let _ = support::any_scene::check(bytes);
});
