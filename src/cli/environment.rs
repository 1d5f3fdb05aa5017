//! Options of the environment light.

use std::path::PathBuf;

use caustica::{
    Result,
    scene::{Environment, Scene},
};

use clap::ValueEnum;

use super::values::{color, rotation, strength};

/// Light from infinitely far away, which no glTF file holds.
#[derive(Debug, clap::Args)]
pub struct EnvironmentOptions {
    /// Light from all around: equirectangular picture, OpenEXR or Radiance HDR
    #[arg(long, value_name = "FILE", help_heading = "Light")]
    pub env: Option<PathBuf>,

    /// Factor on the light of --env, at least 0
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = strength, help_heading = "Light")]
    #[arg(requires = "env", conflicts_with = "background")]
    pub env_strength: f32,

    /// Turns --env about the vertical, degrees counterclockwise as seen from above
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = rotation, help_heading = "Light")]
    #[arg(requires = "env", conflicts_with = "background")]
    pub env_rotation: f32,

    /// The same light from all around: radiance in W/(m² sr)
    #[arg(long, value_name = "R,G,B", value_parser = color, allow_hyphen_values = true, help_heading = "Light")]
    #[arg(conflicts_with = "env")]
    pub background: Option<[f32; 3]>,

    /// What lights a scene that has no light and is given none
    #[arg(long, value_name = "LIGHT", value_enum, default_value = "sky", help_heading = "Light")]
    pub default_light: DefaultLightArg,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DefaultLightArg {
    /// A uniform sky of radiance 1 over darker ground
    Sky,
    /// Nothing: such a scene is an error
    None,
}

impl EnvironmentOptions {
    /// Adds the environment of the options and its warnings to the scenes. Scenes without any light
    /// get the default light, unless the options exclude it.
    pub fn light<'a>(&self, scenes: impl IntoIterator<Item = &'a mut Scene>) -> Result<()> {
        let file = self.env.as_deref().map(|path| Environment::load(path, self.env_strength, self.env_rotation));
        let uniform = self.background.map(|radiance| Environment::uniform(radiance.into()));
        let environment = file.transpose()?.or(uniform);
        for scene in scenes {
            if let Some(environment) = &environment {
                scene.warnings.extend(environment.warnings.iter().cloned());
                scene.environment = Some(environment.clone());
            }
            if self.default_light == DefaultLightArg::Sky {
                scene.add_default_light();
            }
        }
        Ok(())
    }
}
