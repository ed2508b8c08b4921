//! Distance between policies: the references of each against those of the fullest one, along another key.
//!
//! Where the shape relaxes fast, simultaneous tends to quasi-static, with a distance that goes with the ratio of
//! the rates of chemistry and shape: a slope of 1. What it tends to says whether a policy may be used.

use super::Quantity;
use super::advice::{percent, two_digits};
use super::errors::{Case, Distance};
use super::norms::Yardstick;
use super::plots::{Part, panel};
use crate::num::Short;
use crate::output::plot::{Curve, Figure, label};
use crate::run::Simulation;
use crate::study::compare::Timescales;
use crate::study::sweep::{Axis, Plan};

/// The key that chooses a policy.
const KEY: &str = "time.policy";
/// The policy that leaves nothing out.
const FULLEST: &str = "simultaneous";

/// The distances of one policy from another.
struct IsolatedLibrary {
    /// Which policy from which.
    name: String,
    rows: Vec<Row>,
}

/// The distance in one case.
struct Row {
    /// What the case is called.
    case: String,
    /// Its place.
    place: f64,
    /// Distance between the policies.
    apart: Distance,
    /// Uncertainty of the references of each: smaller distances are not resolved.
    floor: Distance,
}

/// Distance between policies.
#[derive(Default)]
pub(super) struct Policies {
    /// Distances of all policies from the fullest; none where policies are not varied.
    all: Vec<IsolatedLibrary>,
    /// What their places are.
    across: String,
}

/// Measures the distance between the policies of a study.
pub(super) fn policies(plan: &Plan, cases: &[Case]) -> Policies {
    let axes = || plan.axes.iter().enumerate().skip(1);
    let found = axes().find(|(_, axis)| axis.key == KEY);
    let Some((at, policies)) = found else { return Policies::default() };
    let of = |case: &Case| case.at.get(at - 1).copied();
    let full = policies.values.iter().position(|value| plain(value) == FULLEST).unwrap_or(0);
    let numeric = axes().find_map(|(k, axis)| Some((k, axis, axis.numbers()?)));
    let mut across = "ratio of the rates of chemistry and shape".to_owned();
    let ratios: Vec<Option<f64>> = cases.iter().map(|case| ratio(plan, case)).collect();
    let known = cases.iter().zip(&ratios).filter(|(case, _)| of(case) == Some(full));
    let by_ratio = known.clone().all(|(_, ratio)| ratio.is_some());
    if let (false, Some((_, axis, _))) = (by_ratio, &numeric) {
        across.clone_from(&axis.key);
    }
    let mut all = Vec::new();
    for (k, value) in policies.values.iter().enumerate().filter(|(k, _)| *k != full) {
        let mut rows = Vec::new();
        for (base, ratio) in cases.iter().zip(&ratios).filter(|(case, _)| of(case) == Some(full)) {
            // The case that differs in the policy alone.
            let same = |case: &&Case| {
                let others = case.at.iter().zip(&base.at).enumerate();
                of(case) == Some(k)
                    && others.filter(|(a, _)| *a != at - 1).all(|(_, (a, b))| a == b)
            };
            let Some(other) = cases.iter().find(same) else { continue };
            let place = match (by_ratio, &numeric) {
                (true, _) => *ratio,
                (false, Some((k, _, places))) => {
                    base.at.get(k - 1).and_then(|at| places.get(*at).copied())
                }
                (false, None) => None,
            };
            if let (Some(place), Some(apart)) = (place, distance(plan, base, other)) {
                let (case, floor) = (named(plan, base, at), floor(apart.time, [base, other]));
                rows.push(Row { case, place, apart, floor });
            }
        }
        rows.sort_by(|a, b| a.place.total_cmp(&b.place));
        let name = format!("{} from {}", plain(value), plain(&policies.values[full]));
        all.push(IsolatedLibrary { name, rows });
    }
    all.retain(|apart| !apart.rows.is_empty());
    Policies { all, across }
}

/// A value without quotes.
fn plain(value: &str) -> &str {
    value.trim_matches('"')
}

/// What a case is called without its policy.
fn named(plan: &Plan, case: &Case, policy: usize) -> String {
    let axes = plan.axes.iter().enumerate().skip(1).zip(&case.at);
    let others = axes.filter(|((k, _), _)| *k != policy);
    others.map(|((_, axis), at)| Axis::label(axis, *at)).collect::<Vec<_>>().join(", ")
}

/// Chemical over elastic rate at the start of a case; none where that has no meaning.
fn ratio(plan: &Plan, case: &Case) -> Option<f64> {
    let number = case.reference.as_ref()?.member;
    let scene = plan.scene(number).ok()?;
    let mut simulation = Simulation::new(&scene, &plan.search()).ok()?;
    simulation.prepare().ok()?;
    let ratio = Timescales::of(&mut simulation).ok()??.ratio();
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

/// The largest distances along time of the references of two cases.
fn distance(plan: &Plan, base: &Case, other: &Case) -> Option<Distance> {
    let (base, other) = (base.reference.as_ref()?, other.reference.as_ref()?);
    let course = Yardstick::of(plan, base.member)?.course(&other.states, &base.states);
    let largest = |of: fn(&Distance) -> f64| course.iter().map(of).fold(0.0, f64::max);
    let time = course.last()?.time;
    Some(Distance { time, species: largest(|d| d.species), shape: largest(|d| d.shape) })
}

/// How far the references of the two cases are from those that confirm them, together.
fn floor(time: f64, cases: [&Case; 2]) -> Distance {
    let of = |quantity| -> f64 {
        let references = cases.iter().filter_map(|case| case.reference.as_ref());
        let known = references.filter_map(|r| r.confirmed.as_ref()?.1.get(quantity));
        known.sum()
    };
    Distance { time, species: of(Quantity::Species), shape: of(Quantity::Shape) }
}

/// A distance is known if it is so many times the distance of the references.
const KNOWN: f64 = 3.0;

/// Places and distances that are known.
fn known(rows: &[Row], of: Part) -> Vec<(f64, f64)> {
    let known = |row: &&Row| of(&row.apart) > KNOWN * of(&row.floor) && of(&row.apart) > 0.0;
    rows.iter().filter(known).map(|row| (row.place, of(&row.apart))).collect()
}

/// A line of slope 1 from the first point, as far up as curves go.
fn guide(curves: &[Curve]) -> Option<Vec<(f64, f64)>> {
    let all = || curves.iter().flat_map(|curve| &curve.points);
    let first = curves.iter().find_map(|curve| curve.points.first())?;
    let last = all().map(|p| p.0).fold(first.0, f64::max);
    let most = all().map(|p| p.1).fold(first.1, f64::max);
    let factor = (last / first.0).min(most / first.1);
    (factor > 1.0).then(|| vec![*first, (factor * first.0, factor * first.1)])
}

/// The slope, on logarithmic axes, from where the distance is least and known to the next place.
fn slope(rows: &[Row], of: Part) -> Option<f64> {
    let points = known(rows, of);
    let least = (0..points.len()).min_by(|a, b| points[*a].1.total_cmp(&points[*b].1))?;
    let next = if least + 1 < points.len() { least + 1 } else { least.checked_sub(1)? };
    let (a, b) = (points[least], points[next]);
    let slope = (b.1 / a.1).ln() / (b.0 / a.0).ln();
    slope.is_finite().then_some(slope)
}

/// What distances are of.
const PARTS: [(&str, Part); 2] =
    [("distance of the species", |d| d.species), ("distance of the shape", |d| d.shape)];

impl Policies {
    /// The distances that are known, as a plot.
    pub(super) fn figure(&self) -> Figure {
        let Self { all, across } = self;
        let mut panels = Vec::new();
        let mut names: Vec<String> = all.iter().map(|apart| apart.name.clone()).collect();
        names.push("slope 1".to_owned());
        for (title, of) in PARTS {
            let line = |(name, apart): (usize, &IsolatedLibrary)| Curve {
                name,
                points: known(&apart.rows, of),
            };
            let mut curves: Vec<Curve> = all.iter().enumerate().map(line).collect();
            curves.extend(guide(&curves).map(|points| Curve { name: all.len(), points }));
            panels.extend(panel(title, across, curves));
        }
        Figure { names, guides: 1, panels, columns: 2 }
    }

    /// The distances as a table; none where policies are not varied.
    pub(super) fn table(&self) -> Option<Vec<Vec<String>>> {
        let Self { all, across } = self;
        let head = ["policy", "case", across, "species", "references", "shape", "references"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        for apart in all {
            for Row { case, place, apart: d, floor } in &apart.rows {
                let mut row = vec![apart.name.clone(), case.clone()];
                row.push(Short(two_digits(*place)).to_string());
                row.extend([d.species, floor.species, d.shape, floor.shape].map(percent));
                rows.push(row);
            }
            let slopes = PARTS.map(|(_, of)| slope(&apart.rows, of));
            if slopes.iter().any(Option::is_some) {
                let mut row = vec![
                    apart.name.clone(),
                    "slope at the smallest distances".into(),
                    String::new(),
                ];
                for slope in slopes {
                    row.push(slope.map_or("-".to_owned(), |s| label(two_digits(s))));
                    row.push(String::new());
                }
                rows.push(row);
            }
        }
        (rows.len() > 1).then_some(rows)
    }
}
