//! Translation of setting names in the library's messages to flags of the command.

/// Name of a setting or another input in the library's messages, and the flag that sets it.
type Row = (&'static str, &'static str);

/// Inputs that a message of the library can name.
const FLAGS: [Row; 44] = [
    ("device", "--device"),
    ("estimate.cone_constant", "--cone-constant"),
    ("estimate.kernel", "--kernel"),
    ("estimate.max_radius", "--max-radius"),
    ("estimate.neighbors", "-k"),
    ("estimate.radius", "--radius"),
    ("estimate.raw", "--raw-estimate"),
    ("estimate.search", "--search"),
    ("estimate.share_reach", "--share"),
    ("estimate.gather_radius", "--gather-radius"),
    ("estimate.gather_reach", "--gather-reach"),
    ("estimate.gather_spacing", "--gather-spacing"),
    ("estimate.irradiance_cells", "--irradiance-cells"),
    ("lights.photon_weights", "--light-photons"),
    ("lights.sampling", "--light-sampling"),
    ("lights.unit", "--light-unit"),
    ("load.allow_outside", "--allow-outside"),
    ("load.caustic_roughness", "--caustic-roughness"),
    ("load.ignore_required", "--ignore-required"),
    ("load.scene", "--scene"),
    ("load.single_scattering", "--single-scattering"),
    ("load.texture_size", "--texture-size"),
    ("load.variant", "--variant"),
    ("passes.alpha", "--alpha"),
    ("passes.range", "--passes"),
    ("photons.caustic", "--caustic-photons"),
    ("photons.emission", "--emission"),
    ("photons.final_gather", "--final-gather"),
    ("photons.global", "--photons"),
    ("photons.max_bounces", "--max-bounces"),
    ("photons.max_paths", "--max-paths"),
    ("photons.mode", "--mode"),
    ("photons.sampler", "--sampler"),
    ("photons.seed", "--seed"),
    ("picture.aperture", "--aperture"),
    ("picture.camera", "--camera"),
    ("picture.crop", "--crop"),
    ("picture.focus", "--focus"),
    ("picture.layers", "--layers"),
    ("picture.light_samples", "--light-samples"),
    ("picture.max_spp", "--max-spp"),
    ("picture.pixel_filter", "--pixel-filter"),
    ("picture.size", "--size"),
    ("picture.spp", "--spp"),
];

/// The environment has no flag of its own name: each of these three sets it.
const ENVIRONMENT: Row = ("scene.environment", "--env, --background or --default-light sky");

/// The library's function that writes parts, and the flags by which the command does.
const PARTS: Row = ("write_part", "render --part or --checkpoint");

/// Replaces the settings in a line by flags: "`picture.crop`" becomes "--crop". The name that
/// begins the message of a refused setting, as in "error: picture.spp 0: must be at least 1",
/// becomes the flag too.
pub fn with_flags(line: &str) -> String {
    FLAGS.iter().chain([&ENVIRONMENT, &PARTS]).fold(line.to_owned(), |line, (setting, flag)| {
        let line = line.replace(&format!("`{setting}`"), flag);
        line.replace(&format!(": {setting} "), &format!(": {flag} "))
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use caustica::{Error, settings::Settings};
    use clap::CommandFactory as _;
    use serde_json::{Value, json};

    use super::*;
    use crate::cli::args::Args;

    /// Paths of all settings: section and field.
    fn paths() -> Vec<(String, String)> {
        let settings = serde_json::to_value(Settings::default()).expect("settings are JSON");
        let sections = settings.as_object().expect("sections");
        let fields = |(section, fields): (&String, &Value)| {
            let names: Vec<_> = fields.as_object().expect("fields").keys().cloned().collect();
            names.into_iter().map(|name| (section.clone(), name)).collect::<Vec<_>>()
        };
        sections.iter().flat_map(fields).collect()
    }

    /// Names in the errors of `Settings::check` when one setting at a time has a value that may be
    /// out of its range.
    fn refused() -> BTreeSet<&'static str> {
        let values =
            [json!(0), json!(-1), json!(1), json!(u32::MAX), json!(1e300), json!("radius"), json!([["lamp", 0]])];
        let mut names = BTreeSet::new();
        for (section, field) in paths() {
            for value in &values {
                let mut settings = serde_json::to_value(Settings::default()).expect("settings are JSON");
                settings[&section][&field] = value.clone();
                let Ok(settings) = serde_json::from_value::<Settings>(settings) else { continue };
                let Err(error) = settings.check() else { continue };
                let Error::Setting { name, .. } = error else { panic!("{error}") };
                assert_eq!(name, format!("{section}.{field}"), "the error of {value} names another setting");
                names.insert(name);
            }
        }
        names
    }

    #[test]
    fn every_setting_that_can_be_refused_has_a_flag() {
        let missing = |rows: &[Row]| -> Vec<&str> {
            refused().into_iter().filter(|name| rows.iter().all(|(setting, _)| setting != name)).collect()
        };
        assert_eq!(missing(&FLAGS), [""; 0]);
        assert_eq!(missing(&FLAGS[..FLAGS.len() - 1]), ["picture.spp"], "control: a table without the last row");
        assert!(refused().len() >= 15, "few settings are refused: {:?}", refused());
    }

    #[test]
    fn every_row_names_a_setting_and_a_flag_of_the_command() {
        let paths: Vec<String> = paths().into_iter().map(|(section, field)| format!("{section}.{field}")).collect();
        let is_input = |name: &str| {
            let is_other = ["device", "scene.environment", "write_part"].contains(&name)
                || ["load.", "passes."].iter().any(|section| name.starts_with(section));
            is_other || paths.iter().any(|path| path == name)
        };
        let mut command = Args::command();
        command.build();
        let options: Vec<_> = command.get_subcommands().flat_map(clap::Command::get_arguments).collect();
        let is_flag = |flag: &str| match flag.strip_prefix("--") {
            Some(long) => options.iter().any(|option| option.get_long() == Some(long)),
            None => options.iter().any(|option| option.get_short() == flag.chars().nth(1)),
        };
        for (setting, flags) in FLAGS.iter().chain([&ENVIRONMENT, &PARTS]) {
            assert!(is_input(setting), "{setting} is no setting");
            let flags: Vec<_> = flags.split([' ', ',']).filter(|word| word.starts_with('-')).collect();
            assert!(!flags.is_empty() && flags.iter().all(|flag| is_flag(flag)), "{setting}: {flags:?}");
        }
        assert!(!is_input("picture.spq") && !is_flag("--spq") && !is_flag("-z"), "control");
    }

    #[test]
    fn lines_name_flags_instead_of_settings() {
        for (line, expected) in [
            ("error: picture.spp 0: must be at least 1", "error: --spp 0: must be at least 1"),
            ("failed: cell 3: picture.aperture 1: needs a focus", "failed: cell 3: --aperture 1: needs a focus"),
            (
                "error: ask for fewer `photons.global` or a smaller `estimate.neighbors`",
                "error: ask for fewer --photons or a smaller -k",
            ),
            ("error: give `scene.environment`", "error: give --env, --background or --default-light sky"),
            ("a.exr: `write_part` did not write it", "a.exr: render --part or --checkpoint did not write it"),
        ] {
            assert_eq!(with_flags(line), expected);
        }
        for control in ["error: picture.spq 0: must be at least 1", "wrote picture.spp", "device: llvmpipe", "`other`"]
        {
            assert_eq!(with_flags(control), control);
        }
    }
}
