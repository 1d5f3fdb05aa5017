//! Evaluation of the claims: each function examines the rows of one figure.

use super::{
    Row,
    numbers::{brief, short},
};
use crate::settings::Mode;

/// Relative tolerance within which two means count as equal.
const SAME_LIGHT: f64 = 0.05;
/// The same tolerance between scenes whose lights have different positions, which changes how much
/// of their light the picture shows.
const ABOUT_THE_SAME_LIGHT: f64 = 0.25;
/// Factor within which two times count as equal.
const SAME_TIME: f64 = 1.25;

/// Measurement, and whether the claim holds; `None` if the rows do not suffice to decide.
pub(super) type Finding = Option<(String, bool)>;

/// Groups rows by scene, mode and a further value, and sorts each group by the varying parameter.
/// Groups of fewer than two rows are left out.
fn series<'a>(rows: &[&'a Row], fixed: fn(&Row) -> u32, varied: fn(&Row) -> u32) -> Vec<Vec<&'a Row>> {
    let mut sorted: Vec<&Row> = rows.iter().copied().filter(|row| row.mode.traces_photons()).collect();
    let group = |row: &Row| (row.scene.clone(), row.mode as u32, fixed(row));
    sorted.sort_by_key(|row| (group(row), varied(row)));
    let groups = sorted.chunk_by(|a, b| group(a) == group(b)).map(<[_]>::to_vec);
    groups.filter(|group| group.len() > 1).collect()
}

fn over_k<'a>(rows: &[&'a Row]) -> Vec<Vec<&'a Row>> {
    series(rows, |row| row.photons, |row| row.neighbors)
}

fn over_n<'a>(rows: &[&'a Row]) -> Vec<Vec<&'a Row>> {
    series(rows, |row| row.neighbors, |row| row.photons)
}

fn ends<'a>(group: &[&'a Row]) -> (&'a Row, &'a Row) {
    (group[0], group[group.len() - 1])
}

/// Minimum and maximum.
fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, x| Some(range.map_or((x, x), |(low, high): (f64, f64)| (low.min(x), high.max(x)))))
}

pub(super) fn energy(rows: &[&Row]) -> Finding {
    let (low, high) = range(rows.iter().map(|row| row.mean())).filter(|_| rows.len() > 1)?;
    let spread = (high - low) / ((high + low) / 2.0);
    let text = format!("mean radiance {} to {}, a spread of {:.1} %", brief(low), brief(high), 100.0 * spread);
    spread.is_finite().then_some((text, spread <= SAME_LIGHT))
}

pub(super) fn gather_dominates(rows: &[&Row]) -> Finding {
    let timed = rows.iter().filter(|row| row.mode.traces_photons() && row.seconds.total > 0.0);
    let fractions: Vec<f64> = timed.map(|row| row.seconds.gather / row.seconds.total).collect();
    let (low, high) = range(fractions.iter().copied())?;
    let most = fractions.iter().filter(|fraction| **fraction > 0.5).count();
    let text = format!(
        "{:.0} % to {:.0} % of the total time, more than half in {most} of {} pictures",
        100.0 * low,
        100.0 * high,
        fractions.len()
    );
    Some((text, most == fractions.len()))
}

/// Growth of the gather's time from the first to the last row of each group, as text and as minimum
/// and maximum.
fn growth(groups: &[Vec<&Row>]) -> Option<(f64, f64)> {
    let of = |group: &Vec<&Row>| {
        let (first, last) = ends(group);
        last.seconds.gather / first.seconds.gather
    };
    range(groups.iter().map(of)).filter(|(low, high)| low.is_finite() && high.is_finite())
}

/// Formats one factor, or the minimum and the maximum.
fn factors((low, high): (f64, f64)) -> String {
    let (low, high) = (brief(low), brief(high));
    if low == high { low } else { format!("{low} to {high}") }
}

pub(super) fn time_with_neighbors(rows: &[&Row]) -> Finding {
    let groups = over_k(rows);
    let (low, high) = growth(&groups)?;
    let (first, last) = ends(&groups[0]);
    let text = format!(
        "from k = {} to k = {} the gather's time grows by a factor of {}",
        first.neighbors,
        last.neighbors,
        factors((low, high))
    );
    Some((text, low > 1.0))
}

pub(super) fn time_with_photons(rows: &[&Row]) -> Finding {
    let groups = over_n(rows);
    let (low, high) = growth(&groups)?;
    let (first, last) = ends(&groups[0]);
    let logarithm = |row: &Row| f64::from(row.photons).ln().max(1.0);
    let allowed = logarithm(last) / logarithm(first);
    let text = format!(
        "from n = {} to n = {} the gather's time grows by a factor of {}; the logarithm by {}, n itself by {}",
        short(first.photons),
        short(last.photons),
        factors((low, high)),
        brief(allowed),
        brief(f64::from(last.photons) / f64::from(first.photons))
    );
    Some((text, high <= 2.0 * allowed))
}

pub(super) fn proportion(rows: &[&Row]) -> Finding {
    let best = |group: &Vec<&Row>| {
        let by_error = |a: &&&Row, b: &&&Row| a.rel_mse.unwrap_or(f64::MAX).total_cmp(&b.rel_mse.unwrap_or(f64::MAX));
        let best = group.iter().filter(|row| row.rel_mse.is_some()).min_by(by_error)?;
        Some((best.photons, best.neighbors))
    };
    let found: Vec<(u32, u32)> = over_k(rows).iter().filter_map(best).collect();
    if found.len() < 2 {
        return None;
    }
    let list: Vec<String> = found.iter().map(|(n, k)| format!("k = {k} at n = {}", short(*n))).collect();
    let rises = found.windows(2).all(|w| w[0].1 <= w[1].1) && found[0].1 < found[found.len() - 1].1;
    Some((format!("smallest relMSE with {}", list.join(", ")), rises))
}

pub(super) fn noise_for_bias(rows: &[&Row]) -> Finding {
    let seen = |row: &&&Row| row.bias > row.bias_limit;
    let of = |group: &Vec<&Row>| {
        let (first, last) = ends(group);
        // A bias below its detection limit cannot be compared.
        let low = group[..group.len() - 1].iter().find(seen)?;
        let text = format!(
            "n = {}: noise {} at k = {} and {} at k = {}, bias {} at k = {} and {} at k = {}",
            short(first.photons),
            brief(first.noise?),
            first.neighbors,
            brief(last.noise?),
            last.neighbors,
            brief(low.bias?),
            low.neighbors,
            brief(last.bias?),
            last.neighbors
        );
        Some((text, last.noise < first.noise && last.bias > low.bias))
    };
    let found: Vec<_> = over_k(rows).iter().filter_map(of).collect();
    let text = found.iter().map(|(text, _)| text.as_str()).collect::<Vec<_>>().join("; ");
    (!found.is_empty()).then(|| (text, found.iter().all(|(_, holds)| *holds)))
}

pub(super) fn corners_bright(rows: &[&Row]) -> Finding {
    let (low, high) = range(rows.iter().filter_map(|row| row.corner_ratio))?;
    let percent = |ratio: f64| format!("{:+.1} %", 100.0 * (ratio - 1.0));
    // The largest k of each n has the least noise.
    let smooth: Vec<(&Row, f64)> =
        over_k(rows).iter().filter_map(|group| Some((ends(group).1, ends(group).1.corner_ratio?))).collect();
    let most = smooth.iter().map(|(_, ratio)| *ratio).fold(0.0, f64::max);
    let line = |(row, ratio): &(&Row, f64)| {
        format!("{} with {}, n = {}, k = {}", percent(*ratio), row.mode.name(), short(row.photons), row.neighbors)
    };
    let list = smooth.iter().map(line).collect::<Vec<_>>().join(", ");
    let text = format!("{list}; over all pictures {} to {}", percent(low), percent(high));
    (!smooth.is_empty()).then(|| (text, most > 1.01 && smooth.iter().all(|(_, ratio)| *ratio > 1.0)))
}

/// Ratio of direct light by photons to that by rays for each scene; `true` where caustics are
/// present as well.
fn photons_over_rays<'a>(rows: &[&'a Row]) -> Vec<(&'a Row, f64, bool)> {
    let rays = |scene: &str| rows.iter().find(|row| row.mode == Mode::DirectRays && row.scene == scene);
    let pair = |row: &&'a Row| {
        let ratio = row.mean() / rays(&row.scene)?.mean();
        ratio.is_finite().then_some((*row, ratio, row.caustic.stored > 0))
    };
    rows.iter().filter(|row| row.mode == Mode::DirectPhotons).filter_map(pair).collect()
}

pub(super) fn direct_agrees(rows: &[&Row]) -> Finding {
    let pairs = photons_over_rays(rows);
    let line = |(row, ratio, caustics): &(&Row, f64, bool)| {
        let note = if *caustics { " with caustics" } else { "" };
        format!("{}: {} times the light of shadow rays{note}", row.scene, brief(*ratio))
    };
    let good = |&(_, ratio, caustics): &(&Row, f64, bool)| {
        ratio >= 1.0 - SAME_LIGHT && (caustics || ratio <= 1.0 + SAME_LIGHT)
    };
    let text = pairs.iter().map(line).collect::<Vec<_>>().join("; ");
    (!pairs.is_empty()).then(|| (text, pairs.iter().all(good)))
}

pub(super) fn delta_shadows(rows: &[&Row]) -> Finding {
    let (_, ratio, _) = *photons_over_rays(rows).first()?;
    Some((format!("{} times the light of shadow rays", brief(ratio)), ratio > 1.01))
}

pub(super) fn three_lights(rows: &[&Row]) -> Finding {
    let (one, three) = ends(if rows.len() > 1 { rows } else { return None });
    let (light, time) = (three.mean() / one.mean(), three.seconds.total / one.seconds.total);
    let text = format!("{} times the light in {} times the time", brief(light), brief(time));
    let holds = (light / 3.0 - 1.0).abs() <= ABOUT_THE_SAME_LIGHT && time <= SAME_TIME;
    (light.is_finite() && time.is_finite()).then_some((text, holds))
}
