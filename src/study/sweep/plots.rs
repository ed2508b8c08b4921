//! Measures of a sweep against one of its keys.
//!
//! Every combination of the other keys is a curve. Seeds are no key to draw curves of: their members are
//! marks of one colour, and the curve goes through their means.

use super::axis::Axis;
use super::member::{Found, MemberStatus};
use super::plan::Plan;
use super::table::{COLUMNS, Column};
use crate::num::real;
use crate::output::plot::{Curve, Figure, Panel};

/// Panels in a row.
const ACROSS: usize = 3;
/// Largest over least value of a measure from which on its axis is logarithmic.
const WIDE: f64 = 100.0;
/// The same of a key whose values are a list.
const WIDE_KEY: f64 = 30.0;

/// The measures against key `across`, a number of `plan.axes`; members that did not come to their end are
/// crosses at the upper edge.
#[must_use]
pub fn figure(plan: &Plan, members: &[Found], across: usize) -> Figure {
    let Some(axis) = plan.axes.get(across) else {
        return Figure { names: Vec::new(), guides: 0, panels: Vec::new(), columns: 1 };
    };
    let places = places(axis);
    let logarithmic = is_logarithmic(axis, &places);
    let curves = combinations(plan, across);
    let of_curve = |found: &Found| {
        let key = combination(plan, across, found);
        curves.iter().position(|(known, _)| *known == key).unwrap_or(0)
    };
    let ended = |found: &&Found| found.status == MemberStatus::Complete;
    let place = |found: &Found| found.at.get(across).and_then(|k| places.get(*k)).copied();
    let lost = |f: &&Found| {
        use MemberStatus::{Damaged, Failed, Killed};
        matches!(f.status, Failed | Killed | Damaged)
    };
    let failed: Vec<(usize, f64)> = members
        .iter()
        .filter(lost)
        .filter_map(|found| Some((of_curve(found), place(found)?)))
        .collect();
    let panel = |column: &Column| -> Option<Panel> {
        let mut drawn: Vec<Curve> = Vec::new();
        let mut marks: Vec<Curve> = Vec::new();
        for name in 0..curves.len() {
            let mut points: Vec<(f64, Vec<f64>)> = Vec::new();
            for found in members.iter().filter(ended).filter(|f| of_curve(f) == name) {
                let (Some(x), Some(y)) = (place(found), (column.of)(found)) else { continue };
                match points.iter_mut().find(|(at, _)| *at == x) {
                    Some((_, values)) => values.push(y),
                    None => points.push((x, vec![y])),
                }
            }
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let single = |(x, values): &(f64, Vec<f64>)| {
                let mark = |y: &f64| Curve { name, points: vec![(*x, *y)] };
                values.iter().map(mark).collect::<Vec<_>>()
            };
            let mean = |(x, values): &(f64, Vec<f64>)| {
                (*x, values.iter().sum::<f64>() / real(values.len()))
            };
            if points.iter().any(|(_, values)| values.len() > 1) {
                marks.extend(points.iter().flat_map(single));
            }
            if !points.is_empty() {
                drawn.push(Curve { name, points: points.iter().map(mean).collect() });
            }
        }
        if drawn.is_empty() && failed.is_empty() {
            return None;
        }
        // A measure that nothing has is not drawn, unless all failed.
        if drawn.is_empty() && members.iter().any(|f| ended(&f)) {
            return None;
        }
        let values = || drawn.iter().chain(&marks).flat_map(|c| c.points.iter().map(|p| p.1));
        let up = is_wide(values(), WIDE);
        drawn.extend(marks);
        Some(Panel {
            title: column.title.to_owned(),
            across: across_text(axis, !failed.is_empty()),
            logarithmic: (logarithmic, up),
            curves: drawn,
            failed: failed.clone(),
            zeros: Vec::new(),
        })
    };
    // The time reached is no result.
    let panels: Vec<Panel> = COLUMNS[1..].iter().filter_map(panel).collect();
    let columns = panels.len().clamp(1, ACROSS);
    Figure { names: curves.into_iter().map(|(_, name)| name).collect(), guides: 0, panels, columns }
}

/// Which keys are drawn: those with several values, seeds only where there is nothing else.
#[must_use]
pub fn drawn_keys(plan: &Plan) -> Vec<usize> {
    let several = |k: &usize| plan.axes.get(*k).is_some_and(|axis| axis.values.len() > 1);
    let all: Vec<usize> = (0..plan.axes.len()).filter(several).collect();
    let keys: Vec<usize> = all.iter().copied().filter(|k| !plan.axes[*k].is_seed()).collect();
    if keys.is_empty() { all } else { keys }
}

/// Where the values of a key are drawn: at themselves, or at 1, 2, … if they are no numbers.
fn places(axis: &Axis) -> Vec<f64> {
    axis.numbers().unwrap_or_else(|| (1..=axis.values.len()).map(real).collect())
}

fn is_logarithmic(axis: &Axis, places: &[f64]) -> bool {
    let positive = places.iter().all(|x| *x > 0.0);
    let numbers = axis.numbers().is_some();
    positive && numbers && (axis.logarithmic || is_wide(places.iter().copied(), WIDE_KEY))
}

/// Whether values are positive, and the largest more than `ratio` times the least.
fn is_wide(values: impl Iterator<Item = f64>, ratio: f64) -> bool {
    let (least, most) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(v), m.max(v)));
    least > 0.0 && most.is_finite() && most > ratio * least
}

fn across_text(axis: &Axis, crosses: bool) -> String {
    let mut text = axis.key.clone();
    if axis.numbers().is_none() {
        let named = axis.values.iter().enumerate();
        let names: Vec<String> =
            named.map(|(k, value)| format!("{} {}", k + 1, super::axis::plain(value))).collect();
        text = format!("{} ({})", axis.title(), names.join(", "));
    }
    if crosses { text + "   × failed" } else { text }
}

/// What of a member's keys tells its curve from others.
fn combination(plan: &Plan, across: usize, found: &Found) -> Vec<usize> {
    let others = plan.axes.iter().zip(&found.at).enumerate();
    let kept = others.filter(|(k, (axis, _))| *k != across && !axis.is_seed());
    kept.map(|(_, (_, at))| *at).collect()
}

/// All combinations of the keys that are not drawn across, and what they are called.
fn combinations(plan: &Plan, across: usize) -> Vec<(Vec<usize>, String)> {
    let others = plan.axes.iter().enumerate().filter(|(k, axis)| *k != across && !axis.is_seed());
    let mut all = vec![(Vec::new(), Vec::new())];
    for (_, axis) in others {
        all = all
            .into_iter()
            .flat_map(|(at, labels): (Vec<usize>, Vec<String>)| {
                (0..axis.values.len()).map(move |k| {
                    let labels: Vec<String> =
                        labels.iter().cloned().chain([axis.label(k)]).collect();
                    (at.iter().copied().chain([k]).collect(), labels)
                })
            })
            .collect();
    }
    let name = |labels: Vec<String>| match labels.is_empty() {
        true => "all members".to_owned(),
        false => labels.join(", "),
    };
    all.into_iter().map(|(at, labels)| (at, name(labels))).collect()
}
