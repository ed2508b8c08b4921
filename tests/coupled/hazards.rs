//! What diffsol does not do by itself, and would harm if nobody did.

use rumple_numerics::linear::{Assembly, LinearChoice};
use rumple_numerics::ode::{
    Equations, NewtonSolver, OdeMethod, OdeProblem, Options, Stepper, problem,
};
use rumple::solve::{SolveError, linear::Sparse};
use rumple::{Error, Result};

type Law = fn(f64, &[f64], &mut [f64]) -> Result<()>;

/// dy/dt = law(t, y) with a diagonal Jacobian.
struct Small {
    law: Law,
    slope: fn(f64, f64) -> f64,
    unknowns: usize,
    stored: Option<Vec<bool>>,
    matrix: Assembly,
    calls: usize,
}

impl Small {
    fn new(law: Law, slope: fn(f64, f64) -> f64, unknowns: usize) -> Self {
        let matrix = Assembly::new(unknowns, unknowns, |entries| {
            (0..unknowns).for_each(|i| entries.add(i, i, 0.0));
        });
        Self { law, slope, unknowns, stored: None, matrix, calls: 0 }
    }
}

impl OdeProblem for Small {
    fn unknowns(&self) -> usize {
        self.unknowns
    }

    fn stored(&self) -> Option<Vec<bool>> {
        self.stored.clone()
    }

    fn residual(&mut self, time: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
        self.calls += 1;
        (self.law)(time, y, out)
    }

    fn jacobian(&mut self, time: f64, y: &[f64]) -> Result<&Sparse> {
        let slope = self.slope;
        self.matrix.fill(|entries| {
            (0..y.len()).for_each(|i| entries.add(i, i, slope(time, y[i])));
        });
        Ok(self.matrix.matrix())
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
    }
}

/// Integrates to `until`, with how often F was called.
fn integrate(
    small: Small,
    start: &[f64],
    options: &Options,
    until: f64,
) -> (Result<Vec<f64>>, usize) {
    let implicit = options.method.is_implicit();
    let equations = Equations::new(small, 0.0, start.to_vec(), implicit).map_err(|(_, e)| e);
    let problem = problem(equations.unwrap(), 0.0, options).unwrap();
    let mut stepper = match Stepper::new(&problem, options) {
        Ok(stepper) => stepper,
        Err(error) => return (Err(error), problem.eqn.with(|p| p.calls)),
    };
    let mut result = Ok(());
    while result.is_ok() && stepper.time() < until {
        result = stepper.step(until, |_, _| Ok(()));
    }
    (result.map(|()| stepper.solution()), problem.eqn.with(|p| p.calls))
}

fn decay(_: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
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
    fn law(time: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
        if time > 0.5 {
            return Err(Error::Solve(SolveError::Interrupted));
        }
        decay(time, y, out)
    }
    for method in METHODS {
        let (y, calls) =
            integrate(Small::new(law, |_, _| -1.0, 2), &[1.0; 2], &options(method, 2), 1.0);
        assert!(matches!(y, Err(Error::Solve(SolveError::Interrupted))), "{method:?}: {y:?}");
        assert!(calls < 5000, "{method:?}: {calls} calls");
    }
}

/// An error that a shorter step cures does not end the integration.
#[test]
fn an_error_that_a_shorter_step_cures_is_cured() {
    // A law that refuses what a too long step gives it.
    fn law(_: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
        if y[0] < 0.0 {
            return Err(Error::Solve(SolveError::NotFinite));
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
    fn law(_: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
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
    fn law(time: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
        let drive = if (200.0 * time).sin() > 0.0 { 900.0 } else { 1.0 };
        out[0] = drive * ((20.0 * time).cos() - y[0]);
        Ok(())
    }
    let mut options = options(OdeMethod::Bdf, 1);
    options.rtol = 1e-3;
    let small = Small::new(law, |time, _| if (200.0 * time).sin() > 0.0 { 900.0 } else { -1.0 }, 1);
    let equations = Equations::new(small, 0.0, vec![1.0], true).map_err(|(_, e)| e).unwrap();
    let problem = problem(equations, 0.0, &options).unwrap();
    let mut stepper = Stepper::new(&problem, &options).unwrap();
    while stepper.time() < 1.0 {
        stepper.step(1.0, |_, _| Ok(())).unwrap();
    }
    let work = stepper.work();
    assert!(work.rejected > 60, "{work:?}");
}

/// diffsol's sparse LU panics where a factorisation fails; a singular matrix must be an error.
#[test]
fn a_singular_newton_matrix_is_an_error() {
    fn law(_: f64, _: &[f64], out: &mut [f64]) -> Result<()> {
        out.fill(1.0);
        Ok(())
    }
    for linear in [LinearChoice::Lu, LinearChoice::Ilu] {
        for method in [OdeMethod::Bdf, OdeMethod::TrBdf2, OdeMethod::Esdirk34] {
            // Without storage and with a Jacobian of nothing: nothing determines the second unknown.
            let mut small = Small::new(law, |_, _| 0.0, 2);
            small.stored = Some(vec![true, false]);
            let options = Options { linear, ..options(method, 2) };
            let (y, _) = integrate(small, &[0.0; 2], &options, 1.0);
            assert!(y.is_err(), "{linear:?} {method:?}: {y:?}");
        }
    }
    let _ = NewtonSolver::new(LinearChoice::Auto, None);
}

/// The least step is absolute in diffsol (1e-13): a problem in other units of time must not meet it.
#[test]
fn units_of_time_do_not_matter() {
    fn law(_: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
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
        let implicit = method.is_implicit();
        let equations =
            Equations::new(small, 0.0, vec![1.0], implicit).map_err(|(_, e)| e).unwrap();
        let problem = problem(equations, 0.0, &options).unwrap();
        let mut stepper = Stepper::new(&problem, &options).unwrap();
        // Steps longer than a thousandth are refused.
        let mut last = 0.0;
        while stepper.time() < 0.02 {
            stepper
                .step(0.02, |time, _| {
                    if time - last > 1e-3 { Err(SolveError::NotFinite.into()) } else { Ok(()) }
                })
                .unwrap();
            assert!(stepper.time() - last <= 1e-3, "{method:?}");
            last = stepper.time();
        }
        let error = (stepper.solution()[0] - (-0.02f64).exp()).abs();
        assert!(error < 1e-5, "{method:?}: {error:e}");
    }
}
