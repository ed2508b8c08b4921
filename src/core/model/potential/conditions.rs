//! Under which conditions energies are: optimal lengths, what laws and internal variables give, species, time; and how the
//! forces change with them.

use super::{Mechanics, Potential};
use crate::Vec3;
use crate::geometry::{Conditions, Shape};
use crate::model::counters::energy;

/// Zeros for the species that energies read.
pub(super) fn zero_species(mechanics: &Mechanics) -> Vec<Vec<f64>> {
    let read = mechanics.species();
    let count = read.iter().max().map_or(0, |last| last + 1);
    let vertices = |s: usize| if read.contains(&s) { mechanics.sheet().vertex_count() } else { 0 };
    (0..count).map(|s| vec![0.0; vertices(s)]).collect()
}

impl Potential {
    /// Brings it under the length factor Φ of every edge.
    pub fn set_length_factor(&mut self, factor: &[f64]) {
        self.set_conditions(Some(factor), self.time);
    }

    /// Brings it under the length factor Φ of every edge and the time given.
    pub fn set_conditions(&mut self, factor: Option<&[f64]>, time: f64) {
        let later = time.to_bits() != self.time.to_bits();
        self.time = time;
        if let Some(factor) = factor {
            let scope = self.lengths.scope(0);
            self.metric.set_length_factor(self.mechanics.sheet(), factor);
            drop(scope);
            self.prepare();
        } else if self.stale || later && self.mechanics.depends_on_time() {
            self.prepare();
        }
    }

    /// Sets internal variables and what laws give, which effects read under the next conditions that are set.
    pub(crate) fn set_fields<'a>(
        &mut self,
        values: impl Iterator<Item = (&'static str, &'a Vec<f64>)>,
    ) {
        let mut count = 0;
        for (k, (name, values)) in values.enumerate() {
            match self.internal.get_mut(k) {
                Some((known, kept)) => {
                    *known = name;
                    kept.clone_from(values);
                }
                None => self.internal.push((name, values.clone())),
            }
            count = k + 1;
        }
        self.internal.truncate(count);
        self.stale = true;
    }

    /// Sets the values at the vertices of a species that energies read, which they see under the next conditions that are
    /// set.
    pub fn set_species(&mut self, number: usize, at_vertices: Vec<f64>) {
        if let Some(values) = self.species.get_mut(number) {
            *values = at_vertices;
            self.stale = true;
        }
    }

    pub(super) fn prepare(&mut self) {
        let sheet = self.mechanics.sheet();
        let (metric, time) = (&self.metric, self.time);
        let (internal, species) = (&self.internal, &self.species);
        let conditions = Conditions { sheet, metric, time, internal, species };
        self.stale = false;
        self.force_scale = 0.0;
        let meters = self.mechanics.meters();
        for ((term, work), meter) in self.mechanics.terms().iter().zip(&mut self.work).zip(meters) {
            let _scope = meter.scope(energy::CONDITIONS);
            term.prepare(&conditions, work);
            self.force_scale = self.force_scale.max(term.force_scale(&conditions));
        }
        for (term, work) in self.mechanics.constraints().iter().zip(&mut self.constraints.work) {
            term.prepare(&conditions, work);
        }
        self.force_scale = sheet.reduction().largest_over_ranks(self.force_scale);
    }

    /// Hands all `∂²U/∂x_i∂C₀_v` at `x` to `emit`, in an order that depends on the sheet alone.
    pub fn mixed_curvature_derivatives(
        &mut self,
        x: &[Vec3],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        self.each(energy::LENGTHS, x, |_, term, work, shape| {
            term.mixed_curvature_derivatives(shape, work, emit)
        });
    }

    /// Hands all `∂²U/∂x_i∂l̄_e` at `x` to `emit`, in an order that depends on the sheet alone.
    pub fn mixed_metric_derivatives(
        &mut self,
        x: &[Vec3],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        self.each(energy::LENGTHS, x, |_, term, work, shape| {
            term.mixed_metric_derivatives(shape, work, emit)
        });
    }

    /// Hands all `∂²U/∂x_i∂c_v` of the species that energies read at `x` to `emit`, in an order that depends on the sheet
    /// alone.
    pub fn mixed_species_derivatives(
        &mut self,
        x: &[Vec3],
        emit: &mut dyn FnMut(usize, (usize, usize), Vec3),
    ) {
        let Self { mechanics, metric, time, internal, species, work, .. } = self;
        let (sheet, time) = (mechanics.sheet(), *time);
        let conditions = Conditions { sheet, metric, time, internal, species };
        let shape = Shape { sheet, metric, time, x };
        let terms = mechanics.terms().iter().zip(work).zip(mechanics.meters());
        for ((term, work), meter) in terms.filter(|((term, _), _)| !term.species().is_empty()) {
            let _scope = meter.scope(energy::SPECIES);
            term.mixed_species_derivatives(&shape, &conditions, work, emit);
        }
    }
}
