//! Distance between policies: the references of each against those of the fullest one, along another key.
//!
//! Where the shape relaxes fast, simultaneous tends to quasi-static, with a distance that goes with the ratio of
//! the rates of chemistry and shape: a slope of 1. What it tends to says whether a policy may be used.

use super::Quantity;
use super::advice::{percent, two_digits};
use super::errors::Case;
use super::plots::panel;
use crate::num::Short;
use crate::output::plot::{Curve, Figure, label};
use crate::run::Simulation;
use crate::study::compare::Timescales;
use crate::study::extent;
use crate::study::plan::Plan;

/// The key that chooses a policy.
const POLICY_KEY: &str = "time.policy";
/// The policy that leaves nothing out.
const FULLEST_POLICY: &str = "simultaneous";
/// A distance is known if it is so many times the distance of the references.
const KNOWN_DISTANCE_RATIO: f64 = 3.0;

/// The distances of one policy from another.
struct PolicyDistances {
    /// Which policy from which.
    name: String,
    rows: Vec<Row>,
}

/// The distance in one case.
struct Row {
    /// Name of the case.
    case: String,
    /// Its place.
    place: f64,
    /// Distance between the policies, of every one of the fields.
    distance: [f64; 2],
    /// Uncertainty of the references of each: smaller distances are not resolved.
    floor: [f64; 2],
}

/// Distance between policies.
#[derive(Default)]
pub(super) struct Policies {
    /// Distances of all policies from the fullest; none where policies are not varied.
    all: Vec<PolicyDistances>,
    /// Title of the abscissa.
    across: String,
}

/// Measures the distance between the policies of a study.
pub(super) fn policies(plan: &Plan, cases: &[Case]) -> Policies {
    let axes = || plan.axes.iter().enumerate().skip(1);
    let Some((at, policies)) = axes().find(|(_, axis)| axis.key == POLICY_KEY) else {
        return Policies::default();
    };
    let of = |case: &Case| case.at.get(at).copied();
    let count = policies.values.len();
    let full = (0..count).find(|k| policies.value(*k) == FULLEST_POLICY).unwrap_or(0);
    let fullest = || cases.iter().filter(|case| of(case) == Some(full));
    let ratios: Option<Vec<f64>> = fullest().map(|case| ratio(plan, case)).collect();
    let numeric = axes().find_map(|(k, axis)| Some((k, axis, axis.numbers()?)));
    let place = |number: usize, case: &Case| match (&ratios, &numeric) {
        (Some(ratios), _) => Some(ratios[number]),
        (None, Some((k, _, places))) => places.get(*case.at.get(*k)?).copied(),
        (None, None) => None,
    };
    let across = match (&ratios, &numeric) {
        (None, Some((_, axis, _))) => axis.key.clone(),
        _ => "ratio of the rates of chemistry and shape".to_owned(),
    };
    let rows = |policy: usize| {
        let row = |(number, base): (usize, &Case)| {
            // The case that differs in the policy alone.
            let others = |case: &Case| {
                let pairs = case.at.iter().zip(&base.at).enumerate().skip(1);
                pairs.filter(|(k, _)| *k != at).all(|(_, (a, b))| a == b)
            };
            let other = cases.iter().find(|case| of(case) == Some(policy) && others(case))?;
            let floor =
                |quantity| [base, other].iter().filter_map(|case| case.floor(quantity)).sum();
            Some(Row {
                place: place(number, base)?,
                distance: distance(base, other)?,
                case: plan.label(&base.at, |k| k != 0 && k != at),
                floor: Quantity::FIELDS.map(floor),
            })
        };
        let mut rows: Vec<Row> = fullest().enumerate().filter_map(row).collect();
        rows.sort_by(|a, b| a.place.total_cmp(&b.place));
        let name = format!("{} from {}", policies.value(policy), policies.value(full));
        PolicyDistances { name, rows }
    };
    let all = (0..count).filter(|k| *k != full).map(rows).filter(|all| !all.rows.is_empty());
    Policies { all: all.collect(), across }
}

/// Chemical over elastic rate at the start of a case; none where that has no meaning.
fn ratio(plan: &Plan, case: &Case) -> Option<f64> {
    let scene = plan.scene(case.reference.as_ref()?.run.member).ok()?;
    let mut simulation = Simulation::new(&scene, &plan.search()).ok()?;
    simulation.prepare().ok()?;
    let ratio = Timescales::of(&mut simulation).ok()??.ratio();
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

/// The largest distances along time of the references of two cases.
fn distance(base: &Case, other: &Case) -> Option<[f64; 2]> {
    let [truth, run] = [base, other].map(|case| Some(&case.reference.as_ref()?.run.states));
    let course = base.norm.as_ref()?.course(run?, truth?);
    let largest = |quantity| course.iter().map(|d| d.of(quantity)).fold(0.0, f64::max);
    (!course.is_empty()).then(|| Quantity::FIELDS.map(largest))
}

/// Places and distances of the field that are known.
fn known(rows: &[Row], field: usize) -> Vec<(f64, f64)> {
    let all = rows.iter().map(|row| (row.place, row.distance[field], row.floor[field]));
    let known = all
        .filter(|(_, distance, floor)| *distance > KNOWN_DISTANCE_RATIO * floor && *distance > 0.0);
    known.map(|(place, distance, _)| (place, distance)).collect()
}

/// A line of slope 1 from the first point, as far up as curves go.
fn guide(curves: &[Curve]) -> Option<Vec<(f64, f64)>> {
    let all = || curves.iter().flat_map(|curve| &curve.points);
    let first = all().next()?;
    let (last, most) = (extent(all().map(|p| p.0)).1, extent(all().map(|p| p.1)).1);
    let factor = (last / first.0).min(most / first.1);
    (factor > 1.0).then(|| vec![*first, (factor * first.0, factor * first.1)])
}

/// The slope, on logarithmic axes, from where the distance is least and known to the next place.
fn slope(rows: &[Row], field: usize) -> Option<f64> {
    let points = known(rows, field);
    let least = (0..points.len()).min_by(|a, b| points[*a].1.total_cmp(&points[*b].1))?;
    let next = if least + 1 < points.len() { least + 1 } else { least.checked_sub(1)? };
    let (a, b) = (points[least], points[next]);
    let slope = (b.1 / a.1).ln() / (b.0 / a.0).ln();
    slope.is_finite().then_some(slope)
}

impl Policies {
    /// The distances that are known, as a plot.
    pub(super) fn figure(&self) -> Figure {
        let Self { all, across } = self;
        let panel = |(field, quantity): (usize, &Quantity)| {
            let line = |(name, of): (usize, &PolicyDistances)| Curve {
                name,
                points: known(&of.rows, field),
            };
            let mut curves: Vec<Curve> = all.iter().enumerate().map(line).collect();
            curves.extend(guide(&curves).map(|points| Curve { name: all.len(), points }));
            panel(format!("distance of the {}", quantity.name()), across, curves)
        };
        let panels = Quantity::FIELDS.iter().enumerate().filter_map(panel).collect();
        let names = all.iter().map(|of| of.name.clone()).chain(["slope 1".to_owned()]);
        Figure { names: names.collect(), guides: 1, marks: Vec::new(), panels }
    }

    /// The distances as a table; none where policies are not varied.
    pub(super) fn table(&self) -> Option<Vec<Vec<String>>> {
        let Self { all, across } = self;
        let head = ["policy", "case", across, "species", "references", "shape", "references"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        for PolicyDistances { name, rows: of } in all {
            for Row { case, place, distance: [species, shape], floor } in of {
                let place = Short(two_digits(*place)).to_string();
                let numbers = [*species, floor[0], *shape, floor[1]].map(percent);
                rows.push([&[name.clone(), case.clone(), place][..], &numbers].concat());
            }
            let slopes = [0, 1].map(|field| slope(of, field));
            if slopes.iter().any(Option::is_some) {
                let [a, b] = slopes.map(|s| s.map_or("-".to_owned(), |s| label(two_digits(s))));
                let title = "slope at the smallest distances".to_owned();
                let (none, name) = (String::new(), name.clone());
                rows.push(vec![name, title, none.clone(), a, none.clone(), b, none]);
            }
        }
        (rows.len() > 1).then_some(rows)
    }
}
