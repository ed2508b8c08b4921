//! What a plugin says about itself: species, parameters, signals read, quantities given.
//!
//! The `const` constructors let a Rust plugin write its descriptor as constants; a C plugin
//! writes the same structures as initialisers.

/// UTF-8 text by start and length; both zero for an empty text.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Str {
    /// First byte.
    pub data: *const u8,
    /// Bytes, without any terminating zero.
    pub length: usize,
}

impl Str {
    /// The text that lives as long as the process.
    #[must_use]
    pub const fn new(text: &'static str) -> Self {
        Self { data: text.as_ptr(), length: text.len() }
    }
}

/// Where species live, and with them rates, signals and length factor.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Location(pub u32);

impl Location {
    /// On the vertices of the mesh.
    pub const VERTEX: Self = Self(0);
    /// On its triangles.
    pub const FACE: Self = Self(1);
}

/// One species: a concentration with its own rate.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Species {
    /// Name in scenes and results, for example `c`; a letter first, then letters, digits or `_`.
    pub name: Str,
    /// Unit of the value, in words of the plugin; `1` for none.
    pub unit: Str,
    /// Description in one sentence.
    pub doc: Str,
    /// Magnitude that matters, > 0: scale of absolute tolerances and difference steps. 0: from the start of a run.
    pub typical: f64,
    /// Least value that makes sense; may be -infinity.
    pub lower: f64,
    /// Greatest value that makes sense; may be +infinity.
    pub upper: f64,
    /// Diffusion coefficient unless the scene gives one, length²/time, >= 0.
    pub diffusion: f64,
    /// Default location; a scene may choose another.
    pub location: Location,
}

impl Species {
    /// A species on vertices with a typical magnitude from the start of a run, any value valid, no diffusion.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str, doc: &'static str) -> Self {
        Self {
            name: Str::new(name),
            unit: Str::new(unit),
            doc: Str::new(doc),
            typical: 0.0,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            diffusion: 0.0,
            location: Location::VERTEX,
        }
    }

    /// With this typical magnitude.
    #[must_use]
    pub const fn typical(self, typical: f64) -> Self {
        Self { typical, ..self }
    }

    /// Valid from `lower` to `upper`, both included.
    #[must_use]
    pub const fn range(self, lower: f64, upper: f64) -> Self {
        Self { lower, upper, ..self }
    }

    /// With this default diffusion coefficient.
    #[must_use]
    pub const fn diffusion(self, diffusion: f64) -> Self {
        Self { diffusion, ..self }
    }

    /// With this default location.
    #[must_use]
    pub const fn location(self, location: Location) -> Self {
        Self { location, ..self }
    }
}

/// One parameter of the law.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name in scenes; same rule as for species.
    pub name: Str,
    /// Unit, in words; `1` for none.
    pub unit: Str,
    /// Description in one sentence.
    pub doc: Str,
    /// Value where a scene gives none (and `default_of` is empty).
    pub default: f64,
    /// If not empty: the name of an earlier parameter whose value is the default.
    pub default_of: Str,
    /// Lower bound; may be -infinity.
    pub lower: f64,
    /// Upper bound; may be +infinity.
    pub upper: f64,
    /// Bits [`Parameter::LOWER_OPEN`], [`Parameter::UPPER_OPEN`].
    pub open: u32,
}

impl Parameter {
    /// The lower bound itself is not allowed.
    pub const LOWER_OPEN: u32 = 1;
    /// The upper bound itself is not allowed.
    pub const UPPER_OPEN: u32 = 2;

    /// A parameter that may take any finite value.
    #[must_use]
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        default: f64,
        doc: &'static str,
    ) -> Self {
        Self {
            name: Str::new(name),
            unit: Str::new(unit),
            doc: Str::new(doc),
            default,
            default_of: Str::new(""),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            open: 0,
        }
    }

    /// CallOwner default is the value of the earlier parameter `name`.
    #[must_use]
    pub const fn default_of(self, name: &'static str) -> Self {
        Self { default_of: Str::new(name), ..self }
    }

    /// Allowed: value >= `lower`.
    #[must_use]
    pub const fn at_least(self, lower: f64) -> Self {
        Self { lower, open: self.open & !Self::LOWER_OPEN, ..self }
    }

    /// Allowed: value > `lower`.
    #[must_use]
    pub const fn above(self, lower: f64) -> Self {
        Self { lower, open: self.open | Self::LOWER_OPEN, ..self }
    }

    /// Allowed: value <= `upper`.
    #[must_use]
    pub const fn at_most(self, upper: f64) -> Self {
        Self { upper, open: self.open & !Self::UPPER_OPEN, ..self }
    }

    /// Allowed: value < `upper`.
    #[must_use]
    pub const fn below(self, upper: f64) -> Self {
        Self { upper, open: self.open | Self::UPPER_OPEN, ..self }
    }
}

/// One signal that the rates read. The engine computes only what is asked for.
///
/// Each scalar signal is one column of a batch; `position` and `normal` are three (x, y, z).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Signal {
    /// Which: `mean_curvature`, `gaussian_curvature`, `area_strain`, `tension`, `area_ratio`,
    /// `contact_pressure`, `time` (one column each), `position`, `normal` (three).
    pub name: Str,
    /// Magnitude that matters, > 0, in the signal's unit: scale of difference steps.
    pub typical: f64,
}

impl Signal {
    /// Mean curvature H, 1/length; > 0 at the top of a bump towards the normal; 0 on the boundary.
    pub const MEAN_CURVATURE: Self = Self::named("mean_curvature");
    /// Gaussian curvature K, 1/length²; > 0 on a sphere.
    pub const GAUSSIAN_CURVATURE: Self = Self::named("gaussian_curvature");
    /// Elastic area strain A/Ā - 1 (current over optimal area, less one); > 0 if stretched.
    pub const AREA_STRAIN: Self = Self::named("area_strain");
    /// Tension σ, force/length; > 0 if stretched. The scene chooses among its three readings.
    pub const TENSION: Self = Self::named("tension");
    /// Area ratio A/A⁰ (current over rest area), growth included.
    pub const AREA_RATIO: Self = Self::named("area_ratio");
    /// Current position, length; three columns.
    pub const POSITION: Self = Self::named("position");
    /// Unit normal; three columns; triangles run counter-clockwise when seen from its tip.
    pub const NORMAL: Self = Self::named("normal");
    /// Contact pressure, force/length²: size of the force of contacts over the current area; 0 where nothing touches.
    pub const CONTACT_PRESSURE: Self = Self::named("contact_pressure");
    /// Time; one column with stride 0.
    pub const TIME: Self = Self::named("time");

    const fn named(name: &'static str) -> Self {
        Self { name: Str::new(name), typical: 1.0 }
    }

    /// With this typical magnitude.
    #[must_use]
    pub const fn typical(self, typical: f64) -> Self {
        Self { typical, ..self }
    }
}

/// What a plugin gives, as bits.
///
/// An engine ignores a bit below 2^32 that it does not know, and refuses the plugin for an unknown
/// bit from 2^32 on: those stand for physics that must not be left out in silence.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities(pub u64);

impl Capabilities {
    /// Rates R, required.
    pub const RATES: Self = Self(1);
    /// Partial derivatives of the rates; without them the engine takes differences.
    pub const RATE_PARTIALS: Self = Self(1 << 1);
    /// A length factor Φ(c) of active strain; without it Φ = 1.
    pub const LENGTH_FACTOR: Self = Self(1 << 2);
    /// Partial derivatives of the length factor; without them the engine takes differences.
    pub const LENGTH_FACTOR_PARTIALS: Self = Self(1 << 3);
    /// Takes parameters that differ from point to point ([`Batch::parameters`](crate::Batch));
    /// without it the engine makes an instance for every set of values.
    pub const PARAMETER_FIELDS: Self = Self(1 << 4);
    /// A spontaneous curvature C₀(c), by the extension [`FEEDBACK`](crate::FEEDBACK).
    pub const SPONTANEOUS_CURVATURE: Self = Self(0x1_0000_0000);
    /// Instances have a state that must be saved and loaded, by an extension. Reserved.
    pub const STATEFUL: Self = Self(0x2_0000_0000);
    /// A length factor Φ⊥(c) across a fibre, by the extension [`FEEDBACK`](crate::FEEDBACK); the length factor is then
    /// the one along it.
    pub const LENGTH_FACTOR_ACROSS: Self = Self(0x4_0000_0000);

    /// These and those.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of `other` are among these.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// What a plugin says about itself. Arrays are given by start, length and the distance between
/// elements in bytes, so that elements can grow.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Descriptor {
    /// Bytes of this structure.
    pub size: usize,
    /// Reverse domain name, for example `org.example.curvature-feedback`.
    pub id: Str,
    /// Short name for people.
    pub name: Str,
    /// Version of the plugin.
    pub version: Str,
    /// Who wrote it.
    pub author: Str,
    /// Licence, as an SPDX expression.
    pub licence: Str,
    /// What it models: equation, reference.
    pub doc: Str,
    /// First species.
    pub species: *const Species,
    /// How many species, at least 1.
    pub species_count: usize,
    /// Bytes from one species to the next.
    pub species_stride: usize,
    /// First parameter.
    pub parameters: *const Parameter,
    /// How many parameters.
    pub parameter_count: usize,
    /// Bytes from one parameter to the next.
    pub parameter_stride: usize,
    /// First signal.
    pub signals: *const Signal,
    /// How many signals.
    pub signal_count: usize,
    /// Bytes from one signal to the next.
    pub signal_stride: usize,
    /// What the plugin gives.
    pub capabilities: Capabilities,
}
