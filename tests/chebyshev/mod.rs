//! The stabilised explicit integrator: order, stability, error control, failures.

use rumple::effects::{Cotan, Measure};
use rumple::num::whole;
use rumple::solve::chemistry::chebyshev::{Chebyshev, Tolerance};
use rumple::solve::{Result, SolveError};
use rumple::tally::Work;

use crate::diffusion::{On, diffuse, disc};

/// `y' = -k (y - cos t) - sin t`, solved by cos t: stiff, with a known answer and time in it.
fn relaxing(k: f64) -> impl FnMut(f64, &[f64], &mut [f64]) -> Result<()> {
    move |t, y, out| {
        out[0] = -k * (y[0] - t.cos()) - t.sin();
        Ok(())
    }
}

/// A logistic in one component and a slow oscillation in two others.
fn smooth(_: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
    out[0] = 2.0 * y[0] * (1.0 - y[0]);
    out[1] = -0.5 * y[1] + y[2];
    out[2] = -y[1] - 0.5 * y[2];
    Ok(())
}

fn smooth_error(y: &[f64], t: f64) -> f64 {
    let logistic = 0.1 / (0.1 + 0.9 * (-2.0 * t).exp());
    let decay = (-0.5 * t).exp();
    (y[0] - logistic).abs() + (y[1] - decay * t.cos()).abs() + (y[2] + decay * t.sin()).abs()
}

const SMOOTH_START: [f64; 3] = [0.1, 1.0, 0.0];

/// With tolerances that accept everything every call is one step: the order for 2 stages and, by
/// bounds larger than needed, for many.
#[test]
fn second_order_for_any_number_of_stages() {
    for bound in [0.0, 300.0, 3000.0] {
        let error = |steps: u32| {
            let mut integrator = Chebyshev::default();
            let mut y = SMOOTH_START;
            let loose = Tolerance { relative: 1e9, absolute: &[1e9; 3] };
            let h = 2.0 / f64::from(steps);
            for k in 0..steps {
                let (a, b) = (h * f64::from(k), h * f64::from(k + 1));
                integrator.integrate(a, b, &mut y, &loose, bound, smooth).unwrap();
            }
            assert_eq!(integrator.work().substeps, u64::from(steps));
            smooth_error(&y, 2.0)
        };
        let (coarse, fine) = (error(20), error(80));
        let order = (coarse / fine).log2() / 2.0;
        println!("bound {bound}: errors {coarse:.2e}, {fine:.2e}, observed order {order:.2}");
        assert!((1.8..2.2).contains(&order), "order {order}");
    }
}

/// The stages know their times: a problem with time in it keeps its order too.
#[test]
fn second_order_with_time_in_the_rates() {
    let error = |steps: u32| {
        let mut integrator = Chebyshev::default();
        let mut y = [1.0];
        let loose = Tolerance { relative: 1e9, absolute: &[1e9] };
        let h = 2.0 / f64::from(steps);
        for k in 0..steps {
            let (a, b) = (h * f64::from(k), h * f64::from(k + 1));
            integrator.integrate(a, b, &mut y, &loose, 40.0, relaxing(1.0)).unwrap();
        }
        (y[0] - 2.0f64.cos()).abs()
    };
    let order = (error(20) / error(80)).log2() / 2.0;
    assert!((1.8..2.2).contains(&order), "order {order}");
}

/// Every factor of ten in the tolerance gains about 10^(2/3) in the error, and errors stay near
/// the tolerance.
#[test]
fn errors_follow_the_tolerance() {
    let run = |tolerance: f64| {
        let mut integrator = Chebyshev::default();
        let mut y = SMOOTH_START;
        let absolute = [tolerance; 3];
        let tolerance = Tolerance { relative: tolerance, absolute: &absolute };
        integrator.integrate(0.0, 5.0, &mut y, &tolerance, 2.5, smooth).unwrap();
        (smooth_error(&y, 5.0), integrator.work())
    };
    let mut before = f64::NAN;
    for exponent in 3..=8 {
        let tolerance = 10f64.powi(-exponent);
        let (error, Work { right_hand_sides, substeps, rejected_substeps, .. }) = run(tolerance);
        println!(
            "{tolerance:.0e}: error {error:.2e}, {substeps}+{rejected_substeps} steps, {right_hand_sides} rates"
        );
        // Global errors of an order-2 method go with tolerance^(2/3).
        assert!(error < 2.0 * tolerance.powf(2.0 / 3.0), "{error} at {tolerance}");
        if exponent > 4 {
            assert!((2.0..12.0).contains(&(before / error)), "{before} → {error}");
        }
        before = error;
    }
}

/// Stiffness costs its square root: k up to 1e6 with few evaluations and the right answer. (The
/// boundary layer takes some sixty steps whatever k.)
#[test]
fn stiff_decay_is_stable_and_cheap() {
    for k in [1e2, 1e4, 1e6] {
        let mut integrator = Chebyshev::default();
        let mut y = [1.5];
        let tolerance = Tolerance { relative: 1e-4, absolute: &[1e-4] };
        integrator.integrate(0.0, 1.0, &mut y, &tolerance, k, relaxing(k)).unwrap();
        let work = integrator.work();
        let error = (y[0] - 1.0f64.cos()).abs();
        println!("k = {k:.0e}: error {error:.1e}, {work:?}");
        assert!(error < 1e-3, "{error}");
        assert!(work.right_hand_sides < 250 + whole(10.0 * k.sqrt()) as u64, "{work:?}");
    }
}

/// D = 1e4 on a disc, a rough start and one long step: no growth, the total kept. The factor of
/// a stiff mode lies between 1/3 and 1, so a step that no error estimate restrains damps, but
/// does not smooth out, what it cannot resolve.
#[test]
fn strong_diffusion_takes_one_long_step() {
    let sheet = disc(1000);
    let scheme = On::rest(&sheet, Cotan::new(&sheet, 0, 1e4, Measure::Concentration, false));
    let mut c: Vec<f64> = (0..1000).map(|i| if i % 7 == 0 { 1.0 } else { 0.0 }).collect();
    let total = |c: &[f64]| scheme.area().iter().zip(c).map(|(a, c)| a * c).sum::<f64>();
    let before = total(&c);
    let spread = |c: &[f64]| {
        let mean = total(c) / scheme.area().iter().sum::<f64>();
        scheme.area().iter().zip(c).map(|(a, c)| a * (c - mean).powi(2)).sum::<f64>()
    };
    let rough = spread(&c);
    // 200 stages reach this far; explicit Euler would need some 10 000 steps.
    let time = 2.4e4 / scheme.spectral_bound();
    let integrator = diffuse(&scheme, &mut c, time, 1e6).unwrap();
    println!("{:?}", integrator.work());
    assert_eq!(integrator.work().substeps, 1);
    assert!(integrator.work().right_hand_sides <= 250);
    println!("spread falls by {:.3}", spread(&c) / rough);
    assert!(spread(&c) < 0.95 * rough);
    assert!((total(&c) / before - 1.0).abs() < 1e-12);
}

fn fail(kind: u8) -> (SolveError, f64) {
    let mut integrator = Chebyshev::default();
    let mut y = [1.0];
    let tolerance = Tolerance { relative: 1e-3, absolute: &[1e-3] };
    let bound = if kind == 2 { f64::NAN } else { 1.0 };
    let rate = |t: f64, y: &[f64], out: &mut [f64]| match kind {
        0 if t > 0.5 => Err(SolveError::Interrupted),
        1 if t > 0.5 => {
            out[0] = f64::NAN;
            Ok(())
        }
        3 if t > 0.5 => Err(SolveError::NotFinite),
        _ => {
            out[0] = -y[0];
            Ok(())
        }
    };
    let error = integrator.integrate(0.0, 1.0, &mut y, &tolerance, bound, rate).unwrap_err();
    (error, y[0])
}

/// What no shorter step cures is passed on; what persists is reported with its cause and place,
/// and `y` keeps its last good values.
#[test]
fn failures_have_their_cause() {
    assert!(matches!(fail(0).0, SolveError::Interrupted));
    let (error, y) = fail(1);
    let SolveError::StepTooSmall { time, .. } = error else { panic!("{error}") };
    assert!((time - 0.5).abs() < 1e-6 && (y - (-0.5f64).exp()).abs() < 1e-2, "{time} {y}");
    assert!(matches!(fail(2).0, SolveError::SpectralBound { .. }));
    assert!(matches!(fail(3).0, SolveError::NotFinite));
}

/// An interval that the rounding of a large time swallows still ends.
#[test]
fn late_times_end_exactly() {
    let mut integrator = Chebyshev::default();
    let mut y = [1.5];
    let tolerance = Tolerance { relative: 1e-6, absolute: &[1e-6] };
    let start = 1e9;
    integrator.integrate(start, start + 1e-6, &mut y, &tolerance, 10.0, relaxing(10.0)).unwrap();
    assert!((y[0] - 1.5).abs() < 1e-4);
}
