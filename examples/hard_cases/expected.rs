//! What is not as a case expects it.

use super::case::Case;
use super::ledger::Ledger;
use super::trial::Ended;

/// What memory may grow by, and speed fall by, from the first to the last tenth of a run.
const MAX_DRIFT: f64 = 1.1;

/// In words, one each; none if all is as expected.
pub fn faults(case: &Case, ended: &Ended) -> Vec<String> {
    let mut faults = Vec::new();
    match ended.status {
        None => faults.push(format!("no end within {} s", case.limit)),
        Some(status) if status.code() != Some(case.code) => {
            faults.push(format!("{status} in place of code {}", case.code));
        }
        Some(_) => {}
    }
    for part in &case.says {
        if !plain(&ended.said).contains(&plain(part)) {
            faults.push(format!("it does not say “{part}”"));
        }
    }
    if let Some(column) = ended.ledger.not_finite() {
        faults.push(format!("`{column}` is not finite"));
    }
    let mut between = |name: &String, values: Vec<f64>, [least, most]: [f64; 2]| {
        if values.is_empty() {
            faults.push(format!("no `{name}`"));
        }
        if let Some(bad) = values.iter().find(|value| !(**value >= least && **value <= most)) {
            faults.push(format!("{name} = {bad:.4e} is not between {least} and {most}"));
        }
    };
    for (name, bounds) in &case.always {
        between(name, ended.ledger.column(name).unwrap_or_default(), *bounds);
    }
    for (name, bounds) in &case.finally {
        between(name, ended.ledger.last(name).into_iter().collect(), *bounds);
    }
    for (name, most) in &case.kept {
        let drift = drift(&ended.ledger, name);
        between(&format!("drift of {name}"), drift.into_iter().collect(), [0.0, *most]);
    }
    if case.steady {
        let (memory, speed) = (growth(&ended.memory), growth(&paces(&ended.ledger)));
        if !(memory < MAX_DRIFT && speed < MAX_DRIFT) {
            faults
                .push(format!("memory grew by {memory:.2}, steps became {speed:.2} times as long"));
        }
    }
    faults
}

/// Without line breaks, which messages are wrapped with, and marks.
fn plain(text: &str) -> String {
    text.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
}

/// Largest distance of a column from its first value, relative to it.
fn drift(ledger: &Ledger, name: &str) -> Option<f64> {
    let values = ledger.column(name).ok()?;
    let first = *values.first()?;
    Some(values.iter().fold(0.0_f64, |most, value| most.max((value - first).abs())) / first.abs())
}

/// Memory, speed and what is conserved over a long run, in words.
pub fn steadiness(case: &Case, ended: &Ended) -> String {
    let memory = ended.memory.last().copied().unwrap_or(f64::NAN);
    let paces = paces(&ended.ledger);
    let told =
        |name: &String| Some(format!(", drift of {name} {:.1e}", drift(&ended.ledger, name)?));
    let drifts = case.kept.keys().filter_map(told);
    format!(
        "memory {memory:.0} MB ({:.3} times that after a tenth), steps {:.2} times as long{}",
        growth(&ended.memory),
        growth(&paces),
        drifts.collect::<String>()
    )
}

/// Median of the last tenth of the values over that of the second tenth.
fn growth(values: &[f64]) -> f64 {
    let tenth = values.len() / 10;
    if tenth == 0 {
        return f64::NAN;
    }
    let median = |part: &[f64]| {
        let mut part = part.to_vec();
        part.sort_by(f64::total_cmp);
        part[part.len() / 2]
    };
    median(&values[values.len() - tenth..]) / median(&values[tenth..2 * tenth])
}

/// Wall time of a thousandth of the steps, one after the other.
fn paces(ledger: &Ledger) -> Vec<f64> {
    let times = ledger.column("wall time").unwrap_or_default();
    let every = (times.len() / 1000).max(1);
    let marks: Vec<f64> = times.iter().copied().step_by(every).collect();
    marks.windows(2).map(|pair| pair[1] - pair[0]).collect()
}
