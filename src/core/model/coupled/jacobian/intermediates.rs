//! What stands between chemistry and shape: `q = (l̄ of the edges, C₀ of the vertices, c̄ at the vertices)`.

use crate::Vec3;
use crate::effects::ParameterField;
use crate::kinetics::field::Columns;
use crate::linear::{BlockMatrix, Entries};
use crate::model::coupled::Layout;
use crate::model::{
    Chemistry, Derivatives, HeldValues, Model, ModelError, Potential, SignalColumns, State, Surface,
};
use crate::sheet::Sheet;

impl JacobianInputs<'_> {
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
    at: &JacobianInputs<'_>,
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
    let (inputs, held) = (chemistry.inputs(), chemistry.held());
    let mut sink = BySignals { layout, partials, inputs, held, entries, lengths: true };
    chemistry.signals().derivatives(&potential.shape(&at.state.x), &mut sink);
}

/// ∂q/∂y.
pub(super) fn intermediates_by_unknowns(
    potential: &Potential,
    at: &JacobianInputs<'_>,
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
    at: &JacobianInputs<'_>,
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

/// Everything at one state.
pub(super) struct JacobianInputs<'a> {
    pub(super) layout: &'a Layout,
    pub(super) state: &'a State,
    pub(super) surface: &'a Surface,
    pub(super) signals: &'a SignalColumns,
    pub(super) hessian: Option<&'a BlockMatrix>,
    /// The laws, where species are unknowns, with ∂R/∂(species, signals).
    pub(super) chemistry: Option<(&'a Chemistry, Columns)>,
    /// ∂Φ/∂c at the edges, times the factor of other growth.
    pub(super) factor_slopes: Option<Vec<Vec<f64>>>,
    /// ∂C₀/∂c at the vertices.
    pub(super) curvature_slopes: Option<Vec<Vec<f64>>>,
    /// Numbers of the species that energies read.
    pub(super) read: &'a [usize],
}

impl<'a> JacobianInputs<'a> {
    /// All but the Hessian. Lengths that nothing feels need no derivatives.
    pub(super) fn new(
        model: &'a Model,
        (layout, state): (&'a Layout, &'a State),
        (surface, signals): (&'a Surface, &'a SignalColumns),
        feels_lengths: impl FnOnce(&Chemistry) -> bool,
    ) -> Result<Self, ModelError> {
        let mut at = Self {
            layout,
            state,
            surface,
            signals,
            hessian: None,
            chemistry: None,
            factor_slopes: None,
            curvature_slopes: None,
            read: &[],
        };
        let Some(chemistry) = model.chemistry().filter(|_| layout.species() > 0) else {
            return Ok(at);
        };
        let c: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
        let on = (&**model.sheet(), state.time);
        at.chemistry = Some((chemistry, chemistry.partials(on, surface, &c, signals)?));
        if feels_lengths(chemistry) {
            at.factor_slopes = factor_slopes(model, chemistry, surface, state)?;
        }
        if layout.mechanical() > 0 {
            let (sheet, species) = (model.sheet(), &state.species);
            at.curvature_slopes = chemistry.curvature_slopes(sheet, surface, species)?;
            at.read = model.mechanics().species();
        }
        Ok(at)
    }
}

pub(super) fn add_vector(
    layout: &Layout,
    entries: &mut Entries<'_>,
    row: usize,
    vertex: usize,
    by: Vec3,
) {
    for axis in 0..3 {
        if let Some(column) = layout.displacement(vertex, axis) {
            entries.add(row, column, by[axis]);
        }
    }
}

/// Turns derivatives of signals into those of the rates.
pub(super) struct BySignals<'a, 'b, 'c> {
    pub(super) layout: &'a Layout,
    pub(super) partials: &'a Columns,
    pub(super) inputs: usize,
    pub(super) held: &'a HeldValues,
    pub(super) entries: &'b mut Entries<'c>,
    /// Whether derivatives by lengths are wanted, or those by positions.
    pub(super) lengths: bool,
}

impl<'a> BySignals<'a, '_, '_> {
    /// The rows of the rates at `point`, but for those that are held, and their derivatives by a signal there.
    fn rates(&self, column: usize, point: usize) -> impl Iterator<Item = (usize, f64)> + use<'a> {
        let Self { layout, partials, inputs, held, .. } = *self;
        let free = (0..layout.species()).filter(move |&s| !held.holds(s, point));
        free.map(move |s| {
            let entry = s * inputs + layout.species() + column;
            (layout.concentration(s, point), partials.column(entry)[point])
        })
    }
}

impl Derivatives for BySignals<'_, '_, '_> {
    fn by_position(&mut self, column: usize, point: usize, vertex: usize, value: Vec3) {
        if !self.lengths {
            for (row, slope) in self.rates(column, point) {
                add_vector(self.layout, self.entries, row, vertex, slope * value);
            }
        }
    }

    fn by_length(&mut self, column: usize, point: usize, edge: usize, value: f64) {
        if self.lengths {
            for (row, slope) in self.rates(column, point) {
                self.entries.add(row, edge, slope * value);
            }
        }
    }
}
