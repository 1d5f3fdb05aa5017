//! Third-party and hostile files: each is rendered, or refused in one line.

mod corpus;
mod folder;
mod hostile;
pub mod memory;

use std::{fs, path::Path, process::Command};

/// Outcome of a run of the command.
struct Ended {
    code: Option<i32>,
    stderr: String,
    /// The picture was written.
    wrote: bool,
}

/// Renders the scene with the command: 16 x 16 pixels.
fn render_with_command(scene: &Path) -> Ended {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = folder.path().join("a.exr");
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    command.arg("render").arg(scene).arg("-o").arg(&picture);
    command.args(["-q", "--size", "16x16", "--spp", "1", "--photons", "500", "-k", "10"]);
    let output = command.output().expect("it starts");
    let left = fs::read_dir(folder.path()).expect("can be listed").count();
    assert_eq!(left, usize::from(picture.exists()), "{}: something else was left behind", scene.display());
    let stderr = String::from_utf8(output.stderr).expect("messages are text");
    assert!(output.stdout.is_empty(), "{}: {:?}", scene.display(), output.stdout);
    Ended { code: output.status.code(), stderr, wrote: picture.exists() }
}

impl Ended {
    /// The one line of the refusal, without the file's folder. Any other outcome is an error.
    fn refusal(&self, scene: &Path) -> Result<String, String> {
        let line = self.stderr.strip_suffix('\n').unwrap_or(&self.stderr);
        match line.strip_prefix("error: ") {
            Some(said) if self.code == Some(1) && !self.wrote && !said.contains('\n') => {
                Ok(said.replace(&scene.display().to_string(), "FILE"))
            }
            _ => Err(format!("exit {:?}, picture {}, stderr {:?}", self.code, self.wrote, self.stderr)),
        }
    }
}
