//! Measures of a sweep against one of its keys.
//!
//! Every combination of the other keys is a curve. Seeds are no key to draw curves of: their members are
//! marks of one colour, and the curve goes through their means.

use super::table::{COLUMNS, Column};
use crate::output::plot::{Figure, Panel};
use crate::study::draw::plot::{KeyPlot, extent};
use crate::study::gather::{Found, MemberStatus};
use crate::study::plan::{Axis, Plan};

/// Largest over least value of a measure from which on its axis is logarithmic.
const WIDE: f64 = 100.0;
/// The same of a key whose values are a list.
const WIDE_KEY: f64 = 30.0;

/// The measures against key `across`, a number of `plan.axes`; members that failed are crosses at the upper edge.
#[must_use]
pub fn figure(plan: &Plan, members: &[Found], across: usize) -> Figure {
    let axis = &plan.axes[across];
    let plot = KeyPlot::new(plan, across, |k| {
        k != across && plan.axes.get(k).is_some_and(|axis| !axis.is_seed())
    });
    let wide = axis.logarithmic || is_wide(plot.places.iter().copied(), WIDE_KEY);
    let positive = plot.places.iter().all(|x| *x > 0.0) && axis.numbers().is_some();
    let lost = members.iter().filter(|f| f.status.is_lost());
    let failed: Vec<(usize, f64)> = lost.filter_map(|found| plot.place(&found.at)).collect();
    let complete = || members.iter().filter(|f| f.status == MemberStatus::Complete);
    let panel = |column: &Column| -> Option<Panel> {
        let values = complete().filter_map(|f| Some((&f.at[..], (column.of)(f)?)));
        let curves = plot.curves(values);
        // A measure that no member has is not drawn, unless all failed.
        if curves.is_empty() && (failed.is_empty() || complete().next().is_some()) {
            return None;
        }
        let values = curves.iter().flat_map(|c| c.points.iter().map(|p| p.1));
        Some(Panel {
            title: column.title.to_owned(),
            across: across_text(axis, !failed.is_empty()),
            logarithmic: (positive && wide, is_wide(values, WIDE)),
            curves,
            failed: failed.clone(),
            zeros: Vec::new(),
        })
    };
    // The time reached is no result.
    let panels = COLUMNS[1..].iter().filter_map(panel).collect();
    plot.figure("all members", panels)
}

/// Which keys are drawn: those with several values, seeds only where there is nothing else.
#[must_use]
pub fn drawn_keys(plan: &Plan) -> Vec<usize> {
    let all = (0..plan.axes.len()).filter(|k| plan.axes[*k].values.len() > 1);
    let (seeds, keys): (Vec<usize>, Vec<usize>) = all.partition(|k| plan.axes[*k].is_seed());
    if keys.is_empty() { seeds } else { keys }
}

/// Whether values are positive, and the largest more than `ratio` times the least.
fn is_wide(values: impl Iterator<Item = f64>, ratio: f64) -> bool {
    let (least, most) = extent(values);
    least > 0.0 && most.is_finite() && most > ratio * least
}

fn across_text(axis: &Axis, crosses: bool) -> String {
    let mut text = axis.key.clone();
    if axis.numbers().is_none() {
        let names = (0..axis.values.len()).map(|k| format!("{} {}", k + 1, axis.value(k)));
        text = format!("{} ({})", axis.title(), names.collect::<Vec<_>>().join(", "));
    }
    if crosses { text + "   × failed" } else { text }
}
