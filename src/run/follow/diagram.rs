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
pub(super) const FOLD: usize = 1;
pub(super) const BIFURCATION: usize = 2;
pub(super) const SINGULARITY: usize = 3;
const UNSTABLE: usize = 4;

/// The diagram of `rows`; `key` is the title of the parameter, `measure` the title of a measure with its column.
pub(super) fn blocks(rows: &[Row], key: &str, (measure, column): (&str, usize)) -> [Block; 1] {
    let measured = |row: &Row| row.measures[column];
    let used: Vec<usize> = curves(rows, measured).map(|curve| curve.name).collect();
    // The guide stays, as the last one.
    let shown = (0..LEGEND.len()).filter(|name| used.contains(name) || *name == UNSTABLE);
    let shown: Vec<usize> = shown.collect();
    let renamed = |curve: Curve| {
        let name = shown.iter().position(|name| *name == curve.name).unwrap_or_default();
        Curve { name, ..curve }
    };
    let panel = |title: &str, curves: &mut dyn Iterator<Item = Curve>| Panel {
        title: title.to_owned(),
        across: key.to_owned(),
        curves: curves.map(renamed).collect(),
        ..Panel::default()
    };
    let figure = Figure {
        names: shown.iter().map(|name| LEGEND[*name].to_owned()).collect(),
        guides: 1,
        marks: [(FOLD, Mark::Triangle), (BIFURCATION, Mark::Square), (SINGULARITY, Mark::Diamond)]
            .into_iter()
            .filter_map(|(name, mark)| Some((shown.iter().position(|n| *n == name)?, mark)))
            .collect(),
        panels: vec![
            panel(measure, &mut curves(rows, measured)),
            panel("energy [energy]", &mut curves(rows, |row| row.energy)),
        ],
    };
    let caption = format!("Branches of equilibria: {measure} and the energy against {key}.");
    [Block::Plot(Plot { name: "branch".to_owned(), caption, figure })]
}

/// Lines and marks of one number of the rows.
fn curves(rows: &[Row], value: impl Fn(&Row) -> f64 + Copy) -> impl Iterator<Item = Curve> {
    lines(rows, value).into_iter().chain(marks(rows, value))
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
