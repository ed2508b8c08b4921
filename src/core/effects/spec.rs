//! What a scene lists, and what comes of it.

use std::path::Path;

use super::context::EffectContext;
use super::energy::{Contact, Energy, EnergyTerm};
use super::error::EffectError;
use super::internal_variables::InternalVariables;
use super::length_factor::{DirectedLengthFactor, LengthFactor};
use super::prescribed::{DirichletValues, Pins, PrescribedDisplacement};
use super::transport::{Transport, TransportTerm};
use crate::geometry::AreaRule;
use crate::kinetics::breakpoints::TimeDependence;
use crate::sheet::Sheet;

/// What an effect needs of a scene besides its sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// The table `[material]`.
    pub material: bool,
    /// Species, from the table `[kinetics]`.
    pub species: bool,
    /// That vertices move out of the plane z = const, and the key of its table by which it does: it bends
    /// the sheet, pushes it along z, or fixes it there. A scene with `sheet.planar` is refused at that key.
    pub out_of_plane: Option<&'static str>,
}

/// An effect as a scene lists it: its kind and parameters, not yet bound to a sheet.
#[typetag::serialize(tag = "kind")]
pub trait EffectSpec: std::fmt::Debug + Send + Sync {
    /// What the effect is called in results; its kind, unless it says otherwise.
    fn name(&self) -> String {
        self.typetag_name().to_owned()
    }

    /// What it needs of the scene: without that, the scene is refused before anything is built.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// The rule by which it gives areas to vertices, if it has one: the scene's signals, fields and
    /// reports then go by the same.
    fn vertex_area(&self) -> Option<AreaRule> {
        None
    }

    /// The files that it reads, by their keys within its table.
    fn files(&self) -> Vec<(&'static str, &Path)> {
        Vec::new()
    }

    /// Makes their paths absolute: they count from `folder`.
    fn resolve_paths_against(&mut self, _folder: &Path) {}

    /// Binds it to a sheet, a material and the species there are.
    ///
    /// # Errors
    /// A parameter that does not fit the sheet or the kinetics.
    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError>;

    /// Where what it brings has kinks and jumps from time 0 to `until`, and its course between them: steps end there and
    /// pass over no pulse.
    fn time_dependence(&self, _sheet: &Sheet, _until: f64) -> TimeDependence {
        TimeDependence::default()
    }

    /// What it does there, among the other effects of `scene`, that the author of a scene may not have meant; begins with
    /// `warning: ` where results are likely to be wrong.
    fn notes(&self, _context: &EffectContext<'_>, _scene: &SceneSummary<'_>) -> Vec<String> {
        Vec::new()
    }
}

/// What [`EffectSpec::notes`] may know of a scene besides the context of its effect.
#[derive(Debug, Clone, Copy, Default)]
pub struct SceneSummary<'a> {
    /// The names of all effects.
    pub effects: &'a [String],
    /// Whether the shape of the sheet at rest is read from a file.
    pub sheet_file: bool,
}

crate::family!(dyn EffectSpec, "effect", "kind");

/// The names of all effects that a scene of this program can list, sorted.
#[must_use]
pub fn kinds() -> Vec<&'static str> {
    crate::registry::names::<dyn EffectSpec>()
}

/// The error for a key that `model` does not have, but `other` has.
pub(super) fn misplaced(key: &'static str, model: &str, reason: &str, other: &str) -> EffectError {
    EffectError {
        key,
        message: format!("model = \"{model}\" has no {key}: it {reason}"),
        help: Some(format!("leave {key} out, or choose model = \"{other}\"")),
    }
}

/// What an effect brings to a model: any of these, and of each as many as it likes.
#[derive(Default)]
pub struct Effect {
    /// Energies.
    pub energies: Vec<EnergyTerm>,
    /// Directions that are fixed.
    pub pins: Option<Pins>,
    /// Fixed directions whose positions are prescribed in time.
    pub prescribed: Vec<PrescribedDisplacement>,
    /// What must be zero at every shape: the value of each, which has no unit (a strain, a share), is
    /// kept below 1e-9 by a force along its gradient.
    pub constraints: Vec<EnergyTerm>,
    /// Length factors that multiply those of laws.
    pub growth: Vec<LengthFactor>,
    /// A direction in which the length factor of the law acts.
    pub direction: Option<DirectedLengthFactor>,
    /// Transports of species.
    pub transports: Vec<TransportTerm>,
    /// Values of species that are held.
    pub held: Vec<DirichletValues>,
    /// Variables of its own with rates.
    pub internal: Vec<Box<dyn InternalVariables>>,
}

impl Effect {
    /// With an energy.
    #[must_use]
    pub fn energy(energy: impl Energy) -> Self {
        Self { energies: vec![EnergyTerm::new(energy)], ..Self::default() }
    }

    /// With an energy of contact.
    #[must_use]
    pub fn contact(energy: impl Contact) -> Self {
        Self { energies: vec![EnergyTerm::contact(energy)], ..Self::default() }
    }

    /// With a constraint: what `zero` gives as its energy is kept at 0.
    #[must_use]
    pub fn constraint(zero: impl Energy) -> Self {
        Self { constraints: vec![EnergyTerm::new(zero)], ..Self::default() }
    }

    /// With fixed directions.
    #[must_use]
    pub fn pins(pins: Pins) -> Self {
        Self { pins: Some(pins), ..Self::default() }
    }

    /// With internal variables.
    #[must_use]
    pub fn internal(internal: impl InternalVariables) -> Self {
        Self { internal: vec![Box::new(internal)], ..Self::default() }
    }

    /// With a transport.
    #[must_use]
    pub fn transport(transport: impl Transport) -> Self {
        Self::transport_term(TransportTerm::new(transport))
    }

    /// An effect that is one transport, perhaps with a coefficient that reads species.
    #[must_use]
    pub fn transport_term(term: TransportTerm) -> Self {
        Self { transports: vec![term], ..Self::default() }
    }

    /// Numbers of its parts. The pattern names every field, so that none is forgotten.
    #[must_use]
    pub fn parts(&self) -> EffectParts {
        let Self {
            energies,
            pins,
            prescribed,
            constraints,
            growth,
            direction,
            transports,
            held,
            internal,
        } = self;
        let directions = |fixed: &[bool; 3]| fixed.iter().filter(|fixed| **fixed).count();
        let pins = pins.as_deref().unwrap_or_default();
        EffectParts {
            energies: energies.len(),
            pins: [
                pins.iter().map(directions).sum(),
                pins.iter().filter(|fixed| directions(fixed) > 0).count(),
            ],
            prescribed: prescribed.len(),
            constraints: constraints.len(),
            growth: growth.len(),
            directs: direction.is_some(),
            transports: transports.len(),
            held: held.iter().map(|held| held.points().len()).sum(),
            internal: internal.len(),
        }
    }
}

/// Numbers of the parts of an effect.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct EffectParts {
    /// Energies.
    pub energies: usize,
    /// Fixed directions, and the vertices that have some.
    pub pins: [usize; 2],
    /// Fixed directions whose positions are prescribed.
    pub prescribed: usize,
    /// Constraints.
    pub constraints: usize,
    /// Length factors.
    pub growth: usize,
    /// Whether it directs the length factor of the law.
    pub directs: bool,
    /// Transports.
    pub transports: usize,
    /// Points whose values are held.
    pub held: usize,
    /// Internal variables.
    pub internal: usize,
}
