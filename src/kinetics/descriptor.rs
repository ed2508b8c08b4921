//! What kinetics says about itself, checked.

use super::signal::Signal;
use rumple_numerics::num::Short;

/// Where species live.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Location {
    /// On vertices.
    Vertex,
    /// On triangles.
    Face,
    /// On its edges, where length factors are taken; no species lives there.
    #[serde(skip)]
    Edge,
}

impl Location {
    /// What several points are called in messages.
    #[must_use]
    pub fn nouns(self) -> &'static str {
        match self {
            Self::Vertex => "vertices",
            Self::Face => "faces",
            Self::Edge => "edges",
        }
    }

    /// What one point is called in messages.
    #[must_use]
    pub fn noun(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::Face => "face",
            Self::Edge => "edge",
        }
    }
}

/// One species.
#[derive(Debug, Clone, PartialEq)]
pub struct Species {
    /// Name in scenes and results.
    pub name: String,
    /// Unit, in words.
    pub unit: String,
    /// Description.
    pub doc: String,
    /// Magnitude that matters, > 0; that of a run where the law declares none.
    pub typical: Option<f64>,
    /// Least value that makes sense.
    pub lower: f64,
    /// Greatest value that makes sense.
    pub upper: f64,
    /// Diffusion coefficient unless the scene gives one, length²/time.
    pub diffusion: f64,
    /// Location unless the scene gives one.
    pub location: Location,
}

impl Species {
    /// A dimensionless species at vertices, of any value, that does not diffuse.
    #[must_use]
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            unit: "1".into(),
            doc: String::new(),
            typical: None,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            diffusion: 0.0,
            location: Location::Vertex,
        }
    }

    /// The declared typical magnitude, or 1.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.typical.unwrap_or(1.0)
    }
}

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name in scenes.
    pub name: String,
    /// Unit, in words.
    pub unit: String,
    /// Description.
    pub doc: String,
    /// Value where the scene gives none.
    pub default: Default,
    /// Lower bound.
    pub lower: f64,
    /// Whether the lower bound itself is excluded.
    pub lower_open: bool,
    /// Upper bound.
    pub upper: f64,
    /// Whether the upper bound itself is excluded.
    pub upper_open: bool,
}

/// The default of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Default {
    /// A number.
    Value(f64),
    /// The value of an earlier parameter.
    SameAs(usize),
}

impl Parameter {
    /// A dimensionless parameter without bounds.
    #[must_use]
    pub fn named(name: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            unit: "1".into(),
            doc: String::new(),
            default: Default::Value(value),
            lower: f64::NEG_INFINITY,
            lower_open: false,
            upper: f64::INFINITY,
            upper_open: false,
        }
    }

    /// Whether the value is finite and within the bounds.
    #[must_use]
    pub fn allows(&self, value: f64) -> bool {
        let above = if self.lower_open { value > self.lower } else { value >= self.lower };
        let below = if self.upper_open { value < self.upper } else { value <= self.upper };
        value.is_finite() && above && below
    }

    /// The bounds as people write them, for example `0 <= alpha < 1`.
    #[must_use]
    pub fn range(&self) -> String {
        let sign = |open| if open { "<" } else { "<=" };
        let mut text = self.name.clone();
        if self.lower.is_finite() {
            text = format!("{} {} {text}", Short(self.lower), sign(self.lower_open));
        }
        if self.upper.is_finite() {
            text = format!("{text} {} {}", sign(self.upper_open), Short(self.upper));
        }
        if text == self.name { format!("{text} is any finite number") } else { text }
    }
}

/// A signal that the rates read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalRead {
    /// Which.
    pub signal: Signal,
    /// Magnitude that matters, > 0, in the signal's unit.
    pub typical: f64,
}

/// What is given besides rates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Capabilities {
    /// Exact partial derivatives of the rates.
    pub rate_partials: bool,
    /// A length factor Φ(c).
    pub length_factor: bool,
    /// Exact partial derivatives of the length factor.
    pub length_factor_partials: bool,
    /// A spontaneous curvature C₀(c).
    pub curvature: bool,
    /// A length factor Φ_⊥(c) across a fibre.
    pub length_factor_across: bool,
    /// Takes parameters that differ from point to point as columns.
    pub parameter_fields: bool,
}

/// An observable besides the species.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Observable {
    /// Name in scenes and results.
    pub name: String,
    /// Unit, in words.
    pub unit: String,
    /// Description.
    pub doc: String,
}

/// What kinetics says about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Descriptor {
    /// Reverse domain name.
    pub id: String,
    /// Short name.
    pub name: String,
    /// Version.
    pub version: String,
    /// Author.
    pub author: String,
    /// Licence.
    pub licence: String,
    /// Equation and reference.
    pub doc: String,
    /// Species, at least one; all default to the same location.
    pub species: Vec<Species>,
    /// Parameters.
    pub parameters: Vec<Parameter>,
    /// Signals that the rates read.
    pub signals: Vec<SignalRead>,
    /// Observables.
    pub observables: Vec<Observable>,
    /// Signals that these read: computed for frames only.
    pub observed: Vec<SignalRead>,
    /// What is given besides rates.
    pub capabilities: Capabilities,
}

/// The names of the columns of signals.
pub(super) fn columns(signals: &[SignalRead]) -> impl Iterator<Item = &'static str> {
    signals.iter().flat_map(|read| read.signal.columns()).copied()
}

/// Adds signals that are not there yet.
pub(super) fn unite(all: &mut Vec<SignalRead>, more: &[SignalRead]) {
    for read in more {
        match all.iter_mut().find(|known| known.signal == read.signal) {
            Some(known) => known.typical = known.typical.min(read.typical),
            None => all.push(*read),
        }
    }
}

/// The numbers of the columns of some signals among those of all.
pub(super) fn among(all: &[SignalRead], some: &[SignalRead]) -> Vec<usize> {
    let columns = |wanted: &SignalRead| {
        let before = all.iter().take_while(|read| read.signal != wanted.signal);
        let first: usize = before.map(|read| read.signal.columns().len()).sum();
        first..first + wanted.signal.columns().len()
    };
    some.iter().flat_map(columns).collect()
}

/// Before the name, in the id of a law that a scene writes out.
pub(super) const FORMULA: &str = "formula.";

impl Descriptor {
    /// Of a law without species, to be completed.
    #[must_use]
    pub fn named(id: impl Into<String>, name: impl Into<String>) -> Self {
        Self {
            id: id.into(),
            name: name.into(),
            version: String::new(),
            author: String::new(),
            licence: String::new(),
            doc: String::new(),
            species: Vec::new(),
            parameters: Vec::new(),
            signals: Vec::new(),
            observables: Vec::new(),
            observed: Vec::new(),
            capabilities: Capabilities::default(),
        }
    }

    /// What messages call the law.
    #[must_use]
    pub fn title(&self) -> String {
        let noun = match self.id.as_str() {
            "joint" => "the laws",
            id if id.starts_with(FORMULA) => "the law",
            _ => "plugin",
        };
        format!("{noun} `{}`", self.name)
    }

    /// The number of signal columns of the rates: one a scalar, three a vector.
    #[must_use]
    pub fn signal_columns(&self) -> usize {
        columns(&self.signals).count()
    }

    /// The number of inputs of the rates: species and signal columns.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.species.len() + self.signal_columns()
    }

    /// The names of the inputs of the rates, in the order of partial derivatives.
    pub fn input_names(&self) -> impl Iterator<Item = &str> {
        self.names_with(&self.signals)
    }

    /// The names of the species, and of the columns of these signals.
    pub fn names_with<'a>(&'a self, signals: &'a [SignalRead]) -> impl Iterator<Item = &'a str> {
        self.species
            .iter()
            .map(|species| species.name.as_str())
            .chain(columns(signals).map(|c| c as &str))
    }

    /// The position of a species, by name.
    #[must_use]
    pub fn species_index(&self, name: &str) -> Option<usize> {
        self.species.iter().position(|species| species.name == name)
    }

    /// Whether the signal is read.
    #[must_use]
    pub fn reads(&self, signal: Signal) -> bool {
        self.signals.iter().any(|read| read.signal == signal)
    }
}
