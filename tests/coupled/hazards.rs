//! Hazards of diffsol that the integrators guard against.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rumple::solve::{Result, SolveError};
use rumple::tally::Tally;
use rumple_numerics::linear::{Assembly, LinearChoice, Sparse};
use rumple_numerics::ode::{Failure, Integration, OdeMethod, OdeProblem, Options, Rejected};

type Law = fn(f64, &[f64], &mut [f64]) -> Result<(), Failure>;

/// An error as a problem tells it.
fn failure(error: SolveError) -> Failure {
    Failure { recoverable: error.is_recoverable(), cause: Box::new(error) }
}

/// dy/dt = law(t, y) with a diagonal Jacobian.
struct Small {
    law: Law,
    slope: fn(f64, f64) -> f64,
    unknowns: usize,
    differential: Option<Vec<bool>>,
    matrix: Assembly,
    calls: Arc<AtomicUsize>,
}

impl Small {
    fn new(law: Law, slope: fn(f64, f64) -> f64, unknowns: usize) -> Self {
        let matrix = Assembly::new(unknowns, unknowns, |entries| {
            (0..unknowns).for_each(|i| entries.add(i, i, 0.0));
        });
        Self { law, slope, unknowns, differential: None, matrix, calls: Arc::default() }
    }
}

impl OdeProblem for Small {
    fn unknowns(&self) -> usize {
        self.unknowns
    }

    fn differential(&self) -> Option<Vec<bool>> {
        self.differential.clone()
    }

    fn rhs(&mut self, time: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        (self.law)(time, y, out)
    }

    fn jacobian(&mut self, time: f64, y: &[f64]) -> Result<&Sparse, Failure> {
        let slope = self.slope;
        self.matrix.fill(|entries| {
            (0..y.len()).for_each(|i| entries.add(i, i, slope(time, y[i])));
        });
        Ok(self.matrix.matrix())
    }

    fn last_jacobian(&self) -> &Sparse {
        self.matrix.matrix()
    }
}

const METHODS: [OdeMethod; 4] =
    [OdeMethod::Bdf, OdeMethod::TrBdf2, OdeMethod::Esdirk34, OdeMethod::Tsit45];

fn options(method: OdeMethod, n: usize) -> Options {
    Options {
        method,
        linear: LinearChoice::Auto,
        displacements: None,
        rtol: 1e-5,
        atol: vec![1e-8; n],
        step: None,
        span: 1.0,
        tally: Tally::default(),
    }
}

/// Steps from 0 to `until`: the last solution and the tries that were rejected. `accept` is asked about every step, with the
/// time of the last one, the new one and the solution there.
fn stepped(
    small: Small,
    start: &[f64],
    options: &Options,
    until: f64,
    mut accept: impl FnMut(f64, f64) -> Result<(), Failure>,
) -> Result<(Vec<f64>, u64)> {
    let mut integration = Integration::new(small, 0.0, start.to_vec(), options.clone())?;
    let (mut time, mut solution, mut rejected) = (0.0, start.to_vec(), 0);
    while time < until {
        let mut next = None;
        let mut tries = Rejected::default();
        let mut keep = |new: f64, y: &[f64]| {
            accept(time, new)?;
            next = Some((new, y.to_vec()));
            Ok(())
        };
        integration.step(until, &mut keep, &mut tries)?;
        rejected += tries.count();
        // What was accepted last is what a step has led to.
        (time, solution) = next.unwrap();
    }
    Ok((solution, rejected))
}

/// Integrates to `until`, with how often F was called.
fn integrate(
    small: Small,
    start: &[f64],
    options: &Options,
    until: f64,
) -> (Result<Vec<f64>>, usize) {
    let calls = Arc::clone(&small.calls);
    let result = stepped(small, start, options, until, |_, _| Ok(()));
    (result.map(|(solution, _)| solution), calls.load(Ordering::Relaxed))
}

fn decay(_: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
    out.iter_mut().zip(y).for_each(|(out, y)| *out = -y);
    Ok(())
}

#[test]
fn every_method_integrates() {
    for method in METHODS {
        let (y, _) =
            integrate(Small::new(decay, |_, _| -1.0, 3), &[1.0; 3], &options(method, 3), 1.0);
        let error = (y.unwrap()[0] - (-1.0f64).exp()).abs();
        assert!(error < 1e-4, "{method:?}: {error:e}");
    }
}

/// The right-hand side has no way to fail; the error must come out all the same, and soon.
#[test]
fn a_failing_right_hand_side_ends_with_its_own_error() {
    fn law(time: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        if time > 0.5 {
            return Err(failure(SolveError::Interrupted));
        }
        decay(time, y, out)
    }
    for method in METHODS {
        let (y, calls) =
            integrate(Small::new(law, |_, _| -1.0, 2), &[1.0; 2], &options(method, 2), 1.0);
        assert!(matches!(y, Err(SolveError::Interrupted)), "{method:?}: {y:?}");
        assert!(calls < 5000, "{method:?}: {calls} calls");
    }
}

/// An error that a shorter step cures does not end the integration.
#[test]
fn an_error_that_a_shorter_step_cures_is_cured() {
    // A law that refuses what a too long step gives it.
    fn law(_: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        if y[0] < 0.0 {
            return Err(failure(SolveError::NotFinite));
        }
        out[0] = -50.0 * y[0].sqrt().min(1.0) * y[0];
        Ok(())
    }
    for method in METHODS {
        let mut options = options(method, 1);
        options.step = Some(0.5);
        let (y, _) = integrate(Small::new(law, |_, _| -50.0, 1), &[1.0], &options, 0.2);
        let y = y.unwrap_or_else(|e| panic!("{method:?}: {e}"));
        assert!(y[0] > 0.0 && y[0] < 0.2, "{method:?}: {y:?}");
    }
}

/// diffsol's explicit error norm drops NaN: such a step would be accepted, and the next one longer.
#[test]
fn a_step_to_nan_is_never_accepted() {
    fn law(_: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        // Not a number beyond y = 2, where the solution arrives at t = 1.
        out.iter_mut().zip(y).for_each(|(out, y)| *out = 1.0 + 0.0 * (2.0 - y).sqrt());
        Ok(())
    }
    for method in METHODS {
        let (y, _) = integrate(Small::new(law, |_, _| 0.0, 5), &[1.0; 5], &options(method, 5), 3.0);
        assert!(y.is_err(), "{method:?} goes through: {y:?}");
    }
}

/// 50 failures of Newton's method in a whole life would end a long run.
#[test]
fn failures_of_newton_do_not_add_up() {
    // A Jacobian of the wrong sign half of the time: Newton's method fails again and again.
    fn law(time: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        let drive = if (200.0 * time).sin() > 0.0 { 900.0 } else { 1.0 };
        out[0] = drive * ((20.0 * time).cos() - y[0]);
        Ok(())
    }
    let mut options = options(OdeMethod::Bdf, 1);
    options.rtol = 1e-3;
    let small = Small::new(law, |time, _| if (200.0 * time).sin() > 0.0 { 900.0 } else { -1.0 }, 1);
    let (_, rejected) = stepped(small, &[1.0], &options, 1.0, |_, _| Ok(())).unwrap();
    assert!(rejected > 60, "{rejected}");
}

/// diffsol's sparse LU panics where a factorisation fails; a singular matrix must be an error.
#[test]
fn a_singular_newton_matrix_is_an_error() {
    fn law(_: f64, _: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        out.fill(1.0);
        Ok(())
    }
    for linear in [LinearChoice::Lu, LinearChoice::Ilu] {
        for method in [OdeMethod::Bdf, OdeMethod::TrBdf2, OdeMethod::Esdirk34] {
            // Without storage and with a Jacobian of nothing: nothing determines the second unknown.
            let mut small = Small::new(law, |_, _| 0.0, 2);
            small.differential = Some(vec![true, false]);
            let options = Options { linear, ..options(method, 2) };
            let (y, _) = integrate(small, &[0.0; 2], &options, 1.0);
            assert!(y.is_err(), "{linear:?} {method:?}: {y:?}");
        }
    }
}

/// The least step is absolute in diffsol (1e-13): a problem in other units of time must not meet it.
#[test]
fn units_of_time_do_not_matter() {
    fn law(_: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        out.iter_mut().zip(y).for_each(|(out, y)| *out = -1e15 * y);
        Ok(())
    }
    for method in METHODS {
        let mut options = options(method, 2);
        options.span = 1e-15;
        let (y, _) = integrate(Small::new(law, |_, _| -1e15, 2), &[1.0; 2], &options, 1e-15);
        let y = y.unwrap_or_else(|e| panic!("{method:?}: {e}"));
        assert!((y[0] - (-1.0f64).exp()).abs() < 1e-4, "{method:?}: {y:?}");
    }
}

/// A refused step leaves the solution where it was.
#[test]
fn a_refused_step_is_taken_back() {
    for method in METHODS {
        let options = options(method, 1);
        let small = Small::new(decay, |_, _| -1.0, 1);
        // Steps longer than a thousandth are refused.
        let mut refused = 0;
        let (y, _) = stepped(small, &[1.0], &options, 0.02, |last, time| {
            if time - last > 1e-3 {
                refused += 1;
                return Err(failure(SolveError::NotFinite));
            }
            Ok(())
        })
        .unwrap();
        assert!(refused > 0, "{method:?}");
        let error = (y[0] - (-0.02f64).exp()).abs();
        assert!(error < 1e-5, "{method:?}: {error:e}");
    }
}
