//! Several laws on one sheet: their species side by side, their rates added, their length factors
//! multiplied, their spontaneous curvatures added.
//!
//! ```text
//! dc/dt = Σ_k R^k(c, x)        Φ = Π_k Φ^k(c)        C₀ = Σ_k C₀^k(c)
//! ```
//!
//! A law takes part with the species that it declares. One that two laws share is the same
//! concentration for both: a law that only reads it gives it no rate.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use super::batch::{Batch, Column};
use super::descriptor::{Capabilities, Descriptor, FORMULA, Species, among, unite};
use super::field::Columns;
use super::{Feedback, Kinetics, KineticsError, Outcome};
use rumple_numerics::num::all_finite_from;

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
                id: "joint".into(),
                name: String::new(),
                version: String::new(),
                author: String::new(),
                licence: String::new(),
                doc: String::new(),
                species: Vec::new(),
                parameters: Vec::new(),
                signals: Vec::new(),
                observables: Vec::new(),
                observed: Vec::new(),
                capabilities: Capabilities { parameter_fields: true, ..Capabilities::default() },
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
        all.capabilities.length_factor |= own.capabilities.length_factor;
        all.capabilities.length_factor_partials = all.capabilities.length_factor;
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
        let wrong = |part: &Part| part.gives_length_factor() && !across(part);
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

/// Refuses to rename what the law does not have.
fn known_names(
    own: &Descriptor,
    rename: &BTreeMap<String, String>,
) -> Result<(), (String, String)> {
    let species = own.species.iter().map(|s| s.name.as_str());
    let known: Vec<&str> = species.chain(own.observables.iter().map(|o| o.name.as_str())).collect();
    let Some(name) = rename.keys().find(|name| !known.contains(&name.as_str())) else {
        return Ok(());
    };
    let message = format!("`{}` has no `{name}`; it has {}", own.name, known.join(", "));
    Err((format!("rename.{name}"), message))
}

/// Error of a law whose species `one`, as `name`, is an earlier law's without being shared.
fn taken(own: &Descriptor, one: &Species, name: &str) -> (String, String) {
    let other = if own.id.starts_with(FORMULA) {
        "give it another name here".to_owned()
    } else {
        format!("rename = {{ {} = \"…\" }}", one.name)
    };
    let message = format!(
        "the species `{name}` belongs to an earlier law already; if it is the same concentration, say \
         shared = [\"{name}\"], else {other}"
    );
    (String::new(), message)
}

/// Error of a law that shares a species `name` no earlier law has.
fn not_shared(all: &Descriptor, name: &str) -> (String, String) {
    let names: Vec<&str> = all.species.iter().map(|s| s.name.as_str()).collect();
    let there = if names.is_empty() {
        "this is the first law: the later one says `shared`".to_owned()
    } else {
        format!("there are {}", names.join(", "))
    };
    ("shared".into(), format!("no earlier law has a species `{name}`; {there}"))
}

/// What two laws say of one species: a range that suits both.
fn share(known: &mut Species, other: &Species) -> Result<(), (String, String)> {
    // "1" is also what a law says that does not care.
    if known.unit == "1" {
        known.unit.clone_from(&other.unit);
    } else if other.unit != "1" && other.unit != known.unit {
        let message = format!(
            "the species `{}` is in {} here, and in {} in an earlier law",
            known.name, other.unit, known.unit
        );
        return Err(("shared".into(), message));
    }
    known.lower = known.lower.max(other.lower);
    known.upper = known.upper.min(other.upper);
    if known.lower >= known.upper {
        let message = format!(
            "no value of `{}` is valid for both this law and an earlier \
            one",
            known.name
        );
        return Err(("shared".into(), message));
    }
    Ok(())
}

impl Part {
    /// Hands this law's view of the inputs to `evaluate`.
    fn with_inputs<R>(&self, batch: &Batch<'_>, evaluate: impl FnOnce(&Batch<'_>) -> R) -> R {
        self.with_signals(&self.signals, batch, evaluate)
    }

    fn with_signals<R>(
        &self,
        signals: &[usize],
        batch: &Batch<'_>,
        evaluate: impl FnOnce(&Batch<'_>) -> R,
    ) -> R {
        let species = take(&self.species, batch.species);
        let signals = take(signals, batch.signals);
        let parameters = batch.parameters.get(self.parameters.clone()).unwrap_or(&[]);
        evaluate(&Batch { species: &species, signals: &signals, parameters, ..*batch })
    }
}

/// The columns of these numbers.
fn take<'a>(numbers: &[usize], columns: &[Column<'a>]) -> Vec<Column<'a>> {
    numbers.iter().filter_map(|number| columns.get(*number).copied()).collect()
}

fn add(to: &mut [f64], values: &[f64]) {
    to.iter_mut().zip(values).for_each(|(to, value)| *to += value);
}

impl Kinetics for JointKinetics {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        rates.iter_mut().for_each(|column| column.fill(0.0));
        let mut warning = None;
        for part in &self.members {
            let mut own = Columns::new(part.species.len(), batch.count);
            let outcome =
                part.with_inputs(batch, |b| part.kinetics.rates(b, &mut own.slices_mut()))?;
            warning = warning.or(outcome);
            for (row, &species) in part.species.iter().enumerate() {
                add(rates[species], own.column(row));
            }
        }
        Ok(warning)
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        rates.iter_mut().for_each(|column| column.fill(0.0));
        partials.iter_mut().for_each(|column| column.fill(0.0));
        let (all, width) = (self.descriptor.species.len(), self.descriptor.inputs());
        let mut warning = None;
        for part in &self.members {
            let (n, inputs) = (part.species.len(), part.kinetics.descriptor().inputs());
            let mut own = Columns::new(n, batch.count);
            let mut slopes = Columns::new(n * inputs, batch.count);
            let outcome = part.with_inputs(batch, |b| {
                part.kinetics.rate_partials(b, &mut own.slices_mut(), &mut slopes.slices_mut())
            })?;
            warning = warning.or(outcome);
            let signals = part.signals.iter().map(|column| all + column);
            let columns: Vec<usize> = part.species.iter().copied().chain(signals).collect();
            for (row, &species) in part.species.iter().enumerate() {
                add(rates[species], own.column(row));
                for (input, &column) in columns.iter().enumerate() {
                    add(partials[species * width + column], slopes.column(row * inputs + input));
                }
            }
        }
        Ok(warning)
    }

    fn length_factor(&self, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
        factor.fill(1.0);
        let mut own = vec![1.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives_length_factor()) {
            let outcome = part.with_inputs(batch, |b| part.kinetics.length_factor(b, &mut own))?;
            warning = warning.or(outcome);
            factor.iter_mut().zip(&own).for_each(|(all, own)| *all *= own);
        }
        Ok(warning)
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        factor.fill(1.0);
        partials.iter_mut().for_each(|column| column.fill(0.0));
        let mut own = vec![1.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives_length_factor()) {
            let mut slopes = Columns::new(part.species.len(), batch.count);
            let outcome = part.with_inputs(batch, |b| {
                part.kinetics.length_factor_partials(b, &mut own, &mut slopes.slices_mut())
            })?;
            warning = warning.or(outcome);
            // (Φ Ψ)' = Φ' Ψ + Φ Ψ'
            for column in partials.iter_mut() {
                column.iter_mut().zip(&own).for_each(|(slope, own)| *slope *= own);
            }
            for (row, &species) in part.species.iter().enumerate() {
                let more = slopes.column(row).iter().zip(factor.iter());
                let column = partials[species].iter_mut();
                column.zip(more).for_each(|(slope, (own, before))| *slope += own * before);
            }
            factor.iter_mut().zip(&own).for_each(|(all, own)| *all *= own);
        }
        Ok(warning)
    }

    fn feedback(&self, which: Feedback, batch: &Batch<'_>, values: &mut [f64]) -> Outcome {
        values.fill(which.neutral());
        let mut own = vec![0.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives(which)) {
            let outcome =
                part.with_inputs(batch, |b| part.kinetics.feedback(which, b, &mut own))?;
            warning = warning.or(outcome);
            values.iter_mut().zip(&own).for_each(|(all, own)| *all = which.joined(*all, *own).0);
        }
        Ok(warning)
    }

    fn feedback_partials(
        &self,
        which: Feedback,
        batch: &Batch<'_>,
        values: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        values.fill(which.neutral());
        partials.iter_mut().for_each(|column| column.fill(0.0));
        let mut own = vec![0.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives(which)) {
            let mut slopes = Columns::new(part.species.len(), batch.count);
            let outcome = part.with_inputs(batch, |b| {
                part.kinetics.feedback_partials(which, b, &mut own, &mut slopes.slices_mut())
            })?;
            warning = warning.or(outcome);
            for (point, (all, own)) in values.iter_mut().zip(&own).enumerate() {
                let (joined, [by_all, by_own]) = which.joined(*all, *own);
                partials.iter_mut().for_each(|column| column[point] *= by_all);
                for (row, &species) in part.species.iter().enumerate() {
                    partials[species][point] += by_own * slopes.column(row)[point];
                }
                *all = joined;
            }
        }
        Ok(warning)
    }

    fn breakpoints(&self, batch: &Batch<'_>, until: f64, times: &mut Vec<f64>) -> bool {
        let of =
            |part: &Part| part.with_inputs(batch, |b| part.kinetics.breakpoints(b, until, times));
        let known: Vec<bool> = self.members.iter().map(of).collect();
        !known.contains(&false)
    }

    fn without_parameter_columns(&self) -> Result<Option<Box<dyn Kinetics>>, KineticsError> {
        let mut members = self.members.clone();
        let mut any = false;
        for part in &mut members {
            if let Some(other) = part.kinetics.without_parameter_columns()? {
                (part.kinetics, any) = (Arc::from(other), true);
            }
        }
        let (descriptor, parameters) = (self.descriptor.clone(), self.parameters.clone());
        Ok(any.then(|| Box::new(Self { descriptor, parameters, members }) as Box<dyn Kinetics>))
    }

    fn offender(&self, rates: bool, batch: &Batch<'_>) -> String {
        let bad = |part: &&Part| {
            part.with_inputs(batch, |b| {
                let mut own = Columns::new(if rates { part.species.len() } else { 1 }, b.count);
                let columns = &mut own.slices_mut();
                let least = if rates { f64::MIN } else { f64::MIN_POSITIVE };
                let outcome = match rates {
                    true => part.kinetics.rates(b, columns),
                    false => part.kinetics.length_factor(b, columns[0]),
                };
                outcome.is_err() || columns.iter().any(|column| !all_finite_from(column, least))
            })
        };
        let found = self.members.iter().find(bad).map(|part| part.kinetics.descriptor());
        found.unwrap_or(&self.descriptor).title()
    }

    fn observe(&self, batch: &Batch<'_>, values: &mut [&mut [f64]]) -> Outcome {
        let mut warning = None;
        for part in self.members.iter().filter(|p| !p.observables.is_empty()) {
            let own = &mut values[part.observables.clone()];
            let outcome =
                part.with_signals(&part.observed, batch, |b| part.kinetics.observe(b, own))?;
            warning = warning.or(outcome);
        }
        Ok(warning)
    }
}

impl Part {
    fn gives(&self, which: Feedback) -> bool {
        which.is_given(&self.kinetics.descriptor().capabilities)
    }

    fn gives_length_factor(&self) -> bool {
        self.kinetics.descriptor().capabilities.length_factor
    }
}
