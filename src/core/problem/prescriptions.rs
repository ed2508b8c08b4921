//! Prescriptions of several effects at one place: refused where they contradict each other, in whatever order they come.
//!
//! | one effect | another |
//! | --- | --- |
//! | a position where the sheet starts, or displaced in time | another position |
//! | a value of a species (Dirichlet) | another value, or a flux through a boundary edge whose two ends have values (Neumann, Robin) |

use super::{Part, ProblemError};
use crate::effects::{Effect, Held, Pins, PrescribedDisplacement, TransportTerm};

/// What earlier effects prescribe.
#[derive(Default)]
pub(super) struct Prescriptions {
    /// Directions that are fixed where the sheet starts.
    fixed: Pins,
    displaced: Vec<PrescribedDisplacement>,
    held: Vec<Held>,
}

impl Prescriptions {
    /// Adds those of effect `number`.
    pub(super) fn add(
        &mut self,
        number: usize,
        effect: &Effect,
        until: f64,
    ) -> Result<(), ProblemError> {
        let mut fixed = effect.pins.clone().unwrap_or_default();
        if !fixed.is_empty() {
            effect.prescribed.iter().for_each(|displaced| displaced.take_from(&mut fixed));
        }
        self.check_positions(number, &fixed, &effect.prescribed, until)?;
        self.check_values(number, &effect.held)?;
        self.fixed.resize(self.fixed.len().max(fixed.len()), [false; 3]);
        for (all, more) in self.fixed.iter_mut().zip(&fixed) {
            (0..3).for_each(|a| all[a] |= more[a]);
        }
        self.displaced.extend_from_slice(&effect.prescribed);
        self.held.extend_from_slice(&effect.held);
        Ok(())
    }

    fn check_positions(
        &self,
        number: usize,
        fixed: &Pins,
        displaced: &[PrescribedDisplacement],
        until: f64,
    ) -> Result<(), ProblemError> {
        let refuse = |key: &str, (vertex, axis): (usize, usize), says: [&str; 2]| {
            let axis = ["x", "y", "z"][axis];
            let message =
                format!("an earlier pin {} vertex {vertex} along {axis}{}", says[0], says[1]);
            let help = "let the regions or the axes of the two differ";
            let part = Part::Effect(number, key.into());
            Err(ProblemError::new(part, message, Some(help)))
        };
        for new in displaced {
            let earlier = self.displaced.iter().find_map(|old| new.conflict(old, until));
            if let Some(place) = earlier {
                return refuse("displacement", place, ["moves", " to another place"]);
            }
            let earlier =
                (!self.fixed.is_empty()).then(|| new.leaves(&self.fixed, until)).flatten();
            if let Some(place) = earlier {
                return refuse("displacement", place, ["keeps", " where it starts"]);
            }
        }
        let earlier = |fixed: &Pins| self.displaced.iter().find_map(|old| old.leaves(fixed, until));
        match (!fixed.is_empty()).then(|| earlier(fixed)).flatten() {
            Some(place) => refuse(
                "where",
                place,
                ["moves", ", and this one, without a displacement, keeps it where it starts"],
            ),
            None => Ok(()),
        }
    }

    fn check_values(&self, number: usize, held: &[Held]) -> Result<(), ProblemError> {
        for new in held {
            if let Some(point) = self.held.iter().find_map(|old| new.conflict(old)) {
                let message = format!(
                    "an earlier effect holds the species at point {point} at another value"
                );
                let help = "let the regions of the two differ, or their values agree";
                let part = Part::Effect(number, "value".into());
                return Err(ProblemError::new(part, message, Some(help)));
            }
        }
        Ok(())
    }

    /// Refuses fluxes through boundary edges whose ends both have held values: nothing of them would flow.
    pub(super) fn check_fluxes(&self, transports: &[TransportTerm]) -> Result<(), ProblemError> {
        if self.held.is_empty() {
            return Ok(());
        }
        for transport in transports {
            let holds =
                |point: &usize| self.held.iter().any(|h| h.holds(transport.species(), *point));
            let found = transport.flux_edges().into_iter().find(|edge| edge.iter().all(holds));
            if let Some([a, b]) = found {
                let at =
                    if a == b { format!("triangle {a}") } else { format!("vertices {a} and {b}") };
                let name = transport.name();
                let message = format!(
                    "it prescribes the {name} through the boundary at {at}, where another effect holds the species"
                );
                let key = transport.speed_key();
                let help = format!(
                    "let the regions of the two differ, or set {key} to 0 there by regions"
                );
                let part = Part::Effect(transport.effect.unwrap_or_default(), "where".into());
                return Err(ProblemError::new(part, message, Some(&help)));
            }
        }
        Ok(())
    }
}
