//! Several laws on one sheet: their species side by side, their rates added, their length factors
//! multiplied, their spontaneous curvatures added.
//!
//! ```text
//! dc/dt = Σ_k R^k(c, x)        Φ = Π_k Φ^k(c)        C₀ = Σ_k C₀^k(c)
//! ```
//!
//! A law takes part with the species that it declares. One that two laws share is the same
//! concentration for both: a law that only reads it gives it no rate.

mod evaluation;
mod species;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use self::species::{known_names, not_shared, share, taken};
use super::descriptor::{Capabilities, Descriptor, Species, among, unite};
use super::{Feedback, Kinetics};

/// One law of several.
#[derive(Debug)]
pub struct Member {
    /// The law.
    pub kinetics: Arc<dyn Kinetics>,
    /// Other names for its species and observables.
    pub rename: BTreeMap<String, String>,
    /// Species, by their new names, that are those of an earlier law.
    pub shared: Vec<String>,
}

/// Why laws do not go together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointError {
    /// Number of the law.
    pub member: usize,
    /// What of it is to blame: `rename.c`, `shared`, or nothing.
    pub key: String,
    /// What is wrong.
    pub message: String,
}

/// Several laws as one.
#[derive(Debug)]
pub struct JointKinetics {
    descriptor: Descriptor,
    parameters: Vec<f64>,
    members: Vec<Part>,
}

/// One law, with the numbers of its columns among all.
#[derive(Debug, Clone)]
struct Part {
    kinetics: Arc<dyn Kinetics>,
    species: Vec<usize>,
    signals: Vec<usize>,
    parameters: Range<usize>,
    observables: Range<usize>,
    /// As `signals`, for these.
    observed: Vec<usize>,
}

impl JointKinetics {
    /// Joins laws; the first one's name and location stand for all.
    ///
    /// # Errors
    /// A name that is used twice without being shared, or given to nothing.
    pub fn new(members: Vec<Member>) -> Result<Self, JointError> {
        let mut joint = Self {
            descriptor: Descriptor {
                capabilities: Capabilities { parameter_fields: true, ..Capabilities::default() },
                ..Descriptor::named("joint", "")
            },
            parameters: Vec::new(),
            members: Vec::new(),
        };
        for (number, member) in members.into_iter().enumerate() {
            let blame = |(key, message)| JointError { member: number, key, message };
            joint.add(member).map_err(blame)?;
        }
        joint.connect();
        joint.check_factors()?;
        Ok(joint)
    }

    /// Adds a law; species and observables under their new names.
    ///
    /// # Errors
    /// A key of the law's table, and what is wrong with it.
    fn add(&mut self, member: Member) -> Result<(), (String, String)> {
        let Member { kinetics, rename, shared } = member;
        let own = kinetics.descriptor();
        known_names(own, &rename)?;
        let renamed = |name: &String| rename.get(name).unwrap_or(name).clone();
        let species = self.add_species(own, renamed, &shared)?;
        let observables = self.add_observables(own, renamed)?;
        let all = &mut self.descriptor;
        unite(&mut all.signals, &own.signals);
        unite(&mut all.observed, &own.observed);
        if !all.name.is_empty() {
            all.name.push_str(" + ");
        }
        all.name.push_str(&own.name);
        let first = all.parameters.len();
        all.parameters.extend(own.parameters.iter().cloned());
        let parameters = first..all.parameters.len();
        self.parameters.extend(kinetics.parameters());
        all.capabilities.rate_partials = true;
        for which in Feedback::ALL {
            if which.is_given(&own.capabilities) {
                which.give(&mut all.capabilities);
            }
        }
        let (signals, observed) = (Vec::new(), Vec::new());
        self.members.push(Part { kinetics, species, signals, parameters, observables, observed });
        Ok(())
    }

    /// Adds the species of a law, those in `shared` by uniting them with an earlier law's; returns their numbers.
    fn add_species(
        &mut self,
        own: &Descriptor,
        renamed: impl Fn(&String) -> String,
        shared: &[String],
    ) -> Result<Vec<usize>, (String, String)> {
        let all = &mut self.descriptor;
        let mut species = Vec::new();
        let before = all.species.len();
        for one in &own.species {
            let name = renamed(&one.name);
            let is_shared = shared.contains(&name);
            match all.species_index(&name) {
                Some(number) if number >= before => {
                    let key = format!("rename.{}", one.name);
                    return Err((key, format!("this would give the law two species `{name}`")));
                }
                Some(number) if is_shared => {
                    share(&mut all.species[number], one)?;
                    species.push(number);
                }
                Some(_) => return Err(taken(own, one, &name)),
                None if is_shared => return Err(not_shared(all, &name)),
                None => {
                    species.push(all.species.len());
                    all.species.push(Species { name, ..one.clone() });
                }
            }
        }
        let names: Vec<String> = own.species.iter().map(|s| renamed(&s.name)).collect();
        if let Some(name) = shared.iter().find(|name| !names.contains(name)) {
            let message =
                format!("`{}` has no species `{name}`; it has {}", own.name, names.join(", "));
            return Err(("shared".into(), message));
        }
        Ok(species)
    }

    /// Adds the observables of a law; returns their range among all.
    fn add_observables(
        &mut self,
        own: &Descriptor,
        renamed: impl Fn(&String) -> String,
    ) -> Result<Range<usize>, (String, String)> {
        let all = &mut self.descriptor;
        let first = all.observables.len();
        for one in &own.observables {
            let name = renamed(&one.name);
            if all.observables.iter().any(|o| o.name == name) || all.species_index(&name).is_some()
            {
                let message = format!(
                    "the name `{name}` is taken by an earlier law: rename = {{ {} = \"…\" }}",
                    one.name
                );
                return Err((String::new(), message));
            }
            all.observables.push(super::Observable { name, ..one.clone() });
        }
        Ok(first..all.observables.len())
    }

    /// Refuses length factors in all directions beside others along and across a fibre.
    fn check_factors(&self) -> Result<(), JointError> {
        let across = |part: &Part| part.gives(Feedback::FactorAcross);
        let wrong = |part: &Part| part.gives(Feedback::LengthFactor) && !across(part);
        let any = self.members.iter().any(across);
        match self.members.iter().position(wrong).filter(|_| any) {
            None => Ok(()),
            Some(member) => {
                let message = "another law of the scene has a length factor across the fibre, and this one has none"
                    .to_owned();
                Err(JointError { member, key: "length_factor".into(), message })
            }
        }
    }

    /// Finds the columns of every member's signals among all, now that all are known.
    fn connect(&mut self) {
        for part in &mut self.members {
            let own = part.kinetics.descriptor();
            part.signals = among(&self.descriptor.signals, &own.signals);
            part.observed = among(&self.descriptor.observed, &own.observed);
        }
    }
}
