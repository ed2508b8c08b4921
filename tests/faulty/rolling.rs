//! A plugin whose species roll the sheet up and make it grow along a fibre and across it; not faulty.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// dc/dt = 1, dd/dt = -d; C₀ = k c d, Φ = 1 + 0.1 c, Φ⊥ = 1 + 0.2 d².
    pub struct Rolling {
        k: 0.5, "1/length", "spontaneous curvature at c = d = 1";
    }
}

impl Model for Rolling {
    const ABOUT: About = About {
        id: "org.rumple.test.rolling",
        name: "rolling",
        version: "0.1.0",
        author: "The Rumple developers",
        licence: "MIT OR Apache-2.0",
        doc: "C0 = k c d",
    };
    const SPECIES: &'static [Species] =
        &[Species::new("c", "1", "rolls"), Species::new("d", "1", "rolls too")];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        rate[0] = S::one();
        rate[1] = -at.species[1];
        Ok(())
    }
}

impl LengthFactor for Rolling {
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        Ok(species[0] * 0.1 + 1.0)
    }
}

#[cfg(across)]
impl LengthFactorAcross for Rolling {
    fn length_factor_across<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        Ok(species[1] * species[1] * 0.2 + 1.0)
    }
}

impl SpontaneousCurvature for Rolling {
    fn curvature<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        Ok(species[0] * species[1] * self.k)
    }
}

export_plugin!(Rolling);
