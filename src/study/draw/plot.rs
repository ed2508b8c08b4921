//! Plots of values against time, cost, or a key of a study.

use std::collections::BTreeMap;

use crate::output::plot::{Curve, Panel};
use crate::study::gather::Statistics;

/// Values from here down are round-off.
pub const ROUND_OFF: f64 = 1e-15;

/// A panel with axes that are not logarithmic.
pub fn panel(title: &str, across: &str, curves: Vec<Curve>) -> Panel {
    Panel { title: title.to_owned(), across: across.to_owned(), curves, ..Panel::default() }
}

/// A panel of values against a cost, both logarithmic, of points `(name, cost, value)`. Values of 0 are marks at the lower
/// edge, points without a value crosses at the upper one.
pub fn cost_panel(
    title: &str,
    across: &str,
    points: impl Iterator<Item = (usize, f64, Option<f64>)>,
) -> Panel {
    let mut panel = Panel { logarithmic: (true, true), ..panel(title, across, Vec::new()) };
    for (name, cost, value) in points {
        match value {
            None => panel.failed.push((name, cost)),
            Some(value) if value <= ROUND_OFF => panel.zeros.push((name, cost)),
            Some(value) => match panel.curves.iter_mut().find(|curve| curve.name == name) {
                Some(curve) => curve.points.push((cost, value)),
                None => panel.curves.push(Curve { name, points: vec![(cost, value)] }),
            },
        }
    }
    panel
}

/// A curve for every name through the means of the values at every place, of points `(name, place, value)`; marks for all of
/// them where a mean is of several.
pub fn curves(points: impl Iterator<Item = (usize, f64, f64)>) -> Vec<Curve> {
    let mut all: BTreeMap<usize, Vec<(f64, Vec<f64>)>> = BTreeMap::new();
    for (name, place, value) in points {
        let points = all.entry(name).or_default();
        match points.iter_mut().find(|(at, _)| *at == place) {
            Some((_, values)) => values.push(value),
            None => points.push((place, vec![value])),
        }
    }
    let (mut means, mut marks) = (Vec::new(), Vec::new());
    for (name, mut points) in all {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if points.iter().any(|(_, values)| values.len() > 1) {
            let all = points.iter().flat_map(|(x, values)| values.iter().map(|y| (*x, *y)));
            marks.extend(all.map(|point| Curve { name, points: vec![point] }));
        }
        let mean = |(x, values): &(f64, Vec<f64>)| Some((*x, Statistics::new(values).mean?));
        means.push(Curve { name, points: points.iter().filter_map(mean).collect() });
    }
    means.extend(marks);
    means
}
