//! λ·∂g/∂p + ∂J/∂p at a fixed state, by central differences.
//!
//! A field has a value at every vertex, and what it changes is near that vertex. So vertices with disjoint neighbourhoods are
//! changed at once: with r the rings over which a change reaches, colours are given so that vertices of one colour are more than
//! 2r rings apart, and every colour costs two evaluations, whatever the number of vertices (Curtis, Powell & Reid, J. Inst. Maths
//! Applics 13 (1974) 117, doi:10.1093/imamat/13.1.117). r is found by changing single vertices: what a change does not reach stays
//! the same to the last bit. In the end all are changed along one random direction, which must give the sum.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::fixed::{Fixed, FixedPoint};
use super::measure::Measure;
use super::objective::{Evaluated, Found, Objective};
use super::parameter::FIELD_OPTION as OPTION;
use crate::Vec3;
use crate::model::{Model, State};
use crate::run::{Error, Result};
use crate::sheet::Sheet;
use crate::solve::continuation::Unknowns;
use crate::solve::sensitivity::changes_with_rigid_motions;

/// Step of a difference, relative to the largest value of the parameter: its error is the square of this, and round-off over it.
const STEP: f64 = 1e-5;
/// Share of λ·g + J by which a change of a number by all of its value is to change it: below, round-off shows, and longer steps are tried,
/// each so many times as long.
const INFLUENCE: f64 = 1e-3;
const STEP_RATIO: f64 = 100.0;
/// Vertices at which the reach of a change is looked for.
const PROBES: usize = 12;
/// Rings over which a change may reach: further away a parameter acts on the whole sheet.
const MAX_REACH: usize = 6;
/// Largest difference between the sum over vertices and the derivative along a direction, relative to the sum of magnitudes.
const TOLERANCE: f64 = 1e-5;

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
struct AtFixedState<'a> {
    objective: &'a Objective,
    values: &'a [Vec<f64>],
    fixed: &'a dyn Fixed,
}

/// λ·g + J at one p, or a derivative of it, in parts.
struct Parts {
    vertices: Vec<f64>,
    triangles: Vec<f64>,
    /// What belongs to no place.
    whole: f64,
}

impl Parts {
    fn sum(&self) -> f64 {
        self.vertices.iter().chain(&self.triangles).sum::<f64>() + self.whole
    }

    /// Sum of the magnitudes.
    fn size(&self) -> f64 {
        self.vertices.iter().chain(&self.triangles).map(|part| part.abs()).sum::<f64>()
            + self.whole.abs()
    }

    /// `Σ_k weight_k · parts_k`.
    fn combined<const K: usize>(all: [(f64, &Self); K]) -> Self {
        let sum =
            |of: &dyn Fn(&Self) -> f64| all.iter().map(|(weight, parts)| weight * of(parts)).sum();
        let (n, m) = (all[0].1.vertices.len(), all[0].1.triangles.len());
        Self {
            vertices: (0..n).map(|i| sum(&|parts| parts.vertices[i])).collect(),
            triangles: (0..m).map(|t| sum(&|parts| parts.triangles[t])).collect(),
            whole: sum(&|parts| parts.whole),
        }
    }
}

impl AtFixedState<'_> {
    /// dJ/dp of parameter number `k`.
    ///
    /// # Errors
    /// Laws that fail; a field that acts beyond its neighbourhood.
    fn derivative(&self, k: usize) -> Result<Vec<f64>> {
        match self.objective.parameters[k].is_field() {
            false => Ok(vec![self.by_number(k)?]),
            true => self.by_colours(k),
        }
    }

    /// The derivative by the number `k`. The step is relative to its value, unless that is so small that it has no influence: of
    /// longer ones that is taken from which the derivative changes least.
    fn by_number(&self, k: usize) -> Result<f64> {
        let (value, mut step) = (self.values[k][0], self.step(k));
        let mut last = self.along((k, step), &|_| 1.0)?.sum();
        if step >= STEP {
            return Ok(last);
        }
        let size = self.parts(k, vec![value])?.size();
        let mut best = (f64::INFINITY, last);
        while step < STEP && step / STEP * last.abs() < INFLUENCE * size {
            step = STEP.min(STEP_RATIO * step);
            let Ok(next) = self.along((k, step), &|_| 1.0) else { break };
            let next = next.sum();
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
    fn step(&self, k: usize) -> f64 {
        let largest = self.values[k].iter().fold(0.0, |largest: f64, v| largest.max(v.abs()));
        STEP * if largest > 0.0 { largest } else { 1.0 }
    }

    /// The derivative along a `direction` of parameter `k` with a step; one-sided where the scene takes no values on the other side.
    fn along(&self, (k, step): (usize, f64), direction: &dyn Fn(usize) -> f64) -> Result<Parts> {
        let value = &self.values[k];
        let at = |steps: f64| {
            let moved = value.iter().enumerate().map(|(i, v)| v + steps * step * direction(i));
            self.parts(k, moved.collect())
        };
        let one_sided = |side: f64, near: &Parts| {
            let (here, far) = (at(0.0)?, at(2.0 * side)?);
            let weights = [-3.0, 4.0, -1.0].map(|weight| side * weight / (2.0 * step));
            Ok(Parts::combined([(weights[0], &here), (weights[1], near), (weights[2], &far)]))
        };
        match (at(1.0), at(-1.0)) {
            (Ok(plus), Ok(minus)) => {
                let weight = 0.5 / step;
                Ok(Parts::combined([(weight, &plus), (-weight, &minus)]))
            }
            (Ok(plus), Err(Error::Scene(_))) => one_sided(1.0, &plus),
            (Err(Error::Scene(_)), Ok(minus)) => one_sided(-1.0, &minus),
            (Err(error), _) | (_, Err(error)) => Err(error),
        }
    }

    /// λ·g + J with this value of parameter `k`.
    fn parts(&self, k: usize, value: Vec<f64>) -> Result<Parts> {
        let mut values = self.values.to_vec();
        values[k] = value;
        let (model, start) = self.objective.model(&values)?;
        let model = Arc::new(model);
        let (terms, states) = self.fixed.terms(&model, &start)?;
        let mut vertices: Vec<f64> = terms.x.iter().map(Vec3::sum).collect();
        let mut at_points = vec![0.0; terms.species.first().map_or(0, Vec::len)];
        for values in &terms.species {
            at_points.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        let mut whole = 0.0;
        let all = |state| self.objective.measures.iter().map(move |measure| (state, measure));
        for (state, measure) in states.iter().flat_map(all) {
            match measure.parts(&model, state) {
                Some(parts) => {
                    at_points.resize(parts.len(), 0.0);
                    at_points.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
                }
                None => whole += measure.value(&model, state)?,
            }
        }
        let on_vertices = at_points.len() == vertices.len();
        if on_vertices {
            vertices.iter_mut().zip(&at_points).for_each(|(sum, part)| *sum += part);
            at_points.clear();
        }
        Ok(Parts { vertices, triangles: at_points, whole })
    }

    /// The derivatives by the values of a field at the vertices.
    fn by_colours(&self, k: usize) -> Result<Vec<f64>> {
        let sheet = &*self.objective.sheet;
        let n = sheet.vertex_count();
        let mut reach = 0;
        for probe in 0..PROBES.min(n) {
            let vertex = probe * n / PROBES.min(n);
            let rings = Rings::around(sheet, &[vertex], MAX_REACH + 1);
            let changed = self.along((k, self.step(k)), &|i| f64::from(i == vertex))?;
            reach = reach.max(rings.reach(sheet, &changed));
        }
        if reach > MAX_REACH {
            return Err(self.not_local(k));
        }
        let mut all = vec![0.0; n];
        let of_colour = |colour: &Vec<usize>| {
            self.objective.control.check()?;
            self.objective
                .control
                .report(|| format!("derivatives by the values of parameter {}", k + 1));
            let mut chosen = vec![0.0; n];
            colour.iter().for_each(|v| chosen[*v] = 1.0);
            let changed = self.along((k, self.step(k)), &|i| chosen[i])?;
            Ok(Rings::around(sheet, colour, reach).gather(sheet, &changed))
        };
        let found: Result<Vec<_>> =
            colours(sheet, 2 * reach + 1).par_iter().map(of_colour).collect();
        for (vertex, part) in found?.into_iter().flatten() {
            all[vertex] += part;
        }
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let signs: Vec<f64> =
            (0..n).map(|_| if random.random::<bool>() { 1.0 } else { -1.0 }).collect();
        let along = self.along((k, self.step(k)), &|i| signs[i])?.sum();
        let sum: f64 = all.iter().zip(&signs).map(|(d, s)| d * s).sum();
        let size: f64 = all.iter().map(|d| d.abs()).sum();
        if (along - sum).abs() > TOLERANCE * size {
            return Err(self.not_local(k));
        }
        Ok(all)
    }

    fn not_local(&self, k: usize) -> Error {
        let key = &self.objective.parameters[k].key;
        Error::Refused(format!(
            "{OPTION} {key}: a value at one vertex acts on more than {MAX_REACH} rings of vertices around it: a map is known \
             of fields that act where they are"
        ))
    }
}

/// The vertices within some rings around several, with the nearest of these.
struct Rings {
    /// Number of rings and the vertex in the middle; none further away.
    of: Vec<Option<(usize, usize)>>,
}

impl Rings {
    fn around(sheet: &Sheet, middles: &[usize], most: usize) -> Self {
        let mut of = vec![None; sheet.vertex_count()];
        middles.iter().for_each(|v| of[*v] = Some((0, *v)));
        let mut front = middles.to_vec();
        for ring in 1..=most {
            let mut next = Vec::new();
            for v in front {
                let Some((_, middle)) = of[v] else { continue };
                for w in neighbours(sheet, v) {
                    if of[w].is_none() {
                        of[w] = Some((ring, middle));
                        next.push(w);
                    }
                }
            }
            front = next;
        }
        Self { of }
    }

    /// What is nearest to a triangle.
    fn of_triangle(&self, corners: &[u32; 3]) -> Option<(usize, usize)> {
        corners.iter().filter_map(|v| self.of[*v as usize]).min()
    }

    /// The rings that a change reaches.
    fn reach(&self, sheet: &Sheet, changed: &Parts) -> usize {
        let ring = |of: Option<(usize, usize)>| of.map_or(usize::MAX, |(ring, _)| ring);
        let vertices = changed.vertices.iter().zip(&self.of);
        let vertices = vertices.filter(|(part, _)| **part != 0.0).map(|(_, of)| ring(*of));
        let triangles = changed.triangles.iter().zip(sheet.triangles());
        let triangles = triangles.filter(|(part, _)| **part != 0.0);
        let triangles = triangles.map(|(_, corners)| ring(self.of_triangle(corners)));
        vertices.chain(triangles).max().unwrap_or(0)
    }

    /// Every part that is not 0, with the vertex in its middle.
    fn gather(&self, sheet: &Sheet, changed: &Parts) -> Vec<(usize, f64)> {
        let vertices = changed.vertices.iter().zip(self.of.iter().copied());
        let triangles = sheet.triangles().iter().map(|corners| self.of_triangle(corners));
        let all = vertices.chain(changed.triangles.iter().zip(triangles));
        let inside = all.filter(|(part, _)| **part != 0.0);
        inside.filter_map(|(part, of)| Some((of?.1, *part))).collect()
    }
}

/// The vertices that share an edge with `v`.
fn neighbours(sheet: &Sheet, v: usize) -> impl Iterator<Item = usize> {
    sheet.vertex_edges().entries(v).iter().map(|(_, other)| *other as usize)
}

/// Sets of vertices that are more than `rings` rings apart from one another.
fn colours(sheet: &Sheet, rings: usize) -> Vec<Vec<usize>> {
    let n = sheet.vertex_count();
    let (mut colour, mut seen) = (vec![usize::MAX; n], vec![usize::MAX; n]);
    let mut sets: Vec<Vec<usize>> = Vec::new();
    for v in 0..n {
        let (mut near, mut front) = (vec![v], vec![v]);
        seen[v] = v;
        for _ in 0..rings {
            let mut next = Vec::new();
            for w in front.iter().flat_map(|u| neighbours(sheet, *u)) {
                if seen[w] != v {
                    seen[w] = v;
                    next.push(w);
                }
            }
            near.extend(&next);
            front = next;
        }
        let mut used = vec![false; sets.len() + 1];
        for w in near {
            if let Some(used) = used.get_mut(colour[w]) {
                *used = true;
            }
        }
        let free = used.iter().position(|used| !used).unwrap_or(sets.len());
        colour[v] = free;
        match sets.get_mut(free) {
            Some(set) => set.push(v),
            None => sets.push(vec![v]),
        }
    }
    sets
}
