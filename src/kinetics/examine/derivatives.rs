//! Given derivatives against differences, where differences can be trusted.
//!
//! A central and a forward difference agree where a law is smooth on their scale. Where they do not
//! (a kink, a jump, round-off) nothing can be said, and nothing is.

use crate::kinetics::differences::{self, Scheme};
use crate::kinetics::field::Columns;
use crate::kinetics::{Batch, Kinetics, KineticsError, Site};

/// A given derivative further from the difference than this share of their size is wrong.
const WRONG: f64 = 1e-3;
/// Derivatives that matter less than this share of the output over the input's typical magnitude are
/// not compared: at the edge of a range differences are one-sided, and no better.
const SMALL: f64 = 1e-4;
/// Two differences must agree by this share to be trusted; the central one is then far better.
const SMOOTH: f64 = 3e-3;

/// Two ways to the same number may differ by this share of the greatest one.
pub(super) const ROUND_OFF: f64 = 1e-9;

/// A wrong derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wrong {
    /// Number of the output column; `None` for the length factor.
    species: Option<usize>,
    input: usize,
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
        let name = |input: usize| descriptor.input_names().nth(input).unwrap_or("?").to_owned();
        let of = match self.species {
            Some(species) => format!("the rate of species {}", name(species)),
            None => "the length factor".to_owned(),
        };
        let call = if self.species.is_some() { "rate_partials" } else { "length_factor_partials" };
        let site = Site { point, ..Site::of(batch, descriptor, &descriptor.signals, self.point) };
        format!(
            "{} gives {} in {call} for the derivative by {} of {of} at {site}, where differences \
             give {:.9e}",
            descriptor.title(),
            self.given,
            name(self.input),
            self.difference
        )
    }
}

/// Given derivatives of one output by one input, with differences by two schemes.
struct Compared<'a> {
    given: &'a [f64],
    central: &'a [f64],
    forward: &'a [f64],
}

/// The worst of what was found, by its relative error.
#[derive(Default)]
struct Worst(Option<(f64, Wrong)>);

impl Worst {
    /// Looks at all points; `scale` is the output over the input's typical magnitude, the size
    /// to which differences lose what is smaller.
    fn look(
        &mut self,
        compared: &Compared<'_>,
        scale: impl Fn(usize) -> f64,
        (species, input): (Option<usize>, usize),
    ) {
        let Compared { given, central, forward } = compared;
        for (point, &given) in given.iter().enumerate() {
            let (difference, other) = (central[point], forward[point]);
            let size = difference.abs().max(other.abs());
            let floor = scale(point);
            let trusted = (difference - other).abs() <= SMOOTH * size + 1e-7 * floor;
            // A small kink met exactly passes for smooth; any slope between those of its sides is
            // right there. The central difference is their mean.
            let left = 2.0 * difference - other;
            let error = (other.min(left) - given).max(given - other.max(left)).max(0.0);
            let size = size.max(given.abs());
            if !trusted || error <= WRONG * size + SMALL * floor {
                continue;
            }
            let relative = error / size;
            if self.0.is_none_or(|(worst, _)| relative > worst) {
                self.0 = Some((relative, Wrong { species, input, point, given, difference }));
            }
        }
    }
}

/// The worst wrong derivative of the rates.
pub(super) fn rates(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
) -> Result<Option<Wrong>, KineticsError> {
    let (species, inputs) = (kinetics.descriptor().species.len(), kinetics.descriptor().inputs());
    let mut rates = Columns::new(species, batch.count);
    let mut given = Columns::new(species * inputs, batch.count);
    let (mut central, mut forward) = (given.clone(), given.clone());
    let by = differences::rate_partials_by;
    by(kinetics, batch, Scheme::Forward, &mut rates.slices_mut(), &mut forward.slices_mut())?;
    by(kinetics, batch, Scheme::Central, &mut rates.slices_mut(), &mut central.slices_mut())?;
    let alone = rates.clone();
    kinetics.rate_partials(batch, &mut rates.slices_mut(), &mut given.slices_mut())?;
    for s in 0..species {
        let pairs = alone.column(s).iter().zip(rates.column(s));
        // Of the greatest in the column: where terms cancel, little is left to compare.
        let most = alone.column(s).iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
        let differ = |(a, b): (&f64, &f64)| (a - b).abs() > ROUND_OFF * most;
        if let Some(point) = pairs.clone().position(differ) {
            return Err(KineticsError::TwoValues {
                law: kinetics.descriptor().title(),
                species: kinetics.descriptor().species[s].name.clone(),
                location: batch.location.noun(),
                point: batch.first + point,
                alone: alone.column(s)[point],
                with_partials: rates.column(s)[point],
            });
        }
    }
    let typical = differences::typical(kinetics);
    let mut worst = Worst::default();
    for entry in 0..species * inputs {
        let (row, input) = (entry / inputs, entry % inputs);
        let [given, central, forward] = [&given, &central, &forward].map(|c| c.column(entry));
        let scale = |point: usize| rates.column(row)[point].abs() / typical[input];
        worst.look(&Compared { given, central, forward }, scale, (Some(row), input));
    }
    Ok(worst.0.map(|(_, wrong)| wrong))
}

/// The worst wrong derivative of the length factor.
pub(super) fn length_factor(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
) -> Result<Option<Wrong>, KineticsError> {
    let species = kinetics.descriptor().species.len();
    let mut factor = vec![1.0; batch.count];
    let mut given = Columns::new(species, batch.count);
    let (mut central, mut forward) = (given.clone(), given.clone());
    let by = differences::length_factor_partials_by;
    by(kinetics, batch, Scheme::Forward, &mut factor, &mut forward.slices_mut())?;
    by(kinetics, batch, Scheme::Central, &mut factor, &mut central.slices_mut())?;
    kinetics.length_factor_partials(batch, &mut factor, &mut given.slices_mut())?;
    let typical = differences::typical(kinetics);
    let mut worst = Worst::default();
    for input in 0..species {
        let [given, central, forward] = [&given, &central, &forward].map(|c| c.column(input));
        let scale = |point: usize| factor[point].abs() / typical[input];
        worst.look(&Compared { given, central, forward }, scale, (None, input));
    }
    Ok(worst.0.map(|(_, wrong)| wrong))
}
