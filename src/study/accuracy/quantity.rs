//! Quantities whose errors are measured.

use serde::{Deserialize, Serialize};

use crate::num::real;
use crate::run::{Error, Result};
use crate::study::extent;
use crate::study::gather::Measures;

/// Quantity whose error is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Values of the species: root mean square of the difference over that of the values, of the worst species,
    /// the largest over the output times.
    Species,
    /// Positions: the same over that of the displacement, after the best rigid motion.
    Shape,
    /// Elastic energy at the end, without the potential of loads.
    Energy,
    /// Largest displacement at the end, after the best of the rigid motions that are free.
    Amplitude,
    /// Number of regions above the level at the end.
    Spots,
    /// Their separation d at the end.
    Separation,
    /// The time at which the largest displacement along the normals first comes half way from its start to its
    /// largest.
    Buckling,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Species,
        Self::Shape,
        Self::Energy,
        Self::Amplitude,
        Self::Spots,
        Self::Separation,
        Self::Buckling,
    ];

    /// The distances of fields, which have no meaning after the references have diverged.
    pub const FIELDS: [Self; 2] = [Self::Species, Self::Shape];

    /// The quantity that a command calls `name`.
    ///
    /// # Errors
    /// There is none; the names.
    pub fn named(name: &str) -> Result<Self> {
        serde_json::from_value(serde_json::Value::from(name)).map_err(|_| {
            let names = Self::ALL.map(|q| serde_json::to_value(q).unwrap_or_default());
            let names: Vec<&str> = names.iter().filter_map(serde_json::Value::as_str).collect();
            Error::Refused(format!(
                "{name:?} is not a quantity; expected one of {}",
                names.join(", ")
            ))
        })
    }

    /// Its name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Species => "species",
            Self::Shape => "shape",
            Self::Energy => "energy",
            Self::Amplitude => "amplitude",
            Self::Spots => "number of regions above the level",
            Self::Separation => "separation",
            Self::Buckling => "time of buckling",
        }
    }

    /// Whether it is a distance of fields.
    pub(crate) fn is_field(self) -> bool {
        Self::FIELDS.contains(&self)
    }

    /// Its value, where it is a measure.
    pub(crate) fn value(self, course: &[Measures]) -> Option<f64> {
        let last = course.last()?;
        match self {
            Self::Species | Self::Shape => None,
            Self::Energy => Some(last.energy).filter(|energy| *energy != 0.0),
            Self::Amplitude => Some(last.amplitude).filter(|amplitude| *amplitude > 0.0),
            Self::Spots => Some(real(last.spots)).filter(|spots| *spots > 0.0),
            Self::Separation => last.separation,
            Self::Buckling => buckling(course),
        }
    }

    /// Returns the relative error of a measure of `course` with respect to `reference`.
    pub(crate) fn error(self, course: &[Measures], reference: &[Measures]) -> Option<f64> {
        let (a, b) = (self.value(course)?, self.value(reference)?);
        (b != 0.0).then(|| (a - b).abs() / b.abs())
    }

    /// Half of the range of a measure over `courses`, relative to the reference.
    pub(crate) fn spread(self, courses: &[Vec<Measures>], reference: &[Measures]) -> Option<f64> {
        let values: Vec<f64> = courses.iter().filter_map(|course| self.value(course)).collect();
        let (least, most) = extent(values.iter().copied());
        let size = self.value(reference)?.abs();
        (values.len() > 1 && size > 0.0).then(|| 0.5 * (most - least) / size)
    }
}

/// The sheet has buckled where it is deflected so many times as far.
const BUCKLING_RATIO: f64 = 2.0;

/// When the deflection comes half way, linearly between output times.
fn buckling(course: &[Measures]) -> Option<f64> {
    let first = course.first()?.deflection;
    let most = course.iter().map(|m| m.deflection).fold(first, f64::max);
    if !(most > BUCKLING_RATIO * first) {
        return None;
    }
    let half = 0.5 * (first + most);
    let after = course.iter().position(|m| m.deflection >= half)?;
    let (a, b) = (course.get(after.checked_sub(1)?)?, &course[after]);
    Some(a.time + (b.time - a.time) * (half - a.deflection) / (b.deflection - a.deflection))
}

/// Values for all quantities of [`Quantity::ALL`].
pub(super) type OfQuantities = [Option<f64>; Quantity::ALL.len()];
