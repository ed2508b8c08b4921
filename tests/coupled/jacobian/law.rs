//! A law with everything that a law may have.

use rumple::kinetics::{
    Batch, Capabilities, Descriptor, Feedback, Kinetics, Location, Outcome, Quantity, Signal,
    SignalRead, Species,
};

/// Two species whose rates depend on each other and on all signals, and that change lengths.
#[derive(Debug)]
pub(super) struct Everything(Descriptor);

impl Everything {
    pub(super) fn new(location: Location) -> Self {
        let species = |name: &str| Species {
            name: name.into(),
            unit: "1".into(),
            doc: String::new(),
            typical: Some(1.0),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            diffusion: 0.0,
            location,
        };
        Self(Descriptor {
            id: "test.everything".into(),
            name: "everything".into(),
            version: "0".into(),
            author: String::new(),
            licence: String::new(),
            doc: String::new(),
            species: vec![species("a"), species("b")],
            parameters: Vec::new(),
            signals: Signal::ALL.map(|signal| SignalRead { signal, typical: 1.0 }).to_vec(),
            capabilities: Capabilities {
                rate_partials: true,
                length_factor: true,
                length_factor_partials: true,
                ..Capabilities::default()
            },
            observables: Vec::new(),
            observed: Vec::new(),
        })
    }

    /// The same, which bends the sheet as well, and grows across a fibre.
    pub(super) fn with_feedback(location: Location) -> Self {
        let mut all = Self::new(location);
        all.0.capabilities.curvature = true;
        all.0.capabilities.length_factor_across = true;
        all
    }

    /// `(1 + k) sin(k + x_k)` summed over inputs, another phase for each species.
    fn term(species: usize, input: usize, x: f64) -> (f64, f64) {
        let phase = 0.3 * species as f64 + 0.7 * input as f64;
        let size = 1.0 + 0.1 * input as f64;
        (size * (phase + x).sin(), size * (phase + x).cos())
    }
}

impl Kinetics for Everything {
    fn descriptor(&self) -> &Descriptor {
        &self.0
    }

    fn parameters(&self) -> &[f64] {
        &[]
    }

    fn evaluate(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let inputs = quantity.inputs(&self.0);
        for point in 0..batch.count {
            let x: Vec<f64> = batch.inputs().map(|x| x.at(point)).collect();
            for (s, value) in values.iter_mut().enumerate() {
                value[point] = match quantity {
                    Quantity::Feedback(which) => feedback(which, x[0], x[1]).0,
                    _ => x.iter().enumerate().map(|(k, x)| Self::term(s, k, *x).0).sum(),
                };
            }
            for (entry, partial) in partials.iter_mut().enumerate() {
                let (s, k) = (entry / inputs, entry % inputs);
                partial[point] = match quantity {
                    Quantity::Feedback(which) => feedback(which, x[0], x[1]).1[k],
                    _ => Self::term(s, k, x[k]).1,
                };
            }
        }
        Ok(None)
    }
}

/// A quantity of two species, with its derivatives.
fn feedback(which: Feedback, a: f64, b: f64) -> (f64, [f64; 2]) {
    match which {
        Feedback::LengthFactor => {
            let slope = 0.1 * (a + 2.0 * b).cos();
            (1.0 + 0.1 * (a + 2.0 * b).sin(), [slope, slope * 2.0])
        }
        Feedback::Curvature => {
            let slope = 0.8 * (2.0 * a - b).cos();
            (0.8 * (2.0 * a - b).sin(), [slope * 2.0, -slope])
        }
        Feedback::FactorAcross => {
            let slope = -0.1 * (a * b).sin();
            (1.0 + 0.1 * (a * b).cos(), [slope * b, slope * a])
        }
    }
}
