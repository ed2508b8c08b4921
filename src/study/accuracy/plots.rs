//! The plots of a study.

use super::advice::{Power, percent, subject};
use super::errors::{Case, Distance, Point};
use super::policies::Policies;
use super::{Quantity, Study};
use crate::num::real;
use crate::output::plot::{Curve, Figure, Panel};
use crate::study::sweep::{Axis, Plan};

/// What a run cost, if that is known.
type Cost = fn(&Point) -> Option<f64>;
/// One of the distances.
pub(super) type Part = fn(&Distance) -> f64;

/// Errors below this are round-off.
const LEAST: f64 = 1e-15;
/// Runs with an error beyond this have diverged.
const FARTHEST: f64 = 100.0;
/// What the plot of policies is called.
const POLICIES: &str = "policies";
/// Label of the line of the references' uncertainty.
const APART: &str = "references, apart";

/// How the line is called at the error that is wanted.
fn wanted(study: &Study) -> String {
    format!("wanted: {}", percent(study.wanted))
}

/// A plot.
pub(super) struct Drawn {
    pub(super) name: String,
    pub(super) caption: String,
    pub(super) figure: Figure,
    /// Of which case it is, if of one.
    pub(super) case: Option<usize>,
}

/// Every plot.
pub(super) fn figures(
    study: &Study,
    plan: &Plan,
    cases: &[Case],
    policies: &Policies,
) -> Vec<Drawn> {
    let mut all = Vec::new();
    for (number, case) in cases.iter().enumerate() {
        let end = match case.name.is_empty() {
            true => String::new(),
            false => format!(",{}", plain(&case.name)),
        };
        let mut add = |name: &str, caption: &str, figure: Figure| {
            if !figure.panels.is_empty() {
                let caption = match case.name.is_empty() {
                    true => caption.to_owned(),
                    false => format!("{}. {caption}", case.name),
                };
                all.push(Drawn {
                    name: format!("{name}{end}"),
                    caption,
                    figure,
                    case: Some(number),
                });
            }
        };
        add(
            "work-precision",
            "What accuracy costs: error against processor time of the steps, and beside it against work that \
             does not depend on the machine: evaluations of forces and laws, and factorisations. Lower left is better. Crosses: failed or diverged, at the time they took. \
             Dashed: how far the references are apart (nothing below it means anything), and the error that is \
             wanted. Triangles at the lower edge: errors of 0. Runs without factorisations are not in the last column. Later lines are \
             thinner, so that those below show.",
            work_precision(study, case),
        );
        add(
            "error-in-time",
            "Errors along time, of every integrator at its middle tolerance. Where the references part, so \
             does the meaning of these distances.",
            in_time(study, case),
        );
        add(
            "tolerance",
            "The error that one gets for the tolerance that one asks for. On the diagonal they are equal; \
             for fixed steps the tolerance is the step as a share of the whole time.",
            trust(study, case),
        );
        add(
            "measures",
            "Errors of what can be measured on any branch of a bifurcation, at the end, against processor time. \
             Below the spread over seeds they are smaller than what other random numbers change.",
            measures(study, case),
        );
        add(
            "map",
            "Error against the force tolerance, a line for every tolerance of the first integrator: where a \
             line is flat, forces are exact enough; what it comes down to is the error in time.",
            map(study, case),
        );
    }
    let policies = policies.figure();
    if !policies.panels.is_empty() {
        let caption = "How far the references of policies are apart, the largest along time. A slope of 1: the \
                       error of leaving a rate out goes with the ratio of the two. Left out: distances below three \
                       times those of the references that confirm them.";
        let (name, caption) = (format!("cases-{POLICIES}"), caption.to_owned());
        all.push(Drawn { name, caption, figure: policies, case: None });
    }
    for (k, axis) in plan.axes.iter().enumerate().skip(1) {
        let across = across(plan, cases, k, axis);
        if !across.panels.is_empty() {
            let name = format!("cases-{}", plan.plot_name(k));
            let caption = format!("Measures of the references at the end against {}.", axis.key);
            all.push(Drawn { name, caption, figure: across, case: None });
        }
    }
    all
}

/// A name for files.
fn plain(name: &str) -> String {
    let name = name.replace(" = ", "=").replace(", ", ",");
    name.replace(|c: char| !c.is_ascii_alphanumeric() && !"=,.+_-".contains(c), "-")
}

fn names(study: &Study, more: &[&str]) -> Vec<String> {
    let curves = study.curves.iter().map(|line| line.name.clone());
    curves.chain(more.iter().map(|name| (*name).to_owned())).collect()
}

pub(super) fn panel(title: &str, across: &str, curves: Vec<Curve>) -> Option<Panel> {
    let some = curves.iter().any(|curve| !curve.points.is_empty());
    some.then(|| Panel {
        title: title.to_owned(),
        across: across.to_owned(),
        logarithmic: (true, true),
        curves,
        failed: Vec::new(),
        zeros: Vec::new(),
    })
}

/// Points of one curve, from loose to tight, of all force tolerances or of the tightest alone.
fn line(case: &Case, curve: usize) -> impl Iterator<Item = &Point> {
    let tightest = case.points.iter().filter_map(|p| p.force).fold(f64::INFINITY, f64::min);
    let tight = move |p: &&Point| p.force.is_none_or(|force| force <= tightest);
    case.points.iter().filter(move |p| p.curve == curve).filter(tight)
}

/// A panel of errors. Those that are nothing but round-off have no place on a logarithmic axis: they are marks at the
/// lower edge.
fn errors(title: &str, across: &str, curves: Vec<Curve>) -> Option<Panel> {
    let mut panel = panel(title, across, curves)?;
    for Curve { name, points } in &mut panel.curves {
        panel.zeros.extend(points.iter().filter(|p| p.1 <= LEAST).map(|p| (*name, p.0)));
        points.retain(|p| p.1 > LEAST);
    }
    Some(panel)
}

/// Whether a run has diverged in any way: it would leave no room for the rest.
fn diverged(point: &Point) -> bool {
    let far = |q: &Quantity| point.error(*q).is_some_and(|error| !(error <= FARTHEST));
    Quantity::ALL.iter().any(far)
}

/// Error of `quantity` against `cost`, with the uncertainty of the references, as curves; what failed.
fn against(
    study: &Study,
    case: &Case,
    quantity: Quantity,
    cost: Cost,
) -> (Vec<Curve>, Vec<(usize, f64)>) {
    let mut curves = Vec::new();
    let mut failed = Vec::new();
    for (name, _) in study.curves.iter().enumerate() {
        let points = line(case, name)
            .filter(|p| !diverged(p))
            .filter_map(|p| Some((cost(p)?, p.error(quantity)?)))
            .filter(|p| p.0 > 0.0);
        curves.push(Curve { name, points: points.collect() });
        let lost = line(case, name).filter(|p| !p.ended() || diverged(p));
        failed.extend(lost.filter_map(|p| Some((name, cost(p)?))));
    }
    let places = || curves.iter().flat_map(|c| c.points.iter().map(|p| p.0));
    let (least, most) = places().fold((f64::INFINITY, 0.0f64), |(l, m), x| (l.min(x), m.max(x)));
    let apart = case.reference.as_ref().and_then(|r| r.confirmed.as_ref()?.1.get(quantity));
    let asked = (subject(study, case) == quantity).then_some(study.wanted);
    for (k, error) in [apart, asked].into_iter().enumerate() {
        if let Some(error) = error.filter(|error| *error > LEAST && least < most) {
            let points = vec![(least, error), (most, error)];
            curves.push(Curve { name: study.curves.len() + k, points });
        }
    }
    (curves, failed)
}

fn work_precision(study: &Study, case: &Case) -> Figure {
    let mut panels = Vec::new();
    let mut columns = 1;
    for quantity in [Quantity::Species, Quantity::Shape] {
        let others = panels.len();
        let costs: [(&str, Cost); 3] = [
            ("processor time of the steps [s]", seconds),
            ("evaluations of forces and laws", |p| number(p.work()?.evaluations())),
            ("factorisations", |p| number(p.work()?.factorisations)),
        ];
        for (title, cost) in costs {
            let (curves, failed) = against(study, case, quantity, cost);
            let title_up = format!("error of the {}", quantity.name());
            if let Some(mut panel) = errors(&title_up, title, curves) {
                panel.failed = failed;
                panels.push(panel);
            }
        }
        columns = columns.max(panels.len() - others);
    }
    let more = [APART, &wanted(study)];
    Figure { names: names(study, &more), guides: more.len(), panels, columns }
}

/// Processor time of the steps, or all that a run took which did not complete.
fn seconds(point: &Point) -> Option<f64> {
    point.seconds().or(point.found.seconds).filter(|seconds| *seconds > 0.0)
}

/// A count that can be drawn on a logarithmic axis.
fn number(count: u64) -> Option<f64> {
    usize::try_from(count).ok().filter(|count| *count > 0).map(real)
}

fn measures(study: &Study, case: &Case) -> Figure {
    let mut panels = Vec::new();
    for quantity in Quantity::ALL.into_iter().filter(|q| !q.is_field()) {
        let (mut curves, failed) = against(study, case, quantity, seconds);
        let places = || curves.iter().flat_map(|c| c.points.iter().map(|p| p.0));
        let (least, most) =
            places().fold((f64::INFINITY, 0.0f64), |(l, m), x| (l.min(x), m.max(x)));
        if let Some(spread) = case.spread_of(quantity).filter(|spread| *spread > 0.0) {
            let points = vec![(least, spread), (most, spread)];
            curves.push(Curve { name: study.curves.len() + 2, points });
        }
        let title = format!("error of the {}", quantity.name());
        if let Some(mut panel) = errors(&title, "processor time of the steps [s]", curves) {
            panel.failed = failed;
            panels.push(panel);
        }
    }
    let more = [APART, &wanted(study), "spread over seeds"];
    Figure { names: names(study, &more), guides: more.len(), panels, columns: 3 }
}

fn in_time(study: &Study, case: &Case) -> Figure {
    let mut panels = Vec::new();
    let distances: [(&str, Part); 2] =
        [("error of the species", |d| d.species), ("error of the shape", |d| d.shape)];
    for (title, of) in distances {
        let points = |course: &[Distance]| -> Vec<(f64, f64)> {
            course
                .iter()
                .map(|d| (d.time, of(d)))
                .filter(|p| p.0 > 0.0 && p.1 > LEAST && p.1 <= FARTHEST)
                .collect()
        };
        let mut curves = Vec::new();
        for (name, _) in study.curves.iter().enumerate() {
            let ended: Vec<&Point> = line(case, name).filter(|p| p.errors.is_some()).collect();
            let middle = ended.get(ended.len() / 2);
            let course = middle.and_then(|p| p.errors.as_ref()).map(|e| points(&e.course));
            curves.push(Curve { name, points: course.unwrap_or_default() });
        }
        if let Some((_, apart)) = case.reference.as_ref().and_then(|r| r.confirmed.as_ref()) {
            curves.push(Curve { name: study.curves.len(), points: points(&apart.course) });
        }
        if let Some(mut panel) = panel(title, "time", curves) {
            panel.logarithmic = (false, true);
            panels.push(panel);
        }
    }
    Figure { names: names(study, &[APART]), guides: 1, panels, columns: 2 }
}

fn trust(study: &Study, case: &Case) -> Figure {
    let mut panels = Vec::new();
    for quantity in [Quantity::Species, Quantity::Shape] {
        let mut curves = Vec::new();
        for (name, _) in study.curves.iter().enumerate() {
            let points = line(case, name).filter_map(|p| Some((p.tolerance, p.error(quantity)?)));
            let points = points.filter(|p| p.1 <= FARTHEST);
            curves.push(Curve { name, points: points.collect() });
        }
        let asked = || case.points.iter().map(|p| p.tolerance);
        let (least, most) = asked().fold((f64::INFINITY, 0.0f64), |(l, m), x| (l.min(x), m.max(x)));
        if curves.iter().any(|c| !c.points.is_empty()) && least < most {
            let points = vec![(least, least), (most, most)];
            curves.push(Curve { name: study.curves.len(), points });
            let title = format!("error of the {}", quantity.name());
            panels.extend(errors(&title, "tolerance", curves));
        }
    }
    Figure { names: names(study, &["error = tolerance"]), guides: 1, panels, columns: 2 }
}

fn map(study: &Study, case: &Case) -> Figure {
    let mut panels = Vec::new();
    let mut tolerances: Vec<f64> = Vec::new();
    for point in case.points.iter().filter(|p| p.curve == 0 && p.force.is_some()) {
        if !tolerances.contains(&point.tolerance) {
            tolerances.push(point.tolerance);
        }
    }
    for quantity in [Quantity::Species, Quantity::Shape] {
        let line = |(name, tolerance): (usize, &f64)| {
            let mine = |p: &&Point| p.curve == 0 && p.tolerance == *tolerance;
            let points = case.points.iter().filter(mine);
            let points = points.filter_map(|p| Some((p.force?, p.error(quantity)?)));
            Curve { name, points: points.collect() }
        };
        let curves = tolerances.iter().enumerate().map(line).collect();
        let title = format!("error of the {}", quantity.name());
        panels.extend(errors(&title, "force tolerance", curves));
    }
    let name = study.curves.first().map_or("", |c| c.name.as_str());
    let named = tolerances.iter().map(|t| format!("{name}, {}", Power(*t)));
    Figure { names: named.collect(), guides: 0, panels, columns: 2 }
}

/// Measures of the references of all cases against one of the other keys.
fn across(plan: &Plan, cases: &[Case], key: usize, axis: &Axis) -> Figure {
    let none = Figure { names: Vec::new(), guides: 0, panels: Vec::new(), columns: 1 };
    let Some(places) = axis.numbers().filter(|all| all.len() > 1) else { return none };
    let wide = places.iter().all(|x| *x > 0.0);
    // A line for every combination of the keys that are left.
    let rest = |case: &Case| -> Vec<usize> {
        let at = case.at.iter().enumerate();
        at.filter(|(k, _)| k + 1 != key).map(|(_, at)| *at).collect()
    };
    let mut lines: Vec<(Vec<usize>, String)> = Vec::new();
    for case in cases {
        let rest = rest(case);
        if !lines.iter().any(|(known, _)| *known == rest) {
            let others = plan.axes.iter().enumerate().skip(1).filter(|(k, _)| *k != key);
            let named = others.map(|(_, axis)| axis).zip(&rest);
            let name: Vec<String> = named.map(|(axis, k)| axis.label(*k)).collect();
            let name = if name.is_empty() { "references".to_owned() } else { name.join(", ") };
            lines.push((rest, name));
        }
    }
    let mut panels = Vec::new();
    for quantity in Quantity::ALL.into_iter().filter(|q| !q.is_field()) {
        let mut curves = Vec::new();
        for (name, (known, _)) in lines.iter().enumerate() {
            let mine = cases.iter().filter(|case| rest(case) == *known);
            let point = |case: &Case| {
                let place = places.get(*case.at.get(key - 1)?)?;
                Some((*place, quantity.of(&case.reference.as_ref()?.measures)?))
            };
            let mut points: Vec<(f64, f64)> = mine.filter_map(point).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            curves.push(Curve { name, points });
        }
        if let Some(mut panel) = panel(quantity.name(), &axis.key, curves) {
            panel.logarithmic = (wide, false);
            panels.push(panel);
        }
    }
    let columns = panels.len().clamp(1, 3);
    Figure { names: lines.into_iter().map(|(_, name)| name).collect(), guides: 0, panels, columns }
}
