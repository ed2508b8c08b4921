//! Typical magnitudes of species, the units of absolute tolerances, where a law declares none.
//!
//! ```text
//! typical = max |c|                     at the start, and of held values up to the end
//!           |δ| with |R(c + δ) - R(c)| ≥ |R(c)|/3       where that is 0: the smallest change that the rate R feels
//!           |R| · 1                     where it feels none, per unit of time
//! ```
//!
//! Each is the nearest power of ten, at most 1, so that it is the same for a formula and for a function that gives the same
//! rates but for round-off. What follows from rates is found one species after the other, along the network of reactions. A
//! species without any is as large as the largest of the others. A law that reads the time has its largest rates within the
//! run: at its start alone, or at a few round times, a pulse has a tail and a sine may have a zero. All depends on the scene
//! alone: a run that is resumed has the same.

use std::sync::Arc;

use crate::Stepper;
use crate::kinetics::{Batch, Column, Quantity, Signal, field};
use crate::model::{Chemistry, SignalColumns};
use crate::num::{Short, real, whole};
use crate::reduction::Reduction;
use crate::scene::Scene;

/// The decades that are looked through for a change that a rate feels.
const DECADES: std::ops::RangeInclusive<i32> = -100..=0;
/// A rate feels a change that changes it by this part: the decade is then the nearest one to where a linear rate vanishes.
const FELT: f64 = 1.0 / 3.0;
/// Times at which a law that reads the time is evaluated: within its first steps, and spread over the run for what begins
/// later, by multiples of the golden ratio, of which no period is a multiple.
const TIMES: [usize; 2] = [1024, 256];
/// Values at these times in all, but so many times at least.
const MAX_VALUES: f64 = 4e6;
const MIN_TIMES: f64 = 64.0;
const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;

/// Sets those of the species of `stepper` at its start, and notes where the absolute tolerance is above all values there.
pub(super) fn set(scene: &Scene, stepper: &mut Stepper, notes: &mut Vec<String>) {
    let model = stepper.model().clone();
    let Some(chemistry) = model.chemistry() else { return };
    let reduction = model.sheet().reduction();
    let (held, until) = (chemistry.held(), scene.time.span.until.get());
    let of_held = |s: usize| reduction.max(1, |_| held.largest(s, until));
    let start = stepper.state.species.iter().enumerate();
    let start: Vec<f64> = start.map(|(s, c)| largest(reduction, c).max(of_held(s))).collect();
    let species = &chemistry.descriptor().species;
    let mut sizes: Vec<Option<f64>> = start.iter().map(|start| nearest(*start)).collect();
    // Collective: the same on all ranks, as all of it is.
    if sizes.contains(&None) {
        from_rates(stepper, chemistry, until, &mut sizes);
    }
    let known = || species.iter().zip(&sizes).map(|(species, size)| species.typical.or(*size));
    let others = known().flatten().fold(0.0, f64::max);
    let others = if others > 0.0 { others } else { 1.0 };
    chemistry.set_typical(known().map(|size| size.unwrap_or(others)).collect());
    let Some(atol) = scene.time.integrator.atol() else { return };
    for (s, species) in species.iter().enumerate() {
        let absolute = atol * chemistry.typical(s);
        let (size, what) = match (start[s], sizes[s]) {
            (0.0, Some(size)) => (size, "the size that its rate leads to"),
            (0.0, None) => continue,
            (start, _) => (start, "its largest value at the start, or held"),
        };
        if absolute > size {
            notes.push(format!(
                "the absolute tolerance of species {} is {}, above {what}, {}: errors as large as the values pass; lower \
                 its typical magnitude ({}) or time.integrator.atol",
                species.name,
                Short(absolute),
                Short(size),
                Short(chemistry.typical(s))
            ));
        }
    }
}

fn largest(reduction: &Reduction, values: &[f64]) -> f64 {
    reduction.max(values.len(), |i| values[i].abs())
}

/// The power of ten next to a size, at most 1; none of 0.
fn nearest(size: f64) -> Option<f64> {
    let decade = size.log10().round().clamp(f64::from(*DECADES.start()), 0.0);
    (size > 0.0).then(|| 10_f64.powf(decade))
}

/// Finds those of species that start at 0.
fn from_rates(
    stepper: &mut Stepper,
    chemistry: &Chemistry,
    until: f64,
    typical: &mut [Option<f64>],
) {
    let model = stepper.model().clone();
    let reduction = model.sheet().reduction();
    let times = match chemistry.descriptor().reads(Signal::Time) {
        true => times(stepper, chemistry, until),
        false => Vec::new(),
    };
    let mut at = stepper.evaluate();
    // A start without values is refused elsewhere.
    let total = at.rates().map(<[_]>::to_vec).ok();
    let signals = at.signals().ok().cloned();
    if reduction.any(total.is_none() || signals.is_none()) {
        return;
    }
    let (total, signals) = (total.unwrap_or_default(), signals.unwrap_or_default());
    let signals = felt_signals(chemistry, signals);
    let species = stepper.state.species.clone();
    let mut start = Start { chemistry, reduction, species, signals, times };
    for _ in 0..typical.len() {
        let fastest = start.fastest(&total);
        let unknown = (0..typical.len()).filter(|s| typical[*s].is_none());
        let found: Vec<_> =
            unknown.filter_map(|s| Some((s, start.change(s, &fastest[s])?))).collect();
        if found.is_empty() {
            return;
        }
        for (s, change) in found {
            typical[s] = Some(change.abs());
            start.species[s].iter_mut().for_each(|c| *c += change);
        }
    }
}

/// Times up to `until` at which the laws of `stepper` may be fastest; fewer where there are many points.
fn times(stepper: &mut Stepper, chemistry: &Chemistry, until: f64) -> Vec<f64> {
    let sheet = Arc::clone(stepper.model().sheet());
    // They are found again with the magnitudes.
    let mut breakpoints = stepper.breakpoints.clone();
    breakpoints.sample(&mut stepper.evaluate());
    let mut times = breakpoints.sample_times(TIMES[0], sheet.reduction());
    times.extend((1..=TIMES[1]).map(|k| until * (GOLDEN_RATIO * real(k)).fract()));
    let values = sheet.reduction().count(chemistry.points(&sheet)) * real(times.len());
    let every = (values / MAX_VALUES).min(real(times.len()) / MIN_TIMES);
    times.into_iter().step_by(whole(every.ceil()).max(1)).collect()
}

/// Signals of at least their typical magnitudes: a shape that is flat or at rest has those of round-off.
fn felt_signals(chemistry: &Chemistry, mut signals: SignalColumns) -> SignalColumns {
    let reads = chemistry.descriptor().signals.iter();
    let columns = reads.flat_map(|read| read.signal.columns().iter().map(move |_| read));
    for (values, read) in signals.iter_mut().zip(columns).filter(|(_, r)| r.signal != Signal::Time)
    {
        values.iter_mut().for_each(|x| *x = x.abs().max(read.typical).copysign(*x));
    }
    signals
}

/// Where a run starts, with changes of species that start at 0.
struct Start<'a> {
    chemistry: &'a Chemistry,
    reduction: &'a Reduction,
    species: Vec<Vec<f64>>,
    signals: SignalColumns,
    /// Times of a law that reads the time.
    times: Vec<f64>,
}

impl Start<'_> {
    /// The change of species s by which its rate would change, in the direction of the largest `rates`, at their time.
    fn change(&self, s: usize, (time, rates): &(Option<f64>, Vec<f64>)) -> Option<f64> {
        let size = largest(self.reduction, rates);
        let point = (0..rates.len()).find(|point| rates[*point].abs() == size);
        // The ranks without the point have no say.
        let sign =
            self.reduction.max(1, |_| point.map_or(0.0, |point| f64::from(rates[point] > 0.0)));
        let direction = if sign > 0.0 { 1.0 } else { -1.0 };
        let about = &self.chemistry.descriptor().species[s];
        let felt = |point: usize| {
            let rate = |change| self.rate(s, (point, *time), change);
            let before = rate(0.0)?;
            let of = |decade: &f64| {
                let change = (direction * decade).clamp(about.lower, about.upper);
                rate(change).is_some_and(|after| (after - before).abs() >= FELT * size)
            };
            DECADES.map(|decade| 10_f64.powf(f64::from(decade))).find(of)
        };
        let found = self.reduction.max(1, |_| point.and_then(felt).unwrap_or(0.0));
        let magnitude = if found > 0.0 { Some(found) } else { nearest(size) };
        magnitude.filter(|_| size > 0.0).map(|magnitude| direction * magnitude)
    }

    /// Of each species the rates, and the time, where they are largest; those of transport `total` where laws have none.
    fn fastest(&self, total: &[Vec<f64>]) -> Vec<(Option<f64>, Vec<f64>)> {
        let mut fastest: Vec<_> = total.iter().map(|rates| (None, rates.clone())).collect();
        let mut most = vec![0.0; total.len()];
        for time in std::iter::once(None).chain(self.times.iter().copied().map(Some)) {
            let rates = self.rates(time).unwrap_or_default();
            for (s, rates) in rates.into_iter().enumerate() {
                let size = largest(self.reduction, &rates);
                if size > most[s] {
                    (most[s], fastest[s]) = (size, (time, rates));
                }
            }
        }
        fastest
    }

    /// The rates of the laws at all points, at this time if not that of the start; none where they have no values.
    fn rates(&self, time: Option<f64>) -> Option<Vec<Vec<f64>>> {
        let points = self.species.first().map_or(0, Vec::len);
        let mut rates = vec![vec![0.0; points]; self.species.len()];
        let mut out: Vec<&mut [f64]> = rates.iter_mut().map(Vec::as_mut_slice).collect();
        let failed = self.with_inputs(time, |kinetics, batch| {
            field::evaluate(kinetics, Quantity::Rates, batch, &mut out, &mut []).is_err()
        });
        (!self.reduction.any(failed)).then_some(rates)
    }

    /// The rate of species s at a point and time with a change of that species.
    fn rate(&self, s: usize, (point, time): (usize, Option<f64>), change: f64) -> Option<f64> {
        let value = self.species[s][point] + change;
        let mut rates = vec![[0.0]; self.species.len()];
        let mut out: Vec<&mut [f64]> = rates.iter_mut().map(<[f64; 1]>::as_mut_slice).collect();
        let evaluated = self.with_inputs(time, |kinetics, batch| {
            batch.with_part(point, 1, |part| {
                let mut species = part.species.to_vec();
                species[s] = Column::uniform(&value);
                let part = Batch { species: &species, ..*part };
                field::evaluate(kinetics, Quantity::Rates, &part, &mut out, &mut [])
            })
        });
        evaluated.ok().map(|_| rates[s][0])
    }

    fn with_inputs<R>(
        &self,
        time: Option<f64>,
        visit: impl FnOnce(&dyn crate::kinetics::Kinetics, &Batch<'_>) -> R,
    ) -> R {
        let species: Vec<&[f64]> = self.species.iter().map(Vec::as_slice).collect();
        let mut signals = self.signals.clone();
        let reads = self.chemistry.descriptor().signals.iter();
        let columns = reads.flat_map(|read| read.signal.columns().iter().map(|_| read.signal));
        for (column, _) in signals.iter_mut().zip(columns).filter(|(_, s)| *s == Signal::Time) {
            time.iter().for_each(|time| column.fill(*time));
        }
        self.chemistry.with_inputs(&species, &signals, visit)
    }
}
