//! Plots and pictures of comparisons: what is in them.

use std::sync::Arc;
use std::time::Duration;

use rumple::kinetics::Location;
use rumple::model::State;
use rumple::output::picture::Picture;
use rumple::run::run::{Ending, Summary};
use rumple::solve::SolveError;
use rumple::study::compare::{Member, MemberRun, contact_sheet, figure};
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
        rate: 0.0,
    };
    let work = Work { steps: 2, iterations: 10, factorisations: 1, ..Work::default() };
    let summary = Summary {
        ending: Ending::Reached,
        time: 2.0,
        resumable: None,
        step: 0,
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

/// Runs of rows of `picture` with a pixel of which `is` holds.
fn bands(picture: &mut Picture, is: fn(&[u8]) -> bool) -> Vec<std::ops::Range<usize>> {
    let (width, height) = picture.size();
    let rgb = picture.rgb_mut();
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for row in (0..height).filter(|row| rgb[3 * width * row..][..3 * width].chunks(3).any(is)) {
        match found.last_mut() {
            Some(last) if last.end == row => last.end += 1,
            _ => found.push(row..row + 1),
        }
    }
    found
}

fn coloured(pixel: &[u8]) -> bool {
    pixel.iter().max().unwrap() - pixel.iter().min().unwrap() > 20
}

fn dark(pixel: &[u8]) -> bool {
    !coloured(pixel) && pixel[0] < 100
}

#[test]
fn every_member_has_a_row_of_its_own_in_the_pictures() {
    let members = [
        member("first", 1.0, 0.0, 0.1),
        failed("second"),
        member("third", 2.0, 0.6, 0.1),
        member("fourth", 2.0, 0.0, 0.9),
        member("like the first", 2.0, 0.0, 0.1),
    ];
    let mut picture = contact_sheet(&members).unwrap().unwrap();
    let rows = bands(&mut picture, coloured);
    // Four sheets, and the key to the colours.
    assert_eq!(rows.len(), 5, "{rows:?}");
    let (width, height) = picture.size();
    assert_eq!(width, 3 * 300, "three times");
    let of = |picture: &mut Picture, rows: &std::ops::Range<usize>| {
        picture.rgb_mut()[3 * width * rows.start..3 * width * rows.end].to_vec()
    };
    let [first, third, fourth, like] = [0, 1, 2, 3].map(|k| of(&mut picture, &rows[k]));
    assert!(first != third && first != fourth && third != fourth);
    assert_eq!(first, like);
    // Every tile of a row holds a sheet.
    for band in &rows[..4] {
        for column in 0..3 {
            let row = (band.start + band.end) / 2;
            let at = 3 * (row * width + column * 300 + 150);
            assert!(coloured(&picture.rgb_mut()[at..at + 3]), "{band:?} {column}");
        }
    }
    // Names and times are written above every row, and once more for the one that failed.
    let words = bands(&mut picture, dark);
    let mut from = 0;
    for (number, row) in rows[..4].iter().enumerate() {
        let above = words.iter().filter(|w| w.start >= from && w.end <= row.start).count();
        assert!(above >= if number == 1 { 3 } else { 2 }, "{number}: {words:?} {rows:?}");
        from = row.end;
    }
    assert!(words.last().unwrap().start >= rows[3].end && rows[4].end < height);
}

#[test]
fn pictures_of_equal_values_say_which() {
    let mut one = member("one", 1.0, 0.3, 0.1);
    if let Ok(ran) = &mut one.outcome {
        ran.shown.iter_mut().flatten().for_each(|v| *v = 0.25);
    }
    let mut picture = contact_sheet(&[one]).unwrap().unwrap();
    let rows = bands(&mut picture, coloured);
    assert_eq!(rows.len(), 1, "{rows:?}");
    assert!(bands(&mut picture, dark).last().unwrap().start >= rows[0].end);
}

/// Marks of the cost plot and numbers below it, of an SVG.
fn cost(members: &[Member]) -> (String, Vec<f64>) {
    let mut figure = figure(members);
    figure.panels.retain(|panel| panel.title.contains("by cost"));
    figure.columns = 1;
    assert_eq!(figure.panels.len(), 1);
    let svg = figure.svg().unwrap();
    let mut texts: Vec<(f64, f64)> = Vec::new();
    for text in svg.split("<text").skip(1) {
        let attribute = |name: &str| -> Option<f64> {
            text.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse().ok()
        };
        let shown = text.split('>').nth(1).and_then(|t| t.split('<').next()).unwrap().trim();
        if let (Ok(value), Some(y)) = (shown.parse(), attribute("y")) {
            texts.push((y, value));
        }
    }
    // Those on the lowest line belong to the axis below.
    let lowest = texts.iter().fold(0.0f64, |m, t| m.max(t.0));
    (svg, texts.iter().filter(|t| t.0 == lowest).map(|t| t.1).collect())
}

#[test]
fn the_cost_plot_has_every_member_and_ticks() {
    // Costs within less than a decade, one member equal to the first, one that begins apart.
    let members = [
        member("first", 0.31, 0.0, 0.5),
        member("near", 0.62, 0.0, 0.501),
        member("the same", 0.35, 0.0, 0.5),
        member("apart from the start", 0.55, 0.0, 5.0),
        failed("failed"),
        failed("failed too"),
    ];
    let (svg, ticks) = cost(&members);
    assert!(ticks.len() >= 2 && ticks.is_sorted(), "{ticks:?}");
    assert!(ticks[0] <= 0.31 && *ticks.last().unwrap() >= 0.62, "{ticks:?}");
    assert_eq!(svg.matches("<circle").count(), 1, "{svg}");
    assert_eq!(svg.matches("<polygon").count(), 5, "{svg}");
    // A first member alone, and costs over many decades.
    assert!(cost(&members[..1]).1.len() >= 2);
    let (_, ticks) = cost(&[member("first", 1e-4, 0.0, 0.5), member("slow", 3e7, 0.0, 0.501)]);
    assert!((4..=9).contains(&ticks.len()), "{ticks:?}");
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
