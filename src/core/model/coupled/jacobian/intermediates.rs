//! What stands between chemistry and shape: `q = (l̄ of the edges, C₀ of the vertices, c̄ at the vertices)`.

use super::{BySignals, Values, add_vector};
use crate::Vec3;
use crate::effects::ParameterField;
use crate::linear::Entries;
use crate::model::{Chemistry, Model, ModelError, Potential, State, Surface};
use crate::sheet::Sheet;

impl Values<'_> {
    /// Whether anything stands between chemistry and shape.
    pub(super) fn has_intermediates(&self) -> bool {
        self.factor_slopes.is_some() || self.curvature_slopes.is_some() || !self.read.is_empty()
    }

    /// Where the spontaneous curvatures and the species of the vertices begin among q, and how many q there are.
    pub(super) fn intermediates(&self, sheet: &Sheet) -> [usize; 3] {
        let (edges, vertices) = (sheet.edges().len(), sheet.vertex_count());
        let species = edges + self.curvature_slopes.as_ref().map_or(0, |_| vertices);
        [edges, species, species + self.read.len() * vertices]
    }
}

/// ∂Φ/∂c at the edges, times the factors of other growth and of remodelling; none where no law has a length factor.
pub(super) fn factor_slopes(
    model: &Model,
    chemistry: &Chemistry,
    surface: &Surface,
    state: &State,
) -> Result<Option<Vec<Vec<f64>>>, ModelError> {
    let slopes = chemistry.length_factor_slopes(model.sheet(), surface, &state.species)?;
    let Some(mut slopes) = slopes else { return Ok(None) };
    if let Some(grown) = model.growth(state.time)? {
        for slope in &mut slopes {
            slope.iter_mut().zip(grown.iter()).for_each(|(slope, grown)| *slope *= grown);
        }
    }
    for factor in model.internal_factors(state)? {
        for slope in &mut slopes {
            slope.iter_mut().zip(factor).for_each(|(slope, factor)| *slope *= factor);
        }
    }
    Ok(Some(slopes))
}

/// ∂F/∂q.
pub(super) fn residual_by_intermediates(
    potential: &mut Potential,
    at: &Values<'_>,
    entries: &mut Entries<'_>,
) {
    let layout = at.layout;
    let [curvatures, species, _] = at.intermediates(potential.sheet());
    let vertices = potential.sheet().vertex_count();
    let mut add = |vertex: usize, column: usize, by: Vec3| {
        for axis in 0..3 {
            if let Some(row) = layout.displacement(vertex, axis) {
                entries.add(row, column, -by[axis]);
            }
        }
    };
    if at.curvature_slopes.is_some() {
        let by = ParameterField::SpontaneousCurvature;
        potential.mixed_derivatives(&at.state.x, by, &mut |vertex, v, by| {
            add(vertex, curvatures + v, by);
        });
    }
    for (k, s) in at.read.iter().enumerate() {
        potential.mixed_derivatives(
            &at.state.x,
            ParameterField::Species(*s),
            &mut |vertex, v, by| {
                add(vertex, species + k * vertices + v, by);
            },
        );
    }
    if at.factor_slopes.is_none() {
        return;
    }
    if layout.mechanical() > 0 {
        potential.mixed_derivatives(&at.state.x, ParameterField::OptimalLength, &mut add);
    }
    let Some((chemistry, partials)) = &at.chemistry else { return };
    let (inputs, held) = (chemistry.descriptor().inputs(), chemistry.held());
    let mut sink = BySignals { layout, partials, inputs, held, entries, lengths: true };
    chemistry.signals().derivatives(&potential.shape(&at.state.x), &mut sink);
}

/// ∂q/∂y.
pub(super) fn intermediates_by_unknowns(
    potential: &Potential,
    at: &Values<'_>,
    entries: &mut Entries<'_>,
) {
    let sheet = potential.sheet();
    let reference = potential.metric().reference_length();
    for (s, slope) in at.factor_slopes.iter().flatten().enumerate() {
        for (e, edge) in sheet.edges().iter().enumerate() {
            let by_end = 0.5 * reference[e] * slope[e];
            for v in edge.vertices {
                by_vertex(potential, at, (e, s, v as usize), by_end, entries);
            }
        }
    }
    let [curvatures, species, _] = at.intermediates(sheet);
    for (s, slope) in at.curvature_slopes.iter().flatten().enumerate() {
        for (v, slope) in slope.iter().enumerate() {
            by_vertex(potential, at, (curvatures + v, s, v), *slope, entries);
        }
    }
    let vertices = sheet.vertex_count();
    for (k, s) in at.read.iter().enumerate() {
        for v in 0..vertices {
            by_vertex(potential, at, (species + k * vertices + v, *s, v), 1.0, entries);
        }
    }
}

/// Adds to a row what changes by `slope` with species number s at a vertex.
fn by_vertex(
    potential: &Potential,
    at: &Values<'_>,
    (row, s, vertex): (usize, usize, usize),
    slope: f64,
    entries: &mut Entries<'_>,
) {
    let (layout, sheet) = (at.layout, potential.sheet());
    Chemistry::sources_of_vertex(sheet, at.surface, vertex, |point, share| {
        entries.add(row, layout.concentration(s, point), slope * share);
    });
    if layout.mechanical() > 0
        && let Some(average) = &at.surface.average
    {
        let c = &at.state.species[s];
        average.shape_derivatives(sheet, &at.state.x, c, vertex, |m, by| {
            add_vector(layout, entries, row, m, slope * by);
        });
    }
}
