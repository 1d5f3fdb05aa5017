//! Words of a command line, one a line of the input: understood, or refused with exit code 2; then the settings that they
//! make.
#![no_main]
#![allow(dead_code, reason = "the command's arguments, of which a target uses a part")]

use libfuzzer_sys::fuzz_target;

#[path = "../../src/cli/any_words.rs"]
mod any_words;
#[path = "../../src/cli/args.rs"]
mod args;
#[path = "../../src/cli/environment.rs"]
mod environment;
#[path = "../../src/cli/loading.rs"]
mod loading;
#[path = "../../src/cli/options.rs"]
mod options;
#[path = "../../src/cli/study_args.rs"]
mod study_args;
#[path = "../../src/cli/values.rs"]
mod values;

fuzz_target!(|bytes: &[u8]| {
    let _ = any_words::check(bytes);
});
