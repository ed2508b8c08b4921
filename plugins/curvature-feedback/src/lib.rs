//! Model I: upward curvature makes a morphogen that expands the sheet.
//!
//! ```text
//! ∂c/∂t = w H⁺/(1 + H⁺/H_s) - β c        H⁺ = max(H, 0)      (+ D Δc, by the engine)
//! l̄     = Φ(c) l⁰                        Φ  = Λ⁰/Λ(c)
//! Λ(c)  = (Λ_max e^{b c*} + Λ_min e^{b c})/(e^{b c*} + e^{b c})
//!       = Λ_min + (Λ_max - Λ_min)/(1 + e^{b (c - c*)})
//! ```
//!
//! c is the morphogen, in units of its own (so `c`, `c*` and `b` carry no unit); H the mean
//! curvature, 1/length, positive at the top of a bump towards the normal; l⁰ and l̄ the rest and
//! optimal length of a bond. The steady maximum is c = w H_s/β. With Λ⁰ = Λ_max (the default) the
//! sheet at c = 0 is strained by (1 - Λ_min/Λ_max) e^{-b c*}; Λ⁰ = Λ(0) makes it exactly free of
//! stress.
//!
//! Reference: A. Zakharov and K. Dasbiswas, Modeling mechanochemical pattern formation in elastic
//! sheets of biological matter, 2021. The saturation is printed there as w H Θ(H)/(1 + H/H_s); the
//! form with H⁺ is the same but has no 0·∞ at H = -H_s.

use rumple_plugin_sdk::prelude::*;

/// The law with its parameters; symbols as in the equation.
pub struct CurvatureFeedback {
    w: f64,
    beta: f64,
    h_s: f64,
    b: f64,
    c_star: f64,
    lambda_max: f64,
    lambda_min: f64,
    lambda_0: f64,
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
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::new("w", "length/time", 15.0, "production per upward curvature").at_least(0.0),
        Parameter::new("beta", "1/time", 1.0, "decay").at_least(0.0),
        Parameter::new("H_s", "1/length", 0.05, "curvature of half saturation").above(0.0),
        Parameter::new("b", "1", 100.0, "steepness of the switch").at_least(0.0),
        Parameter::new("c_star", "1", 0.1, "morphogen at half expansion").at_least(0.0),
        Parameter::new("lambda_max", "1", 1.0, "Lambda without morphogen").above(0.0),
        Parameter::new("lambda_min", "1", 0.65, "Lambda with much morphogen").above(0.0),
        Parameter::new("lambda_0", "1", 1.0, "Lambda that leaves lengths as they are")
            .default_of("lambda_max")
            .above(0.0),
    ];

    fn new(p: &Parameters<'_>) -> Result<Self, Failure> {
        Ok(Self {
            w: p.get("w")?,
            beta: p.get("beta")?,
            h_s: p.get("H_s")?,
            b: p.get("b")?,
            c_star: p.get("c_star")?,
            lambda_max: p.get("lambda_max")?,
            lambda_min: p.get("lambda_min")?,
            lambda_0: p.get("lambda_0")?,
        })
    }

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (c, upward) = (at.species[0], at.signals[0].positive_part());
        let unsaturated = S::from(self.h_s) / (upward + self.h_s);
        rate[0] = upward * unsaturated * self.w - c * self.beta;
        Ok(())
    }
}

impl LengthFactor for CurvatureFeedback {
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        let low = ((species[0] - self.c_star) * -self.b).logistic();
        let lambda = low * (self.lambda_max - self.lambda_min) + self.lambda_min;
        Ok(S::from(self.lambda_0) / lambda)
    }
}

export_plugin!(CurvatureFeedback);
