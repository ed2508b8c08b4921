//! The advice in words: the cheapest integrator and tolerance for the target error.

use super::errors::{Assessment, ComparedRun};
use super::{Quantity, Study};
use crate::output::plot::label;

/// Runs with a larger relative error in any field are not recommended, however accurate they are in another.
const LARGEST_SOUND_ERROR: f64 = 1.0;

/// Quantity of the advice: the one that was asked for; without that a field, or the number of regions where references
/// diverge.
pub(super) fn subject(study: &Study, all: &Assessment) -> Quantity {
    let order = match all.reference.as_ref().and_then(|r| r.diverged) {
        None => [Quantity::Species, Quantity::Shape, Quantity::Energy],
        Some(_) => [Quantity::Spots, Quantity::Energy, Quantity::Amplitude],
    };
    let known = all.quantities();
    let first = order.into_iter().find(|quantity| known.contains(quantity));
    study.of.or(first).unwrap_or(Quantity::Species)
}

/// One recommendation, and whether it can be trusted.
pub(super) fn advice(study: &Study, all: &Assessment) -> String {
    let Some(reference) = &all.reference else {
        let why = all.lost.first().map_or(String::new(), |(name, why)| format!(" ({name}: {why})"));
        return format!(
            "No reference is complete{why}, so errors are not known: continue the study, give looser \
             --tolerances, which the references follow, another --reference, or a longer --limit with \
             --retry-failed."
        );
    };
    if reference.still {
        return "Nothing changes in this scene, neither species nor shape: no error can be measured."
            .to_owned();
    }
    let quantity = subject(study, all);
    let spread = all.spread[quantity as usize].filter(|spread| *spread > study.wanted);
    let enough = spread.unwrap_or(study.wanted);
    let mut text = spread.map_or(String::new(), |spread| {
        let (name, spread) = (quantity.name(), percent(spread));
        format!("Other random numbers change the {name} by {spread}: a smaller error is below the seed-to-seed spread. ")
    });
    text += &format!("For {} in the {}", percent(enough), quantity.name());
    text += &match reference.diverged.filter(|_| quantity.is_field()) {
        Some(at) => format!(" before t = {}: ", label(at)),
        None => ": ".to_owned(),
    };
    let known = |p| Some((p, ComparedRun::error(p, quantity)?, p.found.step_seconds()?));
    let runs: Vec<(&ComparedRun, f64, f64)> = all.points.iter().filter_map(known).collect();
    let sound = |p: &ComparedRun| {
        Quantity::FIELDS.iter().all(|q| p.error(*q).is_none_or(|e| e <= LARGEST_SOUND_ERROR))
    };
    let good = runs.iter().filter(|(point, error, _)| *error <= enough && sound(point));
    let best = good.min_by(|a, b| a.2.total_cmp(&b.2));
    let described = |(point, error, seconds): &(&ComparedRun, f64, f64)| {
        format!("{}, {} (error {})", described(study, point), time(*seconds), percent(*error))
    };
    text += &match (best, runs.iter().min_by(|a, b| a.1.total_cmp(&b.1))) {
        (Some(best), _) => format!("{}. To run it: {}.", described(best), best.0.settings),
        (None, Some(closest)) => {
            let closest = described(closest);
            format!("no run is as accurate; the best is {closest}. Give tighter --tolerances.")
        }
        (None, None) => {
            "no run has one: without spots and buckling nothing can be measured.".to_owned()
        }
    };
    if reference.confirmed.is_none() {
        text += " Flagged as unreliable: nothing confirms the reference.";
    } else if let Some(since) = reference.unstable {
        let since = label(since);
        text += &format!(
            " Flagged as unreliable: from t = {since} on the reference is on a branch that is unstable."
        );
    }
    text
}

/// A tolerance, as 3e-2.
pub(super) struct Scientific(pub(super) f64);

impl std::fmt::Display for Scientific {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.0 == 0.0 {
            return f.write_str("0");
        }
        // Without what rounding leaves behind.
        let text = format!("{:.3e}", self.0);
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        write!(f, "{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
    }
}

/// An integrator with its tolerance.
pub(super) fn described(study: &Study, point: &ComparedRun) -> String {
    let tolerance = Scientific(point.tolerance);
    match study.curves.get(point.curve) {
        Some(curve) if curve.fixed_steps => {
            format!("{}, steps of {tolerance} of the whole time", curve.name)
        }
        curve => format!("{}, rtol {tolerance}", curve.map_or("", |c| &c.name)),
    }
}

/// `2.3 %`, `3.6e-4 %`.
pub(super) fn percent(share: f64) -> String {
    match share {
        0.0 => "0".to_owned(),
        share => format!("{} %", label(two_digits(100.0 * share))),
    }
}

/// A time for people.
pub(super) fn time(seconds: f64) -> String {
    match seconds {
        s if s < 0.995 => format!("{} ms", label(two_digits(1e3 * s))),
        s if s < 600.0 => format!("{} s", label(two_digits(s))),
        s => format!("{:.0} min", s / 60.0),
    }
}

/// Rounded to two digits.
fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}
