//! ∂F/∂y of the coupled system, assembled from what effects, signals and kinetics know.
//!
//! Optimal lengths l̄, the spontaneous curvatures C₀ of laws and species c̄ that energies read stand between chemistry and
//! shape, so the Jacobian is a sum and a product, with q = (l̄ of the edges, C₀ of the vertices, c̄ at the vertices):
//!
//! ```text
//! ∂F/∂y = ∂F/∂y|_q + (∂F/∂q) (∂q/∂y)
//!
//! ∂F_x/∂x|_l̄ = -H                        ∂F_x/∂l̄ = -∂²U/∂x∂l̄
//! ∂F_c/∂x|_l̄ = ∂R/∂s ∂s/∂x + D ∂(Δ_x c)/∂x    ∂F_c/∂l̄ = ∂R/∂s ∂s/∂l̄
//! ∂F_c/∂c|_l̄ = ∂R/∂c + D Δ_x             ∂l̄_e/∂c = l⁰_e Φ'(c_e) ∂c_e/∂c
//!
//! ∂F_x/∂C₀ = -∂²U/∂x∂C₀                   ∂C₀_v/∂c = C₀'(c_v) ∂c_v/∂c
//! ∂F_x/∂c̄ = -∂²U/∂x∂c̄                     ∂c̄_v/∂c = ∂c_v/∂c
//! ```
//!
//! `c_e` is the mean of the ends of a bond; species on faces are carried to vertices by averages that
//! depend on x, so that then ∂q/∂x is there too.

mod intermediates;

use std::ops::Range;

use super::Layout;
use crate::effects::HessianPart;
use crate::kinetics::field::Columns;
use crate::linear::{Assembly, BlockMatrix, Contribution, Entries, Sparse, SumOfProduct};
use crate::model::{
    Chemistry, HeldValues, Model, ModelError, Potential, SignalColumns, State, Surface,
};
use intermediates::{
    BySignals, JacobianInputs, add_vector, intermediates_by_unknowns, residual_by_intermediates,
};

/// Vertices, or points of the chemistry, whose entries one thread names at a time.
const CHUNK_POINTS: usize = 2048;

/// The Jacobian with everything that it is assembled from.
#[derive(Default)]
pub(super) struct Jacobian {
    hessian: Option<BlockMatrix>,
    /// Made with the first values; the pattern stays.
    sums: Option<Sums>,
    /// Whether it is for an incomplete factor alone.
    pub(super) in_strips: bool,
    nothing: Sparse,
}

struct Sums {
    direct: Assembly,
    through: Option<Intermediates>,
}

/// What goes through optimal lengths, spontaneous curvatures and species that energies read.
struct Intermediates {
    of_residual: Assembly,
    of_unknowns: Assembly,
    total: SumOfProduct,
}

/// The model at the state, as far as the unknowns depend on it.
pub(super) struct Inputs<'a> {
    /// Without one, the shape and the signals are given.
    pub potential: Option<&'a mut Potential>,
    pub surface: &'a Surface,
    pub signals: &'a SignalColumns,
}

impl Sums {
    /// Adds what goes through optimal lengths, spontaneous curvatures and species that energies read.
    fn fill_through(&mut self, potential: &mut Potential, at: &JacobianInputs<'_>) {
        let n = at.layout.unknowns();
        let [_, _, intermediates] = at.intermediates(potential.sheet());
        let Self { direct, through } = self;
        let Intermediates { of_residual, of_unknowns, total } = through.get_or_insert_with(|| {
            let of_residual = Assembly::new(n, intermediates, |entries| {
                residual_by_intermediates(potential, at, entries)
            });
            let of_unknowns = Assembly::new(intermediates, n, |entries| {
                intermediates_by_unknowns(potential, at, entries)
            });
            let total =
                SumOfProduct::new(direct.matrix(), of_residual.matrix(), of_unknowns.matrix());
            Intermediates { of_residual, of_unknowns, total }
        });
        of_residual.fill(|entries| residual_by_intermediates(potential, at, entries));
        of_unknowns.fill(|entries| intermediates_by_unknowns(potential, at, entries));
        total.fill(direct.matrix(), of_residual.matrix(), of_unknowns.matrix());
    }
}

/// The second derivatives of the energy and those of the reactions, in parts that are filled in parallel.
fn parts_of_rows<'a>(
    at: &'a JacobianInputs<'_>,
    hessian: &'a BlockMatrix,
    places: &'a [[Option<usize>; 3]],
) -> Vec<Box<Contribution<'a>>> {
    let mut parts: Vec<Box<Contribution<'a>>> = Vec::new();
    parts.extend(in_parts(hessian.pattern().rows()).map(|vertices| {
        Box::new(move |entries: &mut Entries<'_>| {
            second_derivatives(places, hessian, vertices.clone(), entries);
        }) as Box<Contribution<'a>>
    }));
    if let Some((chemistry, partials)) = &at.chemistry {
        let (layout, inputs) = (at.layout, (chemistry.inputs(), chemistry.held()));
        parts.extend(in_parts(layout.points()).map(|points| {
            Box::new(move |entries: &mut Entries<'_>| {
                reactions(layout, partials, inputs, points.clone(), entries);
            }) as Box<Contribution<'a>>
        }));
    }
    parts
}

impl Jacobian {
    /// Evaluates it at a state.
    pub(super) fn fill(
        &mut self,
        model: &Model,
        layout: &Layout,
        state: &State,
        inputs: Inputs<'_>,
    ) -> Result<(), ModelError> {
        let _scope = model.tally().meter("solver", "coupled Jacobian").uncounted_scope();
        let Inputs { mut potential, surface, signals } = inputs;
        if layout.mechanical() > 0
            && let Some(potential) = &mut potential
        {
            let pattern = potential.pattern(&state.x);
            let hessian = self.hessian.get_or_insert_with(|| BlockMatrix::zeros(pattern));
            potential.hessian(&state.x, HessianPart::Full, hessian)?;
        }
        let feels_lengths = |chemistry: &Chemistry| {
            layout.mechanical() > 0 || potential.is_some() && chemistry.reads_strain()
        };
        let at = JacobianInputs::new(model, (layout, state), (surface, signals), feels_lengths)?;
        let at = JacobianInputs { hessian: self.hessian.as_ref(), ..at };
        let n = layout.unknowns();
        let places: Vec<[Option<usize>; 3]> = layout.displacements().collect();
        // Without a Hessian they are few, and lists in parts cost memory.
        let apart = at.hessian.is_some();
        let parts = at.hessian.map(|hessian| parts_of_rows(&at, hessian, &places));
        let parts = parts.unwrap_or_default();
        let parts: Vec<&Contribution<'_>> = parts.iter().map(|part| &**part).collect();
        let others = |entries: &mut Entries<'_>| {
            if let Some((chemistry, partials)) = at.chemistry.as_ref().filter(|_| !apart) {
                let inputs = (chemistry.inputs(), chemistry.held());
                reactions(layout, partials, inputs, 0..layout.points(), entries);
            }
            others(potential.as_deref(), model, &at, entries);
        };
        // What goes through lengths is added to rows in their own order.
        let through = at.has_intermediates();
        let in_strips = self.in_strips && parts.is_empty() && !through;
        let sums = self.sums.get_or_insert_with(|| Sums {
            direct: match in_strips {
                true => Assembly::for_incomplete_factor(n, others),
                false => Assembly::in_parts(n, n, &parts, others),
            },
            through: None,
        });
        sums.direct.fill_in_parts(&parts, others);
        drop(parts);
        if let Some(potential) = potential.filter(|_| through) {
            sums.fill_through(potential, &at);
        }
        Ok(())
    }

    pub(super) fn matrix(&self) -> &Sparse {
        match &self.sums {
            Some(Sums { through: Some(through), .. }) => through.total.matrix(),
            Some(Sums { direct, .. }) => direct.matrix(),
            None => &self.nothing,
        }
    }

    pub(super) fn matrix_mut(&mut self) -> &mut Sparse {
        match &mut self.sums {
            Some(Sums { through: Some(through), .. }) => through.total.matrix_mut(),
            Some(Sums { direct, .. }) => direct.matrix_mut(),
            None => &mut self.nothing,
        }
    }
}

/// Numbers below `n` in parts of the same length.
fn in_parts(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n).step_by(CHUNK_POINTS).map(move |first| first..(first + CHUNK_POINTS).min(n))
}

/// `-H` at these vertices.
fn second_derivatives(
    places: &[[Option<usize>; 3]],
    hessian: &BlockMatrix,
    vertices: Range<usize>,
    entries: &mut Entries<'_>,
) {
    for i in vertices {
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

/// ∂R/∂c at these points.
fn reactions(
    layout: &Layout,
    partials: &Columns,
    (inputs, held): (usize, &HeldValues),
    points: Range<usize>,
    entries: &mut Entries<'_>,
) {
    let species = layout.species();
    for point in points {
        for s in 0..species {
            if held.holds(s, point) {
                let place = layout.concentration(s, point);
                entries.add(place, place, -1.0);
                continue;
            }
            for j in 0..species {
                let value = partials.column(s * inputs + j)[point];
                entries.add(layout.concentration(s, point), layout.concentration(j, point), value);
            }
        }
    }
}

/// What is left of ∂F/∂y at fixed optimal lengths: transports and signals.
fn others(
    potential: Option<&Potential>,
    model: &Model,
    at: &JacobianInputs<'_>,
    entries: &mut Entries<'_>,
) {
    let layout = at.layout;
    let Some((chemistry, partials)) = &at.chemistry else { return };
    let (inputs, held) = (chemistry.inputs(), chemistry.held());
    let sheet = model.sheet();
    let species: Vec<&[f64]> = at.state.species.iter().map(Vec::as_slice).collect();
    let read = (&species[..], chemistry.signal_values(at.signals));
    let transports = chemistry.transports().iter().zip(at.surface.operators());
    for (k, (transport, operator)) in transports.enumerate() {
        let s = transport.species();
        let scope = chemistry.transport_scope(k, "matrix");
        transport.derivatives((sheet, at.state.time), operator, read, &mut |i, by, j, value| {
            if held.holds(s, i) {
                return;
            }
            entries.add(layout.concentration(s, i), layout.concentration(by, j), value);
        });
        drop(scope);
        if layout.mechanical() > 0 {
            let _scope = chemistry.transport_scope(k, "derivatives by positions");
            let x = &at.state.x;
            transport.derivatives_by_positions(
                (sheet, at.state.time),
                operator,
                x,
                read,
                &mut |i, vertex, by| {
                    if !held.holds(s, i) {
                        add_vector(layout, entries, layout.concentration(s, i), vertex, by);
                    }
                },
            );
        }
    }
    if layout.mechanical() > 0
        && let Some(potential) = potential
    {
        let mut sink = BySignals { layout, partials, inputs, held, entries, lengths: false };
        chemistry.signals().derivatives(&potential.shape(&at.state.x), &mut sink);
    }
}
