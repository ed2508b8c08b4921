//! The report of a study: advice, a plot and a table.

use super::advice::{advice, described, percent, subject, time};
use super::errors::{Assessment, ComparedRun};
use super::{Quantity, Study};
use crate::output::plot::{Block, Curve, Figure, Panel, Plot, label};
use crate::study::draw::plot::{ROUND_OFF, cost_panel};
use crate::study::draw::table::{self, csv_table, number, work_cells, work_titles};
use crate::study::plan::Plan;
use crate::study::{Page, extent};

/// Runs with an error beyond this have diverged.
const DIVERGED_ERROR: f64 = 100.0;
/// What the plot shows.
const CAPTION: &str = "What accuracy costs: error against processor time of the steps, the largest before references part \
    for species and shape, at the end for measures. Lower left is better. Crosses: failed or diverged, at the time they \
    took. Triangles at the lower edge: errors of 0. Dashed: the reference uncertainty (noise floor), the target error, and \
    the spread over seeds.";

/// The report of all runs.
pub(super) fn page(study: &Study, plan: &Plan, all: &Assessment) -> Page {
    let scene = plan.scene.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut blocks = vec![Block::Heading(1, format!("What accuracy costs: {scene}"))];
    blocks.extend(plan.set.iter().map(|set| Block::Text(format!("With {set}."))));
    let open = (all.open > 0).then(|| {
        format!(
            "Incomplete: {} of {} runs are still to be made. What follows is of those that there are, and \
             may change; the same command continues.",
            all.open,
            plan.members.len()
        )
    });
    let said: Vec<String> = open.into_iter().chain([advice(study, all)]).collect();
    blocks.extend(said.iter().cloned().map(Block::Advice));
    blocks.push(Block::List(known(all)));
    let figure = figure(study, all);
    if !figure.panels.is_empty() {
        let (name, caption) = ("work-precision".to_owned(), CAPTION.to_owned());
        blocks.push(Block::Plot(Plot { name, caption, figure }));
    }
    blocks.push(Block::Table(table(study, all)));
    if !study.left_out.is_empty() {
        blocks.push(Block::Heading(2, "Left out".into()));
        blocks.push(Block::List(study.left_out.clone()));
    }
    let [_, csv, page] = Study::FILES;
    let files = vec![(csv, self::csv(study, all)), (page, table::markdown(&blocks))];
    Page { blocks, files, said: said.join("\n\n") }
}

/// A panel for every quantity: error against processor time, crosses for what failed; dashed the uncertainty of the
/// references, the error that is wanted and the spread over seeds.
fn figure(study: &Study, all: &Assessment) -> Figure {
    let wanted = format!("wanted: {}", percent(study.wanted));
    let guides = ["reference uncertainty", &wanted, "spread over seeds"];
    let curves = study.curves.len();
    let names = study.curves.iter().map(|curve| curve.name.as_str()).chain(guides);
    let diverged = |point: &ComparedRun| {
        let far = |q: &Quantity| point.error(*q).is_some_and(|error| !(error <= DIVERGED_ERROR));
        Quantity::ALL.iter().any(far)
    };
    let panel = |quantity: Quantity| {
        let points = all.points.iter().filter_map(|point| {
            let time = point.found.step_seconds().or(point.found.seconds).filter(|s| *s > 0.0)?;
            let lost = !point.found.is_complete() || diverged(point);
            let error = point.error(quantity).filter(|_| !lost);
            (lost || error.is_some()).then_some((point.curve, time, error))
        });
        let title = format!("error of the {}", quantity.name());
        let mut panel = cost_panel(&title, "processor time of the steps [s]", points);
        let places = panel.curves.iter().flat_map(|c| c.points.iter().map(|p| p.0));
        let (least, most) = extent(places);
        let wanted = (subject(study, all) == quantity).then_some(study.wanted);
        let levels = [all.floor(quantity), wanted, all.spread[quantity as usize]];
        for (k, level) in levels.into_iter().enumerate() {
            if let Some(level) = level.filter(|level| *level > ROUND_OFF && least < most) {
                panel
                    .curves
                    .push(Curve { name: curves + k, points: vec![(least, level), (most, level)] });
            }
        }
        panel
    };
    let panels: Vec<Panel> = all.quantities().into_iter().map(panel).collect();
    let names = names.map(str::to_owned).collect();
    Figure { names, guides: guides.len(), panels, ..Figure::default() }
}

/// A row for every run that is compared: method, status, errors, cost.
fn csv(study: &Study, all: &Assessment) -> String {
    let head = ["integrator", "tolerance", "status"].map(str::to_owned);
    let errors = Quantity::ALL.map(|q| format!("error of the {}", q.name()));
    let times = ["steps [s]", "start [s]"].map(str::to_owned);
    let mut rows = vec![[&head[..], &errors, &times, &COUNTS.map(str::to_owned)].concat()];
    rows[0].extend(work_titles(&COUNTS));
    rows[0].extend(["memory [MB]".to_owned(), "reason".to_owned()]);
    for point in &all.points {
        let found = &point.found;
        let curve = study.curves.get(point.curve).map_or("", |c| c.name.as_str());
        let mut row = vec![curve.to_owned(), point.tolerance.to_string(), found.status.to_string()];
        row.extend(Quantity::ALL.map(|q| number(point.error(q))));
        row.extend([found.step_seconds(), found.start_seconds].map(number));
        row.extend(counts(point, ""));
        row.extend(work_cells(found.step_work(), &COUNTS));
        row.extend([number(found.peak_resident_megabytes()), found.why_incomplete().to_owned()]);
        rows.push(row);
    }
    csv_table(&rows)
}

/// Counts of work in the first columns.
const COUNTS: [&str; 3] = ["steps", "evaluations", "factorisations"];

/// Steps, evaluations and factorisations of a run; `none` where they are not known.
fn counts(point: &ComparedRun, none: &str) -> [String; 3] {
    let counts = point.found.step_work().map(|w| [w.steps, w.evaluations(), w.factorisations]);
    counts.map_or([none; 3].map(str::to_owned), |counts| counts.map(|n| n.to_string()))
}

/// The same for people, with the quantities that have errors and the iterations of relaxations and of Newton's method.
fn table(study: &Study, all: &Assessment) -> Vec<Vec<String>> {
    let quantities = all.quantities();
    let names = quantities.iter().map(|q| q.name());
    let head = ["integrator", "status"].into_iter().chain(names).chain(["time"]);
    let head = head.chain(COUNTS).chain(["iterations"]).map(str::to_owned);
    let mut rows: Vec<Vec<String>> = vec![head.collect()];
    for point in &all.points {
        let known = |text: Option<String>| text.unwrap_or("-".to_owned());
        let mut row = vec![described(study, point), point.found.status.to_string()];
        row.extend(quantities.iter().map(|q| known(point.error(*q).map(percent))));
        row.push(known(point.found.step_seconds().map(time)));
        row.extend(counts(point, "-"));
        let iterations =
            point.found.step_work().map(|work| work.iterations + work.newton_iterations);
        row.push(known(iterations.map(|n| n.to_string())));
        rows.push(row);
    }
    rows
}

/// Lists the reference, its uncertainty, and the runs that failed.
fn known(all: &Assessment) -> Vec<String> {
    let shares = |of: &dyn Fn(Quantity) -> Option<f64>| -> String {
        let all = Quantity::ALL.into_iter().filter_map(|q| Some((q, of(q)?)));
        let all = all.map(|(q, share)| format!("{} {}", q.name(), percent(share)));
        all.collect::<Vec<_>>().join(", ")
    };
    let mut items = Vec::new();
    if let Some(reference) = &all.reference {
        let took = reference.run.found.step_seconds();
        let took = took.map_or(String::new(), |s| format!(", {}", time(s)));
        items.push(format!("Reference: {}{took}.", reference.name));
        if reference.still {
            return items;
        }
        if let Some((second, _)) = &reference.confirmed {
            let apart = shares(&|q| all.floor(q));
            items.push(format!("Confirmed by {second}; reference uncertainty: {apart}."));
        }
        if let Some(since) = reference.unstable {
            items.push(format!(
                "From t = {} on the reference is on a branch that has become unstable: an imperfection would leave \
                 it. List stability.perturb in the scene, and all runs leave it.",
                label(since)
            ));
        }
        if let Some(at) = reference.diverged {
            items.push(format!(
                "Paths part at t = {}: from there on runs are on different branches, and fields are not compared.",
                label(at)
            ));
        }
    }
    items.extend(all.lost.iter().map(|(name, why)| format!("Reference {name}: {why}.")));
    if all.seeds > 0 {
        items.push(format!(
            "Spread over {} seeds (half of the range): {}. A smaller error is not meaningful.",
            all.seeds + 1,
            shares(&|q| all.spread[q as usize])
        ));
    }
    let found = all.points.iter().map(|point| &point.found).filter(|found| !found.is_complete());
    items.extend(found.map(|f| match f.reason.as_str() {
        "" => format!("{}: {}", f.name, f.status),
        reason => format!("{}: {}: {reason}", f.name, f.status),
    }));
    items
}
