//! Writes the scenes of the repository: `cargo run --release --example make_scenes [FOLDER]`, by
//! default into `scenes`.

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "scenes".to_owned()));
    for (name, bytes) in support::make_scenes::files() {
        std::fs::write(folder.join(name), bytes)?;
    }
    Ok(())
}
