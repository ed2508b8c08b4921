//! λ·∂g/∂p + ∂J/∂p at a fixed state, by central differences.

use std::sync::Arc;

use super::fixed::{Fixed, FixedPoint};
use super::measure::Measure;
use super::objective::{Evaluated, Found, Objective};
use crate::model::{Model, State};
use crate::run::{Error, Result};
use crate::solve::continuation::Unknowns;
use crate::solve::sensitivity::changes_with_rigid_motions;

/// Step of a difference, relative to the largest value of the parameter: its error is the square of this, and round-off over it.
const STEP: f64 = 1e-5;
/// Share of λ·g + J by which a change of a number by all of its value is to change it: below, round-off shows, and longer steps are tried,
/// each so many times as long.
const INFLUENCE: f64 = 1e-3;
const STEP_RATIO: f64 = 100.0;

impl Objective {
    /// dJ/dp at an evaluated p: one list a parameter.
    ///
    /// # Errors
    /// A derivative that is singular; laws that fail; a field that acts beyond its neighbourhood.
    pub fn gradient(&self, evaluated: &mut Evaluated) -> Result<Vec<Vec<f64>>> {
        let Evaluated { at, found, moves, .. } = evaluated;
        let fixed: Box<dyn Fixed + '_> = match found {
            Found::AtRest(point) => {
                let slope = self.slope(&point.point().model, &point.point().state)?;
                *moves = changes_with_rigid_motions(
                    &point.point().model,
                    &point.point().state.x,
                    &slope.x,
                );
                let adjoint = point.adjoint(&slope)?;
                Box::new(FixedPoint { point: point.point(), adjoint })
            }
            Found::InTime(course) => {
                self.check_breakpoints(at)?;
                let fixed = course.adjoint(|model, state| self.slope(model, state))?;
                *moves = fixed.moves;
                Box::new(fixed)
            }
        };
        let at = AtFixedState { objective: self, values: at, fixed: &*fixed };
        (0..self.parameters.len()).map(|k| at.derivative(k)).collect()
    }

    /// ∂J/∂x and ∂J/∂c.
    pub(super) fn slope(&self, model: &Model, state: &State) -> Result<Unknowns> {
        let slope = |measure: &Measure| measure.slope(model, state);
        let slopes = self.measures.iter().map(slope).collect::<Result<Vec<_>>>()?;
        let slope = slopes.into_iter().reduce(|sum, more| sum.plus(1.0, &more));
        Ok(slope.unwrap_or_default())
    }
}

/// One parameter is changed while the state is kept.
pub(super) struct AtFixedState<'a> {
    pub(super) objective: &'a Objective,
    values: &'a [Vec<f64>],
    pub(super) fixed: &'a dyn Fixed,
}

impl AtFixedState<'_> {
    /// dJ/dp of parameter number `k`.
    ///
    /// # Errors
    /// Laws that fail; a field that acts beyond its neighbourhood.
    fn derivative(&self, k: usize) -> Result<Vec<f64>> {
        match self.objective.parameters[k].is_field() {
            false => Ok(vec![self.by_number(k)?]),
            true => self.by_field(k),
        }
    }

    /// The derivative by the number `k`. The step is relative to its value, unless that is so small that it has no influence: of
    /// longer ones that is taken from which the derivative changes least.
    fn by_number(&self, k: usize) -> Result<f64> {
        let (value, mut step) = (self.values[k][0], self.step(k));
        let derivative = |step| -> Result<f64> {
            Ok(self.along((k, step), &|_| 1.0, &|value| self.parts(k, value))?.iter().sum())
        };
        let mut last = derivative(step)?;
        if step >= STEP {
            return Ok(last);
        }
        let size: f64 = self.parts(k, vec![value])?.iter().map(|part| part.abs()).sum();
        let mut best = (f64::INFINITY, last);
        while step < STEP && step / STEP * last.abs() < INFLUENCE * size {
            step = STEP.min(STEP_RATIO * step);
            let Ok(next) = derivative(step) else { break };
            // Of what does not change at all, 0/0, nothing is known.
            let change = (next - last).abs() / next.abs().max(last.abs());
            if change < best.0 {
                best = (change, next);
            }
            last = next;
        }
        Ok(best.1)
    }

    /// The step of differences of parameter `k`.
    pub(super) fn step(&self, k: usize) -> f64 {
        let largest = self.values[k].iter().fold(0.0, |largest: f64, v| largest.max(v.abs()));
        STEP * if largest > 0.0 { largest } else { 1.0 }
    }

    /// The derivative of `values` along a `direction` of parameter `k` with a step; one-sided where the scene takes no values on the
    /// other side.
    pub(super) fn along(
        &self,
        (k, step): (usize, f64),
        direction: &dyn Fn(usize) -> f64,
        values: &dyn Fn(Vec<f64>) -> Result<Vec<f64>>,
    ) -> Result<Vec<f64>> {
        let value = &self.values[k];
        let at = |steps: f64| {
            let moved = value.iter().enumerate().map(|(i, v)| v + steps * step * direction(i));
            values(moved.collect())
        };
        let one_sided = |side: f64, near: &[f64]| {
            let (here, far) = (at(0.0)?, at(2.0 * side)?);
            let weights = [-3.0, 4.0, -1.0].map(|weight| side * weight / (2.0 * step));
            Ok(combined([(weights[0], &here), (weights[1], near), (weights[2], &far)]))
        };
        match (at(1.0), at(-1.0)) {
            (Ok(plus), Ok(minus)) => {
                let weight = 0.5 / step;
                Ok(combined([(weight, &plus), (-weight, &minus)]))
            }
            (Ok(plus), Err(Error::Scene(_))) => one_sided(1.0, &plus),
            (Err(Error::Scene(_)), Ok(minus)) => one_sided(-1.0, &minus),
            (Err(error), _) | (_, Err(error)) => Err(error),
        }
    }

    /// The model with this value of parameter `k`, and its start.
    pub(super) fn model(&self, k: usize, value: Vec<f64>) -> Result<(Model, State)> {
        let mut values = self.values.to_vec();
        values[k] = value;
        self.objective.model(&values)
    }

    /// λ·g + J with this value of parameter `k`, in parts: those of the vertices, those of the triangles, and what belongs to no place.
    pub(super) fn parts(&self, k: usize, value: Vec<f64>) -> Result<Vec<f64>> {
        let (model, start) = self.model(k, value)?;
        let model = Arc::new(model);
        let (terms, states) = self.fixed.terms(&model, &start)?;
        let (n, sheet) = (terms.x.len(), &self.objective.sheet);
        let mut parts = vec![0.0; n + sheet.triangles().len() + 1];
        parts.iter_mut().zip(&terms.x).for_each(|(part, term)| *part = term.sum());
        let mut add = |values: &[f64]| {
            let first = if values.len() == n { 0 } else { n };
            parts[first..].iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        };
        terms.species.iter().for_each(|values| add(values));
        let mut whole = 0.0;
        let all = |state| self.objective.measures.iter().map(move |measure| (state, measure));
        for (state, measure) in states.iter().flat_map(all) {
            match measure.parts(&model, state) {
                Some(parts) => add(&parts),
                None => whole += measure.value(&model, state)?,
            }
        }
        if let Some(last) = parts.last_mut() {
            *last = whole;
        }
        Ok(parts)
    }
}

/// `Σ_k weight_k · values_k`.
fn combined<const K: usize>(all: [(f64, &[f64]); K]) -> Vec<f64> {
    let sum = |i| all.iter().map(|(weight, values)| weight * values[i]).sum();
    (0..all[0].1.len()).map(sum).collect()
}
