//! The same problem in other units of length, time and stress: numbers without units must not change.

use super::Outcome;
use super::case::Rescaled;
use super::trial::{Where, run};

/// A row of the table.
pub struct Row {
    pub text: String,
    pub passed: bool,
}

/// What the last state is without units.
struct Seen {
    values: Vec<(String, f64)>,
    steps: usize,
    cpu: f64,
}

/// All rows.
///
/// # Errors
/// A program that cannot be started.
pub fn rows(place: &Where, scales: &Rescaled) -> Outcome<Vec<Row>> {
    let one =
        trial(place, scales, [1.0; 3])?.map_err(|said| format!("in its own units: {said}"))?;
    let mut rows = Vec::new();
    for unit in 0..3 {
        for factor in &scales.factors {
            let mut factors = [1.0; 3];
            factors[unit] = *factor;
            rows.push(row(place, scales, factors, &one)?);
        }
    }
    let (least, most) = (scales.factors.first().copied(), scales.factors.last().copied());
    if let (Some(least), Some(most)) = (least, most) {
        rows.push(row(place, scales, [least, most, least], &one)?);
        rows.push(row(place, scales, [most, least, most], &one)?);
    }
    Ok(rows)
}

fn row(place: &Where, scales: &Rescaled, factors: [f64; 3], one: &Seen) -> Outcome<Row> {
    let [length, time, stress] = factors;
    let tried = format!("length × {length:.0e}, time × {time:.0e}, stress × {stress:.0e}");
    let (happened, cpu, passed) = match trial(place, scales, factors)? {
        Err(said) => (said, f64::NAN, false),
        Ok(seen) => {
            let off = |((_, a), (_, b)): (&(String, f64), &(String, f64))| (a - b).abs() / b.abs();
            let pairs = seen.values.iter().zip(&one.values);
            let most = pairs
                .map(off)
                .fold(0.0_f64, |most, value| if value <= most { most } else { value });
            let steps = seen.steps.abs_diff(one.steps);
            let few = 20 * steps <= one.steps;
            let happened = format!(
                "{} steps (in its own units {}), differs by {most:.1e}",
                seen.steps, one.steps
            );
            (happened, seen.cpu, most <= scales.within && few)
        }
    };
    let verdict = if passed { "✓" } else { "differs" };
    let expected = format!("same numbers within {:.0e}, steps within 5 %", scales.within);
    let text =
        format!("| `{}` | {tried} | {expected} | {happened} | {cpu:.1} | {verdict} |", scales.name);
    Ok(Row { text, passed })
}

/// The scene with these units; or what it said.
fn trial(place: &Where, scales: &Rescaled, factors: [f64; 3]) -> Outcome<Result<Seen, String>> {
    let factor = |powers: &[f64]| -> f64 {
        powers.iter().zip(factors).map(|(power, factor)| factor.powf(*power)).product()
    };
    let mut command =
        format!("\"$RUMPLE\" run \"$MODELS/{}\" --out \"$OUT\" --quiet", scales.scene);
    for set in &scales.set {
        command += &format!(" --set '{set}'");
    }
    for (key, [value, powers @ ..]) in &scales.keys {
        command += &format!(" --set '{key}={:e}'", value * factor(powers));
    }
    let [length, time, stress] = factors;
    let name = format!("{}-{length:.0e}-{time:.0e}-{stress:.0e}", scales.name);
    let ended = run(place, &name, &command, "", 120.0)?;
    if !ended.status.is_some_and(|status| status.success()) {
        return Ok(Err(ended.said.split_whitespace().collect::<Vec<_>>().join(" ")));
    }
    let value = |(name, powers): (&String, &[f64; 3])| -> Outcome<(String, f64)> {
        Ok((name.clone(), ended.ledger.last(name)? / factor(powers)))
    };
    let values = scales.columns.iter().map(value).collect::<Outcome<_>>()?;
    Ok(Ok(Seen { values, steps: ended.ledger.len() - 1, cpu: ended.cpu }))
}
