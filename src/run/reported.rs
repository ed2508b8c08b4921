//! What laws have flagged or done wrong in a run that goes on, reported once each.

use super::{Error, Simulation, located};
use crate::kinetics::KineticsError;

/// What has been reported already.
#[derive(Debug, Default)]
pub(super) struct Reported {
    unreliable: bool,
    bad: bool,
    energy: bool,
}

impl Reported {
    /// What is new after a step that was accepted, in words.
    pub(super) fn new_faults(&mut self, simulation: &Simulation) -> Vec<String> {
        let mut news = Vec::new();
        if !self.energy
            && let (_, Some((effect, time))) = simulation.model().mechanics().not_finite()
        {
            self.energy = true;
            news.push(format!(
                "the energy or a force of the effect {effect} was not a finite number on the way at time \
                 {time}; the try was made shorter"
            ));
        }
        let Some(chemistry) = simulation.model().chemistry() else { return news };
        let flagged = chemistry.flagged();
        if !self.unreliable
            && let Some(text) = flagged.unreliable(chemistry.descriptor())
        {
            self.unreliable = true;
            news.push(text);
        }
        if !self.bad
            && let Some(bad) = flagged.bad()
        {
            self.bad = true;
            let error = Error::Kinetics(KineticsError::BadOutput(Box::new(bad.clone())));
            let error = located(error, simulation.sheet(), &simulation.state.x);
            news.push(format!("{error}; this was in a rejected step"));
        }
        news
    }
}
