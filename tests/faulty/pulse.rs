//! A plugin that reads the time: a pulse that no derivative shows.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// dc/dt = 1 from `from` to `until`, 0 before and after; with `only`, no value at later times.
    pub struct Pulse {
        from: 50.25, "time", "its begin";
        until: 52.0, "time", "its end";
        only: 1e300, "time", "end of the times that it knows";
    }
}

impl Model for Pulse {
    const ABOUT: About = About {
        id: "org.rumple.test.pulse",
        name: "pulse",
        version: "0.1.0",
        author: "The Rumple developers",
        licence: "MIT OR Apache-2.0",
        doc: "dc/dt = 1 for a while",
    };
    const SPECIES: &'static [Species] = &[Species::new("c", "1", "any")];
    const SIGNALS: &'static [Signal] = &[Signal::TIME];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let t = at.signals[0].value();
        if t > self.only {
            return Err(Failure::Retry { factor: 0.5, message: "too late".into() });
        }
        rate[0] = S::from(if t > self.from && t < self.until { 1.0 } else { 0.0 });
        Ok(())
    }
}

export_plugin!(Pulse);
