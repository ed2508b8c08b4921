//! Tables and plots of studies.

pub mod plot;
pub mod table;

use super::plan::Plan;

/// Values of the axes that are kept, for all combinations of them in the order of the members, with their labels.
fn combinations(plan: &Plan, kept: impl Fn(usize) -> bool + Copy) -> Vec<(Vec<usize>, String)> {
    let mut all: Vec<(Vec<usize>, String)> = Vec::new();
    for point in &plan.members {
        let at = selected(&point.at, kept);
        if !all.iter().any(|(known, _)| *known == at) {
            all.push((at, plan.label(&point.at, kept)));
        }
    }
    all
}

/// The numbers in `at` of the axes that are kept.
pub(super) fn selected(at: &[usize], kept: impl Fn(usize) -> bool) -> Vec<usize> {
    at.iter().enumerate().filter(|(k, _)| kept(*k)).map(|(_, at)| *at).collect()
}
