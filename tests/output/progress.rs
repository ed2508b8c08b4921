use std::io::Write;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rumple::output::remaining::{Remaining, duration};
use rumple::output::{Mode, Progress, ProgressLine};

use crate::common::Noise;

#[derive(Clone, Default)]
struct Page(Arc<Mutex<Vec<u8>>>);

impl Page {
    fn lines(&self) -> Vec<String> {
        let bytes = self.0.lock().unwrap().clone();
        String::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect()
    }
}

impl Write for Page {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn line(step: u64, time: f64) -> ProgressLine {
    ProgressLine { time, step, dt: 0.5, residual: 1e-7, note: String::new() }
}

#[test]
fn first_and_last_are_shown_whatever_the_interval() {
    let page = Page::default();
    let hour = Duration::from_secs(3600);
    let mut progress = Progress::lines_to(Box::new(page.clone()), hour, 0.0, 50.0);
    for step in 0..=100u32 {
        progress.update(&line(step.into(), f64::from(step) * 0.5));
        if step == 10 {
            progress.message("a frame");
        }
    }
    progress.finish();
    let lines = page.lines();
    assert_eq!(lines.len(), 3, "{lines:?}");
    assert!(lines[0].contains("step 0"));
    assert_eq!(lines[1], "a frame");
    assert_eq!(lines[2], "time 50.000000 of 50  step 100  dt 5.000e-1  residual 1.00e-7");
}

#[test]
fn a_shown_last_line_is_not_repeated() {
    let page = Page::default();
    let mut progress = Progress::lines_to(Box::new(page.clone()), Duration::ZERO, 0.0, 2.0);
    progress.update(&line(1, 1.0));
    progress.update(&ProgressLine { note: "steady".to_owned(), ..line(2, 2.0) });
    progress.finish();
    let lines = page.lines();
    assert_eq!(lines.len(), 2, "{lines:?}");
    // One step is no basis for a time that is left.
    assert!(lines[0].ends_with("residual 1.00e-7"), "{lines:?}");
    assert!(lines[1].ends_with("  steady"), "{lines:?}");
}

/// Times without an end, or with nothing between start and end, must not upset the bar.
#[test]
fn every_mode_takes_odd_times() {
    for mode in [Mode::Bar, Mode::Silent] {
        for end in [0.0, f64::INFINITY, f64::NAN] {
            let mut progress = Progress::new(mode, 0.0, end);
            progress.update(&line(1, 1.0));
            progress.update(&line(2, f64::NAN));
            progress.finish();
        }
    }
}

/// Every time left that is reported during a run of these steps (length, seconds): seconds so far, what
/// is reported, what is true.
fn reported(steps: &[(f64, f64)]) -> Vec<(f64, f64, f64)> {
    let end: f64 = steps.iter().map(|s| s.0).sum();
    let total: f64 = steps.iter().map(|s| s.1).sum();
    let (mut time, mut seconds) = (0.0, 0.0);
    let mut remaining = Remaining::default();
    let mut all = Vec::new();
    for (step, cost) in steps {
        time += step;
        seconds += cost;
        remaining.step(seconds, time);
        all.extend(remaining.seconds(end).map(|left| (seconds, left, total - seconds)));
    }
    all
}

/// Steps that grow by `factor` from `first` to `largest`, each of `cost` seconds more or less, to
/// time 20.
fn growing(first: f64, factor: f64, largest: f64, cost: f64) -> Vec<(f64, f64)> {
    let mut noise = Noise::new(3);
    let (mut time, mut step, mut all) = (0.0, first, Vec::new());
    while time < 20.0 {
        all.push((step, cost * (1.0 + 0.5 * noise.number())));
        time += step;
        step = (step * factor).min(largest);
    }
    all
}

fn hardly_wrong(reported: &[(f64, f64, f64)]) {
    for (seconds, left, truth) in reported {
        // The last step may be long against what is left.
        let ratio = (left + 1.0) / (truth + 1.0);
        assert!(
            (0.4..=2.5).contains(&ratio),
            "after {seconds} s: {left} s reported, {truth} s true"
        );
    }
}

/// Runs of a few seconds that were announced to take a minute, or thirteen years.
#[test]
fn short_runs_with_growing_steps_are_not_announced_to_be_long() {
    for (first, factor) in [(1e-9, 1.5), (1e-12, 2.0), (1e-5, 1.05), (1e-3, 1.2), (1e-7, 5.0)] {
        for largest in [0.05, 0.5, f64::INFINITY] {
            for cost in [1e-3, 1e-2, 0.1] {
                hardly_wrong(&reported(&growing(first, factor, largest, cost)));
            }
        }
    }
}

#[test]
fn the_time_left_of_a_long_run_is_told_once_there_is_a_basis() {
    for steps in [growing(1e-9, 1.5, 0.02, 0.1), growing(0.02, 1.0, 0.02, 1e-3 * 20.0)] {
        let all = reported(&steps);
        hardly_wrong(&all);
        let total: f64 = steps.iter().map(|s| s.1).sum();
        let first = all.first().unwrap().0;
        assert!(first >= 2.0 && first < 0.25 * total, "first reported after {first} of {total} s");
        assert!(all.len() * 10 > 7 * steps.len(), "{} of {}", all.len(), steps.len());
    }
    // Thousands of steps are remembered as well as a few, and hours as well as seconds.
    let all = reported(&growing(1e-4, 1.0, 1e-4, 0.5));
    hardly_wrong(&all);
    assert!(all.len() > 100_000);
}

/// Where steps become ever shorter, as before a singular point, there is no end in sight.
#[test]
fn no_time_left_is_told_while_steps_shrink_to_nothing() {
    let mut steps: Vec<(f64, f64)> = growing(0.05, 1.0, 0.05, 0.05);
    let (mut step, begin) = (0.05, 0.05 * 400.0);
    while step > 1e-9 {
        steps.push((step, 0.05));
        step *= 0.8;
    }
    steps.push((20.0, 0.05));
    let end: f64 = steps.iter().map(|s| s.0).sum();
    let (mut time, mut seconds, mut remaining) = (0.0, 0.0, Remaining::default());
    for (number, (step, cost)) in steps[..steps.len() - 1].iter().enumerate() {
        time += step;
        seconds += cost;
        remaining.step(seconds, time);
        // As long as the pace of before counts, its forecast stays what it was.
        let left = remaining.seconds(end).unwrap_or(0.0);
        assert!(left < 60.0, "step {number}, time {time} ({begin}): {left}");
    }
    assert_eq!(remaining.seconds(end), None);
}

#[test]
fn durations_have_two_figures_at_most() {
    let cases = [
        (0.02, "1 s"),
        (2.3, "3 s"),
        (57.2, "57 s"),
        (89.0, "89 s"),
        (185.0, "3.1 min"),
        (2700.0, "45 min"),
        (9000.0, "2.5 h"),
        (99.0 * 3600.0, "4.1 d"),
        (4.1e8, "4700 d"),
    ];
    for (seconds, text) in cases {
        assert_eq!(duration(seconds), text);
    }
}

/// Work within a step is reported where nothing was shown for long, and not more often.
#[test]
fn an_aside_waits_for_its_turn() {
    let hour = Duration::from_secs(3600);
    for (every, expected) in [(Duration::ZERO, 2), (hour, 0)] {
        let page = Page::default();
        let progress = Progress::lines_to(Box::new(page.clone()), every, 0.0, 2.0);
        let aside = progress.aside();
        aside.report(&|| "half way".into());
        aside.report(&|| "nearly there".into());
        assert_eq!(page.lines().len(), expected);
    }
}
