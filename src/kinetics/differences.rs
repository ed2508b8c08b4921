//! Partial derivatives by differences, for laws that give none of their own and to compare with those of others.
//!
//! ```text
//! ∂f/∂x ≈ (f(x + h) - f(x - h))/(2h)        h = ε^{1/3} max(|x|, x_typical),  ε = 2^-52
//! ```
//!
//! This step balances truncation against round-off, for an error of order ε^{2/3} ≈ 4e-11 relative
//! to f/x_typical where f is smooth. Where x ± h would leave the valid range of a species the
//! difference is one-sided, with an error of order h. At a kink (H = 0 of H⁺) it is the mean slope.

use super::batch::{Batch, Column};
use super::{Kinetics, Outcome, Quantity};

/// ε^{1/3}: the relative step.
pub const STEP: f64 = 6.055_454_452_393_343e-6;

/// Values and partial derivatives of a quantity by differences, for a law that gives its values; layout as in
/// [`Kinetics::evaluate`].
///
/// # Errors
/// If the law fails at any of the points.
pub fn partials<K: Kinetics + ?Sized>(
    kinetics: &K,
    quantity: Quantity,
    batch: &Batch<'_>,
    values: &mut [&mut [f64]],
    partials: &mut [&mut [f64]],
) -> Outcome {
    let descriptor = kinetics.descriptor();
    if !quantity.is_given(descriptor) {
        quantity.write_neutral(values, partials);
        return Ok(None);
    }
    let mut warning = kinetics.evaluate(quantity, batch, values, &mut [])?;
    let (outputs, inputs) = (quantity.outputs(descriptor), quantity.inputs(descriptor));
    let law = |batch: &Batch<'_>, values: &mut [&mut [f64]]| {
        kinetics.evaluate(quantity, batch, values, &mut [])
    };
    for (input, range) in ranges(kinetics).into_iter().take(inputs).enumerate() {
        let slopes = slopes(batch, outputs, input, range, law)?;
        for (row, slope) in slopes.values.chunks(batch.count.max(1)).enumerate() {
            if let Some(partial) = partials.get_mut(row * inputs + input) {
                partial.copy_from_slice(slope);
            }
        }
        warning = warning.or(slopes.warning);
    }
    Ok(warning)
}

/// Typical magnitude and valid range of one input.
#[derive(Clone, Copy)]
pub(super) struct Range {
    pub(super) typical: f64,
    lower: f64,
    upper: f64,
}

/// Typical magnitudes and valid ranges of all inputs.
pub(super) fn ranges<K: Kinetics + ?Sized>(kinetics: &K) -> Vec<Range> {
    let descriptor = kinetics.descriptor();
    let typical = kinetics.typical();
    let species = descriptor.species.iter().enumerate().map(|(s, species)| Range {
        typical: typical.map_or(species.magnitude(), |typical| typical[s]),
        lower: species.lower,
        upper: species.upper,
    });
    let signals = descriptor.signals.iter().flat_map(|read| {
        read.signal.columns().iter().map(|_| Range {
            typical: read.typical,
            lower: read.signal.lower(),
            upper: f64::INFINITY,
        })
    });
    species.chain(signals).collect()
}

/// A side of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Towards smaller inputs.
    Down,
    /// Towards larger inputs.
    Up,
}

/// Steps on one side of a point, each a quarter of the one before.
pub(super) const STEP_SCALES: usize = 3;

impl Range {
    fn around(self, x: f64) -> (f64, f64) {
        let h = STEP * x.abs().max(self.typical);
        let (down, up) = (x - h, x + h);
        match (down < self.lower, up > self.upper) {
            (true, false) => (x, up),
            (false, true) => (down, x),
            (true, true) if self.lower < self.upper => (self.lower, self.upper),
            _ => (down, up),
        }
    }

    /// Inputs on one side of `x` and within the range, the last at the distance of a central
    /// difference; `None` where the range is too narrow.
    fn beside(self, x: f64, side: Side) -> Option<[f64; STEP_SCALES]> {
        let wanted = 16.0 * STEP * x.abs().max(self.typical);
        let room = match side {
            Side::Down => x - self.lower,
            Side::Up => self.upper - x,
        };
        let h = wanted.min(room);
        let at = |h: f64| match side {
            Side::Down => (x - h).max(self.lower),
            Side::Up => (x + h).min(self.upper),
        };
        (h >= wanted / 16.0).then(|| [at(h), at(h / 4.0), at(h / 16.0)])
    }
}

struct Slopes {
    values: Vec<f64>,
    warning: Option<super::Unreliable>,
}

/// Difference quotients of all `outputs` of a law by one input, one output after the other.
fn slopes(
    batch: &Batch<'_>,
    outputs: usize,
    input: usize,
    range: Range,
    law: impl Fn(&Batch<'_>, &mut [&mut [f64]]) -> Outcome,
) -> Result<Slopes, super::KineticsError> {
    let Some(column) = batch.inputs().nth(input) else {
        return Ok(Slopes { values: vec![0.0; outputs * batch.count], warning: None });
    };
    let (downs, ups): (Vec<f64>, Vec<f64>) =
        (0..batch.count).map(|point| range.around(column.at(point))).unzip();
    let (low, warning_low) = shifted(batch, outputs, input, &downs, &law)?;
    let (mut high, warning_high) = shifted(batch, outputs, input, &ups, &law)?;
    for (at, (high, low)) in high.iter_mut().zip(low).enumerate() {
        let point = at % batch.count;
        *high = (*high - low) / (ups[point] - downs[point]);
    }
    Ok(Slopes { values: high, warning: warning_low.or(warning_high) })
}

/// Slopes of all `outputs` of a law by one input towards one side, one output after the other, over
/// ever shorter steps; NaN where the range leaves no room.
pub(super) fn slopes_beside(
    batch: &Batch<'_>,
    outputs: usize,
    input: usize,
    (range, side): (Range, Side),
    law: impl Fn(&Batch<'_>, &mut [&mut [f64]]) -> Outcome,
) -> Result<Vec<[f64; STEP_SCALES]>, super::KineticsError> {
    let mut slopes = vec![[f64::NAN; STEP_SCALES]; outputs * batch.count];
    let Some(column) = batch.inputs().nth(input) else { return Ok(slopes) };
    let here: Vec<f64> = (0..batch.count).map(|point| column.at(point)).collect();
    let beside: Vec<_> = here.iter().map(|x| range.beside(*x, side)).collect();
    let (values, _) = shifted(batch, outputs, input, &here, &law)?;
    for scale in 0..STEP_SCALES {
        let inputs: Vec<f64> =
            beside.iter().zip(&here).map(|(b, x)| b.map_or(*x, |b| b[scale])).collect();
        let (others, _) = shifted(batch, outputs, input, &inputs, &law)?;
        for (at, slope) in slopes.iter_mut().enumerate() {
            let point = at % batch.count;
            // Without room this is 0/0.
            slope[scale] = (others[at] - values[at]) / (inputs[point] - here[point]);
        }
    }
    Ok(slopes)
}

/// All `outputs` of a law with other values of one input, one output after the other.
fn shifted(
    batch: &Batch<'_>,
    outputs: usize,
    input: usize,
    inputs: &[f64],
    law: impl Fn(&Batch<'_>, &mut [&mut [f64]]) -> Outcome,
) -> Result<(Vec<f64>, Option<super::Unreliable>), super::KineticsError> {
    let mut columns: Vec<Column<'_>> = batch.inputs().copied().collect();
    columns[input] = inputs.into();
    let (species, signals) = columns.split_at(batch.species.len());
    let mut values = super::field::Columns::new(outputs, batch.count);
    let warning = law(&Batch { species, signals, ..*batch }, &mut values.slices_mut())?;
    Ok((values.into_inner(), warning))
}
