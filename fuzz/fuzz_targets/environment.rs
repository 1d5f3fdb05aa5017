//! Fuzz target: the bytes of an OpenEXR or Radiance HDR file are read, or refused with a message of
//! one line.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = support::any_environment::check(bytes);
});
