//! Plots of comparisons: what is in them.

use rumple::Vec3;
use rumple::kinetics::Location;
use rumple::model::State;
use rumple::study::compare::Comparison;
use rumple::study::gather::{Deviations, MemberResults, MemberStatus, Run};
use rumple::study::{Measures, Norm};

use crate::common::lattice;

/// A member that ran for `seconds`, its lattice bent by `bend` and its species around `level`, at
/// three times.
fn member(name: &str, seconds: f64, bend: f64, level: f64) -> Run {
    let sheet = lattice(12, 12);
    let state = |step: u32| {
        let bent = |x: &Vec3| Vec3::new(x.x, x.y, bend * f64::from(step) * (x.x * 0.5).sin());
        let x: Vec<Vec3> = sheet.rest().iter().map(bent).collect();
        let species = vec![sheet.rest().iter().map(|x| level + 0.01 * x.y).collect()];
        State { time: f64::from(step), step: step.into(), x: x.into(), species, ..State::default() }
    };
    let states: Vec<State> = (0..3).map(state).collect();
    let measures = |s: &State| Measures {
        time: s.time,
        energy: 1.0,
        amplitude: 0.1,
        deflection: 0.1,
        spots: 1,
        separation: None,
        nearest: None,
        share: 0.5,
        ..Measures::default()
    };
    let found = MemberResults {
        name: name.into(),
        status: MemberStatus::Complete,
        measures: states.iter().map(measures).collect(),
        seconds: Some(seconds),
        start_seconds: Some(0.0),
        ..MemberResults::default()
    };
    Run { found, states }
}

fn norm() -> Norm {
    Norm::new(&lattice(12, 12), vec![(1.0, Location::Vertex)])
}

fn failed(name: &str) -> Run {
    let mut failed = member(name, 0.1, 0.0, 0.5);
    failed.found.status = MemberStatus::Failed;
    failed
}

#[test]
fn the_cost_plot_has_every_member_that_ran() {
    // One member equal to the first, one that begins apart.
    let members = [
        member("first", 0.31, 0.0, 0.5),
        member("near", 0.62, 0.0, 0.501),
        member("the same", 0.35, 0.0, 0.5),
        member("apart from the start", 0.55, 0.0, 5.0),
        failed("failed"),
    ];
    let figure = Comparison::new(members.to_vec(), &norm(), vec!["c".into()]).figure();
    assert_eq!(figure.names[3..], ["apart from the start", "failed (failed)"]);
    let panel = figure.panels.iter().find(|panel| panel.title.contains("by cost")).unwrap();
    assert_eq!(panel.zeros, [(0, 0.31), (2, 0.35)]);
    assert_eq!(panel.failed, [(3, 0.55)]);
    let [near] = &panel.curves[..] else { panic!("{:?}", panel.curves) };
    assert!(near.name == 1 && near.points[0].0 == 0.62 && near.points[0].1 > 0.0);
}

#[test]
fn where_runs_part_is_said_with_what_it_is_measured_against() {
    let (first, other) = (member("first", 1.0, 0.0, 0.1), member("other", 1.0, 0.0, 5.0));
    let norm = norm();
    let from = |a: &Run, b: &Run| Deviations::new(norm.course(&a.states, &b.states));
    let diverged = from(&other, &first).diverged.unwrap();
    let (species, by) = diverged.worst();
    assert_eq!((diverged.time, species), (0.0, Some(0)));
    assert!((by.distance - 4.9).abs() < 1e-12, "{diverged:?}");
    assert!((by.relative() - 4.9 / by.size).abs() < 1e-12, "{diverged:?}");
    // The c of the first is between 0.1 and 0.2.
    assert!(by.size > 0.1 && by.size < 0.2, "{diverged:?}");
    let found = norm.distance(&first.states[1], &first.states[2]);
    assert_eq!(found.largest(), 0.0);
    let bent = member("bent", 1.0, 0.5, 0.1);
    let diverged = from(&first, &bent).diverged.unwrap();
    assert_eq!((diverged.time, diverged.worst().0), (1.0, None));
}
