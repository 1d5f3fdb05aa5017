//! The command line: arguments in, files and messages out. Uses the public library only.

#[cfg(test)]
mod any_words;
mod args;
mod bugs;
mod compare;
mod devices;
mod environment;
mod failures;
mod files;
mod flags;
mod info;
mod loading;
mod merge;
mod merge_args;
mod options;
mod outlook;
mod pass_args;
mod pass_lines;
mod passes;
mod progress;
mod render;
mod say;
mod signals;
mod study;
mod study_args;
mod study_progress;
mod usage;
mod values;

use std::process::ExitCode;

use caustica::{Error, Result};
use clap::Parser;

use args::{Args, Command};

/// Runs the command of the arguments. Exit codes: 0 success, 1 failure of the work, 2 wrong usage,
/// 128 + signal number when stopped.
pub fn run() -> ExitCode {
    let args = Args::parse();
    usage::check(&args.command).unwrap_or_else(|error| error.exit());
    signals::watch();
    let error = match bugs::caught(|| work(args.command)) {
        Ok(Ok(())) => return ExitCode::SUCCESS,
        Ok(Err(Error::Stopped)) => return ExitCode::from(signals::exit_code()),
        Ok(Err(error)) => error.to_string(),
        Err(bug) => bug,
    };
    // Messages of drivers may have several lines; the user gets one.
    say::say(&format!("error: {}", error.lines().collect::<Vec<_>>().join(" ")));
    ExitCode::FAILURE
}

fn work(command: Command) -> Result<()> {
    match command {
        Command::Render(args) => render::render(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Status(args) => merge::status(&args),
        Command::Devices => devices::devices(),
        Command::Info { scene, loading, json, photons, device } => {
            info::info(&scene, &loading.options(), json, photons.then_some(device.as_deref()))
        }
    }
}
