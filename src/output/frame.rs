//! A frame: positions, triangles and named fields of one state.

use std::borrow::Cow;

use rumple_numerics::Vec3;

use super::OutputError;

/// Values of one quantity on all vertices or on all triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Field<'a> {
    /// Name with the unit in brackets, as in `mean_curvature [1/length]`.
    pub name: String,
    /// 1 for a scalar, 3 for a vector.
    pub components: usize,
    /// The values, entity by entity, components together.
    pub data: Cow<'a, [f64]>,
}

impl<'a> Field<'a> {
    /// A scalar field.
    #[must_use]
    pub fn scalar(name: impl Into<String>, data: impl Into<Cow<'a, [f64]>>) -> Self {
        Self { name: name.into(), components: 1, data: data.into() }
    }

    /// A vector field.
    #[must_use]
    pub fn vector(name: impl Into<String>, vectors: &[Vec3]) -> Self {
        let data = vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
        Self { name: name.into(), components: 3, data }
    }
}

/// A state at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame<'a> {
    /// Time of the state, in units of time of the scene.
    pub time: f64,
    /// Number of the accepted step that ended here.
    pub step: u64,
    /// Current positions of the vertices.
    pub points: &'a [Vec3],
    /// Vertices of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// Fields on vertices.
    pub point: Vec<Field<'a>>,
    /// Fields on triangles.
    pub cell: Vec<Field<'a>>,
    /// Single numbers of the whole state, as the energy of an effect; names with units.
    pub field_data: Vec<(String, f64)>,
}

impl Frame<'_> {
    /// Checks that names are unique and arrays have the right length.
    ///
    /// # Errors
    /// [`OutputError::Frame`] naming the array, with the number of values expected and found; or
    /// for a time that is not finite, a triangle beyond the points, or an empty sheet. Values
    /// that are not finite pass: a diverged state is worth looking at.
    pub fn check(&self) -> Result<(), OutputError> {
        let refuse = |message: String| Err(OutputError::Frame { step: self.step, message });
        if !self.time.is_finite() {
            return refuse(format!("the time is {}, expected a finite number", self.time));
        }
        if self.points.is_empty() || self.triangles.is_empty() {
            return refuse("the sheet has no vertices or no triangles".to_owned());
        }
        if i32::try_from(self.triangles.len().max(self.points.len()).saturating_mul(3)).is_err() {
            return refuse(format!(
                "{} vertices and {} triangles are more than 32-bit indices hold",
                self.points.len(),
                self.triangles.len()
            ));
        }
        if let Some((t, corners)) = self
            .triangles
            .iter()
            .enumerate()
            .find(|(_, corners)| corners.iter().any(|&v| v as usize >= self.points.len()))
        {
            return refuse(format!(
                "triangle {t} names vertices {corners:?}, but there are only {} vertices",
                self.points.len()
            ));
        }
        for (kind, fields, count) in
            [("point", &self.point, self.points.len()), ("cell", &self.cell, self.triangles.len())]
        {
            for (i, field) in fields.iter().enumerate() {
                if fields[..i].iter().any(|other| other.name == field.name) {
                    return refuse(format!("two {kind} fields are named `{}`", field.name));
                }
                if !matches!(field.components, 1 | 3) {
                    return refuse(format!(
                        "{kind} field `{}` has {} components, expected 1 or 3",
                        field.name, field.components
                    ));
                }
                if field.data.len() != count * field.components {
                    return refuse(format!(
                        "{kind} field `{}` has {} values, expected {count} × {}",
                        field.name,
                        field.data.len(),
                        field.components
                    ));
                }
            }
        }
        Ok(())
    }
}
