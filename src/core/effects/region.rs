//! Sets of vertices, by their rest positions or numbers, as pins and loads name them.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::EffectError;
use super::field::centroid;
use crate::Vec3;
use crate::num::Short;
use crate::num::checked::{Finite, NonNegative};
use crate::sheet::Sheet;

/// A set of vertices, by their rest positions or numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Region {
    /// All vertices on the boundary.
    #[serde(rename = "rim", alias = "boundary")]
    Boundary,
    /// All vertices.
    All,
    /// Vertices inside a box, its faces included.
    #[serde(rename = "box")]
    Cuboid {
        /// Least coordinates.
        min: [f64; 3],
        /// Greatest coordinates.
        max: [f64; 3],
    },
    /// Vertices no further than `radius` from `centre`.
    Ball {
        /// Centre.
        centre: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// Vertices X with `(X - point)·normal ≥ 0`.
    HalfSpace {
        /// A point of the bounding plane.
        #[serde(default)]
        point: [Finite; 3],
        /// Its normal, into the half-space; the length does not matter.
        normal: [Finite; 3],
    },
    /// Vertices whose distance from an axis lies between two radii, both included.
    Ring {
        /// A point of the axis.
        #[serde(default)]
        centre: [Finite; 3],
        /// Direction of the axis; the length does not matter.
        #[serde(default = "along_z")]
        axis: [Finite; 3],
        /// Least distance.
        inner: NonNegative,
        /// Greatest distance.
        outer: NonNegative,
    },
    /// Vertices by number, from 0.
    Vertices(Vec<u32>),
    /// Vertices that belong to each of several regions.
    AllOf(Vec<Region>),
}

fn along_z() -> [Finite; 3] {
    [Finite::ZERO, Finite::ZERO, Finite::ONE]
}

fn vector(v: &[Finite; 3]) -> Vec3 {
    Vec3::from(v.map(Finite::get))
}

impl Region {
    /// Whether a point belongs to it, for a region of space.
    fn has(&self, x: &Vec3) -> Option<bool> {
        Some(match self {
            Self::Cuboid { min, max } => (0..3).all(|a| x[a] >= min[a] && x[a] <= max[a]),
            Self::Ball { centre, radius } => (x - Vec3::from(*centre)).norm() <= *radius,
            Self::HalfSpace { point, normal } => (x - vector(point)).dot(&vector(normal)) >= 0.0,
            Self::Ring { centre, axis, inner, outer } => {
                let axis = vector(axis).normalize();
                let distance = (x - vector(centre)).cross(&axis).norm();
                distance >= inner.get() && distance <= outer.get()
            }
            Self::Boundary | Self::All | Self::Vertices(_) | Self::AllOf(_) => return None,
        })
    }

    /// For every vertex of `sheet` whether it belongs to the region.
    #[must_use]
    pub fn mask(&self, sheet: &Sheet) -> Vec<bool> {
        match self {
            Self::Boundary => sheet.boundary().to_vec(),
            Self::Vertices(list) => {
                let mut list = list.clone();
                list.sort_unstable();
                let listed = |i| list.binary_search(&sheet.number(i)).is_ok();
                (0..sheet.vertex_count()).map(listed).collect()
            }
            Self::AllOf(parts) => {
                let mut mask = vec![true; sheet.vertex_count()];
                for part in parts {
                    for (all, one) in mask.iter_mut().zip(part.mask(sheet)) {
                        *all &= one;
                    }
                }
                mask
            }
            _ => sheet.rest().iter().map(|x| self.has(x).unwrap_or(true)).collect(),
        }
    }

    /// For every triangle of `sheet` whether it belongs to the region: to one of space if its centroid does, to a
    /// set of vertices if one of its corners does.
    #[must_use]
    pub(crate) fn triangle_mask(&self, sheet: &Sheet) -> Vec<bool> {
        let triangles = sheet.triangles().iter();
        match self {
            Self::Boundary | Self::Vertices(_) => {
                let mask = self.mask(sheet);
                triangles.map(|corners| corners.iter().any(|v| mask[*v as usize])).collect()
            }
            Self::AllOf(parts) => {
                let mut mask = vec![true; sheet.triangle_count()];
                for part in parts {
                    for (all, one) in mask.iter_mut().zip(part.triangle_mask(sheet)) {
                        *all &= one;
                    }
                }
                mask
            }
            _ => triangles.map(|c| self.has(&centroid(sheet, c)).unwrap_or(true)).collect(),
        }
    }

    /// The vertices of `sheet` that belong to it, ascending.
    #[must_use]
    pub fn vertices(&self, sheet: &Sheet) -> Vec<usize> {
        let mask = self.mask(sheet);
        (0..mask.len()).filter(|&i| mask[i]).collect()
    }

    /// Like [`Region::mask`], for the region that `effect` has under `where`.
    ///
    /// # Errors
    /// A vertex that does not exist, a direction of length 0, a ring turned inside out, or no
    /// vertex in the region.
    pub fn choose(&self, sheet: &Sheet, effect: &str) -> Result<Vec<bool>, EffectError> {
        self.chosen(sheet, (Self::mask, "vertex"), effect)
    }

    /// The same for [`Region::triangle_mask`].
    ///
    /// # Errors
    /// As for [`Region::choose`].
    pub(crate) fn choose_triangles(
        &self,
        sheet: &Sheet,
        effect: &str,
    ) -> Result<Vec<bool>, EffectError> {
        self.chosen(sheet, (Self::triangle_mask, "triangle"), effect)
    }

    fn chosen(
        &self,
        sheet: &Sheet,
        (mask, noun): (impl Fn(&Self, &Sheet) -> Vec<bool>, &str),
        effect: &str,
    ) -> Result<Vec<bool>, EffectError> {
        let refuse = |message: String, help: &str| EffectError {
            key: "where",
            message,
            help: Some(help.into()),
        };
        self.check(sheet).map_err(|(message, help)| refuse(message, help))?;
        let mask = mask(self, sheet);
        if sheet.reduction().any(mask.contains(&true)) {
            Ok(mask)
        } else {
            let help = self.nothing_chosen(sheet);
            Err(refuse(format!("no {noun} is chosen by this {effect}"), &help))
        }
    }

    /// What the region is and where the sheet is, for a region that has nothing of it.
    fn nothing_chosen(&self, sheet: &Sheet) -> String {
        if let Self::Boundary = self {
            return "a closed surface has no boundary".into();
        }
        let extents = ["x", "y", "z"].iter().enumerate().map(|(axis, name)| {
            let values = || sheet.rest().iter().map(|x| x[axis]);
            let (least, most) = (
                values().fold(f64::INFINITY, f64::min),
                values().fold(f64::NEG_INFINITY, f64::max),
            );
            format!("{name} from {} to {}", Short(least), Short(most))
        });
        let extents = extents.collect::<Vec<_>>().join(", ");
        format!("it is {self}; the sheet at rest has {extents}")
    }

    fn check(&self, sheet: &Sheet) -> Result<(), (String, &'static str)> {
        let [n, _] = sheet.counts_of_whole();
        match self {
            Self::Vertices(list) => match list.iter().find(|v| **v as usize >= n) {
                Some(v) => Err((
                    format!("vertex {v} does not exist: the sheet has {n}"),
                    "vertices are numbered from 0",
                )),
                None => Ok(()),
            },
            Self::HalfSpace { normal, .. } => direction("normal", normal),
            Self::Ring { axis, inner, outer, .. } => {
                direction("axis", axis)?;
                if inner > outer {
                    let (inner, outer) = (inner.get(), outer.get());
                    let message = format!("the ring's inner = {inner} is above outer = {outer}");
                    return Err((message, "inner and outer are distances from the axis"));
                }
                Ok(())
            }
            Self::AllOf(parts) => parts.iter().try_for_each(|part| part.check(sheet)),
            Self::Boundary | Self::All | Self::Cuboid { .. } | Self::Ball { .. } => Ok(()),
        }
    }
}

/// What a region is, in words.
impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let point = |x: [f64; 3]| {
            let [x, y, z] = x.map(Short);
            format!("({x}, {y}, {z})")
        };
        let at = |v: &[Finite; 3]| point(v.map(Finite::get));
        match self {
            Self::Boundary => f.write_str("the boundary"),
            Self::All => f.write_str("all of the sheet"),
            Self::Cuboid { min, max } => {
                write!(f, "the box from {} to {}", point(*min), point(*max))
            }
            Self::Ball { centre, radius } => {
                write!(f, "the ball of radius {} around {}", Short(*radius), point(*centre))
            }
            Self::HalfSpace { point, normal } => {
                write!(f, "the half-space from {} on along {}", at(point), at(normal))
            }
            Self::Ring { centre, axis, inner, outer } => write!(
                f,
                "the ring from {} to {} around the axis through {} along {}",
                Short(inner.get()),
                Short(outer.get()),
                at(centre),
                at(axis)
            ),
            Self::Vertices(list) => write!(f, "a list of {} vertices", list.len()),
            Self::AllOf(parts) => {
                let parts: Vec<String> = parts.iter().map(ToString::to_string).collect();
                write!(f, "what these have in common: {}", parts.join("; "))
            }
        }
    }
}

fn direction(name: &str, v: &[Finite; 3]) -> Result<(), (String, &'static str)> {
    let length = vector(v).norm();
    if length > 0.0 && length.is_finite() {
        Ok(())
    } else {
        Err((format!("the {name} must be a nonzero vector"), "for example [0, 0, 1]"))
    }
}
