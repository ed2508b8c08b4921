//! The advice in words: the cheapest integrator and tolerance for the target error.

use super::errors::{Case, Point};
use super::{Quantity, Study};
use crate::output::plot::label;

/// Noise floor of errors, in units of the distance between the references.
const NOISE_FLOOR_RATIO: f64 = 10.0;
/// Runs with a larger relative error in any field are not recommended, however accurate they are in another.
const LARGEST_SOUND_ERROR: f64 = 1.0;

/// Quantity of the advice: the one that was asked for; without that a field, or the number of regions where references
/// diverge.
pub(super) fn subject(study: &Study, case: &Case) -> Quantity {
    let order = match case.reference.as_ref().and_then(|r| r.diverged) {
        None => [Quantity::Species, Quantity::Shape, Quantity::Energy],
        Some(_) => [Quantity::Spots, Quantity::Energy, Quantity::Amplitude],
    };
    let known = case.quantities();
    let first = order.into_iter().find(|quantity| known.contains(quantity));
    study.of.or(first).unwrap_or(Quantity::Species)
}

/// Points of a case with an error of `quantity` and a time, the cheapest first.
fn ranked(case: &Case, quantity: Quantity) -> Vec<(&Point, f64, f64)> {
    let known = |p| Some((p, Point::error(p, quantity)?, p.found.step_seconds()?));
    let mut ranked: Vec<_> = case.points.iter().filter_map(known).collect();
    ranked.sort_by(|a, b| a.2.total_cmp(&b.2));
    ranked
}

/// One recommendation, why, and how far it can be trusted.
pub(super) fn advice(study: &Study, case: &Case) -> String {
    let Some(reference) = &case.reference else {
        let why =
            case.lost.first().map_or(String::new(), |(name, why)| format!(" ({name}: {why})"));
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
    let quantity = subject(study, case);
    let ranked = ranked(case, quantity);
    let (name, wanted) = (quantity.name(), percent(study.wanted));
    let spread = case.spread[quantity as usize].filter(|spread| *spread > study.wanted);
    let mut text = match spread {
        None => format!("For {wanted}"),
        Some(spread) => format!(
            "Other random numbers change the {name} by {spread}: a smaller error is below the seed-to-seed spread. For \
             {spread} in place of the {wanted} that are wanted",
            spread = percent(spread)
        ),
    };
    text += &match reference.diverged.filter(|_| quantity.is_field()) {
        Some(at) => format!(" in the {name} before t = {}: ", label(at)),
        None => format!(" in the {name}: "),
    };
    let sound = |p: &Point| {
        Quantity::FIELDS.iter().all(|q| p.error(*q).is_none_or(|e| e <= LARGEST_SOUND_ERROR))
    };
    let enough = spread.unwrap_or(study.wanted);
    let mut good = ranked.iter().filter(|(point, error, _)| *error <= enough && sound(point));
    let best = good.next();
    let next = best.and_then(|(best, ..)| good.find(|(other, ..)| other.curve != best.curve));
    let what = |(point, error, seconds): &(&Point, f64, f64)| {
        let point = described(study, point);
        format!("{point}, {} (error {})", time(*seconds), percent(*error))
    };
    text += &match (best, ranked.iter().min_by(|a, b| a.1.total_cmp(&b.1))) {
        (Some(best), _) => what(best),
        (None, Some(closest)) => {
            let closest = what(closest);
            format!("no run is as accurate; the best is {closest}. Give tighter --tolerances")
        }
        (None, None) => {
            "no run has one: without spots and buckling nothing can be measured".to_owned()
        }
    };
    text += &next.map_or(".".to_owned(), |next| format!("; next best {}.", what(next)));
    text += &trust(case, quantity, &ranked);
    if let Some((point, ..)) = best {
        text += &format!(" To run it: {}.", point.settings);
    }
    text
}

/// Describes the uncertainty of the references.
fn trust(case: &Case, quantity: Quantity, ranked: &[(&Point, f64, f64)]) -> String {
    let Some(reference) = &case.reference else { return String::new() };
    let first = &reference.name;
    let Some((second, _)) = &reference.confirmed else {
        return format!(" Flagged as unreliable: nothing confirms the reference, {first}.");
    };
    let Some(agreement) = case.floor(quantity) else { return String::new() };
    let alike = match reference.alike {
        _ if reference.stabilised => " (of one method at two stabilisations)",
        true => " (of one method)",
        false => "",
    };
    let agreed = percent(agreement);
    let mut text = format!(" The references, {first} and {second}{alike}, agree to {agreed}");
    // Of errors that are smaller than this more than their size is not known.
    let floor = NOISE_FLOOR_RATIO * agreement;
    text += &match ranked.iter().filter(|(_, error, _)| *error < floor).count() {
        _ if agreement == 0.0 => ".".to_owned(),
        0 => format!(", {NOISE_FLOOR_RATIO} times or more below every error shown."),
        below => format!(
            ": of errors below {} only the order of magnitude is known ({below} of {}).",
            percent(floor),
            ranked.len()
        ),
    };
    if let Some(since) = reference.unstable {
        text += &format!(
            " Flagged as unreliable: from t = {} on the reference is on a branch that is unstable, which an \
             imperfection would leave.",
            label(since)
        );
    }
    if let Some(at) = reference.diverged {
        text += &format!(
            " Paths part at t = {}: from there on runs are on different branches, and fields are not \
             compared.",
            label(at)
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
pub(super) fn described(study: &Study, point: &Point) -> String {
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
