//! Derivatives by the values of a field: what a value changes is near its vertex.
//!
//! Vertices with disjoint neighbourhoods are changed at once: with r the rings over which a change reaches, colours are given so that
//! vertices of one colour are more than 2r rings apart, and every colour costs two evaluations, whatever the number of vertices
//! (Curtis, Powell & Reid, J. Inst. Maths Applics 13 (1974) 117, doi:10.1093/imamat/13.1.117). r is found by changing single
//! vertices: what a change does not reach stays the same to the last bit. In the end all are changed along one random direction, which
//! must give the sum.
//!
//! ```text
//! λ·∂g/∂p = Σ_e (Σ_i λ_i·∂²U/∂x_i∂l̄_e) ∂l̄_e/∂p        where p acts by the optimal lengths l̄ alone
//! ```
//!
//! Whether it does is seen along the random direction, vertex by vertex. Lengths cost little beside forces, and reach one ring.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::differences::AtFixedState;
use super::parameter::FIELD_OPTION as OPTION;
use crate::num::index;
use crate::run::{Error, Result};
use crate::sheet::Sheet;

/// Vertices at which the reach of a change is looked for.
const PROBES: usize = 12;
/// Rings over which a change may reach: further away a parameter acts on the whole sheet.
const MAX_REACH: usize = 6;
/// Largest difference between the sum over vertices and the derivative along a direction, relative to the sum of magnitudes; and
/// largest one of a vertex, relative to the largest of all, of what acts by lengths alone.
const TOLERANCE: f64 = 1e-5;

/// Values that a field changes near where it is changed itself.
struct Local<'a> {
    /// Corners of the place of every value, of a vertex or an edge some more than once; what comes after the last has none.
    places: Vec<[u32; 3]>,
    /// dJ by every value.
    weights: Vec<f64>,
    /// The values with a field.
    values: Box<dyn Fn(Vec<f64>) -> Result<Vec<f64>> + Sync + 'a>,
}

impl AtFixedState<'_> {
    /// The derivatives by the values of the field `k` at the vertices.
    ///
    /// # Errors
    /// Laws that fail; a field that acts beyond its neighbourhood.
    pub(super) fn by_field(&self, k: usize) -> Result<Vec<f64>> {
        let sheet = &*self.objective.sheet;
        let n = sheet.vertex_count();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let signs: Vec<f64> =
            (0..n).map(|_| if random.random::<bool>() { 1.0 } else { -1.0 }).collect();
        let parts = self.in_parts(k);
        let along = self.along((k, self.step(k)), &|i| signs[i], &parts.values)?;
        let local = self.by_lengths(k, &signs, &along)?.unwrap_or(parts);
        let reach = self.reach(k, &local)?;
        let of_colour = |colour: &Vec<usize>| {
            self.objective.control.check()?;
            self.objective
                .control
                .report(|| format!("derivatives by the values of parameter {}", k + 1));
            let changed = self.changed_at(k, colour, &local)?;
            Ok(Rings::around(sheet, colour, reach).gather(&local, &changed))
        };
        let found: Result<Vec<_>> =
            colours(sheet, 2 * reach + 1).par_iter().map(of_colour).collect();
        let mut all = vec![0.0; n];
        found?.into_iter().flatten().for_each(|(vertex, part)| all[vertex] += part);
        let sum: f64 = all.iter().zip(&signs).map(|(d, s)| d * s).sum();
        let size: f64 = all.iter().map(|d| d.abs()).sum();
        if (along.iter().sum::<f64>() - sum).abs() > TOLERANCE * size {
            return Err(self.not_local(k));
        }
        Ok(all)
    }

    /// λ·g + J in parts.
    fn in_parts(&self, k: usize) -> Local<'_> {
        let sheet = &*self.objective.sheet;
        let vertices = 0..sheet.vertex_count();
        let mut places: Vec<_> = vertices.map(|v| [index(v); 3]).collect();
        places.extend(sheet.triangles());
        let weights = vec![1.0; places.len() + 1];
        Local { places, weights, values: Box::new(move |value| self.parts(k, value)) }
    }

    /// Optimal lengths, if the field acts by them alone at a state at rest: `along` are the derivatives of the parts along `signs`.
    fn by_lengths(&self, k: usize, signs: &[f64], along: &[f64]) -> Result<Option<Local<'_>>> {
        let Some(fixed) = self.fixed.at_rest() else { return Ok(None) };
        let values = move |value| {
            let (model, start) = self.model(k, value)?;
            let state = fixed.point.state_of(&model, &start.species);
            Ok(fixed.point.optimal_lengths(&model, &state)?)
        };
        let change = self.along((k, self.step(k)), &|i| signs[i], &values)?;
        let (mut left, mut weights) = (along.to_vec(), vec![0.0; change.len()]);
        for (vertex, edge, by) in fixed.point.by_optimal_lengths(&fixed.adjoint.x)? {
            left[vertex] -= by * change[edge];
            weights[edge] += by;
        }
        let largest = |all: &[f64]| all.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        if !(largest(&left) <= TOLERANCE * largest(along)) {
            return Ok(None);
        }
        let edges = self.objective.sheet.edges().iter();
        let places = edges.map(|edge| [edge.vertices[0], edge.vertices[1], edge.vertices[1]]);
        Ok(Some(Local { places: places.collect(), weights, values: Box::new(values) }))
    }

    /// Derivatives of the values by the field `k` at all of `vertices` at once.
    fn changed_at(&self, k: usize, vertices: &[usize], local: &Local<'_>) -> Result<Vec<f64>> {
        let mut chosen = vec![0.0; self.objective.sheet.vertex_count()];
        vertices.iter().for_each(|v| chosen[*v] = 1.0);
        self.along((k, self.step(k)), &|i| chosen[i], &local.values)
    }

    /// Rings over which a change at a vertex reaches: of some that are spread over the sheet, those far apart at once.
    fn reach(&self, k: usize, local: &Local<'_>) -> Result<usize> {
        let sheet = &*self.objective.sheet;
        let n = sheet.vertex_count();
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for probe in 0..PROBES.min(n) {
            let vertex = probe * n / PROBES.min(n);
            let near = Rings::around(sheet, &[vertex], 2 * (MAX_REACH + 1)).of;
            match groups.iter_mut().find(|group| group.iter().all(|v| near[*v].is_none())) {
                Some(group) => group.push(vertex),
                None => groups.push(vec![vertex]),
            }
        }
        let mut reach = 0;
        for group in groups {
            let changed = self.changed_at(k, &group, local)?;
            reach = reach.max(Rings::around(sheet, &group, MAX_REACH + 1).reach(local, &changed));
        }
        if reach > MAX_REACH { Err(self.not_local(k)) } else { Ok(reach) }
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

    /// The rings, and the vertex in the middle, of the value number `i`.
    fn nearest(&self, local: &Local<'_>, i: usize) -> Option<(usize, usize)> {
        local.places.get(i)?.iter().filter_map(|v| self.of[*v as usize]).min()
    }

    /// The rings that a change reaches.
    fn reach(&self, local: &Local<'_>, changed: &[f64]) -> usize {
        let ring = |i| self.nearest(local, i).map_or(usize::MAX, |(ring, _)| ring);
        let reached = changed.iter().enumerate().filter(|(_, change)| **change != 0.0);
        reached.map(|(i, _)| ring(i)).max().unwrap_or(0)
    }

    /// dJ by every change that is not 0, with the vertex in its middle.
    fn gather(&self, local: &Local<'_>, changed: &[f64]) -> Vec<(usize, f64)> {
        let reached = changed.iter().enumerate().filter(|(_, change)| **change != 0.0);
        let part = |(i, change): (usize, &f64)| {
            Some((self.nearest(local, i)?.1, local.weights[i] * change))
        };
        reached.filter_map(part).collect()
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
