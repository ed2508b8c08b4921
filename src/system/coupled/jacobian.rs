//! ∂F/∂y of the coupled system, assembled from what effects, signals and kinetics know.
//!
//! Optimal lengths l̄ stand between chemistry and shape, so the Jacobian is a sum and a product:
//!
//! ```text
//! ∂F/∂y = ∂F/∂y|_l̄ + (∂F/∂l̄) (∂l̄/∂y)
//!
//! ∂F_x/∂x|_l̄ = -H                        ∂F_x/∂l̄ = -∂²U/∂x∂l̄
//! ∂F_c/∂x|_l̄ = ∂R/∂s ∂s/∂x + D ∂(Δ_x c)/∂x    ∂F_c/∂l̄ = ∂R/∂s ∂s/∂l̄
//! ∂F_c/∂c|_l̄ = ∂R/∂c + D Δ_x             ∂l̄_e/∂c = l⁰_e Φ'(c_e) ∂c_e/∂c
//! ```
//!
//! `c_e` is the mean of the ends of a bond; species on faces are carried there by averages that
//! depend on x, so that then ∂l̄/∂x is there too.

use std::sync::Arc;

use super::Layout;
use crate::effects::HessianPart;
use crate::kinetics::field::Columns;
use crate::solve::linear::{Assembly, BlockMatrix, BlockPattern, Entries, Sparse, SumOfProduct};
use crate::state::State;
use crate::system::signals::Derivatives;
use crate::system::{SignalColumns, System};
use crate::{Result, Vec3};

/// The Jacobian with everything that it is assembled from.
#[derive(Default)]
pub(super) struct Jacobian {
    hessian: Option<BlockMatrix>,
    direct: Assembly,
    lengths: Option<Lengths>,
}

/// What goes through the optimal lengths.
struct Lengths {
    of_residual: Assembly,
    of_unknowns: Assembly,
    total: SumOfProduct,
}

/// Everything at one state.
struct Values<'a> {
    layout: &'a Layout,
    state: &'a State,
    hessian: Option<&'a BlockMatrix>,
    /// ∂R/∂(species, signals).
    partials: Option<Columns>,
    /// ∂Φ/∂c at the edges.
    factor_slopes: Option<Vec<Vec<f64>>>,
}

impl Jacobian {
    pub(super) fn new(
        system: &mut System,
        layout: &Layout,
        state: &State,
        given: Option<&SignalColumns>,
    ) -> Result<Self> {
        let hessian = (layout.mechanical() > 0).then(|| {
            let pattern = BlockPattern::two_rings(system.mechanics().sheet());
            BlockMatrix::zeros(Arc::new(pattern))
        });
        let values = values(hessian.as_ref(), system, layout, state, given)?;
        let n = layout.unknowns();
        let direct = Assembly::new(n, n, |entries| direct(system, &values, entries));
        let lengths = values.factor_slopes.is_some().then(|| {
            let edges = system.mechanics().sheet().edges().len();
            let of_residual =
                Assembly::new(n, edges, |entries| residual_by_lengths(system, &values, entries));
            let of_unknowns =
                Assembly::new(edges, n, |entries| lengths_by_unknowns(system, &values, entries));
            let total =
                SumOfProduct::new(direct.matrix(), of_residual.matrix(), of_unknowns.matrix());
            Lengths { of_residual, of_unknowns, total }
        });
        let mut jacobian = Self { hessian, direct, lengths };
        jacobian.fill(system, layout, state, given)?;
        Ok(jacobian)
    }

    pub(super) fn fill(
        &mut self,
        system: &mut System,
        layout: &Layout,
        state: &State,
        given: Option<&SignalColumns>,
    ) -> Result<()> {
        if let Some(hessian) = &mut self.hessian {
            system.mechanics().hessian(&state.x, HessianPart::Full, hessian);
        }
        let values = values(self.hessian.as_ref(), system, layout, state, given)?;
        self.direct.fill(|entries| direct(system, &values, entries));
        if let Some(Lengths { of_residual, of_unknowns, total }) = &mut self.lengths {
            of_residual.fill(|entries| residual_by_lengths(system, &values, entries));
            of_unknowns.fill(|entries| lengths_by_unknowns(system, &values, entries));
            total.fill(self.direct.matrix(), of_residual.matrix(), of_unknowns.matrix());
        }
        Ok(())
    }

    pub(super) fn matrix(&self) -> &Sparse {
        match &self.lengths {
            Some(lengths) => lengths.total.matrix(),
            None => self.direct.matrix(),
        }
    }
}

fn values<'a>(
    hessian: Option<&'a BlockMatrix>,
    system: &mut System,
    layout: &'a Layout,
    state: &'a State,
    given: Option<&SignalColumns>,
) -> Result<Values<'a>> {
    let mut values = Values { layout, state, hessian, partials: None, factor_slopes: None };
    let signals = given.map_or_else(|| system.signals(state), Clone::clone);
    let sheet = system.mechanics().sheet().clone();
    // Of a chemistry that does not change the lengths alone matter, and those do not change either.
    if let Some(chemistry) = system.chemistry().filter(|_| layout.species() > 0) {
        let c: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
        values.partials = Some(chemistry.reaction_partials(&c, &signals)?);
        // Lengths that nothing feels need no derivatives.
        if layout.mechanical() > 0 || given.is_none() && chemistry.reads_strain() {
            values.factor_slopes = chemistry.length_factor_slopes(&sheet, &state.species)?;
        }
    }
    Ok(values)
}

/// ∂F/∂y at fixed optimal lengths.
fn direct(system: &mut System, at: &Values<'_>, entries: &mut Entries<'_>) {
    let layout = at.layout;
    if let Some(hessian) = at.hessian {
        let places: Vec<[Option<usize>; 3]> = layout.displacements().collect();
        for i in 0..places.len() {
            for (&j, block) in hessian.pattern().row(i).iter().zip(hessian.row(i)) {
                let j = j as usize;
                for (a, row) in places[i].into_iter().enumerate() {
                    for (b, column) in places[j].into_iter().enumerate() {
                        if let (Some(row), Some(column)) = (row, column) {
                            entries.add(row, column, -block[(a, b)]);
                            if j != i {
                                entries.add(column, row, -block[(a, b)]);
                            }
                        }
                    }
                }
            }
        }
    }
    let (Some(partials), Some(chemistry)) = (&at.partials, system.chemistry_apart()) else {
        return;
    };
    let (chemistry, mechanics) = chemistry;
    let (species, inputs) = (layout.species(), chemistry.descriptor().inputs());
    for point in 0..layout.points() {
        for s in 0..species {
            for j in 0..species {
                let value = partials.column(s * inputs + j)[point];
                entries.add(layout.concentration(s, point), layout.concentration(j, point), value);
            }
        }
    }
    let sheet = mechanics.sheet().clone();
    for transport in chemistry.transport() {
        let s = transport.species();
        transport.entries(&sheet, &mut |i, j, value| {
            entries.add(layout.concentration(s, i), layout.concentration(s, j), value);
        });
        if layout.mechanical() > 0 {
            let (x, c) = (&at.state.x, &at.state.species[s]);
            transport.shape_derivatives(&sheet, x, c, &mut |i, vertex, by| {
                add_vector(layout, entries, layout.concentration(s, i), vertex, by);
            });
        }
    }
    if layout.mechanical() > 0 {
        let mut sink = BySignals { layout, partials, inputs, entries, lengths: false };
        mechanics
            .with_shape(&at.state.x, |shape| chemistry.signals().derivatives(shape, &mut sink));
    }
}

fn add_vector(layout: &Layout, entries: &mut Entries<'_>, row: usize, vertex: usize, by: Vec3) {
    for axis in 0..3 {
        if let Some(column) = layout.displacement(vertex, axis) {
            entries.add(row, column, by[axis]);
        }
    }
}

/// Turns derivatives of signals into those of the rates.
struct BySignals<'a, 'b, 'c> {
    layout: &'a Layout,
    partials: &'a Columns,
    inputs: usize,
    entries: &'b mut Entries<'c>,
    /// Whether derivatives by lengths are wanted, or those by positions.
    lengths: bool,
}

impl BySignals<'_, '_, '_> {
    /// The row of the rate of species `s` at `point`, and its derivative by a signal there.
    fn rate(&self, s: usize, column: usize, point: usize) -> (usize, f64) {
        let entry = s * self.inputs + self.layout.species() + column;
        (self.layout.concentration(s, point), self.partials.column(entry)[point])
    }
}

impl Derivatives for BySignals<'_, '_, '_> {
    fn by_position(&mut self, column: usize, point: usize, vertex: usize, value: Vec3) {
        if !self.lengths {
            for s in 0..self.layout.species() {
                let (row, slope) = self.rate(s, column, point);
                add_vector(self.layout, self.entries, row, vertex, slope * value);
            }
        }
    }

    fn by_length(&mut self, column: usize, point: usize, edge: usize, value: f64) {
        if self.lengths {
            for s in 0..self.layout.species() {
                let (row, slope) = self.rate(s, column, point);
                self.entries.add(row, edge, slope * value);
            }
        }
    }
}

/// ∂F/∂l̄.
fn residual_by_lengths(system: &mut System, at: &Values<'_>, entries: &mut Entries<'_>) {
    let layout = at.layout;
    if layout.mechanical() > 0 {
        system.mechanics().metric_derivatives(&at.state.x, &mut |vertex, edge, by| {
            for axis in 0..3 {
                if let Some(row) = layout.displacement(vertex, axis) {
                    entries.add(row, edge, -by[axis]);
                }
            }
        });
    }
    let (Some(partials), Some(apart)) = (&at.partials, system.chemistry_apart()) else { return };
    let (chemistry, mechanics) = apart;
    let inputs = chemistry.descriptor().inputs();
    let mut sink = BySignals { layout, partials, inputs, entries, lengths: true };
    mechanics.with_shape(&at.state.x, |shape| chemistry.signals().derivatives(shape, &mut sink));
}

/// ∂l̄/∂y.
fn lengths_by_unknowns(system: &mut System, at: &Values<'_>, entries: &mut Entries<'_>) {
    let (Some(slopes), Some((chemistry, mechanics))) =
        (&at.factor_slopes, system.chemistry_apart())
    else {
        return;
    };
    let layout = at.layout;
    let sheet = mechanics.sheet().clone();
    let reference = mechanics.metric().reference_length();
    for (s, slope) in slopes.iter().enumerate() {
        for (e, edge) in sheet.edges().iter().enumerate() {
            let by_end = 0.5 * reference[e] * slope[e];
            for v in edge.vertices {
                chemistry.sources_of_vertex(&sheet, v as usize, |point, share| {
                    entries.add(e, layout.concentration(s, point), by_end * share);
                });
                if layout.mechanical() > 0
                    && let Some(average) = chemistry.average()
                {
                    let c = &at.state.species[s];
                    average.shape_derivatives(&sheet, &at.state.x, c, v as usize, |m, by| {
                        add_vector(layout, entries, e, m, by_end * by);
                    });
                }
            }
        }
    }
}
