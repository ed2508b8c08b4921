//! Numbers of a shape, by which a branch is drawn.

use crate::Vec3;
use crate::geometry::{area, volume};
use crate::num::real;
use crate::sheet::Sheet;

/// A number of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Largest displacement of a vertex from its rest position.
    Displacement,
    /// Mean displacement of the vertices along an axis, by its number.
    Mean(usize),
    /// Extent along z.
    Height,
    /// Area.
    Area,
    /// Enclosed volume of a closed sheet.
    Volume,
}

impl Measure {
    /// Those of every sheet.
    pub const ALL: [Self; 7] = [
        Self::Displacement,
        Self::Mean(0),
        Self::Mean(1),
        Self::Mean(2),
        Self::Height,
        Self::Area,
        Self::Volume,
    ];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Mean(0) => "mean-x",
            Self::Mean(1) => "mean-y",
            Self::Mean(_) => "mean-z",
            Self::Height => "height",
            Self::Area => "area",
            Self::Volume => "volume",
        }
    }

    /// Its title, with the unit.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Displacement => "largest displacement [length]",
            Self::Mean(0) => "mean displacement along x [length]",
            Self::Mean(1) => "mean displacement along y [length]",
            Self::Mean(_) => "mean displacement along z [length]",
            Self::Height => "height [length]",
            Self::Area => "area [length^2]",
            Self::Volume => "volume [length^3]",
        }
    }

    /// Of the shape `x`; not a number where the sheet has none.
    #[must_use]
    pub fn of(self, sheet: &Sheet, x: &[Vec3]) -> f64 {
        let moved = || x.iter().zip(sheet.rest()).map(|(x, rest)| x - rest);
        match self {
            Self::Displacement => moved().map(|d| d.norm()).fold(0.0, f64::max),
            Self::Mean(axis) => moved().map(|d| d[axis]).sum::<f64>() / real(x.len()),
            Self::Height => {
                let (low, high) = x
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x.z), h.max(x.z)));
                high - low
            }
            Self::Area => area(sheet, x),
            Self::Volume if sheet.boundary().contains(&true) => f64::NAN,
            Self::Volume => volume(sheet, x, Vec3::zeros()),
        }
    }
}

impl std::str::FromStr for Measure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|measure| measure.name() == text).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|measure| measure.name()).collect();
            format!("expected one of {}", names.join(", "))
        })
    }
}
