//! Replay of the fuzzing corpus: seeds and inputs that fuzzing found.

use std::{fs, path::Path};

use support::{any_environment, any_scene};

use super::memory::peak;

/// Maximum memory for reading a file of a corpus, whatever sizes it claims.
const MAX_BYTES: i64 = 200 << 20;

/// Passes each file of a corpus to `check`. Returns the numbers of accepted and of refused files.
fn replay<T>(corpus: &str, check: impl Fn(&[u8]) -> Result<T, String>) -> (usize, usize) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(corpus);
    let mut paths: Vec<_> = fs::read_dir(folder).expect("can be listed").map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    let mut counts = (0, 0);
    for path in paths {
        let bytes = fs::read(&path).expect("can be read");
        println!("{}", path.display());
        let (most, read) = peak(|| check(&bytes));
        assert!(most < MAX_BYTES, "{}: {most} bytes at once", path.display());
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
