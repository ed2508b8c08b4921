//! A Rust program that embeds the library: its signal handlers and its end are its own.

use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};

use rumple::kinetics::{Batch, Column, Location, Quantity, field};
use rumple::model::Evaluation;
use rumple::output::{Interrupt, Mode, Progress, ResultDirectory};
use rumple::run::{Ending, Observer, StepInfo, run};

use super::build::library;
use crate::common::prepare;
use crate::coupled::DOME;

const CHILD: &str = "RUMPLE_TEST_EMBEDDING";

/// Masks of caught and of ignored signals of this process.
fn signal_masks() -> Vec<String> {
    let text = fs::read_to_string("/proc/self/status").unwrap();
    let is_mask = |line: &&str| ["SigCgt:", "SigIgn:"].iter().any(|key| line.starts_with(key));
    text.lines().filter(is_mask).map(str::to_owned).collect()
}

/// The other half of the test below, in a process where no other test changes anything.
#[test]
fn child_evaluates_a_plugin() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let before = signal_masks();
    assert_eq!(before.len(), 2, "{before:?}");
    let law = library("curvature-feedback").instantiate(&BTreeMap::new()).unwrap();
    let c = [0.25; 2];
    let batch = Batch {
        location: Location::Vertex,
        first: 0,
        count: 2,
        species: &[(&c[..]).into()],
        signals: &[Column::uniform(&0.125)],
        parameters: &[],
    };
    field::evaluate(&law, Quantity::Rates, &batch, &mut [&mut [0.0; 2]], &mut []).unwrap();
    drop(law);
    run_with_an_observer();
    assert_eq!(signal_masks(), before);
}

/// Heights at the accepted states, until one is later than the limit.
#[derive(Default)]
struct Heights {
    limit: f64,
    seen: Vec<(f64, f64)>,
    frames: usize,
}

fn height(at: &Evaluation<'_>) -> f64 {
    at.state().x.iter().map(|x| x.z.abs()).fold(0.0, f64::max)
}

impl Observer for Heights {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> rumple::Result<()> {
        if info.new {
            self.seen.push((at.state().time, height(at)));
        }
        self.frames += usize::from(info.frame);
        Ok(())
    }

    fn stop(&mut self, at: &mut Evaluation<'_>) -> rumple::Result<Option<Ending>> {
        Ok((at.state().time > self.limit).then_some(Ending::Observed("late enough")))
    }
}

/// A run with an observer of another crate, from a program that watches for signals itself.
fn run_with_an_observer() {
    let folder = tempfile::tempdir().unwrap();
    let observed = |limit: f64, name: &str| {
        let (scene, mut simulation) = prepare(DOME, &["output.every=0.25", "time.until=1.0"]);
        let directory = ResultDirectory::prepare(&folder.path().join(name), false).unwrap();
        let mut progress = Progress::new(Mode::Silent, 1.0);
        let mut heights = Heights { limit, ..Heights::default() };
        let others: &mut [&mut dyn Observer] = &mut [&mut heights];
        let interrupt = Interrupt::on_request();
        let summary = run::observed(
            &scene,
            &mut simulation,
            &directory,
            &mut progress,
            interrupt,
            (None, others),
        );
        (heights, summary.unwrap())
    };
    let (heights, summary) = observed(f64::INFINITY, "whole");
    assert_eq!(summary.ending, Ending::Reached);
    assert_eq!((heights.seen.len() as u64, heights.frames), (summary.step + 1, 5));
    assert!(heights.seen.is_sorted_by(|a, b| a.0 < b.0));
    assert!(heights.seen.iter().all(|seen| seen.1 > 0.0));
    let first = heights.seen.iter().find(|seen| seen.0 > 0.3).unwrap().0;
    let (heights, summary) = observed(0.3, "stopped");
    assert_eq!(summary.ending, Ending::Observed("late enough"));
    assert_eq!((summary.time, heights.seen.last().unwrap().0), (first, first));
}

#[test]
fn the_library_installs_no_signal_handler() {
    let out = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "plugins::embedding::child_evaluates_a_plugin", "--nocapture"])
        .env(CHILD, "1")
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&out.stdout) + String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success() && text.contains("1 passed"), "{text}");
}
