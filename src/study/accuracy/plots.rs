//! The plots of a study.

use super::advice::{Scientific, percent, subject};
use super::errors::{Case, Point};
use super::policies::Policies;
use super::{Quantity, Study};
use crate::num::real;
use crate::output::plot::{Curve, Figure, Panel, Plot};
use crate::study::draw::plot::StudyPlot;
use crate::study::extent;
use crate::study::gather::Distance;
use crate::study::plan::Plan;

/// Cost of a run, if that is known.
type Cost = fn(&Point) -> Option<f64>;

/// Errors below this are round-off.
const ROUND_OFF: f64 = 1e-15;
/// Runs with an error beyond this have diverged.
const DIVERGED_ERROR: f64 = 100.0;
/// Label of the line of the references' uncertainty.
const UNCERTAINTY_LABEL: &str = "reference uncertainty";

/// Name, caption and figure of a plot of a case.
type CasePlot = (&'static str, &'static str, fn(&Study, &Case) -> Figure);

/// Every plot of a case.
const OF_CASE: [CasePlot; 6] = [
    (
        "work-precision",
        "What accuracy costs: error against processor time of the steps, and beside it against work that \
         does not depend on the machine: evaluations of forces and laws, iterations of relaxations and of Newton's method, and factorisations. Lower left is better. \
         Along a line with the stabilisation varied, the tolerance is fixed. \
         Crosses: failed or diverged, at the time they took. \
         Dashed: the reference uncertainty (noise floor), and the target error \
         wanted. Triangles at the lower edge: errors of 0. Runs without iterations or factorisations are not in those columns. Later lines are \
         thinner, so that those below show.",
        work_precision,
    ),
    (
        "error-in-time",
        "Errors along time, of every integrator at its middle tolerance. Where the references part, so \
         does the meaning of these distances.",
        in_time,
    ),
    (
        "tolerance",
        "The error that one gets for the tolerance that one asks for. On the diagonal they are equal; \
         for fixed steps the tolerance is the step as a share of the whole time.",
        by_tolerance,
    ),
    (
        "stabilisation",
        "Error against the stabilisation, the largest share of the energy supplied that the drag takes up: where a line is \
         flat, the drag is small enough, and the error that is left is that of the tolerance.",
        by_stabilisation,
    ),
    (
        "measures",
        "Errors of what can be measured on any branch of a bifurcation, at the end, against processor time. \
         Below the spread over seeds they are smaller than what other random numbers change.",
        measures,
    ),
    (
        "map",
        "Error against the force tolerance, a line for every tolerance of the first integrator: where a \
         line is flat, forces are exact enough; what it comes down to is the error in time.",
        by_force_tolerance,
    ),
];

/// Every plot that has something to show, with the number of its case if it is of one.
pub(super) fn figures(
    study: &Study,
    plan: &Plan,
    cases: &[Case],
    policies: &Policies,
) -> Vec<(Option<usize>, Plot)> {
    let mut all = Vec::new();
    let mut add = |case, name, caption, figure: Figure| {
        if !figure.panels.is_empty() {
            all.push((case, Plot { name, caption, figure }));
        }
    };
    for (number, case) in cases.iter().enumerate() {
        let [before, after] = match case.name.is_empty() {
            true => Default::default(),
            false => [format!("{}. ", case.name), format!(",{}", file_name(&case.name))],
        };
        for (name, caption, figure) in OF_CASE {
            let (name, caption) = (format!("{name}{after}"), format!("{before}{caption}"));
            add(Some(number), name, caption, figure(study, case));
        }
    }
    let caption = "Distance between the references of policies, the largest along time. A slope of 1: the \
                   error of leaving a rate out goes with the ratio of the two. Left out: distances below three \
                   times those of the references that confirm them.";
    add(None, "cases-policies".to_owned(), caption.to_owned(), policies.figure());
    for (k, axis) in plan.axes.iter().enumerate().skip(1) {
        let caption = format!("Measures of the references at the end against {}.", axis.key);
        add(None, format!("cases-{}", plan.plot_name(k)), caption, across(plan, cases, k));
    }
    all
}

/// A name for files.
fn file_name(name: &str) -> String {
    let name = name.replace(" = ", "=").replace(", ", ",");
    name.replace(|c: char| !c.is_ascii_alphanumeric() && !"=,.+_-".contains(c), "-")
}

/// Panels of a study with a curve for every integrator, and lines to compare with.
fn figure(study: &Study, guides: &[&str], panels: Vec<Panel>) -> Figure {
    let curves = study.curves.iter().map(|line| line.name.as_str());
    let names = curves.chain(guides.iter().copied()).map(str::to_owned).collect();
    Figure { names, guides: guides.len(), marks: Vec::new(), panels }
}

/// The name of the line at the error that is wanted.
fn wanted(study: &Study) -> String {
    format!("wanted: {}", percent(study.wanted))
}

/// A panel with logarithmic axes; none without points.
pub(super) fn panel(title: String, across: &str, curves: Vec<Curve>) -> Option<Panel> {
    let some = curves.iter().any(|curve| !curve.points.is_empty());
    let (across, logarithmic) = (across.to_owned(), (true, true));
    some.then(|| Panel { title, across, logarithmic, curves, ..Panel::default() })
}

/// A panel of errors. Those that are nothing but round-off have no place on a logarithmic axis: they are marks at the
/// lower edge.
fn errors(of: Quantity, across: &str, curves: Vec<Curve>) -> Option<Panel> {
    let mut panel = panel(error_of(of), across, curves)?;
    for Curve { name, points } in &mut panel.curves {
        panel.zeros.extend(points.iter().filter(|p| p.1 <= ROUND_OFF).map(|p| (*name, p.0)));
        points.retain(|p| p.1 > ROUND_OFF);
    }
    Some(panel)
}

fn error_of(quantity: Quantity) -> String {
    format!("error of the {}", quantity.name())
}

/// Points of one curve, from loose to tight, of all force tolerances or of the tightest alone; with the point of the other
/// curve that it branches off.
fn line<'a>(study: &Study, case: &'a Case, curve: usize) -> impl Iterator<Item = &'a Point> {
    let tightest = case.points.iter().filter_map(|p| p.force).fold(f64::INFINITY, f64::min);
    let tight = |p: &&Point| p.force.is_none_or(|force| force <= tightest);
    let from = study.curves.get(curve).and_then(|c| c.branches_off);
    let root = |p: &Point| from.is_some_and(|f| p.curve == f.curve && p.tolerance == f.tolerance);
    let points = case.points.iter().filter(|p| p.curve == curve || root(p)).filter(tight);
    let mut points: Vec<&Point> = points.collect();
    if from.is_some() {
        let share = |p: &Point| p.stabilisation.unwrap_or_default();
        points.sort_by(|a, b| share(b).total_cmp(&share(a)));
    }
    points.into_iter()
}

/// A curve for every integrator, through what `of` makes of its points.
fn curves(study: &Study, case: &Case, of: impl Fn(&Point) -> Option<(f64, f64)>) -> Vec<Curve> {
    let curve = |name| Curve { name, points: line(study, case, name).filter_map(&of).collect() };
    (0..study.curves.len()).map(curve).collect()
}

/// Adds a horizontal line at `level`, as long as the curves reach.
fn add_guide(curves: &mut Vec<Curve>, name: usize, level: Option<f64>) {
    let (least, most) = extent(curves.iter().flat_map(|c| c.points.iter().map(|p| p.0)));
    if let Some(level) = level.filter(|_| least < most) {
        curves.push(Curve { name, points: vec![(least, level), (most, level)] });
    }
}

/// Whether a run has diverged in any way: it would leave no room for the rest.
fn diverged(point: &Point) -> bool {
    let far = |q: &Quantity| point.error(*q).is_some_and(|error| !(error <= DIVERGED_ERROR));
    Quantity::ALL.iter().any(far)
}

/// Error of `quantity` against a cost, with the uncertainty of the references, the error that is wanted and the
/// spread over seeds; crosses for what failed.
fn against(
    study: &Study,
    case: &Case,
    quantity: Quantity,
    (title, cost): (&str, Cost),
) -> Option<Panel> {
    let mut curves = curves(study, case, |p| {
        let point = (cost(p)?, p.error(quantity)?);
        (!diverged(p) && point.0 > 0.0).then_some(point)
    });
    let lost = |name| {
        let lost = line(study, case, name).filter(|p| !p.is_complete() || diverged(p));
        lost.filter_map(move |p| Some((name, cost(p)?)))
    };
    let failed = (0..study.curves.len()).flat_map(lost).collect();
    let wanted = (subject(study, case) == quantity).then_some(study.wanted);
    let levels = [case.floor(quantity), wanted, case.spread_of(quantity)];
    for (k, level) in levels.into_iter().enumerate() {
        add_guide(&mut curves, study.curves.len() + k, level.filter(|level| *level > ROUND_OFF));
    }
    Some(Panel { failed, ..errors(quantity, title, curves)? })
}

/// Processor time of the steps, or all that a run took which did not complete.
const TIME: (&str, Cost) = ("processor time of the steps [s]", |point| {
    point.seconds().or(point.found.seconds).filter(|seconds| *seconds > 0.0)
});

fn work_precision(study: &Study, case: &Case) -> Figure {
    /// A count that can be drawn on a logarithmic axis.
    fn number(count: u64) -> Option<f64> {
        usize::try_from(count).ok().filter(|count| *count > 0).map(real)
    }
    let costs: [(&str, Cost); 4] = [
        TIME,
        ("evaluations of forces and laws", |p| number(p.work()?.evaluations())),
        ("iterations", |p| number(p.iterations()?)),
        ("factorisations", |p| number(p.work()?.factorisations)),
    ];
    let panels = |quantity| -> Vec<Panel> {
        costs.iter().filter_map(|cost| against(study, case, quantity, *cost)).collect()
    };
    let panels = Quantity::FIELDS.map(panels);
    figure(study, &[UNCERTAINTY_LABEL, &wanted(study)], panels.concat())
}

fn measures(study: &Study, case: &Case) -> Figure {
    let panels = Quantity::MEASURES.into_iter().filter_map(|q| against(study, case, q, TIME));
    figure(study, &[UNCERTAINTY_LABEL, &wanted(study), "spread over seeds"], panels.collect())
}

fn in_time(study: &Study, case: &Case) -> Figure {
    let panel = |quantity| {
        let points = |course: &[Distance]| -> Vec<(f64, f64)> {
            let all = course.iter().map(|d| (d.time, d.of(quantity)));
            all.filter(|p| p.0 > 0.0 && p.1 > ROUND_OFF && p.1 <= DIVERGED_ERROR).collect()
        };
        let curve = |name| {
            let ended: Vec<_> = line(study, case, name).filter_map(|p| p.errors.as_ref()).collect();
            let middle = ended.get(ended.len() / 2);
            Curve { name, points: middle.map_or(Vec::new(), |errors| points(&errors.course)) }
        };
        let mut curves: Vec<Curve> = (0..study.curves.len()).map(curve).collect();
        if let Some((_, errors)) = case.reference.as_ref().and_then(|r| r.confirmed.as_ref()) {
            curves.push(Curve { name: study.curves.len(), points: points(&errors.course) });
        }
        Some(Panel { logarithmic: (false, true), ..panel(error_of(quantity), "time", curves)? })
    };
    figure(study, &[UNCERTAINTY_LABEL], Quantity::FIELDS.into_iter().filter_map(panel).collect())
}

fn by_tolerance(study: &Study, case: &Case) -> Figure {
    let (least, most) = extent(case.points.iter().map(|p| p.tolerance));
    let panel = |quantity| {
        let mut curves = curves(study, case, |p| {
            Some((p.tolerance, p.error(quantity).filter(|error| *error <= DIVERGED_ERROR)?))
        });
        curves.retain(|c| !branches(study, c));
        let some = least < most && curves.iter().any(|c| !c.points.is_empty());
        let points = vec![(least, least), (most, most)];
        curves.push(Curve { name: study.curves.len(), points });
        errors(quantity, "tolerance", curves).filter(|_| some)
    };
    let panels = Quantity::FIELDS.into_iter().filter_map(panel);
    figure(study, &["error = tolerance"], panels.collect())
}

/// Whether the stabilisation is varied along `curve`.
fn branches(study: &Study, curve: &Curve) -> bool {
    study.curves.get(curve.name).is_some_and(|line| line.branches_off.is_some())
}

fn by_stabilisation(study: &Study, case: &Case) -> Figure {
    let panel = |quantity| {
        let mut curves = curves(study, case, |p| {
            let error = p.error(quantity).filter(|error| *error <= DIVERGED_ERROR)?;
            Some((p.stabilisation.filter(|share| *share > 0.0)?, error))
        });
        curves.retain(|curve| branches(study, curve));
        add_guide(&mut curves, study.curves.len(), case.floor(quantity));
        errors(quantity, "stabilisation", curves)
    };
    let quantities = [Quantity::Species, Quantity::Shape, Quantity::Energy];
    let panels = quantities.into_iter().filter_map(panel).collect();
    let mut figure = figure(study, &[UNCERTAINTY_LABEL], panels);
    // The colours are those of the other plots.
    let others = study.curves.iter().zip(&mut figure.names);
    others.filter(|(line, _)| line.branches_off.is_none()).for_each(|(_, name)| name.clear());
    figure
}

fn by_force_tolerance(study: &Study, case: &Case) -> Figure {
    let mut tolerances: Vec<f64> = Vec::new();
    for point in case.points.iter().filter(|p| p.curve == 0 && p.force.is_some()) {
        if !tolerances.contains(&point.tolerance) {
            tolerances.push(point.tolerance);
        }
    }
    let panel = |quantity| {
        let line = |(name, tolerance): (usize, &f64)| {
            let mine = |p: &&Point| p.curve == 0 && p.tolerance == *tolerance;
            let points = case.points.iter().filter(mine);
            let points = points.filter_map(|p| Some((p.force?, p.error(quantity)?)));
            Curve { name, points: points.collect() }
        };
        errors(quantity, "force tolerance", tolerances.iter().enumerate().map(line).collect())
    };
    let panels = Quantity::FIELDS.into_iter().filter_map(panel).collect();
    let name = study.curves.first().map_or("", |c| c.name.as_str());
    let names = tolerances.iter().map(|t| format!("{name}, {}", Scientific(*t))).collect();
    Figure { names, guides: 0, marks: Vec::new(), panels }
}

/// Measures of the references of all cases against one of the other keys.
fn across(plan: &Plan, cases: &[Case], key: usize) -> Figure {
    let axis = &plan.axes[key];
    if axis.numbers().is_none_or(|all| all.len() < 2) {
        return Figure::default();
    }
    let plot = StudyPlot::new(plan, key, |k| k != 0 && k != key);
    let panel = |quantity: &Quantity| {
        let value = |case: &'_ Case| quantity.of(case.measures()?);
        let values = cases.iter().filter_map(|case| Some((&case.at[..], value(case)?)));
        let panel = panel(quantity.name().to_owned(), &axis.key, plot.curves(values))?;
        let positive = plot.places.iter().all(|x| *x > 0.0);
        Some(Panel { logarithmic: (positive, false), ..panel })
    };
    let panels = Quantity::MEASURES.iter().filter_map(panel).collect();
    plot.figure("references", panels)
}
