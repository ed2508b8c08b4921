//! The report of a study: tables, and words around the plots.

use super::advice::{described, percent, time, two_digits};
use super::errors::{Case, Point};
use super::policies::Policies;
use super::{IntegratorCurve, Quantity, Study};
use crate::num::{Short, real};
use crate::output::plot::{Block, Plot, label};
use crate::study::draw::table::{csv_table, number, work_cells, work_titles};
use crate::study::plan::{Axis, Plan};
use crate::study::refinement::{self, order_and_limit};
use crate::study::run::Timing;

/// A row for every run that is compared: method, status, errors, cost.
pub(super) fn csv(study: &Study, cases: &[Case]) -> String {
    let head = ["case", "integrator", "tolerance", "force tolerance", "stabilisation", "status"];
    let head = head.map(str::to_owned);
    let errors = Quantity::ALL.map(|q| format!("error of the {}", q.name()));
    let times = ["steps [s]", "least [s]", "most [s]", "start [s]"].map(str::to_owned);
    let mut rows = vec![[&head[..], &errors, &times, &COUNT_NAMES.map(str::to_owned)].concat()];
    rows[0].extend(work_titles(&COUNT_NAMES));
    rows[0].extend(["memory [MB]".to_owned(), "reason".to_owned()]);
    for (case, point) in cases.iter().flat_map(|case| case.points.iter().map(move |p| (case, p))) {
        let found = &point.found;
        let curve = study.curves.get(point.curve).map_or("", |c| c.name.as_str());
        let mut row = vec![case.name.clone(), curve.to_owned(), point.tolerance.to_string()];
        row.extend([number(point.force), number(point.stabilisation), found.status.to_string()]);
        row.extend(Quantity::ALL.map(|q| number(point.error(q))));
        let timing = found.timing.as_ref();
        let spread = timing.map(|t| t.spread());
        let times = [spread.map(|s| s.0), spread.map(|s| s.1), timing.map(|t| t.start)];
        row.push(number(point.seconds()));
        row.extend(times.map(number));
        row.extend(counts(point, ""));
        // Other programs do not count more.
        row.extend(work_cells(point.work().filter(|_| !point.is_peer()), &COUNT_NAMES));
        row.extend([number(found.peak_resident_megabytes()), found.why_incomplete().to_owned()]);
        rows.push(row);
    }
    csv_table(&rows)
}

/// The report.
pub(super) fn blocks(
    study: &Study,
    plan: &Plan,
    (cases, policies): (&[Case], &Policies),
    (open, advice): (Option<&str>, &[String]),
    drawings: Vec<(Option<usize>, Plot)>,
) -> Vec<Block> {
    let scene = plan.scene.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut blocks = vec![Block::Heading(1, format!("What accuracy costs: {scene}"))];
    for set in &plan.set {
        blocks.push(Block::Text(format!("With {set}.")));
    }
    blocks.extend(open.map(|open| Block::Advice(open.to_owned())));
    let mut drawings = drawings.into_iter().peekable();
    for (number, (case, advice)) in cases.iter().zip(advice).enumerate() {
        if !case.name.is_empty() {
            blocks.push(Block::Heading(2, case.name.clone()));
        }
        blocks.push(Block::Advice(advice.clone()));
        blocks.push(Block::List(known(case)));
        while let Some((_, plot)) = drawings.next_if(|(case, _)| *case == Some(number)) {
            blocks.push(Block::Plot(plot));
        }
        let depth = if case.name.is_empty() { 2 } else { 3 };
        let title = "Errors in units of the tolerance";
        let text = "One asks for a tolerance and gets an error: 1 is what was asked for. Fixed steps have no \
                    tolerance and are left out.";
        blocks.push(Block::Heading(depth, "All runs".into()));
        blocks.push(Block::Table(table(study, case)));
        blocks.extend(section(depth, title, text, ratios(study, case)));
    }
    for (k, axis) in plan.axes.iter().enumerate().skip(1) {
        let text = "Measures of the references at the end on ever finer meshes, the order of convergence that \
                    the three finest show for edges as long as N^(-1/2), and what they tend to (Richardson). \
                    No order: the three do not converge evenly, or other random numbers change the finest by more \
                    than the last two differ.";
        let rows = mesh(cases, k, axis);
        blocks.extend(rows.into_iter().flat_map(|rows| section(2, "The mesh", text, rows)));
    }
    let text = "Distance between the references of policies, the largest along time, against the ratio of the rates \
                of chemistry and shape at the start, and beside that how far those references are from the ones that \
                confirm them: smaller distances are not known. With a slope of 1 a policy errs by what it leaves out.";
    blocks.extend(policies.table().into_iter().flat_map(|rows| section(2, "Policies", text, rows)));
    blocks.extend(drawings.map(|(_, plot)| Block::Plot(plot)));
    if !study.left_out.is_empty() {
        blocks.push(Block::Heading(2, "Left out".into()));
        blocks.push(Block::List(study.left_out.clone()));
    }
    blocks
}

/// A table with its heading and a paragraph.
fn section(depth: usize, title: &str, text: &str, rows: Vec<Vec<String>>) -> [Block; 3] {
    [Block::Heading(depth, title.into()), Block::Text(text.into()), Block::Table(rows)]
}

/// Lists the reference of a case, its uncertainty, and the runs that failed.
fn known(case: &Case) -> Vec<String> {
    let shares = |of: &dyn Fn(Quantity) -> Option<f64>| -> String {
        let all = Quantity::ALL.into_iter().filter_map(|q| Some((q, of(q)?)));
        let all = all.map(|(q, share)| format!("{} {}", q.name(), percent(share)));
        all.collect::<Vec<_>>().join(", ")
    };
    let mut items = Vec::new();
    if let Some(reference) = &case.reference {
        let seconds = reference.run.found.timing.as_ref().map(Timing::median);
        let took = seconds.map_or(String::new(), |s| format!(", {}", time(s)));
        items.push(format!("Reference: {}{took}.", reference.name));
        if reference.still {
            return items;
        }
        if let Some((second, _)) = &reference.confirmed {
            let apart = shares(&|q| case.floor(q));
            items.push(format!("Confirmed by {second}; reference uncertainty: {apart}."));
        }
        if let Some(from) = reference.diverged {
            items.push(format!(
                "The references part at t = {}: from there on they are on different branches, distances of \
                 fields mean nothing, and errors of species and shape are the largest before. Number of \
                 regions, energy, amplitude and separation are compared at the end.",
                label(from)
            ));
        }
        if let Some(since) = reference.unstable {
            items.push(format!(
                "From t = {} on the reference is on a branch that has become unstable: an imperfection would leave \
                 it. List stability.perturb in the scene, and all runs leave it.",
                label(since)
            ));
        }
        for (name, distance) in &reference.others {
            items.push(format!("Another reference, {name}, is {} away.", percent(*distance)));
        }
        let outputs = reference.run.found.measures.len();
        if let Some(steps) = bound_by_output(case, outputs) {
            items.push(format!(
                "The run with the fewest steps makes {steps} and ends one at each of {} output times: with a longer time \
                 between outputs it would err by more.",
                outputs - 1
            ));
        }
    }
    items.extend(case.lost.iter().map(|(name, why)| format!("Reference {name}: {why}.")));
    if case.seeds > 0 {
        items.push(format!(
            "Spread over {} seeds (half of the range): {}. A smaller error is not meaningful.",
            case.seeds + 1,
            shares(&|q| case.spread_of(q))
        ));
    }
    for Point { name, found, .. } in case.points.iter().filter(|p| !p.is_complete()) {
        let why = [name.clone(), found.status.to_string(), found.reason.clone()];
        let some: Vec<String> = why.into_iter().filter(|text| !text.is_empty()).collect();
        items.push(some.join(": "));
    }
    items
}

/// Fewest steps of a run with error control, if output times bound them: few more than one to each.
fn bound_by_output(case: &Case, outputs: usize) -> Option<u64> {
    // What has diverged says nothing of steps.
    let near = |p: &&Point| p.error(Quantity::Species).is_some_and(|error| error < 0.5);
    let steps = case.points.iter().filter(near);
    let fewest = steps.filter_map(|p| p.work().map(|w| w.steps)).filter(|n| *n > 0).min()?;
    (outputs > 2 && real(usize::try_from(fewest).ok()?) < 2.0 * real(outputs - 1)).then_some(fewest)
}

fn table(study: &Study, case: &Case) -> Vec<Vec<String>> {
    let has = |q: &Quantity| case.points.iter().any(|p| p.error(*q).is_some());
    let quantities: Vec<Quantity> = Quantity::ALL.into_iter().filter(has).collect();
    let names = quantities.iter().map(|q| q.name());
    let head = ["integrator", "status"].into_iter().chain(names).chain(["time", "spread"]);
    let mut rows: Vec<Vec<String>> =
        vec![head.chain(COUNT_NAMES).chain([ITERATIONS]).map(str::to_owned).collect()];
    for point in &case.points {
        let mut row = vec![described(study, point), point.found.status.to_string()];
        let error = |q: &Quantity| point.error(*q).map_or("-".to_owned(), percent);
        row.extend(quantities.iter().map(error));
        row.push(point.seconds().map_or("-".into(), time));
        let timing = point.found.timing.as_ref().filter(|t| t.steps.len() > 1);
        let spread = timing.map(|t| format!("{} … {}", time(t.spread().0), time(t.spread().1)));
        row.push(spread.unwrap_or("-".into()));
        row.extend(counts(point, "-"));
        row.push(point.iterations().map_or("-".into(), |n| n.to_string()));
        rows.push(row);
    }
    rows
}

/// The counts of work that every program reports.
const COUNT_NAMES: [&str; 3] = ["steps", "evaluations", "factorisations"];
/// Iterations of relaxations and of Newton's method.
const ITERATIONS: &str = "iterations";

/// Steps, evaluations and factorisations of a run; `none` where they are not known.
fn counts(point: &Point, none: &str) -> [String; 3] {
    let counts = point.work().map(|w| [w.steps, w.evaluations(), w.factorisations]);
    counts.map_or([none; 3].map(str::to_owned), |counts| counts.map(|n| n.to_string()))
}

/// Error over tolerance of every integrator: least, median and largest.
fn ratios(study: &Study, case: &Case) -> Vec<Vec<String>> {
    let mut rows =
        vec![["integrator", "of", "least", "median", "largest"].map(str::to_owned).to_vec()];
    let has_tolerance = |line: &IntegratorCurve| !line.fixed_steps && line.branches_off.is_none();
    for (number, line) in study.curves.iter().enumerate().filter(|(_, line)| has_tolerance(line)) {
        for quantity in Quantity::FIELDS {
            let mine = case.points.iter().filter(|p| p.curve == number);
            let ratio = |p: &Point| Some(p.error(quantity)? / p.tolerance);
            let mut all: Vec<f64> = mine.filter_map(ratio).collect();
            all.sort_by(f64::total_cmp);
            let (Some(least), Some(largest)) = (all.first(), all.last()) else { continue };
            let median = 0.5 * (all[all.len() / 2] + all[(all.len() - 1) / 2]);
            let cells = [*least, median, *largest].map(|v| label(two_digits(v)));
            let names = [line.name.clone(), quantity.name().to_owned()];
            rows.push([&names[..], &cells].concat());
        }
    }
    rows
}

/// Measures of the references against the number of vertices; none where that is not varied alone.
fn mesh(cases: &[Case], key: usize, axis: &Axis) -> Option<Vec<Vec<String>>> {
    let vertices = axis.numbers().filter(|_| axis.key == refinement::KEY)?;
    if vertices.len() < 2 || cases.len() != vertices.len() {
        return None;
    }
    let of = |k: &usize| cases.iter().find(|case| case.at.get(key) == Some(k));
    let mut order: Vec<usize> = (0..vertices.len()).collect();
    order.sort_by(|a, b| vertices[*a].total_cmp(&vertices[*b]));
    let mut head = vec!["measure".to_owned()];
    head.extend(order.iter().map(|k| Short(vertices[*k]).to_string()));
    head.extend(["order".to_owned(), "limit".to_owned()]);
    let mut rows = vec![head];
    for quantity in Quantity::MEASURES {
        let value = |k: &usize| quantity.of(of(k)?.measures()?);
        let values: Vec<Option<f64>> = order.iter().map(value).collect();
        if values.iter().all(Option::is_none) {
            continue;
        }
        let mut row = vec![quantity.name().to_owned()];
        row.extend(values.iter().map(|v| v.map_or("-".to_owned(), label)));
        let known =
            order.iter().zip(&values).filter_map(|(k, v)| Some((vertices[*k].powf(-0.5), (*v)?)));
        let known: Vec<(f64, f64)> = known.collect();
        let last: Option<[(f64, f64); 3]> = known.last_chunk::<3>().copied();
        let finest = order.last().and_then(of);
        let noise = finest.and_then(|case| case.spread_of(quantity)).unwrap_or(0.0);
        let even = |all: &[(f64, f64); 3]| (all[1].1 - all[2].1).abs() > noise * all[2].1.abs();
        let found = last.filter(even).and_then(order_and_limit);
        row.push(found.map_or("-".into(), |(order, _)| format!("{order:.2}")));
        row.push(found.map_or("-".into(), |(_, limit)| label(limit)));
        rows.push(row);
    }
    Some(rows)
}
