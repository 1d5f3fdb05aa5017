//! `report.html` of a comparison in a browser.

use std::{fs, path::Path, process::Command};

use super::browser::Browser;
use serde_json::Value;

const ARROW_RIGHT: &str = "\u{e014}";

/// Compares a small picture. The exit code must be `code`.
fn compare(folder: &Path, words: &str, code: i32) {
    let status = Command::new(env!("CARGO_BIN_EXE_caustica"))
        .args(["compare", "scenes/mirror-and-glass.gltf", "-q", "--size", "48x32", "--photons", "2k", "-k", "20", "-o"])
        .arg(folder)
        .args(words.split_whitespace())
        .status()
        .expect("the program starts");
    assert_eq!(status.code(), Some(code));
}

/// Clipping of the second picture, and position of the divider.
fn cut(browser: &Browser) -> (Value, Value) {
    let style = |what: &str| browser.run(&format!("return {what}"));
    (
        style("getComputedStyle(document.querySelector('#pair img + img')).clipPath"),
        style("getComputedStyle(document.querySelector('#pair'), '::after').left"),
    )
}

#[test]
fn the_slider_moves_and_nothing_is_asked_of_the_network() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    compare(folder.path(), "", 0);
    let Some(browser) = Browser::open(1000, 1400) else { return };
    browser.show(&folder.path().join("report.html"));
    let before = cut(&browser);
    assert_eq!(cut(&browser), before, "the control: nothing has moved it yet");
    browser.press("#slider", &ARROW_RIGHT.repeat(200));
    let after = cut(&browser);
    assert!(before.0 != after.0 && before.1 != after.1, "{before:?} {after:?}");
    assert_eq!(after.0, "inset(0px 0px 0px 70%)");
    for (selector, least) in [("img", 3), ("#facts tr", 5), ("#cost tbody tr", 4), ("svg .bar", 1)] {
        let count = browser.run(&format!("return document.querySelectorAll('{selector}').length"));
        assert!(count.as_u64().is_some_and(|n| n >= least), "{selector}: {count}");
    }
    let drawn = browser.run("return [...document.images].every(i => i.complete && i.naturalWidth > 0)");
    assert_eq!(drawn, true);
    assert_eq!(browser.run("return document.querySelector('#verdict').className"), "verdict good");
    assert_eq!(browser.complaints(), Vec::<String>::new());
    assert_eq!(browser.outside_requests(), Vec::<String>::new());
}

#[test]
fn the_page_fits_a_phone_and_says_what_is_wrong() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    compare(folder.path(), "--sabotage 3", 1);
    let Some(browser) = Browser::open(500, 900) else { return };
    browser.show(&folder.path().join("report.html"));
    // A browser window is at least 500 pixels wide, so the page is in a frame of a phone's width.
    let overflow = "const f = document.createElement('iframe'); f.style.width = '360px'; f.srcdoc = \
                    document.documentElement.outerHTML; document.body.append(f); return new Promise(done => { f.onload = \
                    () => done(f.contentDocument.documentElement.scrollWidth - f.contentWindow.innerWidth) })";
    let wide = browser.run(overflow);
    assert!(wide.as_i64().is_some_and(|w| w <= 0), "{wide}");
    let long = "document.body.insertAdjacentHTML('beforeend', '<div style=\"width: 900px\">x</div>');";
    let wide = browser.run(&format!("{long} {overflow}"));
    assert!(wide.as_i64().is_some_and(|w| w > 0), "the control: {wide}");
    assert_eq!(browser.run("return document.querySelector('#verdict').className"), "verdict bad");
    let said = browser.run("return document.querySelector('#verdict').textContent");
    assert!(said.as_str().is_some_and(|s| s.contains("queries differ in their photons")), "{said}");
}

#[test]
fn a_bad_page_is_noticed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let page = folder.path().join("page.html");
    fs::write(&page, "<img src=\"http://127.0.0.1:9/a.png\"><script>console.error('bad')</script>").expect("written");
    let Some(browser) = Browser::open(500, 500) else { return };
    browser.show(&page);
    assert!(browser.complaints().iter().any(|c| c.contains("bad")));
    assert_eq!(browser.outside_requests(), ["http://127.0.0.1:9/a.png"]);
}
