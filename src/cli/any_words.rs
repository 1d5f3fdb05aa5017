//! Check of arbitrary command lines, shared by the fuzz target `options` and the replay of its
//! corpus.

use caustica::settings::Settings;
use clap::Parser as _;

use super::args::{Args, Command};

/// Parses the words, one a line, as the arguments of `caustica`. Panics unless invalid arguments
/// are refused with exit code 2 and a text (help is a text with exit code 0), and settings out of
/// range in one line. Returns the text of the refusal.
pub fn check(bytes: &[u8]) -> Result<(), String> {
    let text = String::from_utf8_lossy(bytes);
    match Args::try_parse_from(["caustica"].into_iter().chain(text.lines())) {
        Ok(args) => settings(&args.command).map_or(Ok(()), |settings| check_settings(&settings)),
        Err(error) => {
            let (code, text) = (error.exit_code(), error.render().to_string());
            assert!(!text.is_empty() && code == if error.use_stderr() { 2 } else { 0 }, "{code}: {text}");
            Err(text)
        }
    }
}

fn settings(command: &Command) -> Option<Settings> {
    match command {
        Command::Render(args) => Some(args.settings()),
        Command::Compare(args) => Some(args.options.settings(Settings::default())),
        Command::Study(args) => Some(args.options.settings(Settings::default())),
        Command::Merge(_) | Command::Status(_) | Command::Devices | Command::Info { .. } => None,
    }
}

fn check_settings(settings: &Settings) -> Result<(), String> {
    let checked = settings.check().map_err(|error| error.to_string());
    if let Err(text) = &checked {
        assert!(!text.is_empty() && !text.contains('\n'), "one line: {text}");
    }
    checked
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, fs, path::Path};

    use clap::CommandFactory as _;

    use super::{Args, check};

    const DICTIONARY: &str = include_str!("../../fuzz/options.dict");

    /// Commands and flags that a dictionary of libFuzzer has.
    fn words(dictionary: &str) -> BTreeSet<String> {
        let words = dictionary.lines().flat_map(|line| line.trim_matches('"').split("\\x0a"));
        let known = words.filter(|word| word.starts_with("--") || word.chars().all(char::is_alphabetic));
        known.map(str::to_owned).collect()
    }

    #[test]
    fn the_dictionary_has_all_commands_and_flags() {
        let mut command = Args::command();
        command.build();
        let subcommands = || command.get_subcommands().filter(|sub| sub.get_name() != "help");
        let flags = subcommands().flat_map(clap::Command::get_arguments).filter_map(clap::Arg::get_long);
        let flags: BTreeSet<String> = flags.map(|flag| format!("--{flag}")).collect();
        let commands: BTreeSet<String> = subcommands().map(|sub| sub.get_name().to_owned()).collect();
        let asked: Vec<_> = flags.union(&commands).cloned().collect();
        let missing = |dictionary: &str| -> Vec<String> {
            let words = words(dictionary);
            asked.iter().filter(|word| !words.contains(*word)).cloned().collect()
        };
        assert!(flags.len() > 60 && commands.len() == 7, "{asked:?}");
        assert_eq!(missing(DICTIONARY), [""; 0]);
        assert_eq!(missing(&DICTIONARY.replace("--share", "--shore")), ["--share"], "control");
        let unknown: Vec<String> =
            words(DICTIONARY).into_iter().filter(|word| word.starts_with("--") && !flags.contains(word)).collect();
        assert_eq!(unknown, [""; 0]);
    }

    #[test]
    fn words_of_the_corpus_are_understood_or_refused() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/options");
        let (mut understood, mut refused) = (0, 0);
        for entry in fs::read_dir(folder).expect("can be listed") {
            let path = entry.expect("an entry").path();
            println!("{}", path.display());
            match check(&fs::read(&path).expect("can be read")) {
                Ok(()) => understood += 1,
                Err(_) => refused += 1,
            }
        }
        assert!(understood >= 10 && refused >= 4, "{understood} understood, {refused} refused");
    }
}
