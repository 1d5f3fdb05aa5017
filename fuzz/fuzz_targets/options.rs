//! Fuzz target: the words of a command line, one per line of the input, are parsed or refused with
//! exit code 2; then the settings that they give are checked.
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
#[path = "../../src/cli/merge_args.rs"]
mod merge_args;
#[path = "../../src/cli/options.rs"]
mod options;
#[path = "../../src/cli/pass_args.rs"]
mod pass_args;
#[path = "../../src/cli/study_args.rs"]
mod study_args;
#[path = "../../src/cli/values.rs"]
mod values;

fuzz_target!(|bytes: &[u8]| {
    let _ = any_words::check(bytes);
});
