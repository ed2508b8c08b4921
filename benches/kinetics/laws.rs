//! Models I and II in this program: the plugins' laws as they stand there, and by hand.

use rumple::kinetics::{Batch, Column, Descriptor, Kinetics, Library, Outcome, PluginKinetics};
use rumple_plugin_sdk::Dual;
use rumple_plugin_sdk::prelude::*;

/// A plugin's own law in this program.
pub struct BuiltIn<M> {
    descriptor: Descriptor,
    parameters: Vec<f64>,
    model: M,
}

impl<M> std::fmt::Debug for BuiltIn<M> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("BuiltIn")
    }
}

impl<M: LengthFactor> BuiltIn<M> {
    pub fn new(plugin: &PluginKinetics) -> Self {
        let (descriptor, parameters) = (plugin.descriptor().clone(), plugin.parameters().to_vec());
        let model = M::from_parameters(&Parameters::new(&parameters)).expect("parameters");
        Self { descriptor, parameters, model }
    }

    #[inline(always)]
    fn rate<S: Scalar>(&self, c: S, x: S) -> S {
        let mut rate = [S::from(0.0)];
        let point = Point { species: &[c], signals: &[x] };
        self.model.rates(&point, &mut rate).expect("a rate");
        rate[0]
    }
}

impl<M: LengthFactor> Kinetics for BuiltIn<M> {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        let (c, x) = (plain(&batch.species[0], batch.count), plain(&batch.signals[0], batch.count));
        for (rate, (c, x)) in rates[0].iter_mut().zip(c.iter().zip(x)) {
            *rate = self.rate(*c, *x);
        }
        Ok(None)
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let (c, x) = (plain(&batch.species[0], batch.count), plain(&batch.signals[0], batch.count));
        let [by_c, by_x] = partials else { return Ok(None) };
        let slopes = by_c.iter_mut().zip(by_x.iter_mut());
        for ((rate, slopes), (c, x)) in rates[0].iter_mut().zip(slopes).zip(c.iter().zip(x)) {
            let found = self.rate(Dual::<2>::variable(*c, 0), Dual::variable(*x, 1));
            *rate = found.value;
            [*slopes.0, *slopes.1] = found.derivatives;
        }
        Ok(None)
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let c = plain(&batch.species[0], batch.count);
        for ((factor, slope), c) in factor.iter_mut().zip(partials[0].iter_mut()).zip(c) {
            let found = self.model.length_factor(&[Dual::<1>::variable(*c, 0)]).expect("a factor");
            *factor = found.value;
            [*slope] = found.derivatives;
        }
        Ok(None)
    }
}

/// Model I or II with derivatives by hand.
#[derive(Debug)]
pub struct ByHand {
    descriptor: Descriptor,
    parameters: Vec<f64>,
}

impl ByHand {
    pub fn new(library: &Library, parameters: &[f64]) -> Self {
        let descriptor = library.descriptor().clone();
        Self { descriptor, parameters: parameters.to_vec() }
    }

    /// Rate and its derivatives by species and signal.
    #[inline(always)]
    fn rate(&self, c: f64, signal: f64) -> (f64, f64, f64) {
        let up = if signal > 0.0 { signal } else { 0.0 };
        match self.parameters[..] {
            [w, beta, h_s, ..] if self.parameters.len() == 8 => {
                let share = h_s / (up + h_s);
                let slope = if signal > 0.0 { w * share * share } else { 0.0 };
                (w * up * share - beta * c, -beta, slope)
            }
            [k_on, k_off, a, _] => {
                let off = k_off * (-a * up).exp();
                let slope = if signal > 0.0 { a * off * c } else { 0.0 };
                (k_on * (1.0 - c) - off * c, -k_on - off, slope)
            }
            _ => (f64::NAN, f64::NAN, f64::NAN),
        }
    }

    /// Length factor and its derivative.
    #[inline(always)]
    fn factor(&self, c: f64) -> (f64, f64) {
        match self.parameters[..] {
            [_, _, _, b, c_star, most, least, reference] => {
                let x = b * (c - c_star);
                let e = (-x.abs()).exp();
                let low = if x > 0.0 { e / (1.0 + e) } else { 1.0 / (1.0 + e) };
                let lambda = least + (most - least) * low;
                let slope = -b * (most - least) * e / ((1.0 + e) * (1.0 + e));
                (reference / lambda, -reference / (lambda * lambda) * slope)
            }
            [_, _, _, alpha] => (1.0 - alpha * c, -alpha),
            _ => (f64::NAN, f64::NAN),
        }
    }
}

/// The values of a column, which are stored one after the other here.
fn plain<'a>(column: &Column<'a>, count: usize) -> &'a [f64] {
    column.contiguous(count).expect("contiguous values")
}

impl Kinetics for ByHand {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        let (c, x) = (plain(&batch.species[0], batch.count), plain(&batch.signals[0], batch.count));
        for (rate, (c, x)) in rates[0].iter_mut().zip(c.iter().zip(x)) {
            *rate = self.rate(*c, *x).0;
        }
        Ok(None)
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let (c, x) = (plain(&batch.species[0], batch.count), plain(&batch.signals[0], batch.count));
        let [by_c, by_x] = partials else { return Ok(None) };
        let slopes = by_c.iter_mut().zip(by_x.iter_mut());
        for ((rate, slopes), (c, x)) in rates[0].iter_mut().zip(slopes).zip(c.iter().zip(x)) {
            (*rate, *slopes.0, *slopes.1) = self.rate(*c, *x);
        }
        Ok(None)
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let c = plain(&batch.species[0], batch.count);
        for ((factor, slope), c) in factor.iter_mut().zip(partials[0].iter_mut()).zip(c) {
            (*factor, *slope) = self.factor(*c);
        }
        Ok(None)
    }
}

parameters! {
    /// The law with its parameters; symbols as in the equation.
    pub struct CurvatureFeedback {
        w: 15.0, "length/time", "production per upward curvature", at_least(0.0);
        beta: 1.0, "1/time", "decay", at_least(0.0);
        H_s: 0.05, "1/length", "curvature of half saturation", above(0.0);
        b: 100.0, "1", "steepness of the switch", at_least(0.0);
        c_star: 0.1, "1", "morphogen at half expansion", at_least(0.0);
        lambda_max: 1.0, "1", "Lambda without morphogen", above(0.0);
        lambda_min: 0.65, "1", "Lambda with much morphogen", above(0.0);
        lambda_0: 1.0, "1", "Lambda that leaves lengths as they are",
            default_of("lambda_max"), above(0.0);
    }
}

impl Model for CurvatureFeedback {
    const ABOUT: About = about!(
        "org.rumple.curvature-feedback",
        "dc/dt = w H+/(1 + H+/H_s) - beta c, lengths times lambda_0/Lambda(c). \
         Zakharov & Dasbiswas (2021), Model I."
    );
    const SPECIES: &'static [Species] =
        &[Species::new("c", "1", "morphogen").typical(0.1).range(0.0, f64::INFINITY)];
    const SIGNALS: &'static [Signal] = &[Signal::MEAN_CURVATURE.typical(0.01)];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (c, curvature) = (at.species[0], at.signals[0]);
        rate[0] = self.production(curvature) - c * self.beta;
        Ok(())
    }
}

impl CurvatureFeedback {
    /// w H⁺/(1 + H⁺/H_s), written so that H_s → ∞ and H → ∞ are harmless.
    fn production<S: Scalar>(&self, curvature: S) -> S {
        let upward = curvature.positive_part();
        upward * (S::from(self.H_s) / (upward + self.H_s)) * self.w
    }
}

impl LengthFactor for CurvatureFeedback {
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        let low = ((species[0] - self.c_star) * -self.b).logistic();
        let lambda = low * (self.lambda_max - self.lambda_min) + self.lambda_min;
        Ok(S::from(self.lambda_0) / lambda)
    }
}

parameters! {
    /// The law with its parameters; symbols as in the equation.
    pub struct TensionFeedback {
        k_on: 0.2, "1/time", "binding", at_least(0.0);
        k_off: 10.0, "1/time", "unbinding without tension", at_least(0.0);
        a: 1e-4, "length/force", "how much tension holds motors", at_least(0.0);
        alpha: 0.2, "1", "contraction of lengths at m = 1", at_least(0.0), below(1.0);
    }
}

impl Model for TensionFeedback {
    const ABOUT: About = about!(
        "org.rumple.tension-feedback",
        "dm/dt = k_on (1 - m) - k_off exp(-a tension+) m, lengths times 1 - alpha m. \
         Zakharov & Dasbiswas (2021), Model II."
    );
    const SPECIES: &'static [Species] =
        &[Species::new("m", "1", "bound fraction of the motor").range(0.0, 1.0)];
    const SIGNALS: &'static [Signal] = &[Signal::TENSION.typical(1e4)];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (m, tension) = (at.species[0], at.signals[0].positive_part());
        let unbinding = (tension * -self.a).exp() * self.k_off;
        rate[0] = (S::one() - m) * self.k_on - unbinding * m;
        Ok(())
    }
}

impl LengthFactor for TensionFeedback {
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        Ok(S::one() - species[0] * self.alpha)
    }
}
