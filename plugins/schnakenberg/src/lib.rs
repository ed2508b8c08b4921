//! Schnakenberg kinetics: the simplest law with Turing patterns.
//!
//! ```text
//! ∂u/∂t = γ (a - u + u² v)      (+ D_u Δu, by the engine)
//! ∂v/∂t = γ (b - u² v)          (+ D_v Δv)
//! ```
//!
//! Steady at u = a + b, v = b/(a + b)². Reference: J. Schnakenberg, J. Theor. Biol. 81 (1979) 389,
//! doi:10.1016/0022-5193(79)90042-0; in this form J. D. Murray, Mathematical Biology II (2003), 2.4.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// The law with its parameters.
    pub struct Schnakenberg {
        a: 0.1, "1", "supply of u", at_least(0.0);
        b: 0.9, "1", "supply of v", at_least(0.0);
        gamma: 1.0, "1/time", "pace", above(0.0);
    }
}

impl Model for Schnakenberg {
    const ABOUT: About = about!(
        "org.rumple.schnakenberg",
        "du/dt = gamma (a - u + u^2 v), dv/dt = gamma (b - u^2 v). Schnakenberg (1979)."
    );
    const SPECIES: &'static [Species] =
        &[Species::new("u", "1", "activator"), Species::new("v", "1", "substrate")];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (u, v) = (at.species[0], at.species[1]);
        let made = u * u * v;
        rate[0] = (made - u + self.a) * self.gamma;
        rate[1] = (-made + self.b) * self.gamma;
        Ok(())
    }
}

export_plugin!(Schnakenberg);
