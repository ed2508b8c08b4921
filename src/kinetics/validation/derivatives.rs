//! Given derivatives against differences, where differences can be trusted.
//!
//! On each side of a point that its range leaves room for there are slopes D₀, D₁, D₂ over steps h, h/4
//! and h/16, and their extrapolation E = (4 D₂ - D₁)/3, exact up to h² where the law is smooth on that
//! side; this holds at a bound of the range as well as away from it. Slopes of a smooth law converge by
//! a factor of 4. Those that do not (a jump or a kink within the step, a power below 2 at its root,
//! round-off) are not trusted, and nothing is said. A given derivative is right if it lies in the range
//! of the trusted slopes of both sides, widened by what they differ in: at a kink any slope between
//! those of its sides. One that is infinite is right where the slopes grow without bound.

use crate::differences::{self, STEP_SCALES, Side};
use crate::field::Columns;
use crate::{Batch, Kinetics, KineticsError, Quantity, Site};
use rumple_numerics::num::Short;

/// A given derivative further from the slopes than this share of their size is wrong.
const MISMATCH_SHARE: f64 = 1e-3;
/// Derivatives that matter less than this share of the output over the input's typical magnitude are
/// not compared: differences lose what is smaller.
const NEGLIGIBLE_DERIVATIVE: f64 = 1e-4;
/// Trusted slopes differ by this share of their size at most ...
const SLOPE_AGREEMENT: f64 = 0.02;
/// ... and the last two by this share of what the first two differ in: a smooth law has 1/4.
const CONVERGENCE_RATIO: f64 = 0.4;
/// What round-off leaves of a slope, of the output over the input's typical magnitude.
const SLOPE_NOISE: f64 = 1e-7;

/// Two ways to the same number may differ by this share of the greatest one.
const ROUND_OFF: f64 = 1e-9;

/// A wrong derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wrong {
    quantity: Quantity,
    /// Its column among the partial derivatives.
    entry: usize,
    pub(super) point: usize,
    given: f64,
    difference: f64,
}

impl Wrong {
    pub(super) fn describe(
        &self,
        kinetics: &dyn Kinetics,
        batch: &Batch<'_>,
        point: usize,
    ) -> String {
        let descriptor = kinetics.descriptor();
        let call = self.quantity.call(true);
        let derivative = self.quantity.describe(descriptor, true, self.entry);
        let site = Site { point, ..Site::new(batch, descriptor, &descriptor.signals, self.point) };
        format!(
            "{} gives {} in {call} for {derivative} at {site}, where differences give {:.9e}",
            descriptor.title(),
            Short(self.given),
            self.difference
        )
    }
}

/// What a comparison found.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Compared {
    /// The worst derivative that is wrong.
    pub(super) wrong: Option<Wrong>,
    /// A point with an infinite derivative where that is right.
    pub(super) unbounded: Option<usize>,
    /// Relative error of the worst.
    error: f64,
}

impl Compared {
    /// Inspects one derivative, an entry of a quantity, at all points; `scale` is the output over the input's typical
    /// magnitude.
    fn compare(
        &mut self,
        given: &[f64],
        sides: &[&[[f64; STEP_SCALES]]; 2],
        scale: impl Fn(usize) -> f64,
        (quantity, entry): (Quantity, usize),
    ) {
        for (point, &given) in given.iter().enumerate() {
            let (scale, slopes) = (scale(point), sides.map(|side| Slopes(side[point])));
            // A non-finite output has no derivative.
            if !scale.is_finite() {
                continue;
            }
            let fault = match judge(given, slopes, scale) {
                Judgement::Right => continue,
                Judgement::Unbounded => {
                    self.unbounded.get_or_insert(point);
                    continue;
                }
                Judgement::Wrong(error) => error,
            };
            if self.wrong.is_none() || fault > self.error {
                let difference = best(slopes, scale);
                self.error = fault;
                self.wrong = Some(Wrong { quantity, entry, point, given, difference });
            }
        }
    }
}

enum Judgement {
    /// As far as can be determined.
    Right,
    /// Infinite, and right.
    Unbounded,
    /// By this relative error.
    Wrong(f64),
}

/// Slopes on one side of a point, over ever shorter steps.
#[derive(Clone, Copy)]
struct Slopes([f64; STEP_SCALES]);

impl Slopes {
    fn extrapolated(self) -> f64 {
        let [_, d1, d2] = self.0;
        (4.0 * d2 - d1) / 3.0
    }

    /// The range in which a derivative is right, if these can be trusted; NaN never are.
    fn trusted(self, scale: f64) -> Option<(f64, f64)> {
        let [d0, d1, d2] = self.0;
        let noise = SLOPE_NOISE * scale;
        let all = [d1, d2, self.extrapolated()];
        let (low, high) = (all.into_iter().fold(d1, f64::min), all.into_iter().fold(d1, f64::max));
        let width = high - low;
        let size = d1.abs().max(d2.abs());
        let smooth = width <= SLOPE_AGREEMENT * size + noise;
        let converging = (d2 - d1).abs() <= CONVERGENCE_RATIO * (d1 - d0).abs() + noise;
        (smooth && converging).then_some((low - width, high + width))
    }

    /// Whether the slopes grow without bound towards `infinity`.
    fn diverge(self, infinity: f64) -> bool {
        let [d0, d1, d2] = self.0.map(|d| d * infinity.signum());
        d2 > d1 && d1 > d0 && d2 - d1 > CONVERGENCE_RATIO * (d1 - d0) && infinity.is_infinite()
    }
}

/// The derivative by differences: the mean of those sides that can be trusted, or of all.
fn best(sides: [Slopes; 2], scale: f64) -> f64 {
    let mean = |of: &dyn Fn(&Slopes) -> bool| {
        let found = sides.into_iter().filter(of).map(Slopes::extrapolated);
        let (sum, count) = found.fold((0.0, 0.0), |(sum, count), d| (sum + d, count + 1.0));
        sum / count
    };
    let trusted = mean(&|side| side.trusted(scale).is_some());
    if trusted.is_nan() { mean(&|side| !side.extrapolated().is_nan()) } else { trusted }
}

fn judge(given: f64, sides: [Slopes; 2], scale: f64) -> Judgement {
    if !given.is_finite() {
        let right = sides.into_iter().any(|side| side.diverge(given));
        return if right { Judgement::Unbounded } else { Judgement::Wrong(f64::INFINITY) };
    }
    let trusted = sides.into_iter().filter_map(|side| side.trusted(scale));
    let Some((low, high)) = trusted.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
        return Judgement::Right;
    };
    let error = (low - given).max(given - high).max(0.0);
    let size = low.abs().max(high.abs()).max(given.abs());
    let wrong = error > MISMATCH_SHARE * size + NEGLIGIBLE_DERIVATIVE * scale;
    if wrong { Judgement::Wrong(error / size) } else { Judgement::Right }
}

/// Compares the derivatives of a quantity with slopes of its values.
pub(super) fn compare(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
) -> Result<Compared, KineticsError> {
    let law = kinetics.descriptor();
    let (outputs, inputs) = (quantity.outputs(law), quantity.inputs(law));
    let mut values = Columns::new(outputs, batch.count);
    let mut given = Columns::new(outputs * inputs, batch.count);
    kinetics.evaluate(quantity, batch, &mut values.slices_mut(), &mut given.slices_mut())?;
    if quantity == Quantity::Rates {
        same_rates(kinetics, batch, &values)?;
    }
    let mut found = Compared::default();
    let alone = |batch: &Batch<'_>, values: &mut [&mut [f64]]| {
        kinetics.evaluate(quantity, batch, values, &mut [])
    };
    for (input, range) in differences::ranges(kinetics).into_iter().take(inputs).enumerate() {
        let slopes = |side| differences::slopes_beside(batch, outputs, input, (range, side), alone);
        let sides = [slopes(Side::Down)?, slopes(Side::Up)?];
        for output in 0..outputs {
            let of = output * batch.count..(output + 1) * batch.count;
            let sides = [&sides[0][of.clone()], &sides[1][of]];
            let scale = |point: usize| values.column(output)[point].abs() / range.typical;
            let entry = output * inputs + input;
            found.compare(given.column(entry), &sides, scale, (quantity, entry));
        }
    }
    Ok(found)
}

/// Refuses rates that are others without derivatives than `with_partials`.
fn same_rates(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
    with_partials: &Columns,
) -> Result<(), KineticsError> {
    let species = &kinetics.descriptor().species;
    let mut alone = Columns::new(species.len(), batch.count);
    kinetics.evaluate(Quantity::Rates, batch, &mut alone.slices_mut(), &mut [])?;
    for (s, species) in species.iter().enumerate() {
        let pairs = alone.column(s).iter().zip(with_partials.column(s));
        // Of the greatest in the column: where terms cancel, little is left to compare.
        let finite = alone.column(s).iter().filter(|rate| rate.is_finite());
        let most = finite.fold(0.0_f64, |most, rate| most.max(rate.abs()));
        let differ = |(a, b): (&f64, &f64)| {
            (a.is_finite() || b.is_finite()) && !((a - b).abs() <= ROUND_OFF * most)
        };
        if let Some(point) = pairs.clone().position(differ) {
            return Err(KineticsError::TwoValues {
                law: kinetics.descriptor().title(),
                species: species.name.clone(),
                location: batch.location.noun(),
                point: batch.first + point,
                alone: alone.column(s)[point],
                with_partials: with_partials.column(s)[point],
            });
        }
    }
    Ok(())
}
