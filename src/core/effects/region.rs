//! Sets of vertices or triangles, by rest positions, numbers, or arrays of the mesh file, as pins and loads name them.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::EffectError;
use crate::Vec3;
use crate::num::Short;
use crate::num::checked::{Finite, NonNegative};
use crate::sheet::Sheet;

/// A set of vertices or triangles.
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
    /// Vertices of the triangles, or of the curves, of a physical group of a Gmsh mesh.
    Group(String),
    /// Vertices, or those of triangles, by the values of an array of the mesh file; exactly one of `equals` and `between`.
    Array {
        /// Name of an array of one component.
        name: String,
        /// The value there.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        equals: Option<Finite>,
        /// The least and the greatest value there, both included.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        between: Option<[Finite; 2]>,
    },
    /// What belongs to each of several regions.
    AllOf(Vec<Region>),
    /// What belongs to one or more of several regions.
    AnyOf(Vec<Region>),
    /// What does not belong to a region.
    Not(Box<Region>),
}

fn along_z() -> [Finite; 3] {
    [Finite::ZERO, Finite::ZERO, Finite::ONE]
}

fn vector(v: &[Finite; 3]) -> Vec3 {
    Vec3::from(v.map(Finite::get))
}

impl Region {
    /// Whether a point belongs to it; all points where it is not one of space.
    fn has(&self, x: &Vec3) -> bool {
        match self {
            Self::Cuboid { min, max } => (0..3).all(|a| x[a] >= min[a] && x[a] <= max[a]),
            Self::Ball { centre, radius } => (x - Vec3::from(*centre)).norm() <= *radius,
            Self::HalfSpace { point, normal } => (x - vector(point)).dot(&vector(normal)) >= 0.0,
            Self::Ring { centre, axis, inner, outer } => {
                let axis = vector(axis).normalize();
                let distance = (x - vector(centre)).cross(&axis).norm();
                distance >= inner.get() && distance <= outer.get()
            }
            _ => true,
        }
    }

    /// Whether its vertices are named, rather than those that a mesh happens to have in a part of space.
    pub(super) fn names_vertices(&self) -> bool {
        match self {
            Self::Cuboid { .. }
            | Self::Ball { .. }
            | Self::HalfSpace { .. }
            | Self::Ring { .. } => false,
            Self::AllOf(all) => all.iter().any(Self::names_vertices),
            Self::AnyOf(all) => all.iter().all(Self::names_vertices),
            Self::Not(other) => other.names_vertices(),
            _ => true,
        }
    }

    /// Name and range of the array of the mesh file by which it is given.
    fn array(&self) -> Option<(&str, [f64; 2])> {
        match self {
            Self::Group(name) => Some((name, [1.0; 2])),
            Self::Array { name, equals, between } => {
                let range = between.or(equals.map(|value| [value; 2]))?;
                Some((name, range.map(Finite::get)))
            }
            _ => None,
        }
    }

    /// For every vertex of `sheet` whether it belongs to the region.
    #[must_use]
    pub fn mask(&self, sheet: &Sheet) -> Vec<bool> {
        self.members(sheet, false)
    }

    /// For every triangle of `sheet` whether it belongs to the region: to one of space if its centroid does, to a
    /// set of vertices if one of its corners does.
    #[must_use]
    pub(crate) fn triangle_mask(&self, sheet: &Sheet) -> Vec<bool> {
        self.members(sheet, true)
    }

    /// [`Region::triangle_mask`] or [`Region::mask`].
    fn members(&self, sheet: &Sheet, on_triangles: bool) -> Vec<bool> {
        let triangles = sheet.triangles();
        let of_vertices = |mask: Vec<bool>| match on_triangles {
            true => triangles.iter().map(|t| t.iter().any(|v| mask[*v as usize])).collect(),
            false => mask,
        };
        let count = if on_triangles { triangles.len() } else { sheet.vertex_count() };
        let combined = |parts: &[Self], all: bool| {
            let mut mask = vec![all; count];
            for part in parts {
                // A part changes the mask where it is not `all`.
                let members = mask.iter_mut().zip(part.members(sheet, on_triangles));
                members.filter(|(_, one)| *one != all).for_each(|(whole, one)| *whole = one);
            }
            mask
        };
        match self {
            Self::Boundary => of_vertices(sheet.boundary().to_vec()),
            Self::Vertices(list) => {
                let mut list = list.clone();
                list.sort_unstable();
                let listed = |i| list.binary_search(&sheet.number(i)).is_ok();
                of_vertices((0..sheet.vertex_count()).map(listed).collect())
            }
            Self::Group(_) | Self::Array { .. } => {
                let values = self
                    .array()
                    .and_then(|(name, range)| sheet.where_array(name, range, on_triangles));
                values.unwrap_or_else(|| vec![false; count])
            }
            Self::AllOf(parts) => combined(parts, true),
            Self::AnyOf(parts) => combined(parts, false),
            Self::Not(part) => {
                part.members(sheet, on_triangles).into_iter().map(|one| !one).collect()
            }
            _ if on_triangles => triangles.iter().map(|c| self.has(&sheet.place_of(c))).collect(),
            _ => sheet.places().iter().map(|x| self.has(x)).collect(),
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
        self.check(sheet).map_err(|(message, help)| refuse(message, &help))?;
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
            let values = || sheet.places().iter().map(|x| x[axis]);
            let (least, most) = (
                values().fold(f64::INFINITY, f64::min),
                values().fold(f64::NEG_INFINITY, f64::max),
            );
            format!("{name} from {} to {}", Short(least), Short(most))
        });
        let extents = extents.collect::<Vec<_>>().join(", ");
        format!("it is {self}; the sheet at rest has {extents}")
    }

    fn check(&self, sheet: &Sheet) -> Result<(), (String, String)> {
        let [n, _] = sheet.counts_of_whole();
        match self {
            Self::Vertices(list) => match list.iter().find(|v| **v as usize >= n) {
                Some(v) => Err((
                    format!("vertex {v} does not exist: the sheet has {n}"),
                    "vertices are numbered from 0".into(),
                )),
                None => Ok(()),
            },
            Self::HalfSpace { normal, .. } => direction("normal", normal),
            Self::Ring { axis, inner, outer, .. } => {
                direction("axis", axis)?;
                if inner > outer {
                    let (inner, outer) = (inner.get(), outer.get());
                    let message = format!("the ring's inner = {inner} is above outer = {outer}");
                    return Err((message, "inner and outer are distances from the axis".into()));
                }
                Ok(())
            }
            Self::Array { name, equals, between } if equals.is_some() == between.is_some() => {
                let message = format!("the array `{name}` has one of `equals` and `between`");
                Err((message, format!("as in {{ array = {{ name = {name:?}, equals = 1 }} }}")))
            }
            Self::Group(_) | Self::Array { .. } => self.check_array(sheet),
            Self::AllOf(parts) | Self::AnyOf(parts) => {
                parts.iter().try_for_each(|part| part.check(sheet))
            }
            Self::Not(part) => part.check(sheet),
            Self::Boundary | Self::All | Self::Cuboid { .. } | Self::Ball { .. } => Ok(()),
        }
    }

    /// Refuses a name that the mesh file does not have.
    fn check_array(&self, sheet: &Sheet) -> Result<(), (String, String)> {
        let [points, cells] = sheet.array_names();
        let names = [points, cells].concat();
        let noun = match self {
            Self::Group(_) => "physical group",
            _ => "array of one component",
        };
        let Some((name, range)) = self.array() else { return Ok(()) };
        if sheet.where_array(name, range, false).is_some() {
            return Ok(());
        }
        let help = match names.is_empty() {
            true => format!("it has no {noun}: generated meshes and many formats have none"),
            false => format!("it has: {}", names.join(", ")),
        };
        Err((format!("the mesh has no {noun} `{name}`"), help))
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
            Self::Group(name) => write!(f, "the physical group `{name}`"),
            Self::Array { name, .. } => {
                let [least, most] = self.array().unwrap_or_default().1.map(Short);
                write!(f, "where the array `{name}` is from {least} to {most}")
            }
            Self::AllOf(parts) | Self::AnyOf(parts) => {
                let all = matches!(self, Self::AllOf(_));
                let parts: Vec<String> = parts.iter().map(ToString::to_string).collect();
                let what = if all { "what these have in common" } else { "what one of these has" };
                write!(f, "{what}: {}", parts.join("; "))
            }
            Self::Not(part) => write!(f, "what is not in: {part}"),
        }
    }
}

fn direction(name: &str, v: &[Finite; 3]) -> Result<(), (String, String)> {
    let length = vector(v).norm();
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err((format!("the {name} must be a nonzero vector"), "for example [0, 0, 1]".into()))
}
