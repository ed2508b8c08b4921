//! The steps from a problem to a stepper: checks, effects bound to the sheet, the species, solvers.

use std::sync::Arc;

use super::integrator::unsupported;
use super::prescriptions::Prescriptions;
use super::{Law, OnEffect, Problem, ProblemError, ProblemPart};
use crate::effects::{
    Effect, EffectContext, EffectError, FieldValues, InternalVariables, MaterialField,
    TransportTerm,
};
use crate::geometry::{VertexArea, face_areas};
use crate::kinetics::{Location, Signal, SignalRead};
use crate::model::{Chemistry, Drag, Mechanics, Potential, Signals};
use crate::problem::BoundEffects;
use crate::solve::{Integrator, Relaxer};

impl Problem<'_> {
    /// Refuses what does not fit together.
    pub(super) fn check(&self) -> Result<(), ProblemError> {
        self.check_material()?;
        self.check_plane()?;
        if self.law.as_ref().is_some_and(|law| law.location() == Location::Edge) {
            let message = "no species lives on edges";
            return Err(ProblemError::new(ProblemPart::Law, message, Some("on vertices or faces")));
        }
        self.check_needs()
    }

    /// Refuses a material that no sheet has.
    fn check_material(&self) -> Result<(), ProblemError> {
        let Some(MaterialField { young, poisson, thickness }) = &self.material else {
            return Ok(());
        };
        let refuse = |message| Err(ProblemError::new(ProblemPart::Material, message, None));
        let positive = ((0.0, f64::MAX), "positive and finite");
        let constants = [
            ("young", young, positive),
            ("poisson", poisson, ((-1.0, 0.5), "above -1 and at most 0.5")),
            ("thickness", thickness, positive),
        ];
        for (name, values, ((above, most), range)) in constants {
            let count = self.sheet.triangle_count();
            if let FieldValues::Each(all) = values
                && all.len() != count
            {
                let given = all.len();
                return refuse(format!(
                    "{name} has {given} values, and the sheet {count} triangles"
                ));
            }
            let wrong = |value: &f64| !(*value > above && *value <= most);
            let found = match values {
                FieldValues::Same(value) => Some(*value).filter(wrong),
                FieldValues::Each(all) => all.iter().copied().find(wrong),
            };
            if let Some(value) = found {
                return refuse(format!("{name} is {value}; it must be {range}"));
            }
        }
        Ok(())
    }

    /// Refuses a planar sheet that does not lie in a plane z = const, and effects that act out of it.
    fn check_plane(&self) -> Result<(), ProblemError> {
        let rest = self.sheet.rest();
        let Some(plane) = rest.first().map(|x| x.z).filter(|_| self.planar) else { return Ok(()) };
        if let Some(vertex) = rest.iter().position(|x| x.z != plane) {
            let z = rest[vertex].z;
            let message = format!(
                "the sheet does not lie in a plane z = const: vertex {vertex} is at z = {z}, vertex 0 at \
                 z = {plane}"
            );
            let help = "leave planar out, or turn the mesh so that all z are the same number";
            return Err(ProblemError::new(ProblemPart::Planar, message, Some(help)));
        }
        let found = self.effects.iter().enumerate();
        let mut found = found.filter_map(|(k, e)| e.needs().out_of_plane.map(|key| (k, e, key)));
        let Some((number, effect, key)) = found.next() else { return Ok(()) };
        let message = format!(
            "{} acts along z, and the vertices of a planar sheet do not move there",
            effect.name()
        );
        let help = match key {
            "kind" => "leave the effect out, or sheet.planar",
            "axes" => "axes = \"x\", \"y\" or \"xy\": z is fixed already",
            _ => "give it no z component, or leave sheet.planar out",
        };
        Err(ProblemError::new(ProblemPart::Effect(number, key.into()), message, Some(help)))
    }

    /// Refuses solvers that do not go with a sheet that is spread over ranks.
    pub(super) fn check_ranks(&self, mechanics: &Mechanics) -> Result<(), ProblemError> {
        let Some(place) = self.sheet.reduction().place() else { return Ok(()) };
        let refuse = |part, what: &str, help: &str| {
            let message = format!("{what} {place}");
            Err(ProblemError::new(part, message, Some(help)))
        };
        if !self.integrator.supports_ranks(self.policy.mass_weights()) {
            let (name, policy) = (self.integrator.name(), self.policy.name());
            let what = format!("{name} cannot advance a sheet under the policy {policy}");
            let help =
                "integrator = \"staggered\" does under the policies quasi-static and simultaneous";
            return refuse(ProblemPart::Integrator, &what, help);
        }
        if !mechanics.is_empty() && !self.equilibrium.supports_ranks() {
            let name = self.equilibrium.name();
            let help = "equilibrium.method = \"lbfgs\" does";
            return refuse(ProblemPart::Equilibrium, &format!("{name} cannot relax a sheet"), help);
        }
        Ok(())
    }

    /// Refuses effect number `number` where it does not go with a sheet that is spread over ranks.
    fn check_effect_on_ranks(&self, number: usize, effect: &Effect) -> Result<(), ProblemError> {
        let Some(place) = self.sheet.reduction().place() else { return Ok(()) };
        let refuse = |what: &str, help: &str| {
            let message = format!("{what} {place}");
            Err(ProblemError::new(ProblemPart::Effect(number, "kind".into()), message, Some(help)))
        };
        let elsewhere = match self.sheet.reduction().periods() {
            [] => "in one process, with as many threads as there are cores, it can be listed",
            _ => "on a sheet without sheet.periodic it can be listed",
        };
        let mut contacts = effect.energies.iter().map(|term| term.interaction());
        if contacts.any(|does| does.limits_steps || does.pairs) {
            return refuse(
                "contact does not find the triangles that come near each other",
                elsewhere,
            );
        }
        if let Some(energy) = effect.energies.iter().find(|energy| !energy.supports_ranks()) {
            let help = "Energy::supports_ranks declares that it can be";
            return refuse(&format!("the energy {} cannot be evaluated", energy.name()), help);
        }
        if !effect.internal.is_empty() {
            return refuse("internal variables are not integrated", elsewhere);
        }
        if let Some(constraint) = effect.constraints.first() {
            let name = constraint.name();
            let help = "give the volume a stiffness instead of exact = true";
            return refuse(&format!("the constraint {name} is not kept"), help);
        }
        Ok(())
    }

    /// Refuses effects and signals without the species or the material that they need.
    fn check_needs(&self) -> Result<(), ProblemError> {
        let kinetics = self.law.as_ref().map(|law| law.kinetics.descriptor());
        let signals: Vec<SignalRead> = kinetics
            .map(|d| d.signals.iter().chain(&d.observed).copied().collect())
            .unwrap_or_default();
        let chemical = self.effects.iter().position(|e| e.needs().species);
        if let (None, Some(number)) = (kinetics, chemical) {
            let message =
                format!("{} needs species, and there are no kinetics", self.effects[number].name());
            let part = ProblemPart::Effect(number, "kind".into());
            return Err(ProblemError::new(part, message, Some("add a [kinetics] table")));
        }
        let needing = self.effects.iter().find(|e| e.needs().material).map(|e| e.name());
        let tension = signals.iter().any(|read| read.signal == Signal::Tension);
        if self.material.is_none() && (needing.is_some() || tension) {
            let what = needing.unwrap_or_else(|| "the signal tension".into());
            let message = format!("{what} needs young, poisson and thickness");
            return Err(ProblemError::new(ProblemPart::Material, message, None));
        }
        Ok(())
    }

    /// Refuses a law that reads the pressure of contact where nothing can touch.
    pub(super) fn check_contact(&self, mechanics: &Mechanics) -> Result<(), ProblemError> {
        let read = |law: &Law| {
            let d = law.kinetics.descriptor();
            d.signals.iter().chain(&d.observed).any(|read| read.signal == Signal::ContactPressure)
        };
        if !self.law.as_ref().is_some_and(read) || mechanics.contacts().next().is_some() {
            return Ok(());
        }
        let message = "the law reads contact_pressure, and nothing in the scene can touch";
        let help = "add [[effect]] kind = \"contact\", or kind = \"obstacle\"";
        Err(ProblemError::new(ProblemPart::Law, message, Some(help)))
    }

    /// Binds the effects to the sheet.
    pub(super) fn bind(&self, on_effect: &mut OnEffect<'_>) -> Result<BoundEffects, ProblemError> {
        let law = self.law.as_ref();
        let material = self.material.as_ref().map(MaterialField::largest);
        let context = EffectContext {
            sheet: &self.sheet,
            material: material.as_ref(),
            varying: self.material.as_ref().filter(|material| !material.is_uniform()),
            kinetics: law.map(|law| (law.kinetics.descriptor(), law.location())),
            measure: law.map(|law| law.measure).unwrap_or_default(),
            read: self.read,
        };
        let (mut all, mut prescriptions) = (BoundEffects::default(), Prescriptions::default());
        all.mechanics.planar = self.planar;
        all.mechanics.tally = self.tally.clone();
        all.mechanics.pins = vec![[false; 3]; self.sheet.vertex_count()];
        for (number, spec) in self.effects.iter().enumerate() {
            let mut effect = spec.build(&context).map_err(|e| ProblemError {
                part: ProblemPart::Effect(number, e.key.to_string()),
                message: e.message,
                help: e.help,
            })?;
            effect.transports.iter_mut().for_each(|term| term.effect = Some(number));
            on_effect(number, &**spec, &context, &effect)?;
            if all.direction.is_some() && effect.direction.is_some() {
                let message = "an earlier effect directs the length factor of the law already";
                let part = ProblemPart::Effect(number, "kind".into());
                return Err(ProblemError::new(part, message, Some("leave out one of the two")));
            }
            self.check_effect_on_ranks(number, &effect)?;
            prescriptions.add(number, &effect, (context.kinetics, self.until))?;
            check_internal(number, &all.internal, &effect.internal)?;
            let crosses = effect.transports.iter().any(|t| {
                t.read_species() != t.species()
                    || t.read_by_coefficient().iter().any(|s| *s != t.species())
            });
            all.crossing = all.crossing.or(crosses.then_some(number));
            all.add(effect);
        }
        prescriptions.check_fluxes(&all.transports)?;
        let across =
            law.is_some_and(|law| law.kinetics.descriptor().capabilities.length_factor_across);
        if across && all.direction.is_none() {
            let message =
                "the law has a length factor across a fibre, and no effect gives the fibre";
            let help = "add [[effect]] kind = \"directed-growth\" with its fibre";
            return Err(ProblemError::new(ProblemPart::Law, message, Some(help)));
        }
        Ok(all)
    }

    /// How the shape is relaxed; `None` where it does not move.
    pub(super) fn relaxer(
        &self,
        mechanics: &Arc<Mechanics>,
    ) -> Result<Option<Relaxer>, ProblemError> {
        let help = "add [[effect]] kind = \"stretching\"";
        if mechanics.is_empty() {
            if let Some(name) = mechanics.constraint_names().next() {
                let message = format!("{name} is a constraint, but no effect has an energy");
                return Err(ProblemError::new(ProblemPart::Effects, message, Some(help)));
            }
            return Ok(None);
        }
        let mut potential = Potential::new(mechanics);
        if !(potential.force_scale() > 0.0) {
            let message = "no effect resists stretching";
            return Err(ProblemError::new(ProblemPart::Effects, message, Some(help)));
        }
        if potential.constraints_depend() {
            let names = mechanics.constraint_names().collect::<Vec<_>>().join(", ");
            let (message, help) = match mechanics.all_pinned() {
                true => (
                    format!("pins fix every vertex: no force meets the constraint {names}"),
                    "leave it out, or vertices free",
                ),
                false => (
                    format!(
                        "the constraints {names} act along the same force and cannot all be met"
                    ),
                    "leave out all but one of them",
                ),
            };
            return Err(ProblemError::new(ProblemPart::Effects, message, Some(help)));
        }
        let method = &self.equilibrium;
        let equilibrium = method
            .build(mechanics)
            .map_err(|e| ProblemError::new(ProblemPart::Equilibrium, e.to_string(), None))?;
        let (tolerance, max_iterations) =
            (method.tolerance().on(&potential), method.max_iterations());
        let tightest = method.tolerance().tightest(&potential);
        Ok(Some(Relaxer { equilibrium, tolerance, tightest, max_iterations }))
    }

    /// The species on the sheet.
    pub(super) fn chemistry(
        &self,
        law: Law,
        area: &VertexArea,
        transports: Vec<TransportTerm>,
    ) -> Chemistry {
        let location = law.location();
        let wanted = law.kinetics.descriptor().signals.iter().map(|read| read.signal);
        let mut wanted: Vec<Signal> = wanted.collect();
        for signal in transports.iter().flat_map(TransportTerm::read_signals) {
            if !wanted.contains(&signal) {
                wanted.push(signal);
            }
        }
        let rest_area: Arc<[f64]> = match wanted.contains(&Signal::AreaRatio) {
            true => face_areas(&self.sheet, self.sheet.rest()).into(),
            false => Arc::default(),
        };
        let of = self.material.as_ref();
        let signals = Signals::new(wanted, location, area.clone(), of, law.tension, rest_area)
            .in_plane(self.planar)
            .with_boundary(law.boundary, &self.sheet);
        let Law { kinetics, parameters, measure, .. } = law;
        Chemistry::new(&self.sheet, kinetics, parameters, location, signals, transports, measure)
    }

    /// The integrator, if it can do with what the law and effects ask for.
    pub(super) fn built_integrator(
        &self,
        mechanics: &Mechanics,
        internal: &[Box<dyn InternalVariables>],
    ) -> Result<Box<dyn Integrator>, ProblemError> {
        let refused =
            |message: String, help| ProblemError::new(ProblemPart::Integrator, message, help);
        let integrator = self.integrator.build(self.policy.mass_weights());
        let integrator = integrator.map_err(|e| refused(e.to_string(), None))?;
        match unsupported(self, mechanics, internal) {
            Some((message, help)) => Err(refused(message, Some(help))),
            None => Ok(integrator),
        }
    }

    /// The drag, if the integrator knows it.
    pub(super) fn built_drag(&self) -> Result<Drag, ProblemError> {
        let refused = |e: EffectError| ProblemError {
            part: ProblemPart::Drag,
            message: e.message,
            help: e.help,
        };
        let drag = self.drag.on(&self.sheet, self.read).map_err(refused)?;
        let moves = self.policy.mass_weights().mechanics > 0.0;
        if moves && !drag.is_isotropic() && !self.integrator.supports_anisotropic_drag() {
            let message = "this integrator takes drag to be the same in all directions";
            let help = "integrator = \"staggered\" with shape = \"sdirk2\" (its default) or \
                \"euler\" knows drag along the normal and in the plane";
            return Err(ProblemError::new(ProblemPart::Drag, message, Some(help)));
        }
        Ok(drag)
    }
}

/// Refuses internal variables of effect number `number` that are called as those of an `earlier` one, or that multiply
/// lengths without being on edges.
fn check_internal(
    number: usize,
    earlier: &[Box<dyn InternalVariables>],
    new: &[Box<dyn InternalVariables>],
) -> Result<(), ProblemError> {
    let refused = |message: String, help| {
        Err(ProblemError::new(ProblemPart::Effect(number, "kind".into()), message, Some(help)))
    };
    for term in new {
        let name = term.name();
        if earlier.iter().any(|old| old.name() == name) {
            let message = format!("an earlier effect owns internal variables {name} already");
            return refused(message, "leave out one of the two; fields differ by region");
        }
        if term.multiplies_lengths() && term.location() != Location::Edge {
            let message =
                format!("the internal variables {name} multiply lengths, but are not on edges");
            return refused(message, "location() has to be Location::Edge");
        }
    }
    Ok(())
}
