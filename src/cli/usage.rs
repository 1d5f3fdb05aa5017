//! Wrong usage that no single argument shows.

use std::{collections::HashSet, path::PathBuf};

use caustica::settings::Settings;
use clap::{CommandFactory, error::ErrorKind};

use super::{
    args::{Args, Command, CompareArgs, RenderArgs},
    files::identity,
    flags::with_flags,
    merge_args::MergeArgs,
    render::{jobs, outputs},
};

/// Refuses options that do not go together.
pub fn check(command: &Command) -> Result<(), clap::Error> {
    let (name, problem) = match command {
        Command::Render(args) => ("render", of_render(args)),
        Command::Compare(args) => ("compare", of_compare(args)),
        Command::Merge(args) => ("merge", of_merge(args)),
        _ => return Ok(()),
    };
    let Some(problem) = problem else { return Ok(()) };
    let mut command = Args::command();
    command.build();
    let usage_of = command.find_subcommand_mut(name).expect("this is its check");
    Err(usage_of.error(ErrorKind::ArgumentConflict, problem))
}

/// Two outputs that are one file, several scenes without a folder for their pictures, and settings
/// that exclude each other.
fn of_render(args: &RenderArgs) -> Option<String> {
    // A negative number is no option, and reads like one more scene.
    if let Some(stray) = args.scenes[1..].iter().find(|scene| scene.to_string_lossy().starts_with('-')) {
        return Some(format!("unexpected argument '{}' found", stray.display()));
    }
    if args.scenes.len() > 1 && args.output_dir.is_none() {
        return Some(format!("{} scenes need --output-dir for their pictures", args.scenes.len()));
    }
    twice(jobs(args).iter().flat_map(|job| outputs(args, job))).or_else(|| of_settings(&args.settings()))
}

fn of_compare(args: &CompareArgs) -> Option<String> {
    of_settings(&args.options.settings(Settings::default()))
}

fn of_merge(args: &MergeArgs) -> Option<String> {
    twice(args.outputs.iter())
}

/// An output that is another one as well.
fn twice<'a>(outputs: impl Iterator<Item = &'a PathBuf>) -> Option<String> {
    let (mut known, mut outputs) = (HashSet::new(), outputs);
    outputs
        .find(|path| !known.insert(identity(path)))
        .map(|path| format!("{} is another output as well", path.display()))
}

/// A setting that is refused whatever the scene, in the words of the options.
fn of_settings(settings: &Settings) -> Option<String> {
    let line = with_flags(&format!("error: {}", settings.check().err()?));
    line.strip_prefix("error: ").map(str::to_owned)
}
