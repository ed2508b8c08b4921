//! Plots of comparisons: what is in them.

use std::sync::Arc;
use std::time::Duration;

use rumple::kinetics::Location;
use rumple::model::State;
use rumple::run::run::{Ending, Summary};
use rumple::solve::SolveError;
use rumple::study::compare::{Member, MemberRun, figure};
use rumple::study::{Measures, Norm};
use rumple::tally::{Spent, Work};
use rumple::{Error, Vec3};

use crate::common::lattice;

/// A member that ran for `seconds`, its lattice bent by `bend` and its species around `level`, at
/// three times.
fn member(name: &str, seconds: f64, bend: f64, level: f64) -> Member {
    let sheet = Arc::new(lattice(12, 12));
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
        width: None,
        wrinkle_width: None,
        rate: 0.0,
    };
    let work = Work { steps: 2, iterations: 10, factorisations: 1, ..Work::default() };
    let summary = Summary {
        ending: Ending::Reached,
        time: 2.0,
        resumable: None,
        step: 0,
        to_outputs: [0; 2],
        frames: 3,
        spent: Spent { work, wall_seconds: seconds, ..Spent::default() },
        start: Spent::default(),
        wall: Duration::from_secs_f64(seconds),
        output: Duration::ZERO,
        invariants: Vec::new(),
        drag_share: 0.0,
        intersection: None,
    };
    let ran = MemberRun {
        summary,
        measures: states.iter().map(measures).collect(),
        shown: states.iter().map(|s| s.species[0].clone()).collect(),
        species: vec!["c".into()],
        norm: Norm::new(&sheet, vec![(1.0, Location::Vertex)]),
        sheet,
        states,
    };
    Member { name: name.into(), outcome: Ok(ran) }
}

fn failed(name: &str) -> Member {
    Member { name: name.into(), outcome: Err(Error::Solve(SolveError::Interrupted)) }
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
    let figure = figure(&members);
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
    let (Ok(first), Ok(other)) = (&first.outcome, &other.outcome) else { unreachable!() };
    let diverged = other.deviations(first).diverged.unwrap();
    let (species, by) = diverged.worst();
    assert_eq!((diverged.time, species), (0.0, Some(0)));
    assert!((by.distance - 4.9).abs() < 1e-12, "{diverged:?}");
    assert!((by.relative() - 4.9 / by.size).abs() < 1e-12, "{diverged:?}");
    // The c of the first is between 0.1 and 0.2.
    assert!(by.size > 0.1 && by.size < 0.2, "{diverged:?}");
    let found = first.norm.distance(&first.states[1], &first.states[2]);
    assert_eq!(found.largest(), 0.0);
    let bent = member("bent", 1.0, 0.5, 0.1);
    let Ok(bent) = &bent.outcome else { unreachable!() };
    let diverged = first.deviations(bent).diverged.unwrap();
    assert_eq!((diverged.time, diverged.worst().0), (1.0, None));
}
