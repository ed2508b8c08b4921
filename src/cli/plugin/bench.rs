//! `rumple plugin bench`: nanoseconds a point.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;

use super::{LawArgs, LawSource};
use crate::Result;
use crate::kinetics::field::{self, Columns};
use crate::kinetics::validation::Samples;
use crate::kinetics::{Batch, Feedback, Kinetics, KineticsError, Quantity};

/// Arguments of `plugin bench`.
#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    #[command(flatten)]
    law: LawArgs,
    /// Points of a field.
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// Threads to compute with; all cores by default.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

/// Every quantity is timed for about this long.
const TIMING_DURATION: Duration = Duration::from_millis(700);

pub(super) fn run(args: &BenchArgs) -> Result<()> {
    if let Some(threads) = args.threads {
        // Only fails if a pool exists already, which then serves as well.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    }
    let (kinetics, fields): (Arc<dyn Kinetics>, _) = match args.law.find()? {
        LawSource::Library(library) => {
            (Arc::new(library.instantiate(&BTreeMap::new())?), Vec::new())
        }
        LawSource::Scene { kinetics, fields } => (kinetics, fields),
    };
    let count = args.points as usize;
    let samples = Samples::new(kinetics.descriptor(), count, 1).with_parameters(&fields, 1);
    let (species, inputs) = (kinetics.descriptor().species.len(), kinetics.descriptor().inputs());
    let mut values = Columns::new(species, count);
    let mut partials = Columns::new(species * inputs, count);
    say!(
        "{}: {count} points, {} threads",
        kinetics.descriptor().name,
        rayon::current_num_threads()
    );
    let (values, partials) = (&mut values.slices_mut(), &mut partials.slices_mut());
    let evaluate = |quantity, batch: &Batch<'_>, values: &mut [_], partials: &mut [_]| {
        field::evaluate(&*kinetics, quantity, batch, values, partials).map(drop)
    };
    samples.with(true, |batch| {
        time("rates", count, || evaluate(Quantity::Rates, batch, values, &mut []))?;
        let text = if kinetics.descriptor().capabilities.rate_partials {
            "rates and exact derivatives"
        } else {
            "rates and differences"
        };
        time(text, count, || evaluate(Quantity::Rates, batch, values, partials))
    })?;
    let factor = Quantity::Feedback(Feedback::LengthFactor);
    if factor.is_given(kinetics.descriptor()) {
        let (values, partials) = (&mut values[..1], &mut partials[..species]);
        samples.with(false, |batch| {
            time("length factor and derivatives", count, || {
                evaluate(factor, batch, values, partials)
            })
        })?;
    }
    Ok(())
}

/// Prints the median time a point.
fn time(
    what: &str,
    points: usize,
    mut run: impl FnMut() -> Result<(), KineticsError> + Send,
) -> Result<(), KineticsError> {
    let mut times = Vec::new();
    // All within the pool: to hand work to another thread takes longer than the work.
    rayon::scope(|_| {
        let start = Instant::now();
        while start.elapsed() < TIMING_DURATION || times.len() < 3 {
            let one = Instant::now();
            run()?;
            times.push(one.elapsed().as_secs_f64());
        }
        Ok::<(), KineticsError>(())
    })?;
    times.sort_by(f64::total_cmp);
    let median = times[times.len() / 2] * 1e9 / crate::num::real(points);
    say!("{what:<32} {median:8.2} ns a point (median of {})", times.len());
    Ok(())
}
