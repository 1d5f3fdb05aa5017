//! Parsers of option values. Their error messages name the permitted values.

use std::{path::PathBuf, time::Duration};

use caustica::image::{Frame, auto_exposure};
use caustica::scene::{Environment, LoadOptions};
use caustica::settings::{Crop, EstimateSettings, LightSettings, PassRange, PhotonSettings, PictureSettings, Range};

/// A whole number of at least 1 with an optional suffix: `250`, `200k`, `1.5M`.
pub fn count(text: &str) -> Result<u64, String> {
    let wrong = || "a number of at least 1, as 250, 200k or 1.5M".to_string();
    let (digits, zeros) = match text.strip_suffix(['k', 'K']) {
        Some(digits) => (digits, 3),
        None => text.strip_suffix(['m', 'M']).map_or((text, 0), |digits| (digits, 6)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || !all_digits(whole) || !all_digits(fraction) || digits.ends_with('.') {
        return Err(wrong());
    }
    // Exact in decimal: the fraction's digits replace zeros of the suffix.
    if fraction.len() > zeros {
        return Err(format!("not a whole number; {}", wrong()));
    }
    let shifted = format!("{whole}{fraction}{}", "0".repeat(zeros - fraction.len()));
    match shifted.parse::<u64>() {
        Ok(0) => Err(wrong()),
        Ok(number) => Ok(number),
        Err(_) => Err("too large".to_string()),
    }
}

/// Parser of whole numbers in a range.
pub fn whole(range: Range<u32>) -> impl Fn(&str) -> Result<u32, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse::<u32>().ok().filter(|number| range.contains(*number));
        number.ok_or_else(|| format!("a whole number from {} to {}", range.least(), range.most()))
    }
}

/// Capacity of a photon map, photons.
pub fn photons(text: &str) -> Result<u32, String> {
    let most = PhotonSettings::CAPACITY.most();
    u32::try_from(count(text)?).map_err(|_| format!("too large; at most {most}"))
}

/// `WxH` in pixels.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let range = PictureSettings::SIDE;
    let side = |s: &str| s.parse::<u32>().ok().filter(|n| range.contains(*n));
    let parts = text.split_once(['x', 'X']).and_then(|(w, h)| Some((side(w)?, side(h)?)));
    parts.ok_or_else(|| format!("width x height in pixels, as 1024x768, each {range}"))
}

/// `N` or `A..B`: passes from 0 to N, or from A to B.
pub fn passes(text: &str) -> Result<PassRange, String> {
    let (first, end) = text.split_once("..").unwrap_or(("0", text));
    let number = |text: &str| text.parse::<u32>().ok();
    let range = number(first).zip(number(end)).map(|(first, end)| PassRange { first, end });
    let range = range.filter(|range| range.first < range.end && PassRange::END.contains(range.end));
    range.ok_or_else(|| format!("a number of passes, as 8, or a range, as 3..8; at most {}", PassRange::END.most()))
}

/// `90s`, `10m` or `2h`.
pub fn duration(text: &str) -> Result<Duration, String> {
    let unit = |suffix: char, seconds: f64| Some((text.strip_suffix(suffix)?.parse::<f64>().ok()?, seconds));
    let parsed = unit('s', 1.0).or_else(|| unit('m', 60.0)).or_else(|| unit('h', 3600.0));
    let seconds = parsed.map(|(number, seconds)| number * seconds);
    let seconds = seconds.filter(|seconds| (0.0..1e9).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "a time, as 90s, 10m or 2h".to_string())
}

/// Constant of the cone filter.
pub fn cone_constant(text: &str) -> Result<f32, String> {
    in_range(text, EstimateSettings::CONE_CONSTANT, "a number of ")
}

/// A radius in metres.
pub fn radius(text: &str) -> Result<f32, String> {
    in_range(text, EstimateSettings::RADIUS, "a length in metres, ")
}

/// A distance in metres along the camera's axis.
pub fn focus(text: &str) -> Result<f32, String> {
    in_range(text, PictureSettings::FOCUS, "a length in metres, ")
}

/// `X,Y,W,H` in pixels.
pub fn crop(text: &str) -> Result<Crop, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[column, row, width, height]) if width > 0 && height > 0 => Ok(Crop { column, row, width, height }),
        _ => Err("column, row, width and height in pixels, as 100,50,64,64".to_string()),
    }
}

/// Diameter of a lens.
pub fn aperture(text: &str) -> Result<f32, String> {
    in_range(text, PictureSettings::APERTURE, "a length in metres, ")
}

/// A fraction of the radius of an estimate.
pub fn share_reach(text: &str) -> Result<f32, String> {
    in_range(text, EstimateSettings::SHARE_REACH, "a number ")
}

/// A fraction of the radius of an estimate, for the width of a cell.
pub fn irradiance_cells(text: &str) -> Result<f32, String> {
    in_range(text, EstimateSettings::IRRADIANCE_CELLS, "a number ")
}

/// A distance in the picture, pixels.
pub fn gather_radius(text: &str) -> Result<f32, String> {
    in_range(text, EstimateSettings::GATHER_RADIUS, "a number ")
}

/// A fraction of the distance to what is around a point.
pub fn gather_reach(text: &str) -> Result<f32, String> {
    in_range(text, EstimateSettings::GATHER_REACH, "a number ")
}

/// A relative difference.
pub fn tolerance(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|tolerance| TOLERANCES.contains(*tolerance));
    number.ok_or_else(|| format!("a relative difference of {TOLERANCES}, as 1e-4"))
}

/// Range of the relative difference that a comparison allows.
const TOLERANCES: Range<f64> = Range::at_least(0.0);

/// A factor above 0.
pub fn scale(text: &str) -> Result<f64, String> {
    number(text).filter(|s| *s > 0.0).map(f64::from).ok_or_else(|| "a number above 0".to_string())
}

/// A factor of at least 0.
pub fn strength(text: &str) -> Result<f32, String> {
    in_range(text, Environment::STRENGTH, "a number of ")
}

/// A roughness.
pub fn caustic_roughness(text: &str) -> Result<f32, String> {
    in_range(text, LoadOptions::CAUSTIC_ROUGHNESS, "a number of ")
}

/// An angle.
pub fn rotation(text: &str) -> Result<f32, String> {
    number(text).ok_or_else(|| "a number of degrees".to_string())
}

/// `R,G,B`, each at least 0.
pub fn color(text: &str) -> Result<[f32; 3], String> {
    let channels: Option<Vec<f32>> =
        text.split(',').map(|s| number(s.trim()).filter(|x| Environment::STRENGTH.contains(*x))).collect();
    let color = channels.and_then(|channels| channels.try_into().ok());
    color.ok_or_else(|| format!("three numbers of {}, as 0.5,0.7,1", Environment::STRENGTH))
}

/// `NAME=WEIGHT`; the name may hold a `=` itself.
pub fn light_weight(text: &str) -> Result<(String, f64), String> {
    let range = LightSettings::PHOTON_WEIGHT;
    let wrong = || format!("a light's name, '=' and a number {range}, as lamp=2");
    let (name, weight) = text.rsplit_once('=').ok_or_else(wrong)?;
    let weight = weight.parse::<f64>().ok().filter(|w| range.contains(*w)).ok_or_else(wrong)?;
    Ok((name.to_string(), weight))
}

/// Exposure of PNG files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    Auto,
    Stops(f32),
}

impl Exposure {
    /// Stops for a frame.
    pub fn of(self, frame: &Frame) -> f32 {
        match self {
            Self::Auto => auto_exposure(frame),
            Self::Stops(stops) => stops,
        }
    }

    /// Stops for pictures that are looked at side by side.
    pub fn of_all(self) -> f32 {
        match self {
            Self::Auto => 0.0,
            Self::Stops(stops) => stops,
        }
    }
}

/// Range of [`Exposure::Stops`].
const STOPS: Range<f32> = Range::closed(-100.0, 100.0);

/// `auto`, or stops of exposure.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    in_range(text, STOPS, "auto, or a number of stops ").map(Exposure::Stops)
}

/// A number in the range. The message begins with `what`, followed by the range.
fn in_range(text: &str, range: Range<f32>, what: &str) -> Result<f32, String> {
    let number = text.parse::<f32>().ok().filter(|number| range.contains(*number));
    number.ok_or_else(|| format!("{what}{range}"))
}

fn number(text: &str) -> Option<f32> {
    text.parse::<f32>().ok().filter(|x| x.is_finite())
}

/// An output file, of a format that can be written.
pub fn output(path: PathBuf) -> Result<PathBuf, String> {
    match extension(&path).as_str() {
        "exr" | "png" => Ok(path),
        _ => Err("the name ends in neither .exr nor .png".to_string()),
    }
}

/// A part of a picture.
pub fn part(path: PathBuf) -> Result<PathBuf, String> {
    if extension(&path) == "exr" { Ok(path) } else { Err("the name does not end in .exr".to_string()) }
}

/// Extension in lower case, empty if there is none.
pub fn extension(path: &std::path::Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// A rounded duration in words: `40 s`, `12 min`, `3 h 20 min`.
pub fn words_of_seconds(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        _ if minutes < 60 => format!("{minutes} min"),
        _ => format!("{} h {} min", minutes / 60, minutes % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_take_suffixes() {
        for (text, number) in [
            ("1", 1),
            ("250", 250),
            ("200k", 200_000),
            ("1.5M", 1_500_000),
            ("0.1k", 100),
            ("2K", 2000),
            ("3m", 3_000_000),
            ("18446744073709551615", u64::MAX),
        ] {
            assert_eq!(count(text), Ok(number), "{text}");
        }
    }

    #[test]
    fn what_is_no_count_is_refused() {
        for text in ["", "k", "0", "0k", "-1", "+1", "1e5", "1.5", "1.0005k", "1.", "1.k", ".5k", "1kk", "1 k", "x"] {
            assert!(count(text).is_err(), "{text}");
        }
        assert_eq!(count("18446744073709551616"), Err("too large".to_string()));
        assert!(photons("4294967296").is_err() && photons("4294967295").is_ok());
    }

    #[test]
    fn passes_and_times_are_told_by_their_ends() {
        assert_eq!(passes("8"), Ok(PassRange { first: 0, end: 8 }));
        assert_eq!(passes("3..8"), Ok(PassRange { first: 3, end: 8 }));
        for text in ["", "0", "..8", "3..", "8..8", "8..3", "-1", "1.5", "3..8..9", "1000001", "3 .. 8"] {
            assert!(passes(text).is_err(), "{text}");
        }
        let seconds = |text| duration(text).map(|time| time.as_secs_f64());
        assert_eq!((seconds("90s"), seconds("1.5m"), seconds("2h")), (Ok(90.0), Ok(90.0), Ok(7200.0)));
        for text in ["", "90", "s", "-1s", "NaNs", "infh", "1d", "1e9s", "1 0s"] {
            assert!(duration(text).is_err(), "{text}");
        }
        assert!(part("a.exr".into()).is_ok() && part("a.png".into()).is_err());
    }

    #[test]
    fn sizes_radii_and_names_have_their_ranges() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        for text in ["640", "0x4", "4x0", "x", "4x", "4x-4", "4x4x4", "65536x1", "4.5x4"] {
            assert!(size(text).is_err(), "{text}");
        }
        assert!(cone_constant("0.99").is_err() && cone_constant("1").is_ok() && cone_constant("inf").is_err());
        assert!(radius("0").is_err() && radius("NaN").is_err() && radius("1e-3").is_ok());
        assert!(
            tolerance("0").is_ok()
                && tolerance("1e-4").is_ok()
                && tolerance("-1").is_err()
                && tolerance("inf").is_err()
        );
        assert!(strength("0").is_ok() && strength("-1").is_err() && strength("inf").is_err());
        assert!(rotation("-90").is_ok() && rotation("NaN").is_err() && rotation("north").is_err());
        assert_eq!(color("0, 0.5,2e3"), Ok([0.0, 0.5, 2000.0]));
        for text in ["", "1", "1,2", "1,2,3,4", "1,2,", "1,-2,3", "1,2,inf", "a,b,c"] {
            assert!(color(text).is_err(), "{text}");
        }
        assert_eq!((exposure("-2.5"), exposure("auto")), (Ok(Exposure::Stops(-2.5)), Ok(Exposure::Auto)));
        assert!(exposure("101").is_err() && exposure("Auto").is_err());
        assert_eq!(light_weight("a=b=0.5"), Ok(("a=b".to_string(), 0.5)));
        assert!(["lamp", "lamp=", "lamp=0", "lamp=-1", "lamp=inf"].iter().all(|text| light_weight(text).is_err()));
        assert!(output("a.EXR".into()).is_ok() && output("a.jpg".into()).is_err() && output("exr".into()).is_err());
    }
}
