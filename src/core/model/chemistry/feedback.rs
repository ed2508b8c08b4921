//! What species do to the sheet: spontaneous curvature at the vertices, length factors at the edges.

use super::{Chemistry, Surface};
use crate::kinetics::{Feedback, KineticsError, Location};
use crate::sheet::Sheet;

/// Values at points, and their derivatives, one column a species.
type WithSlopes = (Vec<f64>, Vec<Vec<f64>>);

impl Chemistry {
    /// Spontaneous curvature C₀ at every vertex, 1/length; `None` if the kinetics gives none.
    ///
    /// # Errors
    /// If the plugin fails or gives a number that is not finite.
    pub fn curvature(
        &self,
        sheet: &Sheet,
        surface: &Surface,
        species: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, KineticsError> {
        if !self.descriptor().capabilities.curvature {
            return Ok(None);
        }
        let at_vertices = self.at_vertices(sheet, surface, species);
        self.feedback(Feedback::Curvature, Location::Vertex, &at_vertices)
    }

    /// ∂C₀/∂c at every vertex, one column a species; `None` if the kinetics gives no spontaneous curvature.
    ///
    /// # Errors
    /// As for [`Chemistry::curvature`].
    pub(crate) fn curvature_slopes(
        &self,
        sheet: &Sheet,
        surface: &Surface,
        species: &[Vec<f64>],
    ) -> Result<Option<Vec<Vec<f64>>>, KineticsError> {
        if !self.descriptor().capabilities.curvature {
            return Ok(None);
        }
        let at_vertices = self.at_vertices(sheet, surface, species);
        let found = self.feedback_slopes(Feedback::Curvature, Location::Vertex, &at_vertices)?;
        Ok(found.map(|(_, slopes)| slopes))
    }

    /// A quantity of [`Feedback`]; `None` if the kinetics does not give it.
    pub(super) fn feedback(
        &self,
        which: Feedback,
        location: Location,
        species: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, KineticsError> {
        if !which.is_given(&self.descriptor().capabilities) {
            return Ok(None);
        }
        let mut values = vec![which.neutral(); species.first().map_or(0, Vec::len)];
        let (quantity, inputs) = (which.into(), (species, &[][..]));
        let outcome = self.evaluate(quantity, location, inputs, &mut [&mut values], &mut []);
        self.flagged.note(location, outcome)?;
        Ok(Some(values))
    }

    /// The same with its derivatives, one column a species.
    pub(super) fn feedback_slopes(
        &self,
        which: Feedback,
        location: Location,
        species: &[Vec<f64>],
    ) -> Result<Option<WithSlopes>, KineticsError> {
        if !which.is_given(&self.descriptor().capabilities) {
            return Ok(None);
        }
        let count = species.first().map_or(0, Vec::len);
        let mut values = vec![which.neutral(); count];
        let mut slopes = vec![vec![0.0; count]; species.len()];
        let mut out: Vec<&mut [f64]> = slopes.iter_mut().map(Vec::as_mut_slice).collect();
        let (quantity, inputs) = (which.into(), (species, &[][..]));
        let outcome = self.evaluate(quantity, location, inputs, &mut [&mut values], &mut out);
        self.flagged.note(location, outcome)?;
        Ok(Some((values, slopes)))
    }
}
