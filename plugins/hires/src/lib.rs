//! HIRES: the "high irradiance response" of plant growth to light, eight reactions.
//!
//! From (1, 0, 0, 0, 0, 0, 0, 0.0057). Reference: E. Schäfer, J. Math. Biol. 2 (1975) 41,
//! doi:10.1007/BF00276015; problem `hires` of the IVP test set.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// The law with its parameters.
    pub struct Hires {}
}

impl Model for Hires {
    const ABOUT: About = about!(
        "org.rumple.hires",
        "Eight species of phytochrome chemistry: a standard stiff problem. Schaefer (1975)."
    );
    const SPECIES: &'static [Species] = &[
        Species::new("y1", "1", "species 1").typical(0.001),
        Species::new("y2", "1", "species 2").typical(0.001),
        Species::new("y3", "1", "species 3").typical(0.001),
        Species::new("y4", "1", "species 4").typical(0.001),
        Species::new("y5", "1", "species 5").typical(0.001),
        Species::new("y6", "1", "species 6").typical(0.001),
        Species::new("y7", "1", "species 7").typical(0.001),
        Species::new("y8", "1", "species 8").typical(0.001),
    ];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let y = at.species;
        let bound = y[5] * y[7] * 280.0;
        rate[0] = -y[0] * 1.71 + y[1] * 0.43 + y[2] * 8.32 + 0.0007;
        rate[1] = y[0] * 1.71 - y[1] * 8.75;
        rate[2] = -y[2] * 10.03 + y[3] * 0.43 + y[4] * 0.035;
        rate[3] = y[1] * 8.32 + y[2] * 1.71 - y[3] * 1.12;
        rate[4] = -y[4] * 1.745 + y[5] * 0.43 + y[6] * 0.43;
        rate[5] = -bound + y[3] * 0.69 + y[4] * 1.71 - y[5] * 0.43 + y[6] * 0.69;
        rate[6] = bound - y[6] * 1.81;
        rate[7] = -bound + y[6] * 1.81;
        Ok(())
    }
}

export_plugin!(Hires);
