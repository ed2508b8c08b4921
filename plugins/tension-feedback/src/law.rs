//! The law: in a file of its own, and its functions `inline`, for the engine's benchmark, which
//! compiles it in.

use rumple_plugin_sdk::prelude::*;

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

    #[inline]
    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (m, tension) = (at.species[0], at.signals[0].positive_part());
        let unbinding = (tension * -self.a).exp() * self.k_off;
        rate[0] = (S::one() - m) * self.k_on - unbinding * m;
        Ok(())
    }
}

impl LengthFactor for TensionFeedback {
    #[inline]
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        Ok(S::one() - species[0] * self.alpha)
    }
}
