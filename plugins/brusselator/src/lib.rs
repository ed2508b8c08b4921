//! The Brusselator: oscillations and Turing patterns.
//!
//! ```text
//! ∂u/∂t = a - (b + 1) u + u² v      (+ diffusion, by the engine)
//! ∂v/∂t = b u - u² v
//! ```
//!
//! Steady at u = a, v = b/a, which oscillates for b > 1 + a². Reference: I. Prigogine and R. Lefever,
//! J. Chem. Phys. 48 (1968) 1695, doi:10.1063/1.1668896.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// The law with its parameters.
    pub struct Brusselator {
        a: 1.0, "1", "supply", at_least(0.0);
        b: 3.0, "1", "conversion", at_least(0.0);
    }
}

impl Model for Brusselator {
    const ABOUT: About = about!(
        "org.rumple.brusselator",
        "du/dt = a - (b+1) u + u^2 v, dv/dt = b u - u^2 v. Prigogine & Lefever (1968)."
    );
    const SPECIES: &'static [Species] = &[
        Species::new("u", "1", "first intermediate"),
        Species::new("v", "1", "second intermediate"),
    ];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (u, v) = (at.species[0], at.species[1]);
        let made = u * u * v;
        rate[0] = made - u * (self.b + 1.0) + self.a;
        rate[1] = u * self.b - made;
        Ok(())
    }
}

export_plugin!(Brusselator);
