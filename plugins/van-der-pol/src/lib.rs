//! The van der Pol oscillator in the scaling of the IVP test set.
//!
//! ```text
//! dy1/dt = y2
//! dy2/dt = ((1 - y1²) y2 - y1)/ε
//! ```
//!
//! Stiff for small ε: relaxation oscillations with a period of about 1.6. Reference: E. Hairer and
//! G. Wanner, Solving Ordinary Differential Equations II (1996), IV.1.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// The law with its parameters.
    pub struct VanDerPol {
        epsilon: 1e-6, "time", "stiffness", above(0.0);
    }
}

impl Model for VanDerPol {
    const ABOUT: About = about!(
        "org.rumple.van-der-pol",
        "dy1/dt = y2, dy2/dt = ((1 - y1^2) y2 - y1)/epsilon. Hairer & Wanner (1996)."
    );
    const SPECIES: &'static [Species] =
        &[Species::new("y1", "1", "position"), Species::new("y2", "1/time", "velocity")];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (y1, y2) = (at.species[0], at.species[1]);
        rate[0] = y2;
        rate[1] = ((-y1 * y1 + 1.0) * y2 - y1) * (1.0 / self.epsilon);
        Ok(())
    }
}

export_plugin!(VanDerPol);
