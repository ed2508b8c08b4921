//! The law: in a file of its own, and its functions `inline`, for the engine's benchmark, which
//! compiles it in.

use rumple_plugin_sdk::prelude::*;

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

    #[inline]
    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (c, curvature) = (at.species[0], at.signals[0]);
        rate[0] = self.production(curvature) - c * self.beta;
        Ok(())
    }
}

impl CurvatureFeedback {
    /// w H⁺/(1 + H⁺/H_s), written so that H_s → ∞ and H → ∞ are harmless.
    #[inline]
    fn production<S: Scalar>(&self, curvature: S) -> S {
        let upward = curvature.positive_part();
        upward * (S::from(self.H_s) / (upward + self.H_s)) * self.w
    }
}

impl Observables for CurvatureFeedback {
    const OBSERVABLES: &'static [Observable] =
        &[Observable::new("production", "1/time", "what upward curvature makes of the morphogen")];

    fn observe(&self, at: &Point<'_, f64>, out: &mut [f64]) -> Result<(), Failure> {
        out[0] = self.production(at.signals[0]);
        Ok(())
    }
}

impl LengthFactor for CurvatureFeedback {
    #[inline]
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        let low = ((species[0] - self.c_star) * -self.b).logistic();
        let lambda = low * (self.lambda_max - self.lambda_min) + self.lambda_min;
        Ok(S::from(self.lambda_0) / lambda)
    }
}
