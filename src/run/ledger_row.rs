//! The ledger's row: one line of numbers for every accepted step.

use super::Result;
use super::fields::qualities;
use crate::Vec3;
use crate::effects::Measure;
use crate::model::{Evaluation, Model};
use crate::num::real;
use crate::parallel::{self, BLOCK};
use crate::reduction::Reduction;
use crate::solve::StepReport;
use crate::solve::equilibrium::Relaxation;
use crate::solve::rejections::Cause;
use crate::tally::Work;

/// Title of the column of wall time.
pub(super) const WALL_TIME_TITLE: &str = "wall time [s]";
/// Titles of the ledger's first columns.
const STEP_TITLES: [&str; 4] = ["step", "time", "step size [time]", "error estimate"];

/// What the columns of [`Causes`](crate::solve::rejections::Causes) and of values that are not finite are called.
fn cause_columns() -> impl Iterator<Item = String> {
    let causes = Cause::ALL.into_iter().map(|cause| format!("rejected for {}", cause.name()));
    causes.chain(["values not finite".to_owned()])
}

/// Their row.
fn causes(report: &StepReport) -> impl Iterator<Item = f64> {
    let counts = report.rejected.iter().map(|(_, count)| count).chain([report.not_finite]);
    counts.map(|count| real(usize::try_from(count).unwrap_or(usize::MAX)))
}

fn is_point(model: &Model) -> bool {
    model.sheet().triangles().is_empty()
}

/// Title of the column of the work that the drag takes up.
const DRAG_TITLE: &str = "work of the drag [energy]";
/// Titles of the columns of a quasi-static shape.
const SNAP_TITLES: [&str; 3] =
    ["snaps", "energy released by snaps [energy]", "share of the work of the drag"];
/// Title of the column of the energy of all effects, which begins as those of species do.
const TOTAL_ENERGY_TITLE: &str = "total energy [energy]";
/// Prefix of the titles of the totals of species.
const TOTAL: &str = "total ";

/// Whether the column `title` of a ledger is the total of a species.
pub(crate) fn is_species_total(title: &str) -> bool {
    title.starts_with(TOTAL) && title != TOTAL_ENERGY_TITLE
}

/// Whether the shape is in equilibrium at every time, and may snap from one to another.
fn snaps(model: &Model) -> bool {
    model.moves() && model.mass_weights().mechanics == 0.0
}

/// Names of the effects of contact.
fn touching(model: &Model) -> impl Iterator<Item = &str> {
    let names: Vec<&str> = model.mechanics().names().collect();
    model.mechanics().contacts().map(move |k| names[k])
}

/// Titles of the ledger's columns, with units.
pub(super) fn columns(model: &Model, watched: bool, invariants: &[String]) -> Vec<String> {
    let mut all = STEP_TITLES.map(str::to_owned).to_vec();
    // A row is a step.
    let work = Work::NAMES[1..].iter().map(|(name, _)| name.replace('_', " "));
    let work = work.chain(cause_columns());
    if is_point(model) {
        all.extend(work.chain([WALL_TIME_TITLE.to_owned()]));
        if let Some(chemistry) = model.chemistry() {
            all.extend(chemistry.descriptor().species.iter().map(|s| s.name.clone()));
        }
        all.extend_from_slice(invariants);
        return all;
    }
    all.extend(model.mechanics().names().map(|name| format!("energy of {name} [energy]")));
    for name in model.mechanics().constraint_names() {
        all.push(format!("constraint {name}"));
        all.push(format!("multiplier of {name} [energy]"));
    }
    for name in touching(model) {
        all.push(format!("pairs of {name}"));
        all.push(format!("gap of {name} [length]"));
    }
    all.push(TOTAL_ENERGY_TITLE.to_owned());
    all.extend(work.chain(["force residual".to_owned()]));
    all.push(DRAG_TITLE.to_owned());
    if snaps(model) {
        all.extend(SNAP_TITLES.map(str::to_owned));
    }
    if watched {
        all.push("negative directions".to_owned());
    }
    if let Some(chemistry) = model.chemistry() {
        for species in &chemistry.descriptor().species {
            let name = &species.name;
            all.extend([
                format!("{TOTAL}{name}"),
                format!("least {name}"),
                format!("largest {name}"),
            ]);
        }
    }
    all.extend_from_slice(invariants);
    all.extend(
        ["least quality", "impossible rest triangles", "collapsed triangles", WALL_TIME_TITLE]
            .map(str::to_owned),
    );
    all
}

/// Total, least and largest of nothing.
const EMPTY: [f64; 3] = [0.0, f64::INFINITY, f64::NEG_INFINITY];

/// What the ledger says of a shape alone, kept for as long as that stays.
#[derive(Default)]
pub(super) struct ShapeSums {
    x: Vec<Vec3>,
    known: bool,
    least_quality: f64,
    /// Areas that go with the species, of the triangles or the vertices that they live on.
    area: Vec<f64>,
}

impl ShapeSums {
    fn update(&mut self, model: &Model, x: &[Vec3]) {
        let sheet = model.sheet();
        // A shape that cannot move is not kept to see whether it has.
        let same = sheet.reduction().all(self.x == x);
        if same || !model.moves() && self.known {
            return;
        }
        if model.moves() {
            self.x.clear();
            self.x.extend_from_slice(x);
        }
        self.known = true;
        let qualities = qualities(sheet, x);
        self.least_quality = sheet.reduction().min(qualities.len(), |t| qualities[t]);
        let Some(chemistry) = model.chemistry() else { return };
        // An amount is per rest area, a concentration per current area.
        let amount = chemistry.measure() == Measure::Amount;
        if amount && !self.area.is_empty() {
            return;
        }
        self.area = chemistry.point_areas(sheet, if amount { sheet.rest() } else { x });
    }
}

/// The integral of `c`, over the areas `share` of its points, and its least and largest value.
fn amount_and_range(c: &[f64], share: &[f64], reduction: &Reduction) -> [f64; 3] {
    let of = |k: usize| [c[k] * share[k], c[k], c[k]];
    let both = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1].min(b[1]), a[2].max(b[2])];
    let owned = reduction.owned(c.len());
    let block = |b: usize| {
        let points = b * BLOCK..((b + 1) * BLOCK).min(owned);
        points.map(of).fold(EMPTY, both)
    };
    let here = parallel::reduce(owned.div_ceil(BLOCK), &block, &both);
    let [total, least, largest] = here.unwrap_or(EMPTY);
    let mut total = [total];
    reduction.sum_over_ranks(&mut total);
    [total[0], -reduction.largest_over_ranks(-least), reduction.largest_over_ranks(largest)]
}

/// The row of a state after the step that `info` describes; `shape` is what the last row has said of the shape.
///
/// # Errors
/// If a law fails.
pub(super) fn row(
    at: &mut Evaluation<'_>,
    info: &StepInfo<'_>,
    shape: &mut ShapeSums,
) -> Result<Vec<f64>> {
    let StepInfo { report, negative, invariants, wall, .. } = *info;
    let (model, state) = (at.model(), at.state());
    let step = real(usize::try_from(state.step).unwrap_or(usize::MAX));
    let mut row = vec![step, state.time, report.length, report.error];
    let work = report.work.values().into_iter().skip(1);
    let work = work.map(|count| real(usize::try_from(count).unwrap_or(usize::MAX)));
    let work = work.chain(causes(report));
    if is_point(model) {
        row.extend(work);
        row.push(wall);
        row.extend(state.species.iter().flatten());
        row.extend(invariants);
        return Ok(row);
    }
    let energies = at.energies()?;
    row.extend(&energies);
    if model.mechanics().is_constrained() {
        let potential = at.potential()?;
        let values = potential.constraint_values(&state.x);
        row.extend(values.iter().zip(potential.multipliers()).flat_map(|(g, l)| [*g, *l]));
    }
    for k in model.mechanics().contacts() {
        let touching = at.potential()?.touching(k, &state.x);
        row.extend(touching.iter().flat_map(|t| [real(t.pairs), t.gap]));
    }
    row.push(energies.iter().sum());
    row.extend(work);
    row.push(report.relaxation.residual);
    row.push(report.relaxation.dissipated);
    if snaps(model) {
        let Relaxation { snaps, released, drag_share, .. } = report.relaxation;
        row.extend([real(snaps), released, drag_share]);
    }
    row.extend(negative);
    shape.update(model, &state.x);
    if model.chemistry().is_some() {
        let of = |c: &Vec<f64>| amount_and_range(c, &shape.area, model.sheet().reduction());
        row.extend(state.species.iter().flat_map(of));
    }
    row.extend(invariants);
    row.push(shape.least_quality);
    row.push(real(at.impossible_triangles()?));
    row.push(real(report.relaxation.collapsed));
    row.push(wall);
    Ok(row)
}

/// What is known of an accepted state besides itself.
pub struct StepInfo<'a> {
    /// The step that led to it; at the start, the work of the first relaxation.
    pub report: &'a StepReport,
    /// Whether it is one of the output times, or the last state; once for every state.
    pub frame: bool,
    /// Whether it is seen for the first time. A run that is interrupted in a step shows the state before
    /// again, as its last one.
    pub new: bool,
    /// Number of negative-curvature modes, where the run monitors stability.
    pub negative: Option<f64>,
    /// What the monitors that the scene lists say of it, in the order of their columns.
    pub invariants: &'a [f64],
    /// Wall time since the run began, seconds.
    pub wall: f64,
}
