//! Prescriptions of several effects at one place: refused where they contradict each other, in whatever order they come.
//!
//! | one effect | another |
//! | --- | --- |
//! | a position where the sheet starts, or displaced in time | another position |
//! | a value of a species (Dirichlet) | another value, or a flux through a boundary edge whose two ends have values (Neumann, Robin) |

use super::{ProblemError, ProblemPart};
use crate::effects::{DirichletValues, Effect, Pins, PrescribedDisplacement, TransportTerm};
use crate::kinetics::{Descriptor, Location, Species};
use crate::num::Short;

/// What earlier effects prescribe, by their numbers.
#[derive(Default)]
pub(super) struct Prescriptions {
    /// Directions that are fixed where the sheet starts.
    fixed: Vec<(usize, Pins)>,
    displaced: Vec<(usize, PrescribedDisplacement)>,
    held: Vec<(usize, DirichletValues)>,
}

impl Prescriptions {
    /// Adds those of effect `number`, of the species of `law`, until the time `until`.
    pub(super) fn add(
        &mut self,
        number: usize,
        effect: &Effect,
        (law, until): (Option<(&Descriptor, Location)>, f64),
    ) -> Result<(), ProblemError> {
        let mut fixed = effect.pins.clone().unwrap_or_default();
        if !fixed.is_empty() {
            effect.prescribed.iter().for_each(|displaced| displaced.take_from(&mut fixed));
            self.fixed.push((number, fixed));
        }
        self.displaced.extend(effect.prescribed.iter().map(|new| (number, new.clone())));
        self.check_positions(number, until)?;
        for new in &effect.held {
            if let Some(law) = law {
                check_range(number, new, law, until)?;
            }
            let conflict =
                |(old, held): &(usize, DirichletValues)| Some((*old, new.conflict(held, until)?));
            if let Some((old, point)) = self.held.iter().find_map(conflict) {
                let message =
                    format!("effect[{old}] holds the species at point {point} at another value");
                let help = "let the regions of the two differ, or their values agree";
                let part = ProblemPart::Effect(number, "value".into());
                return Err(ProblemError::new(part, message, Some(help)));
            }
        }
        self.held.extend(effect.held.iter().map(|new| (number, new.clone())));
        Ok(())
    }

    /// Compares the positions that the last effect, of this number, prescribes with those of all.
    fn check_positions(&self, number: usize, until: f64) -> Result<(), ProblemError> {
        let refuse = |key: &str, other: usize, (vertex, axis): (usize, usize), says: [&str; 2]| {
            let (axis, [verb, place]) = (["x", "y", "z"][axis], says);
            let message = format!("effect[{other}] {verb} vertex {vertex} along {axis} {place}");
            let help = "let the regions or the axes of the two differ";
            let part = ProblemPart::Effect(number, key.into());
            Err(ProblemError::new(part, message, Some(help)))
        };
        let (own, kept) =
            ("where it starts", "and this pin, without a displacement, keeps it there");
        let is_last = |other: &usize| *other == number;
        for (one, new) in &self.displaced {
            let earlier =
                self.displaced.iter().filter(|(other, _)| is_last(one) && !is_last(other));
            for (other, old) in earlier {
                if let Some(place) = new.conflict(old, until) {
                    return refuse("displacement", *other, place, ["moves", "to another place"]);
                }
            }
            let pairs = self.fixed.iter().filter(|(other, _)| is_last(one) != is_last(other));
            for (other, fixed) in pairs {
                match new.leaves(fixed, until) {
                    Some(place) if is_last(one) => {
                        return refuse("displacement", *other, place, ["keeps", own]);
                    }
                    Some(place) => return refuse("where", *one, place, ["moves", kept]),
                    None => {}
                }
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
            let by = |point: usize| {
                let holds =
                    |(_, held): &&(usize, DirichletValues)| held.holds(transport.species(), point);
                self.held.iter().find(holds).map(|(other, _)| *other)
            };
            let held = |[a, b]: [usize; 2]| Some(([a, b], by(a)?, by(b)?));
            if let Some(([a, b], other, _)) = transport.flux_edges().into_iter().find_map(held) {
                let at =
                    if a == b { format!("triangle {a}") } else { format!("vertices {a} and {b}") };
                let name = transport.name();
                let message = format!(
                    "it prescribes the {name} through the boundary at {at}, where effect[{other}] holds the species"
                );
                let key = transport.speed_key();
                let help = format!(
                    "let the regions of the two differ, or set {key} to 0 there by regions"
                );
                let part =
                    ProblemPart::Effect(transport.effect.unwrap_or_default(), "where".into());
                return Err(ProblemError::new(part, message, Some(&help)));
            }
        }
        Ok(())
    }
}

/// Refuses values of effect `number` that the law is not valid for at a time up to `until`.
fn check_range(
    number: usize,
    held: &DirichletValues,
    (law, location): (&Descriptor, Location),
    until: f64,
) -> Result<(), ProblemError> {
    let Species { name, lower, upper, .. } = &law.species[held.species()];
    let Some((point, value, time)) = held.out_of_range((*lower, *upper), until) else {
        return Ok(());
    };
    let (noun, time) = (location.noun(), Short(time));
    let message = format!("it holds {name} at {value} at {noun} {point} at time {time}");
    let help = format!("this species is valid from {lower} to {upper}");
    Err(ProblemError::new(ProblemPart::Effect(number, "value".into()), message, Some(&help)))
}
