//! A law with everything that a law may have.

use rumple::kinetics::{
    Batch, Capabilities, Descriptor, Feedback, Kinetics, Location, Outcome, Signal, SignalRead,
    Species,
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
            typical: 1.0,
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

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        for (s, rate) in rates.iter_mut().enumerate() {
            for (point, rate) in rate.iter_mut().enumerate() {
                *rate =
                    batch.inputs().enumerate().map(|(k, x)| Self::term(s, k, x.at(point)).0).sum();
            }
        }
        Ok(None)
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let inputs = self.0.inputs();
        for (entry, partial) in partials.iter_mut().enumerate() {
            let (s, k) = (entry / inputs, entry % inputs);
            let column = batch.inputs().nth(k).unwrap();
            for (point, partial) in partial.iter_mut().enumerate() {
                *partial = Self::term(s, k, column.at(point)).1;
            }
        }
        self.rates(batch, rates)
    }

    fn length_factor(&self, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
        for (point, factor) in factor.iter_mut().enumerate() {
            let [a, b] = [0, 1].map(|s| batch.species[s].at(point));
            *factor = 1.0 + 0.1 * (a + 2.0 * b).sin();
        }
        Ok(None)
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        for (s, partial) in partials.iter_mut().enumerate() {
            for (point, partial) in partial.iter_mut().enumerate() {
                let [a, b] = [0, 1].map(|s| batch.species[s].at(point));
                *partial = 0.1 * (a + 2.0 * b).cos() * [1.0, 2.0][s];
            }
        }
        self.length_factor(batch, factor)
    }

    fn feedback(&self, which: Feedback, batch: &Batch<'_>, values: &mut [f64]) -> Outcome {
        for (point, value) in values.iter_mut().enumerate() {
            let [a, b] = [0, 1].map(|s| batch.species[s].at(point));
            *value = match which {
                Feedback::Curvature => 0.8 * (2.0 * a - b).sin(),
                Feedback::FactorAcross => 1.0 + 0.1 * (a * b).cos(),
            };
        }
        Ok(None)
    }

    fn feedback_partials(
        &self,
        which: Feedback,
        batch: &Batch<'_>,
        values: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        for (s, partial) in partials.iter_mut().enumerate() {
            for (point, partial) in partial.iter_mut().enumerate() {
                let [a, b] = [0, 1].map(|s| batch.species[s].at(point));
                *partial = match which {
                    Feedback::Curvature => 0.8 * (2.0 * a - b).cos() * [2.0, -1.0][s],
                    Feedback::FactorAcross => -0.1 * (a * b).sin() * [b, a][s],
                };
            }
        }
        self.feedback(which, batch, values)
    }
}
