//! Invariants for arbitrary bytes given as an environment map, shared by the fuzz target
//! `environment` and the replay of its corpus.

use std::path::Path;

use caustica::scene::Environment;

/// Reads the bytes and checks the map. Returns the map, or the error, which must be one line.
pub fn check(bytes: &[u8]) -> Result<Environment, String> {
    match Environment::from_bytes(bytes, Path::new("any"), 1.0, 0.0) {
        Ok(map) => {
            assert!(map.width > 0 && map.height > 0, "{} x {}", map.width, map.height);
            assert_eq!(map.pixels.len() as u64, u64::from(map.width) * u64::from(map.height));
            assert!(map.pixels.as_flattened().iter().all(|x| x.is_finite() && *x >= 0.0));
            assert!(map.warnings.iter().all(|line| !line.contains('\n')), "{:?}", map.warnings);
            Ok(map)
        }
        Err(error) => {
            let text = error.to_string();
            assert!(!text.is_empty() && !text.contains('\n'), "one line: {text}");
            Err(text)
        }
    }
}
