//! Inputs that fuzzing found or started from, read again.

use std::{fs, path::Path};

use support::{any_environment, any_scene};

use super::memory::peak;

/// What the files of a corpus may take to read, whatever they claim.
const MOST_BYTES: i64 = 200 << 20;

/// Gives each file of a corpus to `check`; returns how many were read and how many were refused.
fn replay<T>(corpus: &str, check: impl Fn(&[u8]) -> Result<T, String>) -> (usize, usize) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(corpus);
    let mut paths: Vec<_> = fs::read_dir(folder).expect("can be listed").map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    let mut counts = (0, 0);
    for path in paths {
        let bytes = fs::read(&path).expect("can be read");
        println!("{}", path.display());
        let (most, read) = peak(|| check(&bytes));
        assert!(most < MOST_BYTES, "{}: {most} bytes at once", path.display());
        match read {
            Ok(_) => counts.0 += 1,
            Err(_) => counts.1 += 1,
        }
    }
    counts
}

#[test]
fn scenes_of_the_corpus_are_read_or_refused() {
    let (read, refused) = replay("scene", any_scene::check);
    assert!(read >= 20 && refused >= 20, "{read} read, {refused} refused");
}

#[test]
fn environments_of_the_corpus_are_read_or_refused() {
    let (read, refused) = replay("environment", any_environment::check);
    assert!(read >= 5 && refused >= 2, "{read} read, {refused} refused");
}
