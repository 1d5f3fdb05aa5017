//! `caustica info`.

use std::{fmt::Write, path::Path};

use caustica::{
    Result,
    gpu::Gpu,
    renderer::trace_photons,
    scene::{LoadOptions, Scene},
    settings::Quality,
    stats::{MapStats, PhotonStats},
};

use super::{progress::Display, say::print};

/// Prints the contents of a scene and how they are read, as text or as JSON; with a device also the
/// photons of a picture at the default settings.
pub fn info(path: &Path, options: &LoadOptions, json: bool, device: Option<Option<&str>>) -> Result<()> {
    let mut scene = Scene::load_with(path, options)?;
    scene.add_default_light();
    let info = scene.describe();
    let photons = device.map(|device| photons(&scene, device)).transpose()?;
    let text = if json {
        let mut all = serde_json::to_value(&info).expect("plain values");
        if let Some(photons) = &photons {
            all["photons"] = serde_json::to_value(photons).expect("plain values");
        }
        serde_json::to_string_pretty(&all).expect("plain values")
    } else {
        info.to_string() + &photons.as_ref().map(lines).unwrap_or_default()
    };
    print(&format!("{}\n", text.trim_end()))
}

fn photons(scene: &Scene, device: Option<&str>) -> Result<PhotonStats> {
    // Not an environment of the option, which would ask for photons wherever it is set.
    let named = std::env::var("CAUSTICA_DEVICE").ok();
    let gpu = Gpu::open(device.or(named.as_deref()))?;
    let settings = Quality::Normal.settings().with(|s| s.counts_seen = true);
    let display = Display::new(false, false);
    let stats = trace_photons(&gpu, scene, &settings, &display);
    display.finish();
    Ok(stats?.photons)
}

fn lines(photons: &PhotonStats) -> String {
    let mut text = String::from("  photons of a picture at the default settings\n");
    for (name, map) in [("global", &photons.global), ("caustic", &photons.caustic)] {
        writeln!(text, "    {name:<8} {}", line(map)).expect("a String can be written");
    }
    text
}

fn line(map: &MapStats) -> String {
    let seen = map.seen.unwrap_or_default();
    if seen.sampled == 0 {
        return "none".into();
    }
    let percent = 100.0 * seen.seen as f64 / seen.sampled as f64;
    format!("{} of {} paths, {percent:.1} % where the camera sees them", map.stored, map.emitted)
}
