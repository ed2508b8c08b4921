//! Output times nearer to each other than the integrator's own steps.

use super::program::{folder, passes_with, text};
use crate::common::prepare;

const SHEET: &str = r#"
sheet = { shape = "disc", radius = 3.0, vertices = 30 }
[kinetics]
rates.c = "-c"
initial.c = 1.0
[time]
policy = "simultaneous"
until = 1000.0
"#;

/// Steps to `count` output times `every` apart; the number of steps and the largest error relative to 1.
fn outputs(integrator: &str, every: f64, count: u32) -> (usize, f64) {
    let (_, mut simulation) = prepare(SHEET, &[&format!("time.integrator={integrator}")]);
    simulation.prepare().unwrap();
    let (mut steps, mut error): (usize, f64) = (0, 0.0);
    for k in 1..=count {
        let target = f64::from(k) * every;
        while simulation.state().time < target {
            let step = simulation.step(target);
            step.unwrap_or_else(|e| panic!("{integrator}, {every}, output {k}: {e}"));
            steps += 1;
        }
        assert_eq!(simulation.state().time.to_bits(), target.to_bits());
        error = error.max((simulation.state().species[0][0] - (-target).exp()).abs());
    }
    (steps, error)
}

/// The summary says where output times set the length of the steps.
#[test]
fn steps_that_end_at_output_times_are_counted() {
    let folder = folder(SHEET);
    let said = |keys: &[&str]| {
        let mut args = vec!["run", "scene.toml", "--out", "out", "--force"];
        keys.iter().for_each(|key| args.extend(["--set", key]));
        let out = passes_with(folder.path(), &args);
        text(&out.stdout)
    };
    let few = ["output.every=2.5", "time.until=5", "time.integrator='monolithic'"];
    assert!(!said(&few).contains("end at output times"));
    assert!(!said(&["time.until=5"]).contains("end at output times"));
    let many = ["output.every=0.01", "time.until=1", "output.report=false"];
    let words = said(&many);
    let count: Vec<u32> = words
        .lines()
        .find(|line| line.contains("steps end at output times"))
        .unwrap_or_else(|| panic!("{words}"))
        .split(' ')
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(count[0] == 99 && count[1] <= 198, "{words}");
}

#[test]
fn many_outputs_are_met_exactly() {
    for method in ["bdf", "tr-bdf2", "esdirk34"] {
        let integrator = format!("{{ kind = 'monolithic', method = '{method}' }}");
        for (every, count) in [(0.02, 10_000), (0.01, 3000), (1e-3, 3000), (1.0 / 3.0, 2000)] {
            let (steps, error) = outputs(&integrator, every, count);
            let most = 3 * usize::try_from(count).unwrap() + 500;
            assert!(steps < most, "{method}, {every}: {steps} steps");
            assert!(error < 1e-3, "{method}, {every}: {error}");
        }
    }
    // Steps of diffsol that output times cut in turn lost the direction of time.
    let (steps, error) = outputs("{ kind = 'monolithic', method = 'bdf' }", 3e-5, 30_000);
    assert!(steps < 90_000 && error < 1e-3, "{steps} steps, {error}");
    for (integrator, error) in
        [("'staggered'", 0.05), ("{ kind = 'explicit', method = 'tsit45' }", 1e-3)]
    {
        let (steps, found) = outputs(integrator, 0.02, 2000);
        assert!(steps < 4500 && found < error, "{integrator}: {steps} steps, {found}");
    }
}

/// 3 · 0.3 is not 0.9 in floating-point numbers: there is one frame at the end, and no step of round-off before it.
#[test]
fn multiples_that_meet_the_end_up_to_round_off_are_the_end() {
    let folder = folder(SHEET);
    for (every, until) in [("0.3", "0.9"), ("0.7", "2.1"), ("0.1", "0.3"), ("0.1", "0.7")] {
        let keys = [format!("output.every={every}"), format!("time.until={until}")];
        let keys = keys.iter().flat_map(|key| ["--set", key]);
        let args = ["run", "scene.toml", "--out", "out", "--force", "--quiet"];
        passes_with(folder.path(), &args.into_iter().chain(keys).collect::<Vec<_>>());
        let frames = std::fs::read_dir(folder.path().join("out/frames")).unwrap().count();
        let [every, until]: [f64; 2] = [every, until].map(|number| number.parse().unwrap());
        assert_eq!(frames, rumple::num::whole((until / every).round()) + 1, "{every}, {until}");
    }
}
