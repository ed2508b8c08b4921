//! A plugin that misbehaves as its parameter `fault` says, at points where c > 0.5.

use rumple_plugin_sdk::prelude::*;

/// dc/dt = -c, but for the fault.
pub struct Misbehaving {
    fault: f64,
}

impl Parametric for Misbehaving {
    const PARAMETERS: &'static [Parameter] = &[Parameter::new("fault", "1", if cfg!(panics) { 10.0 } else { 0.0 }, "which")];

    fn from_parameters(p: &Parameters<'_>) -> Result<Self, Failure> {
        match p.get("fault")? {
            1.0 => panic!("no luck in create"),
            2.0 => Err(Failure::fatal("these do not go together")),
            3.0 => p.get("flaut").map(|fault| Self { fault }),
            fault => Ok(Self { fault }),
        }
    }
}

impl Model for Misbehaving {
    const ABOUT: About = About {
        id: "org.rumple.test.misbehaving",
        name: "misbehaving",
        version: "0.1.0",
        author: "The Rumple developers",
        licence: "MIT OR Apache-2.0",
        doc: "dc/dt = -c, but for a fault",
    };
    const SPECIES: &'static [Species] = &[Species::new("c", "1", "any")];
    const SIGNALS: &'static [Signal] = &[Signal::MEAN_CURVATURE];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let c = at.species[0];
        rate[0] = -c;
        if c.value() > 0.5 {
            match self.fault {
                10.0 => panic!("no luck with c = {}", c.value()),
                11.0 => rate[0] = S::from(f64::NAN),
                12.0 => rate[0] = S::from(f64::INFINITY),
                13.0 => rate[7] = c,
                14.0 => return Err(Failure::fatal("out of range")),
                15.0 => return Err(Failure::Retry { factor: 0.25, message: "too fast".into() }),
                16.0 => return Err(Failure::Retry { factor: -3.0, message: "ü".repeat(5000) }),
                17.0 => return Err(Failure::Unreliable("extrapolated".into())),
                18.0 => rate[0] = (c - 0.75).sqrt(),
                _ => {}
            }
        }
        Ok(())
    }
}

impl LengthFactor for Misbehaving {
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
        match self.fault {
            20.0 => Ok(S::one() - species[0]),
            21.0 => panic!("no luck with the length factor"),
            _ => Ok(S::one()),
        }
    }
}

export_plugin!(Misbehaving);
