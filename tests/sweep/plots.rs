//! Plots of sweeps: what is in them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rumple::study::Measures;
use rumple::study::gather::{MemberResults, MemberStatus};
use rumple::study::plan::{Axis, Member, Plan};
use rumple::study::sweep::{drawn_keys, figure};

use rumple::tally::Work;

/// Title of the measure `spots` in plots.
const REGIONS: &str = "regions above the level";

pub(super) fn plan(axes: &[&str]) -> Plan {
    let axes: Vec<Axis> = axes.iter().map(|text| Axis::parse(text).unwrap()).collect();
    let count = axes.iter().map(|axis| axis.values.len()).product();
    let at = |number: usize| {
        let mut rest = number;
        let mut at: Vec<usize> = Vec::new();
        for axis in axes.iter().rev() {
            at.push(rest % axis.values.len());
            rest /= axis.values.len();
        }
        at.reverse();
        at
    };
    let point = |number: usize| Member {
        folder: number.to_string(),
        at: at(number),
        fingerprint: String::new(),
        limit: None,
    };
    let members = (0..count).map(point).collect();
    Plan {
        version: String::new(),
        scene: PathBuf::new(),
        set: Vec::new(),
        axes,
        level: None,
        threads: 1,
        plugin_path: Vec::new(),
        states: false,
        files: BTreeMap::new(),
        members,
        law: None,
    }
}

/// A complete member with `spots`, and measures around `value`.
pub(super) fn complete(plan: &Plan, number: usize, spots: usize, value: f64) -> MemberResults {
    let measures = Measures {
        time: 2.0,
        energy: 10.0 * (1.0 + value),
        amplitude: 0.5,
        deflection: 0.5,
        spots,
        separation: Some(3.0 + value),
        nearest: None,
        share: 0.5,
        ..Measures::default()
    };
    MemberResults {
        name: plan.name(number),
        at: plan.members[number].at.clone(),
        status: MemberStatus::Complete,
        reason: String::new(),
        measures: vec![measures],
        totals: Vec::new(),
        steady: None,
        seconds: Some(1.0),
        memory: Some(20_000_000),
        work: Some(Work { steps: 5, ..Work::default() }),
        start: None,
        intersection: None,
        start_seconds: None,
    }
}

/// The same, but nothing came of it.
pub(super) fn without(plan: &Plan, number: usize, status: MemberStatus) -> MemberResults {
    let mut found = complete(plan, number, 0, 0.0);
    found.status = status;
    found.measures.clear();
    (found.seconds, found.memory, found.work) = (None, None, None);
    found
}

#[test]
fn measures_are_drawn_against_a_key_with_a_curve_for_every_other_value() {
    let plan = plan(&["a.h=0.5,1,50", "D=0,5", "sheet.seed=1..3"]);
    let members: Vec<MemberResults> = (0..18)
        .map(|k| match k {
            // h = 50, D = 5 failed with every seed.
            15..18 => without(&plan, k, MemberStatus::Failed),
            _ => complete(&plan, k, 1 + k % 3, 0.0),
        })
        .collect();
    assert_eq!(drawn_keys(&plan), [0, 1], "seeds are no key to draw against");
    let drawn = figure(&plan, &members, 0);
    assert_eq!(drawn.names, ["D = 0", "D = 5"]);
    let titles: Vec<&str> = drawn.panels.iter().map(|p| p.title.as_str()).collect();
    assert!(titles.contains(&REGIONS) && titles.contains(&"separation d [length]"), "{titles:?}");
    assert!(!titles.contains(&"nearest centres [length]"), "no member has any: {titles:?}");
    let spots = drawn.panels.iter().find(|p| p.title == REGIONS).unwrap();
    assert_eq!(spots.logarithmic, (true, false));
    // A curve through the means over seeds, and a mark for every seed.
    let curves: Vec<_> = spots.curves.iter().filter(|c| c.points.len() > 1).collect();
    assert_eq!(curves[0].points, [(0.5, 2.0), (1.0, 2.0), (50.0, 2.0)]);
    assert_eq!(curves[1].points, [(0.5, 2.0), (1.0, 2.0)]);
    assert_eq!(spots.curves.len() - curves.len(), 15);
    assert_eq!(spots.failed, [(1, 50.0); 3]);
    assert!(spots.across.contains("a.h") && spots.across.contains("× failed"), "{}", spots.across);
}

#[test]
fn keys_without_numbers_have_places_of_their_own() {
    let plan = plan(&["time.policy=quasi-static,simultaneous"]);
    let members = [complete(&plan, 0, 1, 0.0), complete(&plan, 1, 4, 1.0)];
    let drawn = figure(&plan, &members, 0);
    let spots = drawn.panels.iter().find(|p| p.title == REGIONS).unwrap();
    assert_eq!(spots.curves[0].points, [(1.0, 1.0), (2.0, 4.0)]);
    assert!(spots.across.contains("1 quasi-static, 2 simultaneous"), "{}", spots.across);
    assert_eq!(drawn.names, ["all members"]);
}

#[test]
fn a_sweep_of_which_all_failed_has_plots_that_show_it() {
    let plan = plan(&["h=1,2"]);
    let members = [0, 1].map(|k| without(&plan, k, MemberStatus::Failed));
    let drawn = figure(&plan, &members, 0);
    assert!(!drawn.panels.is_empty());
    assert!(drawn.panels.iter().all(|panel| panel.failed == [(0, 1.0), (0, 2.0)]));
    // Nothing has begun: nothing to draw.
    let members = [0, 1].map(|k| without(&plan, k, MemberStatus::NotBegun));
    assert!(figure(&plan, &members, 0).panels.is_empty());
}
