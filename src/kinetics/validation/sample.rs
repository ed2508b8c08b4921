//! Inputs over the declared ranges of a law, from a seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::field::{self, Columns};
use crate::{
    Batch, Column, Descriptor, Kinetics, KineticsError, Location, Quantity, Signal, SignalRead,
};

/// Inputs at many points.
#[derive(Debug, Clone)]
pub struct Samples {
    count: usize,
    species: Vec<Vec<f64>>,
    signals: Vec<Vec<f64>>,
    /// Where they differ from point to point.
    parameters: Vec<Vec<f64>>,
}

/// Magnitudes from a thousandth of the typical one to ten times it.
const DECADES: std::ops::Range<f64> = -3.0..1.0;

impl Samples {
    /// `count` points: first every input at 0 or at a bound, the others at typical values; then
    /// random ones.
    ///
    /// Species are within their valid range; signals are of either sign where they may be, an area
    /// is positive, a normal has length 1, time is not negative.
    #[must_use]
    pub fn new(descriptor: &Descriptor, count: usize, seed: u64) -> Self {
        Self::reading(descriptor, &descriptor.signals, count, seed)
    }

    /// As [`Samples::new`], for what observables read.
    #[must_use]
    pub(crate) fn observing(descriptor: &Descriptor, count: usize, seed: u64) -> Self {
        Self::reading(descriptor, &descriptor.observed, count, seed)
    }

    fn reading(descriptor: &Descriptor, read: &[SignalRead], count: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut species: Vec<Vec<f64>> = Vec::new();
        for one in &descriptor.species {
            let span = one.upper - one.lower;
            let draw = |random: &mut ChaCha8Rng| {
                let size = one.magnitude() * 10_f64.powf(random.random_range(DECADES));
                match (one.lower.is_finite(), one.upper.is_finite()) {
                    (true, true) => one.lower + span * random.random_range(0.0..=1.0),
                    (true, false) => one.lower + size,
                    (false, true) => one.upper - size,
                    (false, false) => signed(random, size),
                }
            };
            species.push((0..count).map(|_| draw(&mut random)).collect());
        }
        let mut signals = Vec::new();
        for read in read {
            let first = signals.len();
            for _ in read.signal.columns() {
                let draw = |random: &mut ChaCha8Rng| {
                    let size = read.typical * 10_f64.powf(random.random_range(DECADES));
                    match read.signal {
                        Signal::AreaRatio => 10_f64.powf(random.random_range(-1.0..1.0)),
                        Signal::AreaStrain => signed(random, size).max(-0.9),
                        Signal::ContactPressure | Signal::Time => size,
                        Signal::Normal => random.random_range(-1.0..1.0),
                        _ => signed(random, size),
                    }
                };
                signals.push((0..count).map(|_| draw(&mut random)).collect::<Vec<f64>>());
            }
            if read.signal == Signal::Normal {
                unit(&mut signals[first..]);
            }
        }
        let mut samples = Self { count, species, signals, parameters: Vec::new() };
        samples.mark(descriptor, read);
        samples
    }

    /// With the parameters of random places of a sheet: one column a parameter, of one value or one
    /// a place; none for those of the law.
    #[must_use]
    pub fn with_parameters(mut self, fields: &[Vec<f64>], seed: u64) -> Self {
        let places = fields.iter().map(Vec::len).max().unwrap_or(0);
        if places > 0 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let chosen: Vec<usize> =
                (0..self.count).map(|_| random.random_range(0..places)).collect();
            let at = |field: &Vec<f64>, place: usize| *field.get(place).unwrap_or(&field[0]);
            let column = |field| chosen.iter().map(|place| at(field, *place)).collect();
            self.parameters = fields.iter().map(column).collect();
        }
        self
    }

    /// Puts the corners of the ranges first.
    fn mark(&mut self, descriptor: &Descriptor, read: &[SignalRead]) {
        let mut point = 0;
        for (number, one) in descriptor.species.iter().enumerate() {
            for corner in [0.0, one.lower, one.upper] {
                let valid = corner.is_finite() && corner >= one.lower && corner <= one.upper;
                if valid && point < self.count {
                    self.species[number][point] = corner;
                    point += 1;
                }
            }
        }
        let mut column = 0;
        for read in read {
            let zero = !matches!(read.signal, Signal::AreaRatio | Signal::Normal);
            for _ in read.signal.columns() {
                if zero && point < self.count {
                    self.signals[column][point] = 0.0;
                    point += 1;
                }
                column += 1;
            }
        }
    }

    /// Hands the inputs to `evaluate`; without signals for length factors.
    pub fn with<R>(&self, signals: bool, evaluate: impl FnOnce(&Batch<'_>) -> R) -> R {
        let species: Vec<Column<'_>> = self.species.iter().map(Into::into).collect();
        let read: Vec<Column<'_>> = self.signals.iter().map(Into::into).collect();
        let parameters: Vec<Column<'_>> = self.parameters.iter().map(Into::into).collect();
        evaluate(&Batch {
            location: Location::Vertex,
            first: 0,
            count: self.count,
            species: &species,
            signals: if signals { &read } else { &[] },
            parameters: &parameters,
        })
    }
}

fn signed(random: &mut ChaCha8Rng, size: f64) -> f64 {
    if random.random_bool(0.5) { size } else { -size }
}

/// Scales three columns so that every point has length 1.
fn unit(columns: &mut [Vec<f64>]) {
    let count = columns.first().map_or(0, Vec::len);
    for point in 0..count {
        let square: f64 = columns.iter().map(|c| c[point] * c[point]).sum();
        let length = square.sqrt().max(f64::MIN_POSITIVE);
        columns.iter_mut().for_each(|c| c[point] /= length);
    }
}

/// A quantity at all points, by the path that runs take.
pub(super) fn values(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
) -> Result<Columns, KineticsError> {
    let mut values = Columns::new(quantity.outputs(kinetics.descriptor()), batch.count);
    field::evaluate(kinetics, quantity, batch, &mut values.slices_mut(), &mut [])?;
    Ok(values)
}

/// The rates at all points.
pub(super) fn rates(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<Columns, KineticsError> {
    values(kinetics, Quantity::Rates, batch)
}
