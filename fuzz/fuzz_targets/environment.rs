//! The bytes of an OpenEXR or Radiance HDR file: read, or refused in one line.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../tests/assets/any_environment.rs"]
mod any_environment;

fuzz_target!(|bytes: &[u8]| {
    let _ = any_environment::check(bytes);
});
