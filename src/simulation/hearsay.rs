//! What laws have said or done in a run that goes on, told once each.

use super::{Setup, located};
use crate::Error;
use crate::kinetics::KineticsError;

/// What has been told already.
#[derive(Debug, Default)]
pub(super) struct Hearsay {
    unreliable: bool,
    bad: bool,
}

impl Hearsay {
    /// What is new after a step that was accepted, in words.
    pub(super) fn news(&mut self, setup: &mut Setup) -> Vec<String> {
        let Some(chemistry) = setup.system.chemistry() else { return Vec::new() };
        let heard = chemistry.heard();
        let mut news = Vec::new();
        if !self.unreliable
            && let Some(text) = heard.unreliable(chemistry.descriptor())
        {
            self.unreliable = true;
            news.push(text);
        }
        if !self.bad
            && let Some(bad) = heard.bad()
        {
            self.bad = true;
            let error = Error::Kinetics(KineticsError::BadOutput(Box::new(bad.clone())));
            let error = located(error, &setup.sheet, &setup.state.x);
            news.push(format!("{error}; this was in a try that has been given up for another"));
        }
        news
    }
}
