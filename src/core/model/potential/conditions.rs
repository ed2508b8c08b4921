//! Under which conditions energies are: optimal lengths, what laws and internal variables give, species, time; and how the
//! forces change with them.

use super::Potential;
use crate::Vec3;
use crate::effects::ParameterField;
use crate::geometry::{Conditions, Shape};

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
            let scope = self.lengths.scope("evaluations");
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
        let meters = self.mechanics.meters();
        for ((term, work), meter) in self.mechanics.terms().iter().zip(&mut self.work).zip(meters) {
            let _scope = meter.scope("conditions");
            term.energy.prepare(&conditions, work);
        }
        for (term, work) in self.mechanics.constraints().iter().zip(&mut self.constraints.work) {
            term.energy.prepare(&conditions, work);
        }
    }

    /// Hands all `∂²U/∂x_i∂q_j` at `x` to `emit`, q the field `by`, in an order that depends on the sheet alone.
    pub fn mixed_derivatives(
        &mut self,
        x: &[Vec3],
        by: ParameterField,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let Self { mechanics, metric, time, internal, species, work, .. } = self;
        let (sheet, time) = (mechanics.sheet(), *time);
        let conditions = Conditions { sheet, metric, time, internal, species };
        let shape = Shape { sheet, metric, time, x };
        for ((term, work), meter) in mechanics.terms().iter().zip(work).zip(mechanics.meters()) {
            let what = match by {
                ParameterField::Species(s) if !term.reads().species.contains(&s) => continue,
                ParameterField::Species(_) => "derivatives by species",
                ParameterField::SpontaneousCurvature if !term.reads().curvature => continue,
                _ => "derivatives by lengths",
            };
            let _scope = meter.scope(what);
            term.energy.mixed_derivatives(&shape, &conditions, work, by, emit);
        }
    }
}
