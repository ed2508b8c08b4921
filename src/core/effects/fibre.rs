//! Fibres: a direction in the sheet, given over the rest positions and carried with the surface.
//!
//! ```text
//! fibre = [1, 0, 0]                              three numbers
//! fibre = ["-y", "x", 0]                         or formulas of x, y, z (rest position)
//! fibre = { file = "tissue.vtu", array = "a" }   an array of three components of a mesh file
//! ```
//!
//! The direction is projected into the plane of the sheet at rest; its length and sign have no meaning. On a triangle or
//! an edge a is the unit vector of the projection of the formula at its centre. Of an array per point it is the mean over the
//! corners, of an array per cell that of the triangle, at an edge the mean over its sides; before the mean every direction
//! gets the sign in which it makes the least angle with the first one.

use std::fmt;
use std::path::{Path, PathBuf};

use nalgebra::Unit;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize as DeriveDeserialize, Serialize};

use super::{EffectContext, EffectError, Field};
use crate::Vec3;
use crate::kinetics::Location;
use crate::kinetics::formula::FieldFormula;
use crate::parallel;
use crate::sheet::{Edge, Sheet};

/// The shortest projection, in units of the direction, that has a direction of its own.
const MIN_PROJECTION: f64 = 1e-6;

/// A direction as a scene gives it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Fibre {
    /// Three numbers or formulas of `x`, `y` and `z` (rest position).
    Components([Field; 3]),
    /// An array of three components of a mesh file with the same points or faces.
    Array {
        /// The file.
        file: PathBuf,
        /// Name of the array.
        array: String,
    },
}

/// What a table of a fibre has.
#[derive(DeriveDeserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    file: PathBuf,
    array: String,
}

impl<'de> Deserialize<'de> for Fibre {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct FibreVisitor;

        impl<'de> Visitor<'de> for FibreVisitor {
            type Value = Fibre;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "three numbers or formulas of x, y and z, or a table with the keys `file` and `array`",
                )
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Fibre, A::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(list)).map(Fibre::Components)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Fibre, A::Error> {
                let Table { file, array } = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Fibre::Array { file, array })
            }
        }

        deserializer.deserialize_any(FibreVisitor)
    }
}

/// Directions of an array, at the vertices or the triangles.
struct Directions {
    place: Location,
    values: Vec<Vec3>,
}

impl Fibre {
    /// The file that it is read from.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Components(_) => None,
            Self::Array { file, .. } => Some(file),
        }
    }

    /// Makes the path of its file absolute: it counts from `folder`.
    pub fn resolve_path_against(&mut self, folder: &Path) {
        if let Self::Array { file, .. } = self {
            *file = folder.join(&*file);
        }
    }

    /// The directions at triangles or edges with these centres, of any length; `vertices` and `triangles` of each make up
    /// its value of an array.
    fn directions_at(
        &self,
        context: &EffectContext<'_>,
        centres: &[Vec3],
        vertices: impl Fn(usize) -> Vec<u32>,
        triangles: impl Fn(usize) -> Vec<u32>,
    ) -> Result<Vec<Vec3>, EffectError> {
        match self {
            Self::Components(components) => of_components(components, centres),
            Self::Array { file, array } => {
                let Directions { place, values } = of_file(context, file, array)?;
                let of = |k: usize| match place {
                    Location::Vertex => aligned_sum(&values, &vertices(k)),
                    _ => aligned_sum(&values, &triangles(k)),
                };
                Ok((0..centres.len()).map(of).collect())
            }
        }
    }

    /// The square of the cosine of the angle to the fibre, for every edge of the sheet at rest.
    ///
    /// # Errors
    /// A formula or an array that cannot be read, or a direction that does not lie in the sheet anywhere near an edge.
    pub fn cos_squared_of_edges(
        &self,
        context: &EffectContext<'_>,
    ) -> Result<Vec<f64>, EffectError> {
        Ok(self.cos_sin_of_edges(context)?.into_iter().map(|[square, _]| square).collect())
    }

    /// cos² θ and sin θ cos θ of every edge of the sheet at rest, θ from the fibre counter-clockwise seen from where the normals
    /// point to.
    ///
    /// # Errors
    /// As for [`Fibre::cos_squared_of_edges`].
    pub fn cos_sin_of_edges(
        &self,
        context: &EffectContext<'_>,
    ) -> Result<Vec<[f64; 2]>, EffectError> {
        let sheet = context.sheet;
        let (rest, edges) = (sheet.rest(), sheet.edges());
        let centres: Vec<Vec3> = edges.iter().map(|edge| sheet.place_of(&edge.vertices)).collect();
        let sides = |e: usize| edges[e].triangles.into_iter().filter(|t| *t != Edge::NONE);
        let ends = |e: usize| edges[e].vertices.to_vec();
        let directions = self.directions_at(context, &centres, ends, |e| sides(e).collect())?;
        let mut angles = vec![[0.0; 2]; edges.len()];
        parallel::fill(&mut angles, |e| {
            let [a, b] = edges[e].vertices.map(|v| rest[v as usize]);
            let normal: Vec3 = sides(e).map(|t| normal(sheet, t as usize)).sum();
            let Some(fibre) = in_plane(&directions[e], &normal) else { return [f64::NAN; 2] };
            let edge = (b - a).normalize();
            let (along, across) = (fibre.dot(&edge), normal.normalize().cross(&fibre).dot(&edge));
            [along.powi(2), along * across]
        });
        let place = |e: usize| format!("near {:.3?}", centres[e].as_slice());
        checked(angles, |[square, _]| square.is_finite(), place)
    }

    /// The fibre in every triangle of the sheet at rest.
    ///
    /// # Errors
    /// As for [`Fibre::cos_squared_of_edges`].
    pub(crate) fn in_triangles(
        &self,
        context: &EffectContext<'_>,
    ) -> Result<Vec<Vec3>, EffectError> {
        let sheet = context.sheet;
        let centres = sheet.triangle_places();
        let corners = |t: usize| sheet.triangles()[t].to_vec();
        let directions =
            self.directions_at(context, &centres, corners, |t| vec![crate::num::index(t)])?;
        let mut fibres = vec![Vec3::zeros(); directions.len()];
        parallel::fill(&mut fibres, |t| {
            in_plane(&directions[t], &normal(sheet, t)).map_or(Vec3::zeros(), Unit::into_inner)
        });
        let place = |t: usize| format!("in triangle {t} near {:.3?}", centres[t].as_slice());
        checked(fibres, |fibre| *fibre != Vec3::zeros(), place)
    }
}

fn of_components(components: &[Field; 3], points: &[Vec3]) -> Result<Vec<Vec3>, EffectError> {
    let mut columns = Vec::with_capacity(3);
    for component in components {
        columns.push(match component {
            Field::Number(value) => vec![value.get(); points.len()],
            Field::Formula(text) => FieldFormula::new(text, false)
                .map_err(|e| EffectError { key: "fibre", message: e.message, help: e.help })?
                .evaluate(points, 0.0),
            Field::Array { .. } | Field::Regions { .. } => {
                return Err(EffectError {
                    key: "fibre",
                    message: "a component of a fibre is a number or a formula".into(),
                    help: Some(
                        "as in fibre = [\"-y\", \"x\", 0]; an array has all three: fibre = { file = …, array = … }".into(),
                    ),
                });
            }
        });
    }
    let of = |k: usize| Vec3::from_fn(|axis, _| columns[axis][k]);
    Ok((0..points.len()).map(of).collect())
}

/// The array of a file, per point or per cell.
fn of_file(
    context: &EffectContext<'_>,
    file: &Path,
    array: &str,
) -> Result<Directions, EffectError> {
    let refuse = |message: String, help: Option<String>| EffectError {
        key: "fibre",
        message: format!("{}: {message}", file.display()),
        help,
    };
    let Some(read) = context.read else {
        return Err(refuse("files are not read here".into(), Some("give three numbers".into())));
    };
    let unread = |message| EffectError { key: "fibre", message, help: None };
    let surface = read(file).map_err(unread)?;
    let (found, place, needed) = match (surface.point_array(array), surface.cell_array(array)) {
        (Some(found), _) => (found, Location::Vertex, context.sheet.vertex_count()),
        (None, Some(found)) => (found, Location::Face, context.sheet.triangle_count()),
        (None, None) => {
            let all = surface.point_arrays.iter().chain(&surface.cell_arrays);
            let names: Vec<&str> = all.map(|array| array.name.as_str()).collect();
            let help = match names.is_empty() {
                true => "the file has none".to_owned(),
                false => format!("its arrays: {}", names.join(", ")),
            };
            return Err(refuse(format!("no array `{array}`"), Some(help)));
        }
    };
    if found.components != 3 {
        let message = format!(
            "array `{}` has {}, and a fibre needs 3",
            found.name,
            match found.components {
                1 => "1 component".to_owned(),
                many => format!("{many} components"),
            }
        );
        let help = "those of a direction along x, y and z; formulas give it too, as in fibre = [\"-y\", \"x\", 0]";
        return Err(refuse(message, Some(help.into())));
    }
    if found.values.len() != 3 * needed {
        let message = format!(
            "array `{}` has {} directions; {needed} are needed, one per {} of the sheet",
            found.name,
            found.values.len() / 3,
            place.noun()
        );
        return Err(refuse(message, None));
    }
    let values = found.values.chunks_exact(3).map(Vec3::from_column_slice).collect();
    Ok(Directions { place, values })
}

/// Sum of some directions, each of unit length and with the sign in which it is closest to the first.
fn aligned_sum(all: &[Vec3], some: &[u32]) -> Vec3 {
    let mut sum = Vec3::zeros();
    for k in some {
        let one = all[*k as usize].try_normalize(0.0).unwrap_or_default();
        sum += if sum.dot(&one) < 0.0 { -one } else { one };
    }
    sum
}

/// Derivatives along a unit vector in triangle `t` at rest of its three shape functions, 1/length: `n × e_k/(2A)` along it, e_k opposite
/// corner k.
pub(super) fn shape_slopes(sheet: &Sheet, t: usize, fibre: &Vec3) -> [f64; 3] {
    let x = sheet.triangles()[t].map(|v| sheet.rest()[v as usize]);
    let normal = (x[1] - x[0]).cross(&(x[2] - x[0]));
    let twice_area = normal.norm();
    [0, 1, 2].map(|k| {
        let edge = x[(k + 2) % 3] - x[(k + 1) % 3];
        (normal / twice_area).cross(&edge).dot(fibre) / twice_area
    })
}

/// The normal of a triangle at rest, of twice its area.
fn normal(sheet: &Sheet, t: usize) -> Vec3 {
    let [a, b, c] = sheet.triangles()[t].map(|v| sheet.rest()[v as usize]);
    (b - a).cross(&(c - a))
}

/// The unit vector of a direction's projection; nothing where there is none.
fn in_plane(direction: &Vec3, normal: &Vec3) -> Option<Unit<Vec3>> {
    let normal = Unit::try_new(*normal, 0.0)?;
    let least = MIN_PROJECTION * direction.norm();
    let projected = direction - normal.dot(direction) * normal.into_inner();
    Unit::try_new(projected, least.max(f64::MIN_POSITIVE))
}

fn checked<T>(
    all: Vec<T>,
    right: impl Fn(&T) -> bool,
    place: impl Fn(usize) -> String,
) -> Result<Vec<T>, EffectError> {
    match all.iter().position(|one| !right(one)) {
        None => Ok(all),
        Some(k) => Err(EffectError {
            key: "fibre",
            message: format!("the fibre has no direction in the sheet {}", place(k)),
            help: Some("it must not vanish, nor be normal to the sheet, anywhere".into()),
        }),
    }
}
