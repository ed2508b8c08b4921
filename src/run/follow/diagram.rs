//! The diagram of branches: a measure and the energy over the key, stable parts solid and others dashed.

use super::record::Row;
use crate::output::plot::{Curve, Figure, Panel};

/// Names of the legend; the last one is drawn as a guide, dashed.
const NAMES: [&str; 4] =
    ["stable", "fold", "bifurcation", "unstable: the Hessian has negative eigenvalues"];
const STABLE: usize = 0;
const FOLD: usize = 1;
const BIFURCATION: usize = 2;
const UNSTABLE: usize = 3;

/// The diagram of `rows`; `key` is the title of the parameter, `measure` that of their measure.
pub(super) fn figure(rows: &[Row], key: &str, measure: &str) -> Figure {
    let of = |value: fn(&Row) -> f64| lines(rows, value).into_iter().chain(marks(rows, value));
    let used: Vec<usize> = of(|row| row.measure).map(|curve| curve.name).collect();
    // The guide stays, as the last one.
    let shown = (0..NAMES.len()).filter(|name| used.contains(name) || *name == UNSTABLE);
    let shown: Vec<usize> = shown.collect();
    let renamed = |curve: Curve| {
        let name = shown.iter().position(|name| *name == curve.name).unwrap_or_default();
        Curve { name, ..curve }
    };
    let panel = |title: &str, value: fn(&Row) -> f64| Panel {
        title: title.to_owned(),
        across: key.to_owned(),
        curves: of(value).map(renamed).collect(),
        ..Panel::default()
    };
    Figure {
        names: shown.iter().map(|name| NAMES[*name].to_owned()).collect(),
        guides: 1,
        panels: vec![panel(measure, |row| row.measure), panel("energy [energy]", |row| row.energy)],
        columns: 2,
    }
}

/// Pieces of branches, which end where their stability changes.
fn lines(rows: &[Row], value: fn(&Row) -> f64) -> Vec<Curve> {
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

/// Folds and bifurcations.
fn marks(rows: &[Row], value: fn(&Row) -> f64) -> impl Iterator<Item = Curve> + '_ {
    rows.iter().filter_map(move |row| {
        let name = match row.event {
            super::record::FOLD => FOLD,
            super::record::BIFURCATION => BIFURCATION,
            _ => return None,
        };
        Some(Curve { name, points: vec![(row.parameter, value(row))] })
    })
}
