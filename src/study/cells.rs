//! Disk cache of finished renders, keyed by a hash of all inputs that determine them.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::radii::Radii;
use crate::{
    error::{Error, Result},
    gpu::Gpu,
    image::{Frame, read_exr, write_exr, write_file},
    scene::{Environment, Scene},
    settings::Settings,
    stats::Stats,
};

/// All inputs that determine a render, as text.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key(String);

impl Key {
    /// Scenes and environments are identified by the bytes of their files ([`Scene::hash`]), not by
    /// their names.
    pub fn new(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Self {
        let settings = serde_json::to_string(settings).expect("settings hold nothing that JSON cannot");
        let (version, hash) = (env!("CARGO_PKG_VERSION"), &scene.hash);
        let environment = scene.environment.as_ref().map_or(String::new(), |environment| {
            let Environment { hash, strength, rotation, .. } = environment;
            format!("environment {hash} strength {strength} rotation {rotation}\n")
        });
        Self(format!(
            "caustica {version}\nscene {hash}\n{environment}settings {settings}\nadapter {}\ndriver {}",
            gpu.name, gpu.driver
        ))
    }

    fn file_name(&self) -> String {
        let hash = Sha256::digest(self.0.as_bytes());
        hash.iter().take(12).map(|byte| format!("{byte:02x}")).collect()
    }
}

/// Measurements of the render of a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Measured {
    pub stats: Stats,
    /// Radii of the global and of the caustic map; `None` where no estimate found a photon.
    pub radii: [Option<Radii>; 2],
}

/// Record file beside each picture.
#[derive(Serialize, Deserialize)]
struct Record {
    key: String,
    measured: Measured,
}

/// Folder `cells` of a study.
pub(super) struct Cells {
    folder: PathBuf,
}

impl Cells {
    /// Creates the folder if it does not exist.
    pub fn open(study: &Path) -> Result<Self> {
        let folder = study.join("cells");
        fs::create_dir_all(&folder).map_err(|source| failure(&folder, source))?;
        crate::image::check_output(&folder.join("probe"))?;
        Ok(Self { folder })
    }

    fn record_path(&self, key: &Key) -> PathBuf {
        self.folder.join(key.file_name() + ".json")
    }

    fn picture_path(&self, key: &Key) -> PathBuf {
        self.folder.join(key.file_name() + ".exr")
    }

    /// Loads the record stored under the key. A damaged or foreign cell counts as missing.
    pub fn find(&self, key: &Key) -> Option<Measured> {
        let record: Record = serde_json::from_slice(&fs::read(self.record_path(key)).ok()?).ok()?;
        (record.key == key.0 && self.frame(key).is_ok()).then_some(record.measured)
    }

    /// Loads the picture stored under the key.
    pub fn frame(&self, key: &Key) -> Result<Frame> {
        read_exr(&self.picture_path(key))
    }

    /// The record is written last: its presence marks the picture as complete.
    pub fn keep(&self, key: &Key, scene: &Scene, settings: &Settings, frame: &Frame, measured: Measured) -> Result<()> {
        let origin = scene.origin(settings, &measured.stats);
        write_exr(&self.picture_path(key), frame, &origin)?;
        let path = self.record_path(key);
        let text = serde_json::to_vec_pretty(&Record { key: key.0.clone(), measured })
            .map_err(|e| failure(&path, io::Error::other(e)))?;
        write_file(&path, &text)
    }
}

fn failure(path: &Path, source: io::Error) -> Error {
    Error::Io { path: path.to_path_buf(), source }
}
