//! How long a run takes, said before it is over.

use std::fs;
use std::time::{Duration, Instant};

use rumple::run::Explanation;
use rumple::run::forecast::{Forecast, Range, StepRule, Taken, Way, words};
use serde_json::Value;

use super::program::{folder, rumple, text};
use super::{SMALL, prepare};
use crate::common::{self, Noise};

const UNTIL: f64 = 20.0;

fn way(every: f64) -> Way {
    Way { until: UNTIL, every, max_steps: None, may_end_sooner: false }
}

/// Heun's rule, which says what its error estimate allows, and that of a method which does not.
const WITH_ESTIMATE: StepRule =
    StepRule::Controlled { rtol: 1e-2, power: 2.0, longest: f64::INFINITY, growth: 2.0 };
const WITHOUT_ESTIMATE: StepRule =
    StepRule::Controlled { rtol: 1e-6, power: 6.0, longest: f64::INFINITY, growth: f64::INFINITY };

/// The steps of a step control to [`UNTIL`]: they begin at `first`, grow by `growth` at most to what `allowed`
/// says of the time, more or less, end at the multiples of `every`, and cost `cost`, more or less. Where one is
/// rejected it is repeated at half the length.
fn steps(
    rule: StepRule,
    (first, growth): (f64, f64),
    allowed: impl Fn(f64) -> f64,
    every: f64,
    cost: f64,
) -> Vec<Taken> {
    let told = rule == WITH_ESTIMATE;
    let mut noise = Noise::new(3);
    let (mut time, mut next, mut outputs, mut all) = (0.0, first, 1.0, Vec::new());
    while time < UNTIL {
        let mut seconds = cost * (1.0 + 0.5 * noise.number());
        let limit = allowed(time) * (1.0 + 0.2 * noise.number());
        let mut proposed = f64::min(next, limit);
        if all.len() % 9 == 4 {
            proposed *= 0.5;
            seconds *= 2.0;
        }
        let target = f64::min(outputs * every, UNTIL);
        let cut = proposed >= target - time;
        let length = if cut { target - time } else { proposed };
        time = if cut { target } else { time + length };
        all.push(Taken { time, length, allowed: told.then_some(limit), cut, seconds });
        next = growth * proposed;
        if cut {
            outputs += 1.0;
        }
    }
    all
}

/// Forecasts during a run of these steps: time and seconds so far, and seconds left; and the total.
fn told(rule: StepRule, every: f64, steps: &[Taken]) -> (Vec<(f64, f64, Range)>, f64) {
    let total: f64 = steps.iter().map(|step| step.seconds).sum();
    let (mut spent, mut all) = (0.0, Vec::new());
    let mut forecast = Forecast::new(rule, way(every), 0.0);
    for step in steps {
        spent += step.seconds;
        forecast.step(*step);
        all.extend(forecast.left().map(|left| (step.time, spent, left)));
    }
    (all, total)
}

/// Every forecast is right within a factor of 4, and of 2 after a tenth of the way; the first is shown
/// before three tenths of it.
fn right(rule: StepRule, every: f64, steps: &[Taken], what: &str) {
    let (all, total) = told(rule, every, steps);
    for (time, spent, left) in &all {
        let ratio = (spent + left.likely) / total;
        let factor = if *time < 0.1 * UNTIL { 4.0 } else { 2.0 };
        assert!(
            (1.0 / factor..=factor).contains(&ratio),
            "{what}: at time {time}, after {spent} of {total} s, {left:?} are left"
        );
        assert!(left.least <= left.likely && left.likely <= left.most, "{what}: {left:?}");
    }
    let first = all.first().unwrap_or_else(|| panic!("{what}: no forecast in {total} s"));
    assert!(first.0 < 0.3 * UNTIL, "{what}: first told at time {} of {UNTIL}", first.0);
}

#[test]
fn growing_steps_cut_by_outputs_and_rejected_are_forecast_within_a_factor_of_two() {
    for (rule, name) in [(WITH_ESTIMATE, "told"), (WITHOUT_ESTIMATE, "untold")] {
        for every in [UNTIL, 1.0, 0.15] {
            for (first, growth) in [(1e-3, 1.3), (1e-5, 2.0), (0.05, 2.0)] {
                let what = format!("{name}, every {every}, from {first} by {growth}");
                let flat = steps(rule, (first, growth), |_| 0.2, every, 0.1);
                right(rule, every, &flat, &what);
                let growing = steps(rule, (first, growth), |t| 0.03 + 0.03 * t, every, 0.1);
                right(rule, every, &growing, &format!("{what}, ever longer"));
            }
        }
    }
}

/// A run of 2.6 s was announced to take 57 s, and one of 3.6 s 114 466 h: at the pace of the first steps.
#[test]
fn short_runs_whose_steps_grow_are_not_announced_to_be_long() {
    for (rule, first, growth, total) in [
        (WITH_ESTIMATE, 1e-3, 1.2, 2.6),
        (WITHOUT_ESTIMATE, 1e-3, 1.2, 2.6),
        (WITH_ESTIMATE, 1e-12, 2.0, 3.6),
        (WITHOUT_ESTIMATE, 1e-12, 1.5, 3.6),
    ] {
        for longest in [0.5, 5.0, f64::INFINITY] {
            let made = steps(rule, (first, growth), |_| longest, UNTIL, 0.1);
            let all: f64 = made.iter().map(|step| step.seconds).sum();
            let made: Vec<Taken> = made
                .into_iter()
                .map(|step| Taken { seconds: step.seconds * total / all, ..step })
                .collect();
            for (_, spent, left) in told(rule, UNTIL, &made).0 {
                let most = 2.0 * total;
                assert!(
                    spent + left.most < 2.0 * most && spent + left.likely < most,
                    "{first}, {growth}, {longest}: after {spent} s {left:?} of {total} s"
                );
            }
        }
    }
}

/// Where steps become ever shorter, as before a singularity, no end is forecast.
#[test]
fn nothing_is_told_while_steps_shrink_to_nothing() {
    let mut forecast = Forecast::new(WITHOUT_ESTIMATE, way(UNTIL), 0.0);
    let (mut time, mut length) = (0.0, 0.05);
    let mut step = |time: &mut f64, length: f64| {
        *time += length;
        forecast.step(Taken { time: *time, length, allowed: None, cut: false, seconds: 0.05 });
        forecast.left()
    };
    for _ in 0..200 {
        step(&mut time, length);
    }
    assert!(step(&mut time, length).is_some());
    while length > 1e-9 {
        length *= 0.8;
        // As long as the pace of before counts, its forecast stays about what it was.
        let left = step(&mut time, length).map_or(0.0, |left| left.likely);
        assert!(left < 40.0, "at time {time} with steps of {length}: {left}");
    }
    for _ in 0..100 {
        step(&mut time, length);
    }
    assert_eq!(step(&mut time, length), None);
}

#[test]
fn the_steps_of_a_method_with_fixed_steps_are_counted_exactly() {
    let point = "sheet = { shape = 'point' }
        time = { until = 1.0, integrator = { kind = 'staggered', method = 'euler', step = 0.03 } }
        kinetics = { rates.c = '-c', initial.c = 1.0 }";
    for (more, every) in [("output.every=0.1", 0.1), ("output.every=0.35", 0.35), ("", 1.0)] {
        let overrides: Vec<&str> = Some(more).filter(|more| !more.is_empty()).into_iter().collect();
        let (scene, mut simulation) = common::prepare(point, &overrides);
        simulation.prepare().unwrap();
        let way = Way::of(&scene);
        assert_eq!(way.every, every);
        let mut forecast = Forecast::new(StepRule::Fixed(0.03), way, 0.0);
        let mut said = Vec::new();
        let mut output = 1.0;
        while simulation.state().time < 1.0 {
            let target = f64::min(output * every, 1.0);
            let length = simulation.step(target).unwrap().length;
            let time = simulation.state().time;
            if time >= target {
                output += 1.0;
            }
            forecast.step(Taken { time, length, allowed: None, cut: time >= target, seconds: 0.5 });
            said.push(forecast.steps_left());
        }
        let all = said.len();
        for (made, left) in said.into_iter().enumerate().skip(2) {
            let true_left = all - 1 - made;
            assert_eq!(left, Some(true_left as f64), "every {every}: after {} of {all}", made + 1);
        }
        // Steps that cost the same make seconds as exact as steps.
        assert_eq!(forecast.whole().map(|whole| whole.likely), Some(0.5 * all as f64));
    }
}

#[test]
fn a_run_that_ends_after_so_many_steps_is_forecast_to() {
    let way = Way { max_steps: Some(50), ..way(UNTIL) };
    let mut forecast = Forecast::new(StepRule::Fixed(0.01), way, 3.0);
    for k in 1..=20u32 {
        let time = 0.01 * f64::from(k);
        forecast.step(Taken { time, length: 0.01, allowed: None, cut: false, seconds: 2.0 });
    }
    assert_eq!(forecast.steps_left(), Some(30.0));
    let whole = forecast.whole().unwrap().likely;
    assert!((whole - 103.0).abs() < 1e-9, "{whole}");
}

/// Steps go with the square root of the tolerance, or with the step that is chosen; output times bound them.
#[test]
fn other_tolerances_cost_what_the_order_of_the_method_says() {
    let after = |rule, allowed, length: f64, every: f64| {
        let mut forecast = Forecast::new(rule, way(every), 0.0);
        for k in 1..=50u32 {
            let time = length * f64::from(k);
            forecast.step(Taken { time, length, allowed, cut: length == every, seconds: 1.0 });
        }
        let at = |factor| forecast.whole_at(factor).unwrap() / forecast.whole().unwrap().likely;
        [at(0.5), at(1.0), at(2.0)]
    };
    // A shorter step costs less, by a power of 0.3 where nothing else is known.
    let root = 0.5f64.powf(-0.5 * 0.7);
    let [half, same, double] = after(WITH_ESTIMATE, Some(0.1), 0.1, UNTIL);
    assert!((same - 1.0).abs() < 1e-12, "{same}");
    assert!(
        (half / root - 1.0).abs() < 0.03 && (double * root - 1.0).abs() < 0.03,
        "{half} {double}"
    );
    let [half, _, double] = after(StepRule::Fixed(0.1), None, 0.1, UNTIL);
    assert!((half / root.powi(2) - 1.0).abs() < 1e-6, "{half}");
    assert!((double * root.powi(2) - 1.0).abs() < 1e-6, "{double}");
    // Steps that might be far longer than the output times allow stay as they are.
    let [half, _, double] = after(WITH_ESTIMATE, Some(2.0), 0.1, 0.1);
    assert!((half - 1.0).abs() < 1e-9 && (double - 1.0).abs() < 1e-9, "{half} {double}");
}

#[test]
fn durations_have_two_figures_at_most() {
    let cases = [
        (0.02, "less than 0.1 s"),
        (0.43, "0.4 s"),
        (2.3, "2 s"),
        (57.2, "57 s"),
        (89.0, "89 s"),
        (185.0, "3.1 min"),
        (2700.0, "45 min"),
        (9000.0, "2.5 h"),
        (99.0 * 3600.0, "4.1 d"),
        (4.1e8, "4700 d"),
    ];
    for (seconds, expected) in cases {
        assert_eq!(words::duration(seconds), expected);
    }
    let range = |least, likely, most| Range { likely, least, most };
    assert_eq!(words::about(range(25.0, 40.0, 80.0)), "about 40 s (25 to 80 s)");
    assert_eq!(words::about(range(39.0, 40.0, 42.0)), "about 40 s");
    assert_eq!(words::about(range(0.01, 0.02, 0.2)), "less than 0.1 s");
}

fn run_time(explanation: &Explanation) -> Option<String> {
    let section = explanation.sections.iter().find(|section| section.title == "run time")?;
    Some(section.lines.iter().map(|line| format!("{} {}\n", line.what, line.because)).collect())
}

#[test]
fn explain_makes_first_steps_for_as_long_as_it_may() {
    let (scene, mut simulation) = prepare(&[]);
    let mut all = Explanation::of(&scene, &mut simulation).unwrap();
    assert_eq!(run_time(&all), None);
    all.predict(&scene, &mut simulation, Duration::from_secs(600));
    let said = run_time(&all).unwrap();
    assert!(said.contains("rtol 0.02; half the tolerance about") || said.contains("all"), "{said}");
    // A budget that is over at once, on a sheet of which a step takes long.
    let (scene, mut simulation) = prepare(&[
        "sheet.vertices=20000",
        "sheet.radius=100",
        "time.until=1000",
        "output.every=10",
    ]);
    let mut all = Explanation::of(&scene, &mut simulation).unwrap();
    let began = Instant::now();
    all.predict(&scene, &mut simulation, Duration::from_millis(50));
    assert!(began.elapsed() < Duration::from_secs(20), "{:?}", began.elapsed());
    let said = run_time(&all).unwrap();
    assert!(said.contains("not known yet") && all.predicted.is_none(), "{said}");
}

#[test]
fn a_run_says_how_long_it_takes_and_how_far_off_that_was() {
    // As many equal steps as take a second on most machines; a power of 2, so that times are exact.
    let point = "sheet = { shape = 'point' }
        time = { until = 1.0, integrator = { kind = 'staggered', method = 'euler', step = 7.62939453125e-6 } }
        kinetics = { rates.c = '-c', initial.c = 1.0 }";
    let folder = folder(point);
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "out", "--threads", "1"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let status = fs::read_to_string(folder.path().join("out/status.json")).unwrap();
    let status: Value = serde_json::from_str(&status).unwrap();
    let predicted = &status["predicted"];
    let (said, judged) = (text(&out.stderr), text(&out.stdout));
    if status["wall_seconds"].as_f64().unwrap() < 1.0 && predicted.is_null() {
        assert!(!said.contains("about") && !judged.contains("predicted"), "{said}{judged}");
        return;
    }
    assert_eq!(predicted["steps"], 131_072, "{status}");
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(
        number(&predicted["took"]["seconds"]) >= number(&predicted["after_seconds"]),
        "{status}"
    );
    assert!(said.contains("in steps of 7.62939453125e-6; half the step about"), "{said}");
    assert!(
        judged.contains("predicted after") && judged.contains("times the prediction"),
        "{judged}"
    );
}

#[test]
fn explain_can_be_told_not_to_make_steps() {
    let folder = folder(SMALL);
    let without = rumple(folder.path(), &["explain", "scene.toml", "--predict", "0"]);
    assert!(without.status.success() && !text(&without.stdout).contains("run time"));
    let with = rumple(folder.path(), &["explain", "scene.toml"]);
    assert!(text(&with.stdout).contains("run time"), "{}", text(&with.stdout));
    let wrong = rumple(folder.path(), &["explain", "scene.toml", "--predict", "-1"]);
    assert_eq!(wrong.status.code(), Some(2));
}
