//! What measures do on ever finer meshes: the order that the three finest show, and the limit they tend to.
//!
//! ```text
//! f(h) = f₀ + C h^p,   h = N^(-1/2) of N vertices
//! (f₁ - f₂) / (f₂ - f₃) = (h₁^p - h₂^p) / (h₂^p - h₃^p)
//! ```
//!
//! Source: Roache, J. Fluids Eng. 116 (1994), doi:10.1115/1.2910291.

use std::collections::BTreeMap;
use std::fmt;

use super::gather::{MemberResults, MemberStatus, Statistics};
use super::plan::{Axis, Plan};
use crate::num::real;
use crate::output::plot::label;

/// The key that refines a mesh.
pub const KEY: &str = "sheet.vertices";
/// Vertices of the meshes of `--refine` over those of the scene.
const FACTORS: [usize; 3] = [1, 2, 4];
/// Orders that are looked for.
const ORDER_RANGE: (f64, f64) = (0.2, 4.5);
/// Halvings of the range of orders: to its last digit.
const HALVINGS: usize = 60;
/// Values that differ by less than this share are the same: what relaxations and steps leave.
const SAME: f64 = 1e-6;

/// The meshes of `--refine` on a sheet of `vertices`.
#[must_use]
pub fn axis(vertices: usize) -> Axis {
    Axis {
        key: KEY.to_owned(),
        paths: vec![KEY.to_owned()],
        values: FACTORS.map(|factor| (vertices * factor).to_string()).to_vec(),
        logarithmic: true,
        ..Axis::default()
    }
}

/// The meshes of `axis` from the coarsest to the finest, as the number of a value and its count of vertices; none
/// of another key, or of fewer than three.
#[must_use]
pub fn meshes(axis: &Axis) -> Option<Vec<(usize, f64)>> {
    let vertices = axis.numbers().filter(|all| axis.key == KEY && all.len() >= FACTORS.len())?;
    let mut meshes: Vec<(usize, f64)> = vertices.into_iter().enumerate().collect();
    meshes.sort_by(|a, b| a.1.total_cmp(&b.1));
    Some(meshes)
}

/// A column of numbers.
pub(super) struct Column<'a> {
    /// Its title, with the unit.
    pub(super) title: &'a str,
    /// The number of a member.
    pub(super) of: BoxedNumberOf<'a>,
}

/// The numbers in `at` of the axes that are kept.
pub(super) fn selected(at: &[usize], kept: impl Fn(usize) -> bool) -> Vec<usize> {
    at.iter().enumerate().filter(|(k, _)| kept(*k)).map(|(_, at)| *at).collect()
}

/// The same, of a column that the species name.
pub(super) type BoxedNumberOf<'a> = Box<dyn Fn(&MemberResults) -> Option<f64> + 'a>;

/// What a measure does as the mesh is refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Convergence {
    /// The three finest meshes agree.
    Same(f64),
    /// Two successive meshes differ by less than the standard error over the seeds.
    Spread,
    /// It converges with an order to a limit.
    Order(f64, f64),
    /// It does neither, or a mesh has no value.
    NotConverged,
}

impl Convergence {
    /// Judges the values on three meshes, given as the number of vertices and the statistics over seeds, the coarsest
    /// first.
    #[must_use]
    pub fn judge(meshes: [(f64, Statistics); 3]) -> Self {
        let [Some(a), Some(b), Some(c)] = meshes.map(|(_, found)| found.mean) else {
            return Self::NotConverged;
        };
        let square =
            |found: Statistics| found.deviation.map_or(0.0, |d| d * d / real(found.count.max(1)));
        let [first, second, third] = meshes.map(|(_, found)| square(found));
        if (a - c).abs().max((b - c).abs()) <= SAME * c.abs() {
            return Self::Same(c);
        }
        let known = |apart: f64, squares: f64| apart.abs() > squares.sqrt();
        if !(known(a - b, first + second) && known(b - c, second + third)) {
            return Self::Spread;
        }
        let [h1, h2, h3] = meshes.map(|(vertices, _)| vertices.powf(-0.5));
        order_and_limit([(h1, a), (h2, b), (h3, c)])
            .map_or(Self::NotConverged, |(p, f)| Self::Order(p, f))
    }

    /// What the measure tends to.
    #[must_use]
    pub fn limit(self) -> Option<f64> {
        match self {
            Self::Same(value) | Self::Order(_, value) => Some(value),
            Self::Spread | Self::NotConverged => None,
        }
    }
}

impl fmt::Display for Convergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Same(_) => f.write_str("unchanged"),
            Self::Spread => f.write_str("within the spread"),
            Self::Order(order, _) => f.write_str(&label((order * 100.0).round() / 100.0)),
            Self::NotConverged => f.write_str("not converged"),
        }
    }
}

/// Measures on the meshes of an axis of at least three counts of vertices, in a row for each, with the order of
/// convergence and the limit of the three finest; for every combination of the other axes that are no seeds, over which
/// means are taken.
pub(super) fn rows(
    plan: &Plan,
    members: &[MemberResults],
    columns: &[Column<'_>],
    title: fn(&Axis) -> &str,
    cell: fn(Option<f64>) -> String,
) -> Option<Vec<Vec<String>>> {
    let found = |(k, axis)| Some((k, meshes(axis)?));
    let (across, meshes) = plan.axes.iter().enumerate().find_map(found)?;
    let kept = |k: usize| k != across && !plan.axes[k].is_seed();
    let axes = || plan.axes.iter().enumerate().filter(|(k, _)| kept(*k)).map(|(_, axis)| axis);
    let head = axes().map(|axis| title(axis).to_owned()).chain(["measure".to_owned()]);
    let head = head.chain(meshes.iter().map(|(_, vertices)| label(*vertices)));
    let mut rows = vec![head.chain(["order", "limit"].map(str::to_owned)).collect()];
    let complete: Vec<_> = members.iter().filter(|f| f.status == MemberStatus::Complete).collect();
    let mut groups: BTreeMap<Vec<usize>, Vec<&MemberResults>> = BTreeMap::new();
    for found in complete {
        groups.entry(selected(&found.at, kept)).or_default().push(found);
    }
    for (at, group) in groups {
        for column in columns {
            let on = |mesh: usize| -> Statistics {
                let group = group.iter().filter(|f| f.at.get(across) == Some(&mesh));
                Statistics::new(&group.filter_map(|f| (column.of)(f)).collect::<Vec<f64>>())
            };
            let found: Vec<_> = meshes.iter().map(|(k, vertices)| (*vertices, on(*k))).collect();
            let Some(finest) = found.last_chunk::<3>().copied() else { continue };
            let nothing =
                |(_, values): &(f64, Statistics)| values.mean.is_none_or(|mean| mean == 0.0);
            if found.iter().all(nothing) {
                continue;
            }
            let verdict = Convergence::judge(finest);
            let row = axes().zip(&at).map(|(axis, k)| axis.value(*k).to_owned());
            let row = row.chain([column.title.to_owned()]);
            let row = row.chain(found.iter().map(|(_, values)| cell(values.mean)));
            rows.push(row.chain([verdict.to_string(), cell(verdict.limit())]).collect());
        }
    }
    Some(rows)
}

/// Order p and limit f₀ through three values `(h, f)`, the coarsest first. None where no order from 0.2 to 4.5 fits, more
/// than elements have, as where differences change their sign.
#[must_use]
pub fn order_and_limit([a, b, c]: [(f64, f64); 3]) -> Option<(f64, f64)> {
    let ratio = (a.1 - b.1) / (b.1 - c.1);
    if !(ratio > 0.0 && ratio.is_finite()) {
        return None;
    }
    let of = |p: f64| (a.0.powf(p) - b.0.powf(p)) / (b.0.powf(p) - c.0.powf(p)) - ratio;
    let (mut low, mut high) = ORDER_RANGE;
    if !(of(low) < 0.0 && of(high) > 0.0) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if of(middle) < 0.0 { low = middle } else { high = middle }
    }
    let p = 0.5 * (low + high);
    let constant = (b.1 - c.1) / (b.0.powf(p) - c.0.powf(p));
    Some((p, c.1 - constant * c.0.powf(p)))
}
