//! The point to blame for an error, with what the law saw there.

use crate::batch::UNWRITTEN_BITS;
use std::fmt;

use rumple_numerics::num::Short;

use super::feedback::is_factor;
use super::{Batch, Descriptor, SignalRead};

/// A point of a call.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// `vertex`, `face` or `edge`.
    pub location: &'static str,
    /// Its number.
    pub point: usize,
    /// Name and value of every input there: species, signal columns, parameters that vary.
    pub inputs: Vec<(String, f64)>,
    /// Its place, where the caller has given one.
    pub position: Option<[f64; 3]>,
}

impl Site {
    /// A point of a batch with these signals, counted from the first one of it.
    pub(super) fn new(
        batch: &Batch<'_>,
        descriptor: &Descriptor,
        signals: &[SignalRead],
        point: usize,
    ) -> Self {
        let values = batch.inputs().map(|column| column.at(point));
        let names = descriptor.names_with(signals).map(str::to_owned);
        let parameters = descriptor.parameters.iter().zip(batch.parameters);
        let varying = parameters.filter(|(_, column)| column.parts().1 > 0);
        let inputs = if point < batch.count {
            let varying = varying.map(|(parameter, c)| (parameter.name.clone(), c.at(point)));
            names.zip(values).chain(varying).collect()
        } else {
            Vec::new()
        };
        let (location, point) = (batch.location.noun(), batch.first.saturating_add(point));
        Self { location, point, inputs, position: None }
    }
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.location, self.point)?;
        if !self.inputs.is_empty() {
            let inputs: Vec<String> = self
                .inputs
                .iter()
                .map(|(name, value)| format!("{name} = {}", Short(*value)))
                .collect();
            write!(f, " ({})", inputs.join(", "))?;
        }
        if let Some([x, y, z]) = self.position {
            write!(f, ", position ({x:.4}, {y:.4}, {z:.4})")?;
        }
        Ok(())
    }
}

/// A bad output, with all that is needed to reproduce it.
#[derive(Debug, Clone, PartialEq)]
pub struct BadValue {
    /// The law, as messages call it.
    pub law: String,
    /// Which call.
    pub call: &'static str,
    /// What was returned, for example `the rate of species c`.
    pub quantity: String,
    /// The value.
    pub value: f64,
    /// Where.
    pub site: Site,
}

impl fmt::Display for BadValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { law, call, quantity, value, site } = self;
        if value.to_bits() == UNWRITTEN_BITS {
            let must = "it must write every output at every point";
            return write!(f, "{law} leaves {quantity} unwritten in {call} at {site}: {must}");
        }
        write!(f, "{law} returned {} in {call} for {quantity} at {site}", Short(*value))?;
        if *value <= 0.0 && is_factor(quantity) {
            write!(
                f,
                "; a length factor must be positive: keep the species in their range, or let the \
                 factor level off as 1 + a*tanh(c) does"
            )?;
        }
        if value.is_infinite() && call.ends_with("_partials") {
            f.write_str(
                "; the slope is infinite there, as of sqrt(c) at c = 0: start from another value, or write \
                 sqrt(c + 1e-9)",
            )?;
        }
        Ok(())
    }
}
