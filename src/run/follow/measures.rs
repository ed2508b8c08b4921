//! Numbers of a shape, by which a branch is drawn.

use crate::Vec3;
use crate::geometry::{area, volume};
use crate::num::real;
use crate::sheet::Sheet;
use crate::solve::continuation::Unknowns;

/// A number of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Displacement from the rest shape along that of the first critical mode, whose largest displacement has length 1; where
    /// no shape moves the change of the species along that mode.
    Mode,
    /// Mean displacement from the rest shape along the forces by which the key pushes as it goes from its first value to its
    /// last, weighted by their size: positive where the sheet gives way to them.
    Load,
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
    /// Mean of a species over its points, by its number.
    Species(usize),
}

/// Directions that displacements are taken along.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Directions {
    /// The first critical mode, once there is one.
    pub mode: Option<Unknowns>,
    /// The species at the start of the first branch, from which their change along a mode counts.
    pub species: Vec<Vec<f64>>,
    /// Difference of the forces on the start between the last value of the key and its first; none if there is none.
    pub load: Option<Vec<Vec3>>,
}

impl Measure {
    /// Those of every sheet, with their names on the command line and their titles with units.
    pub const ALL: [(Self, &str, &str); 10] = [
        (Self::Mode, "along-mode", "amplitude of the critical mode"),
        (Self::Load, "along-load", "mean displacement along the load [length]"),
        (Self::Displacement, "displacement", "largest displacement [length]"),
        (Self::Mean(0), "mean-x", "mean displacement along x [length]"),
        (Self::Mean(1), "mean-y", "mean displacement along y [length]"),
        (Self::Mean(2), "mean-z", "mean displacement along z [length]"),
        (Self::Height, "height", "height [length]"),
        (Self::Area, "area", "area [length^2]"),
        (Self::Volume, "volume", "volume [length^3]"),
        (Self::Species(0), "species", "mean of a species"),
    ];

    /// Its title, with the unit; that of a species has no name.
    #[must_use]
    pub fn title(self) -> &'static str {
        Self::ALL.iter().find(|(measure, ..)| *measure == self).map_or("mean of a species", |m| m.2)
    }

    /// Of the shape `x`; not a number where it has none.
    #[must_use]
    pub fn value(self, sheet: &Sheet, at: &Unknowns, directions: &Directions) -> f64 {
        let x = &at.x[..];
        let moved = || x.iter().zip(sheet.rest()).map(|(x, rest)| x - rest);
        let along = |direction: &[Vec3]| moved().zip(direction).map(|(d, v)| d.dot(v)).sum::<f64>();
        match self {
            Self::Mode => directions.mode.as_ref().map_or(f64::NAN, |mode| {
                let square = mode.x.iter().map(Vec3::norm_squared).sum::<f64>();
                if square > 0.0 {
                    return along(&mode.x) / square;
                }
                let start = directions.species.iter().flatten();
                let changes = at.species.iter().flatten().zip(start).map(|(c, start)| c - start);
                let mode = || mode.species.iter().flatten();
                let square = mode().map(|v| v * v).sum::<f64>();
                changes.zip(mode()).map(|(c, v)| c * v).sum::<f64>() / square
            }),
            Self::Load => directions
                .load
                .as_ref()
                .map_or(f64::NAN, |load| along(load) / load.iter().map(Vec3::norm).sum::<f64>()),
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
            Self::Species(k) => at
                .species
                .get(k)
                .map_or(f64::NAN, |values| values.iter().sum::<f64>() / real(values.len())),
        }
    }
}

impl std::str::FromStr for Measure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(_, name, _)| *name == text).map(|found| found.0);
        found.ok_or_else(|| {
            format!("expected one of {}", Self::ALL.map(|(_, name, _)| name).join(", "))
        })
    }
}
