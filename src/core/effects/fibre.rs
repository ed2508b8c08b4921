//! Fibres: a direction in the sheet, given by a formula of the rest position and carried with the surface.
//!
//! The direction is projected into the plane of the sheet at rest; its length and sign have no meaning. On a triangle or
//! an edge a is the unit vector of the projection of the formula at its centre.

use nalgebra::Unit;
use serde::{Deserialize, Serialize};

use super::{EffectError, Field};
use crate::Vec3;
use crate::kinetics::formula::FieldFormula;
use crate::parallel;
use crate::sheet::{Edge, Sheet};

/// The shortest projection, in units of the direction, that has a direction of its own.
const SHORTEST: f64 = 1e-6;

/// A direction as a scene gives it: three numbers or formulas of `x`, `y`, `z` (rest position).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fibre(pub [Field; 3]);

impl Fibre {
    /// The directions at `points`, of any length.
    fn at(&self, points: &[Vec3]) -> Result<Vec<Vec3>, EffectError> {
        let mut columns = Vec::with_capacity(3);
        for component in &self.0 {
            columns.push(match component {
                Field::Number(value) => vec![value.get(); points.len()],
                Field::Formula(text) => FieldFormula::new(text, false)
                    .map_err(|e| EffectError { key: "fibre", message: e.message, help: e.help })?
                    .at(points, 0.0),
                Field::Array { .. } | Field::Regions { .. } => {
                    return Err(EffectError {
                        key: "fibre",
                        message: "a component of a fibre is a number or a formula".into(),
                        help: Some("as in fibre = [\"-y\", \"x\", 0]".into()),
                    });
                }
            });
        }
        let of = |k: usize| Vec3::from_fn(|axis, _| columns[axis][k]);
        Ok((0..points.len()).map(of).collect())
    }

    /// The square of the cosine of the angle to the fibre, for every edge of the sheet at rest.
    ///
    /// # Errors
    /// A formula that cannot be read, or a direction that does not lie in the sheet anywhere near an edge.
    pub fn along_edges(&self, sheet: &Sheet) -> Result<Vec<f64>, EffectError> {
        let (rest, edges) = (sheet.rest(), sheet.edges());
        let middle = |edge: &Edge| {
            let [a, b] = edge.vertices.map(|v| rest[v as usize]);
            0.5 * (a + b)
        };
        let centres: Vec<Vec3> = edges.iter().map(middle).collect();
        let directions = self.at(&centres)?;
        let mut squares = vec![0.0; edges.len()];
        parallel::fill(&mut squares, |e| {
            let [a, b] = edges[e].vertices.map(|v| rest[v as usize]);
            let both = edges[e].triangles.iter().filter(|t| **t != Edge::NONE);
            let normal: Vec3 = both.map(|t| normal(sheet, *t as usize)).sum();
            let fibre = in_plane(&directions[e], &normal);
            fibre.map_or(f64::NAN, |fibre| fibre.dot(&(b - a).normalize()).powi(2))
        });
        let place = |e: usize| format!("near {:.3?}", centres[e].as_slice());
        checked(squares, |square| square.is_finite(), place)
    }

    /// The fibre in every triangle of the sheet at rest.
    ///
    /// # Errors
    /// As for [`Fibre::along_edges`].
    pub fn in_triangles(&self, sheet: &Sheet) -> Result<Vec<Vec3>, EffectError> {
        let centre = |corners: &[u32; 3]| {
            corners.iter().map(|v| sheet.rest()[*v as usize]).sum::<Vec3>() / 3.0
        };
        let centres: Vec<Vec3> = sheet.triangles().iter().map(centre).collect();
        let directions = self.at(&centres)?;
        let mut fibres = vec![Vec3::zeros(); directions.len()];
        parallel::fill(&mut fibres, |t| {
            in_plane(&directions[t], &normal(sheet, t)).map_or(Vec3::zeros(), Unit::into_inner)
        });
        let place = |t: usize| format!("in triangle {t} near {:.3?}", centres[t].as_slice());
        checked(fibres, |fibre| *fibre != Vec3::zeros(), place)
    }
}

/// The normal of a triangle at rest, of twice its area.
fn normal(sheet: &Sheet, t: usize) -> Vec3 {
    let [a, b, c] = sheet.triangles()[t].map(|v| sheet.rest()[v as usize]);
    (b - a).cross(&(c - a))
}

/// The unit vector of a direction's projection; nothing where there is none.
fn in_plane(direction: &Vec3, normal: &Vec3) -> Option<Unit<Vec3>> {
    let normal = Unit::try_new(*normal, 0.0)?;
    let least = SHORTEST * direction.norm();
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
