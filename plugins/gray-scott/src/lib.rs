//! The Gray-Scott model: spots that divide, stripes, mazes.
//!
//! ```text
//! ∂u/∂t = -u v² + F (1 - u)      (+ diffusion, by the engine)
//! ∂v/∂t = u v² - (F + k) v
//! ```
//!
//! Reference: J. E. Pearson, Science 261 (1993) 189, doi:10.1126/science.261.5118.189.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// The law with its parameters.
    pub struct GrayScott {
        feed: 0.04, "1/time", "feed rate F", at_least(0.0);
        kill: 0.06, "1/time", "removal rate k", at_least(0.0);
    }
}

impl Model for GrayScott {
    const ABOUT: About = about!(
        "org.rumple.gray-scott",
        "du/dt = -u v^2 + feed (1 - u), dv/dt = u v^2 - (feed + kill) v. Pearson (1993)."
    );
    const SPECIES: &'static [Species] =
        &[Species::new("u", "1", "substrate"), Species::new("v", "1", "autocatalyst")];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (u, v) = (at.species[0], at.species[1]);
        let made = u * v * v;
        rate[0] = -made + (-u + 1.0) * self.feed;
        rate[1] = made - v * (self.feed + self.kill);
        Ok(())
    }
}

export_plugin!(GrayScott);
