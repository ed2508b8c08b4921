//! The advice in words: the cheapest integrator and tolerance for the target error.

use super::errors::{Case, Point};
use super::{Quantity, Role, Study};
use crate::output::plot::label;
use crate::study::run::Timing;

/// Noise floor of errors, in units of the distance between the references.
const NOISE_FLOOR_RATIO: f64 = 10.0;
/// Runs with a larger relative error in any field are not recommended, however accurate they are in another.
const LARGEST_SOUND_ERROR: f64 = 1.0;

/// Quantity of the advice: the one that was asked for; without that a field, or the number of regions where references
/// diverge.
pub(super) fn subject(study: &Study, case: &Case) -> Quantity {
    let known = |quantity: &Quantity| case.points.iter().any(|p| p.error(*quantity).is_some());
    let order = match case.diverged() {
        None => [Quantity::Species, Quantity::Shape, Quantity::Energy],
        Some(_) => [Quantity::Spots, Quantity::Energy, Quantity::Amplitude],
    };
    study.of.or_else(|| order.into_iter().find(known)).unwrap_or(Quantity::Species)
}

/// Points of a case with an error of `quantity` and a time, the cheapest first; other programs are not among
/// them.
pub(super) fn ranked(case: &Case, quantity: Quantity) -> Vec<(&Point, f64, f64)> {
    let all = case.points.iter().filter(|p| !p.is_peer());
    let mut ranked: Vec<_> =
        all.filter_map(|p| Some((p, p.error(quantity)?, p.seconds()?))).collect();
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
    let name = quantity.name();
    let wanted = percent(study.wanted);
    let spread = case.spread_of(quantity).filter(|spread| *spread > study.wanted);
    let enough = spread.unwrap_or(study.wanted);
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
    let fields = Quantity::FIELDS;
    let sound =
        |p: &Point| fields.iter().all(|q| p.error(*q).is_none_or(|e| e <= LARGEST_SOUND_ERROR));
    let good = ranked.iter().filter(|(point, error, _)| *error <= enough && sound(point));
    let good: Vec<_> = good.collect();
    text += &match good.first() {
        None => match ranked.iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((point, error, seconds)) => format!(
                "no run is as accurate; the best is {} with an error of {} in {}. Give tighter --tolerances.",
                described(study, point),
                percent(*error),
                time(*seconds)
            ),
            None => {
                "no run has one: nothing there is to be measured (no spot, no buckling).".to_owned()
            }
        },
        Some(best) => recommended(study, case, quantity, best, &good),
    };
    text += &trust(study, case, quantity, &ranked);
    if let Some((point, ..)) = good.first() {
        text += &format!(" To run it: {}.", point.settings);
    }
    text
}

/// The cheapest run that is accurate enough, with its errors, its neighbours and the next best among `good`.
fn recommended(
    study: &Study,
    case: &Case,
    quantity: Quantity,
    &&(point, error, seconds): &&(&Point, f64, f64),
    good: &[&(&Point, f64, f64)],
) -> String {
    let what = |(point, error, seconds): (&Point, f64, f64)| {
        format!("{}, {} (error {}", described(study, point), time(seconds), percent(error))
    };
    let others = Quantity::FIELDS.into_iter().filter(|q| *q != quantity);
    let others = others.filter_map(|q| Some((q, point.error(q)?)));
    let others: String = others
        .map(|(q, error)| format!("; error of the {} {}", q.name(), percent(error)))
        .collect();
    let next = match good.iter().find(|(other, ..)| other.curve != point.curve) {
        Some(&&next) => {
            let longer = longer(point, next.0, next.2 / seconds);
            format!("; next best {}; {longer}).", what(next))
        }
        None if study.curves.len() == 1 => ".".to_owned(),
        None => "; no other integrator is as accurate at these tolerances.".to_owned(),
    };
    let neighbours = neighbours(study, case, point, quantity);
    what((point, error, seconds)) + &neighbours + &others + ")" + &next
}

/// Describes the uncertainty of the references.
fn trust(study: &Study, case: &Case, quantity: Quantity, ranked: &[(&Point, f64, f64)]) -> String {
    let Some(reference) = &case.reference else { return String::new() };
    let first = &reference.name;
    let Some((second, _)) = &reference.confirmed else {
        return format!(" Flagged as unreliable: nothing confirms the reference, {first}.");
    };
    let Some(agreement) = case.floor(quantity) else { return String::new() };
    let mut methods = study.runs.iter().filter_map(|role| match role {
        Role::Reference { method, .. } => Some(method),
        _ => None,
    });
    let best = methods.next();
    let alike = match (reference.alike, methods.any(|method| Some(method) != best)) {
        _ if reference.stabilised => " (of one method at two stabilisations)",
        (true, true) => " (of one method: no other came to its end)",
        (true, false) => " (of one method: no other was asked for)",
        (false, _) => "",
    };
    // Of many pairs one agrees well by accident.
    let others = reference.others.iter().map(|(name, apart)| (name, *apart));
    let third = others.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, apart)| {
        quantity.is_field()
            && reference.diverged.is_none()
            && *apart > NOISE_FLOOR_RATIO * agreement
    });
    let third = third.map_or(String::new(), |(name, apart)| {
        format!(" (the next, {name}, is {} away)", percent(apart))
    });
    let agreed = percent(agreement);
    let text = format!(" The references, {first} and {second}{alike}, agree to {agreed}{third}");
    // Of errors that are smaller than this more than their size is not known.
    let floor = NOISE_FLOOR_RATIO * agreement;
    let below = ranked.iter().filter(|(_, error, _)| *error < floor).count();
    let mut text = match below {
        _ if agreement == 0.0 => format!("{text}."),
        0 => format!("{text}, {NOISE_FLOOR_RATIO} times or more below every error shown."),
        _ => format!(
            "{text}: of errors below {} only the order of magnitude is known ({below} of {}).",
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

/// Compares the times of two runs, within their scatter.
fn longer(best: &Point, other: &Point, ratio: f64) -> String {
    let spread = |p: &Point| p.found.timing.as_ref().map(Timing::spread);
    let resolved = match (spread(best), spread(other)) {
        (Some((_, slowest)), Some((fastest, _))) => fastest > slowest,
        _ => true,
    };
    match resolved {
        true => format!("{} times as long", label(two_digits(ratio))),
        false => "as fast, within the scatter of the times".to_owned(),
    }
}

/// Errors and times of the same integrator at the next tolerances.
fn neighbours(study: &Study, case: &Case, point: &Point, quantity: Quantity) -> String {
    let all = || case.points.iter().filter(|p| p.curve == point.curve && p.force == point.force);
    let curve = study.curves.get(point.curve);
    let branch = curve.is_some_and(|c| c.branches_off.is_some());
    let place = |p: &Point| p.stabilisation.filter(|_| branch).unwrap_or(p.tolerance);
    let order = |a: &&Point, b: &&Point| place(a).total_cmp(&place(b));
    let tighter = all().filter(|p| place(p) < place(point)).max_by(order);
    let looser = all().filter(|p| place(p) > place(point)).min_by(order);
    let what = match curve {
        Some(curve) if curve.fixed_steps => "steps",
        _ if branch => "stabilisation",
        _ => "at",
    };
    let said = |p: &Point| -> Option<String> {
        let (error, seconds) = (p.error(quantity)?, p.seconds()?);
        let place = Scientific(place(p));
        Some(format!("; {what} {place} {} for {}", time(seconds), percent(error)))
    };
    [looser, tighter].into_iter().flatten().filter_map(said).collect()
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
    let curve = study.curves.get(point.curve);
    let from = curve.and_then(|c| study.curves.get(c.branches_off?.curve)).or(curve);
    let name = from.map_or("", |c| c.name.as_str());
    let tolerance = Scientific(point.tolerance);
    let mut text = match curve.is_some_and(|c| c.fixed_steps) {
        true => format!("{name}, steps of {tolerance} of the whole time"),
        false => format!("{name}, rtol {tolerance}"),
    };
    if let Some(share) = point.stabilisation {
        text += &format!(", stabilisation {}", Scientific(share));
    }
    if let Some(force) = point.force {
        text += &format!(", force tolerance {}", Scientific(force));
    }
    text
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
pub(super) fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}
