//! The diagram of branches: a measure and the energy over the key, stable parts solid and others dashed.

use super::row::Row;
use crate::output::plot::{Block, Curve, Figure, Mark, Panel, Plot};

/// Names of the legend; the last one is drawn as a guide, dashed.
const LEGEND: [&str; 5] = [
    "stable (solid)",
    "fold",
    "bifurcation",
    "singularity",
    "unstable (dashed): some disturbances grow",
];
const STABLE: usize = 0;
const FOLD: usize = 1;
const BIFURCATION: usize = 2;
const SINGULARITY: usize = 3;
const UNSTABLE: usize = 4;

/// The diagram of `rows`; `key` is the title of the parameter, `measure` the title of a measure with its column.
pub(super) fn blocks(rows: &[Row], key: &str, (measure, column): (&str, usize)) -> [Block; 1] {
    let panel = |title: &str, curves: Vec<Curve>| Panel {
        title: title.to_owned(),
        across: key.to_owned(),
        curves,
        ..Panel::default()
    };
    let panels = vec![
        panel(measure, curves(rows, |row: &Row| row.measures[column])),
        panel("energy [energy]", curves(rows, |row| row.energy)),
    ];
    // The legend leaves empty names out; the guide stays.
    let used = |name: usize| panels[0].curves.iter().any(|curve| curve.name == name);
    let names = (0..LEGEND.len()).map(|name| match used(name) || name == UNSTABLE {
        true => LEGEND[name].to_owned(),
        false => String::new(),
    });
    let marks =
        vec![(FOLD, Mark::Triangle), (BIFURCATION, Mark::Square), (SINGULARITY, Mark::Diamond)];
    let figure = Figure { names: names.collect(), guides: 1, marks, panels };
    let caption = format!("Branches of equilibria: {measure} and the energy against {key}.");
    [Block::Plot(Plot { name: "branch".to_owned(), caption, figure })]
}

/// Lines and marks of one number of the rows.
fn curves(rows: &[Row], value: impl Fn(&Row) -> f64 + Copy) -> Vec<Curve> {
    [lines(rows, value), marks(rows, value)].concat()
}

/// Pieces of branches, which end where their stability changes.
fn lines(rows: &[Row], value: impl Fn(&Row) -> f64) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    let mut open = false;
    for pair in rows.windows(2) {
        let [from, to] = pair else { continue };
        if from.branch != to.branch {
            open = false;
            continue;
        }
        // At a special point itself an eigenvalue is 0, of either sign.
        let stable = if from.is_special() { to } else { from }.negative == 0;
        let name = if stable { STABLE } else { UNSTABLE };
        let end = (to.parameter, value(to));
        match curves.last_mut() {
            Some(curve) if open && curve.name == name => curve.points.push(end),
            _ => curves.push(Curve { name, points: vec![(from.parameter, value(from)), end] }),
        }
        open = true;
    }
    curves
}

/// Folds, bifurcations and singularities.
fn marks(rows: &[Row], value: impl Fn(&Row) -> f64) -> Vec<Curve> {
    let mark = |row: &Row| {
        let name = match row.event {
            crate::run::follow::row::FOLD => FOLD,
            crate::run::follow::row::BIFURCATION => BIFURCATION,
            crate::run::follow::row::SINGULARITY => SINGULARITY,
            _ => return None,
        };
        Some(Curve { name, points: vec![(row.parameter, value(row))] })
    };
    rows.iter().filter_map(mark).collect()
}
