//! Models I and II in this program: the plugins' laws as they stand there, and by hand.

use rumple::kinetics::{
    Batch, Column, Descriptor, Feedback, Kinetics, Outcome, PluginKinetics, Quantity,
};
use rumple_plugin_sdk::Dual;
use rumple_plugin_sdk::prelude::*;

#[path = "../../plugins/curvature-feedback/src/law.rs"]
pub mod curvature_feedback;

#[path = "../../plugins/tension-feedback/src/law.rs"]
pub mod tension_feedback;

/// A law of one species and one signal at one point.
pub trait AtPoint: Send + Sync {
    fn rate(&self, c: f64, x: f64) -> f64;

    /// With the derivatives by species and signal.
    fn rate_partials(&self, c: f64, x: f64) -> (f64, [f64; 2]);

    /// With the derivative by the species.
    fn factor_partials(&self, c: f64) -> (f64, [f64; 1]);
}

/// A plugin's own law.
pub struct BuiltIn<M>(M);

impl<M: LengthFactor> BuiltIn<M> {
    pub fn new(parameters: &[f64]) -> Self {
        Self(M::from_parameters(&Parameters::new(parameters)).expect("parameters"))
    }

    #[inline(always)]
    fn at<S: Scalar>(&self, c: S, x: S) -> S {
        let mut rate = [S::from(0.0)];
        self.0.rates(&Point { species: &[c], signals: &[x] }, &mut rate).expect("a rate");
        rate[0]
    }
}

impl<M: LengthFactor> AtPoint for BuiltIn<M> {
    #[inline(always)]
    fn rate(&self, c: f64, x: f64) -> f64 {
        self.at(c, x)
    }

    #[inline(always)]
    fn rate_partials(&self, c: f64, x: f64) -> (f64, [f64; 2]) {
        let found = self.at(Dual::variable(c, 0), Dual::variable(x, 1));
        (found.value, found.derivatives)
    }

    #[inline(always)]
    fn factor_partials(&self, c: f64) -> (f64, [f64; 1]) {
        let found = self.0.length_factor(&[Dual::variable(c, 0)]).expect("a factor");
        (found.value, found.derivatives)
    }
}

/// Model I with derivatives by hand; its parameters in the plugin's order.
pub struct CurvatureByHand(pub [f64; 8]);

impl AtPoint for CurvatureByHand {
    #[inline(always)]
    fn rate(&self, c: f64, curvature: f64) -> f64 {
        self.rate_partials(c, curvature).0
    }

    #[inline(always)]
    fn rate_partials(&self, c: f64, curvature: f64) -> (f64, [f64; 2]) {
        let [w, beta, h_s, ..] = self.0;
        let up = if curvature > 0.0 { curvature } else { 0.0 };
        let share = h_s / (up + h_s);
        let slope = if curvature > 0.0 { w * share * share } else { 0.0 };
        (w * up * share - beta * c, [-beta, slope])
    }

    #[inline(always)]
    fn factor_partials(&self, c: f64) -> (f64, [f64; 1]) {
        let [_, _, _, b, c_star, most, least, reference] = self.0;
        let x = b * (c - c_star);
        let e = (-x.abs()).exp();
        let low = if x > 0.0 { e / (1.0 + e) } else { 1.0 / (1.0 + e) };
        let lambda = least + (most - least) * low;
        let slope = -b * (most - least) * e / ((1.0 + e) * (1.0 + e));
        (reference / lambda, [-reference / (lambda * lambda) * slope])
    }
}

/// Model II with derivatives by hand.
pub struct TensionByHand(pub [f64; 4]);

impl AtPoint for TensionByHand {
    #[inline(always)]
    fn rate(&self, m: f64, tension: f64) -> f64 {
        self.rate_partials(m, tension).0
    }

    #[inline(always)]
    fn rate_partials(&self, m: f64, tension: f64) -> (f64, [f64; 2]) {
        let [k_on, k_off, a, _] = self.0;
        let off = k_off * (-a * if tension > 0.0 { tension } else { 0.0 }).exp();
        let slope = if tension > 0.0 { a * off * m } else { 0.0 };
        (k_on * (1.0 - m) - off * m, [-k_on - off, slope])
    }

    #[inline(always)]
    fn factor_partials(&self, m: f64) -> (f64, [f64; 1]) {
        let [.., alpha] = self.0;
        (1.0 - alpha * m, [-alpha])
    }
}

/// A law of this program as the engine sees laws: plain loops over columns.
pub struct InProgram<L> {
    descriptor: Descriptor,
    parameters: Vec<f64>,
    law: L,
}

impl<L> InProgram<L> {
    /// In place of a plugin.
    pub fn new(plugin: &PluginKinetics, law: L) -> Self {
        let (descriptor, parameters) = (plugin.descriptor().clone(), plugin.parameters().to_vec());
        Self { descriptor, parameters, law }
    }
}

impl<L> std::fmt::Debug for InProgram<L> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.descriptor.name)
    }
}

/// The values of a column, which are stored one after the other here.
fn plain<'a>(column: &Column<'a>, count: usize) -> &'a [f64] {
    column.contiguous(count).expect("contiguous values")
}

impl<L: AtPoint> Kinetics for InProgram<L> {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn evaluate(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let c = plain(&batch.species[0], batch.count);
        match (quantity, partials) {
            (Quantity::Rates, []) => {
                let x = plain(&batch.signals[0], batch.count);
                for (rate, (c, x)) in values[0].iter_mut().zip(c.iter().zip(x)) {
                    *rate = self.law.rate(*c, *x);
                }
            }
            (Quantity::Rates, [by_c, by_x]) => {
                let x = plain(&batch.signals[0], batch.count);
                let slopes = by_c.iter_mut().zip(by_x.iter_mut());
                let at = values[0].iter_mut().zip(slopes);
                for ((rate, slopes), (c, x)) in at.zip(c.iter().zip(x)) {
                    (*rate, [*slopes.0, *slopes.1]) = self.law.rate_partials(*c, *x);
                }
            }
            (Quantity::Feedback(Feedback::LengthFactor), [by_c]) => {
                for ((factor, slope), c) in values[0].iter_mut().zip(by_c.iter_mut()).zip(c) {
                    (*factor, [*slope]) = self.law.factor_partials(*c);
                }
            }
            (other, partials) => other.write_neutral(values, partials),
        }
        Ok(None)
    }
}
