//! What shows only after many calls: results that differ now and then, memory that is not given back.

use std::time::{Duration, Instant};

use super::validate::{Check, Verdict};
use crate::field::Columns;
use crate::library::is_checked;
use crate::process_memory::private_resident_bytes;
use crate::{Batch, Kinetics, KineticsError, Quantity};

/// Calls at one point, each compared with the first; fewer of a law that takes its time.
const CALLS: usize = 10_000;
const TIME_LIMIT: Duration = Duration::from_secs(2);
/// Rounds of that many calls; memory that grows in all but the first by so many bytes is lost.
const ROUNDS: usize = 4;
const LEAK_THRESHOLD: u64 = 64 << 10;

/// Calls the rates at the first point of the batch again and again.
pub(super) fn check(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Check {
    let species = kinetics.descriptor().species.len();
    let rates = || -> Result<Columns, KineticsError> {
        let mut rates = Columns::new(species, 1);
        batch.with_part(0, 1, |b| {
            kinetics.evaluate(Quantity::Rates, b, &mut rates.slices_mut(), &mut [])
        })?;
        Ok(rates)
    };
    let first = rates()?;
    let (begin, mut calls) = (Instant::now(), 0);
    let mut memory = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        for _ in 0..CALLS / ROUNDS {
            if begin.elapsed() > TIME_LIMIT {
                return Ok(Verdict::Good(format!("{calls} calls at one point")));
            }
            calls += 1;
            let again = rates()?;
            let how = "one call after the other";
            batch.with_part(0, 1, |b| {
                super::determinism::compare(kinetics, b, &first, &again, 0, how)
            })?;
        }
        // Of a process that others use as well it says nothing.
        memory.extend(private_resident_bytes().filter(|_| is_checked()));
    }
    let grows = |pair: &[u64]| pair[1].saturating_sub(pair[0]) >= LEAK_THRESHOLD;
    if memory.len() == ROUNDS && memory.windows(2).all(grows) {
        let lost = (memory[ROUNDS - 1] - memory[0]) / (CALLS - CALLS / ROUNDS) as u64;
        return Ok(Verdict::Fault(format!(
            "takes some {lost} bytes of memory in every call of rates and does not give them back"
        )));
    }
    Ok(Verdict::Good(format!("{CALLS} calls at one point")))
}
