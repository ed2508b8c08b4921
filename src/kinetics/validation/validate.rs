//! All checks of a law, one after the other.

use super::sample::{rates, values};
use super::verdict::{Check, Verdict};
use super::{Samples, derivatives, determinism, output_coverage};
use crate::{Feedback, Kinetics, KineticsError, Quantity, Site};

/// Sampled points.
const SAMPLED_POINTS: usize = 4096;
/// Points that are called one by one.
const SINGLE_CALL_POINTS: usize = 256;

/// What one check found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// The check.
    pub check: &'static str,
    /// How it ended.
    pub verdict: Verdict,
}

/// Runs every check on a law: with its own parameters, or with those of random places of `fields`
/// (one column a parameter, of one value or one a place; empty for none). `begin` is called with every check before it starts, `end` with what it found: a law may end the
/// process in between.
pub fn validate(
    kinetics: &dyn Kinetics,
    fields: &[Vec<f64>],
    seed: u64,
    begin: &mut dyn FnMut(&'static str),
    end: &mut dyn FnMut(Finding),
) {
    let checks = Checks::new(kinetics, fields, seed);
    let mut run = |check: &'static str, body: &dyn Fn() -> Check| {
        begin(check);
        let verdict = body().unwrap_or_else(|error| Verdict::Fault(error.to_string()));
        end(Finding { check, verdict });
    };
    let samples = &checks.samples;
    // First of all: what a law keeps from earlier calls may no longer change later.
    run("same inputs, same outputs", &|| checks.determinism());
    run("finite rates", &|| checks.rates());
    let given = kinetics.descriptor().capabilities;
    let named = |which: &Feedback| *which == Feedback::LengthFactor || which.is_given(&given);
    for which in Feedback::ALL.into_iter().filter(named) {
        let check = match which {
            Feedback::LengthFactor => "finite, positive length factor",
            Feedback::Curvature => "finite spontaneous curvature",
            Feedback::FactorAcross => "finite, positive length factor across",
        };
        run(check, &|| checks.feedback(which));
    }
    run("several threads at once", &|| {
        samples.with(true, |batch| determinism::threads(kinetics, batch))?;
        good("8 threads")
    });
    run("derivatives", &|| wrong_derivatives(kinetics, samples));
    run("observables", &|| checks.observables());
    run("writes only where it may", &|| checks.coverage());
}

fn good(text: impl Into<String>) -> Check {
    Ok(Verdict::Good(text.into()))
}

fn skipped(text: &str) -> Check {
    Ok(Verdict::Skipped(text.to_owned()))
}

/// A law and the points at which it is checked.
struct Checks<'a> {
    kinetics: &'a dyn Kinetics,
    fields: &'a [Vec<f64>],
    seed: u64,
    samples: Samples,
    /// Few enough for calls point by point.
    few: Samples,
}

impl<'a> Checks<'a> {
    fn new(kinetics: &'a dyn Kinetics, fields: &'a [Vec<f64>], seed: u64) -> Self {
        let sample =
            |count| Samples::new(kinetics.descriptor(), count, seed).with_parameters(fields, seed);
        Self {
            kinetics,
            fields,
            seed,
            samples: sample(SAMPLED_POINTS),
            few: sample(SINGLE_CALL_POINTS),
        }
    }

    /// Points at which observables are evaluated.
    fn observing(&self, count: usize) -> Samples {
        let samples = Samples::observing(self.kinetics.descriptor(), count, self.seed);
        samples.with_parameters(self.fields, self.seed)
    }

    fn rates(&self) -> Check {
        self.samples.with(true, |batch| rates(self.kinetics, batch))?;
        good(at_all())
    }

    fn feedback(&self, which: Feedback) -> Check {
        if !which.is_given(&self.kinetics.descriptor().capabilities) {
            return skipped("none is given");
        }
        self.samples.with(false, |batch| values(self.kinetics, which.into(), batch))?;
        good(at_all())
    }

    fn determinism(&self) -> Check {
        self.samples.with(true, |batch| determinism::same_twice(self.kinetics, batch))?;
        self.few.with(true, |batch| determinism::one_by_one(self.kinetics, batch))?;
        good("called twice, in batches and point by point")
    }

    fn observables(&self) -> Check {
        if !Quantity::Observables.is_given(self.kinetics.descriptor()) {
            return skipped("there are none");
        }
        self.observing(SAMPLED_POINTS)
            .with(true, |batch| values(self.kinetics, Quantity::Observables, batch))?;
        good(at_all())
    }

    fn coverage(&self) -> Check {
        self.few.with(true, |batch| output_coverage::check(self.kinetics, batch))?;
        self.observing(SINGLE_CALL_POINTS).with(true, |batch| {
            output_coverage::check_quantity(self.kinetics, Quantity::Observables, batch, false)
        })?;
        good(format!("{SINGLE_CALL_POINTS} points"))
    }
}

fn at_all() -> String {
    format!("{SAMPLED_POINTS} points")
}

fn wrong_derivatives(kinetics: &dyn Kinetics, samples: &Samples) -> Check {
    let law = kinetics.descriptor();
    let (mut what, mut unbounded) = (Vec::new(), String::new());
    for quantity in Quantity::ALL.into_iter().filter(|quantity| quantity.has_partials(law)) {
        let outcome = samples.with(quantity == Quantity::Rates, |batch| {
            let found = derivatives::compare(kinetics, quantity, batch)?;
            let wrong = found.wrong.map(|w| w.describe(kinetics, batch, w.point));
            let signals = quantity.signals(law);
            let place = |point| Site::new(batch, law, signals, point).to_string();
            Ok::<_, KineticsError>((wrong, found.unbounded.map(place)))
        })?;
        match outcome {
            (Some(wrong), _) => return Ok(Verdict::Fault(wrong)),
            (None, Some(place)) => {
                unbounded = format!(
                    "; infinite at {place}, as differences are: implicit methods \
                                     cannot pass there"
                );
            }
            (None, None) => {}
        }
        what.push(match quantity {
            Quantity::Feedback(which) => which.describe().trim_start_matches("the "),
            Quantity::Rates | Quantity::Observables => "rates",
        });
    }
    Ok(match what.as_slice() {
        [] => Verdict::Skipped("none are given: the engine takes differences".into()),
        what => Verdict::Good(format!("{} against differences{unbounded}", what.join(" and "))),
    })
}
