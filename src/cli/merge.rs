//! `caustica merge` and `caustica status`.

use std::{collections::BTreeSet, fmt::Write as _, time::Instant};

use caustica::{
    Error, Result,
    image::{Missing, Survey, WindowParts, merge, survey, write_exr_with, write_png},
    settings::{Crop, PassRange},
};
use serde_json::json;

use super::{
    failures::Failures,
    files::Files,
    merge_args::{MergeArgs, StatusArgs},
    progress::Display,
    render::exposure_line,
    say::print,
    signals,
    values::extension,
};

/// Lines of what is missing or twice there that one message has at most.
const MOST_LISTED: usize = 20;

/// Adds up the parts and writes the picture.
pub fn run(args: &MergeArgs) -> Result<()> {
    let started = Instant::now();
    let display = Display::new(args.quiet, true);
    let mut files = Files::default();
    args.parts.iter().try_for_each(|path| files.read(path, "a part"))?;
    args.outputs.iter().try_for_each(|path| files.write(path))?;
    let found = survey(&args.parts)?;
    if !found.overlaps.is_empty() {
        return Err(Error::Differs(format!("parts overlap: {}", listed(&found.overlaps))));
    }
    if let Some((more, wanted)) = surplus(&found, args.passes).first().zip(args.passes) {
        return Err(Error::Differs(format!("parts have the passes {more}, and {wanted} are asked for")));
    }
    let missing = missing(&found, args.passes);
    match (missing.is_empty(), args.allow_gaps) {
        (true, _) => {}
        (false, true) => display.note(&format!("missing: {}", listed(&missing))),
        (false, false) => {
            let missing = listed(&missing);
            return Err(Error::Incomplete(format!("parts are missing: {missing}; --allow-gaps merges what there is")));
        }
    }
    if found.devices.len() > 1 {
        let names: Vec<_> = found.devices.iter().map(|(device, driver)| format!("{device} ({driver})")).collect();
        display.note(&format!(
            "the parts are of {} adapters, which round differently: {}",
            names.len(),
            names.join(", ")
        ));
    }
    let total = args.parts.len();
    let check = |done: usize| {
        let tenth = |done: usize| 10 * done / total;
        display.state(&format!("merge: {done} of {}", parts(total)), 0.0, done == 0 || tenth(done) > tenth(done - 1));
        if signals::stop_requested() { Err(Error::Stopped) } else { Ok(()) }
    };
    let (frame, attributes) = merge(&found, &check)?;
    check(total)?;
    let mut failures = Failures::default();
    for path in &args.outputs {
        let is_png = extension(path) == "png";
        let written = match is_png {
            true => write_png(path, &frame, args.exposure.of(&frame), args.tonemap.into()),
            false => write_exr_with(path, &frame, &attributes),
        };
        if failures.take(written) {
            if is_png {
                display.note(&exposure_line(args.exposure, &frame));
            }
            display.note(&format!("wrote {}", path.display()));
        }
    }
    display.note(&format!("merged {} in {:.1} s", parts(total), started.elapsed().as_secs_f64()));
    failures.outcome()
}

/// Says what there is.
pub fn status(args: &StatusArgs) -> Result<()> {
    let found = survey(&args.parts)?;
    let (missing, surplus) = (missing(&found, args.passes), surplus(&found, args.passes));
    if args.json {
        let mut text = serde_json::to_string_pretty(&report(&found, &missing, &surplus)).expect("it is JSON");
        text.push('\n');
        return print(&text);
    }
    let (width, height) = found.whole;
    let mut text = format!("picture: {width}x{height}\n");
    let mut line = |label: &str, value: &str| writeln!(text, "{label}: {value}").expect("a String can be written");
    for of_window in &found.windows {
        let passes: Vec<_> = of_window.passes().iter().map(ToString::to_string).collect();
        let rectangle = words(of_window.window);
        line("pixels", &format!("{rectangle}: passes {} in {}", passes.join(", "), parts(of_window.parts.len())));
    }
    missing.iter().for_each(|missing| line("missing", missing));
    surplus.iter().for_each(|more| line("more than asked for", &format!("passes {more}")));
    if !found.around_crop().is_empty() {
        let around: Vec<_> = found.around_crop().into_iter().map(|crop| format!("--crop {}", words(crop))).collect();
        line("around this crop", &format!("no part has {}", around.join(", ")));
    }
    found.overlaps.iter().for_each(|overlap| line("twice", overlap));
    found.devices.iter().for_each(|(device, driver)| line("device", &format!("{device} ({driver})")));
    print(&text)
}

fn report(found: &Survey, missing: &[String], surplus: &[PassRange]) -> serde_json::Value {
    let window = |parts: &WindowParts| {
        let passes: Vec<_> = parts.passes().iter().map(ToString::to_string).collect();
        json!({ "crop": parts.window, "passes": passes, "parts": parts.parts.len() })
    };
    let windows: Vec<_> = found.windows.iter().map(window).collect();
    let devices: Vec<_> =
        found.devices.iter().map(|(name, driver)| json!({ "name": name, "driver": driver })).collect();
    json!({
        "complete": missing.is_empty() && surplus.is_empty() && found.overlaps.is_empty(),
        "size": found.whole,
        "windows": windows,
        "missing": missing,
        "surplus": surplus.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "around": found.around_crop(),
        "overlaps": found.overlaps,
        "devices": devices,
    })
}

/// What is missing, as options that render it: `--passes 3..8`, `--crop 0,0,64,64 --passes 0..8`.
fn missing(found: &Survey, wanted: Option<PassRange>) -> Vec<String> {
    let options = |Missing { crop, passes }: Missing| {
        let crop = crop.map_or(String::new(), |crop| format!("--crop {} ", words(crop)));
        format!("{crop}--passes {passes}")
    };
    found.missing(wanted.unwrap_or(found.passes())).into_iter().map(options).collect()
}

/// Ranges of passes that parts hold and that are not all asked for.
fn surplus(found: &Survey, wanted: Option<PassRange>) -> Vec<PassRange> {
    let Some(wanted) = wanted else { return Vec::new() };
    let there = found.windows.iter().flat_map(WindowParts::passes);
    let is_more = |there: &PassRange| there.first < wanted.first || there.end > wanted.end;
    there.filter(is_more).collect::<BTreeSet<_>>().into_iter().collect()
}

/// A number of parts.
fn parts(count: usize) -> String {
    if count == 1 { "1 part".to_owned() } else { format!("{count} parts") }
}

/// A crop as `--crop` has it.
fn words(Crop { column, row, width, height }: Crop) -> String {
    format!("{column},{row},{width},{height}")
}

/// Lines in one.
fn listed(lines: &[String]) -> String {
    let more = lines.len().saturating_sub(MOST_LISTED);
    let mut text = lines[..lines.len() - more].join(", ");
    if more > 0 {
        let _ = write!(text, ", and {more} more, which `caustica status` lists");
    }
    text
}
