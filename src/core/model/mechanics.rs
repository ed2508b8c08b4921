//! The mechanical half of a model: the energies that a scene lists, and the directions it fixes.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use super::rigid::free_motions;
use crate::Vec3;
use crate::effects::{EnergyTerm, Pins, PrescribedDisplacement};
use crate::geometry::RestMetric;
use crate::linear::BlockPattern;
use crate::sheet::{Sheet, SheetError};
use crate::tally::{Meter, Tally};

/// Energies and fixed directions of one sheet.
#[derive(Debug)]
pub struct Mechanics {
    sheet: Arc<Sheet>,
    /// Kept where there are energies; else made when it is first asked for.
    reference: OnceLock<RestMetric>,
    terms: Vec<EnergyTerm>,
    names: Vec<String>,
    pins: Pins,
    prescribed: Vec<PrescribedDisplacement>,
    constraints: Vec<EnergyTerm>,
    constraint_names: Vec<String>,
    species: Vec<usize>,
    /// Whether no vertex moves along z.
    planar: bool,
    /// The vertices with pins.
    pinned: Vec<usize>,
    /// Made when it is first asked for.
    pattern: OnceLock<Arc<BlockPattern>>,
    tally: Tally,
    /// One for each of the terms.
    meters: Vec<Meter>,
    not_finite: NotFinite,
}

/// Energies that were no numbers, in rejected step attempts.
#[derive(Debug, Default)]
struct NotFinite {
    count: AtomicU64,
    /// The effect that gave the first one, and the time in force.
    first: OnceLock<(String, f64)>,
}

/// What mechanics are made of.
#[derive(Debug, Default)]
pub struct MechanicsParts {
    /// Energies.
    pub terms: Vec<EnergyTerm>,
    /// Fixed directions; a vertex without an entry is free.
    pub pins: Pins,
    /// Fixed directions that move.
    pub prescribed: Vec<PrescribedDisplacement>,
    /// What must be zero at every shape: the value of each, which has no unit.
    pub constraints: Vec<EnergyTerm>,
    /// Whether the sheet moves in its plane z = const: z is fixed at every vertex, and matrices have two
    /// unknowns a vertex. As pinning z everywhere, and less work.
    pub planar: bool,
    /// Where its work is counted.
    pub tally: Tally,
}

impl Mechanics {
    /// Puts `terms` on `sheet`.
    ///
    /// # Errors
    /// A rest state with edges or triangles of no size.
    pub fn new(
        sheet: Arc<Sheet>,
        terms: Vec<EnergyTerm>,
        pins: Pins,
    ) -> Result<Arc<Self>, SheetError> {
        Self::from_parts(sheet, MechanicsParts { terms, pins, ..MechanicsParts::default() })
    }

    /// Puts `parts` on `sheet`.
    ///
    /// # Errors
    /// A rest state with edges or triangles of no size.
    pub fn from_parts(sheet: Arc<Sheet>, parts: MechanicsParts) -> Result<Arc<Self>, SheetError> {
        let MechanicsParts { terms, mut pins, prescribed, constraints, planar, tally } = parts;
        pins.resize(sheet.vertex_count(), [false; 3]);
        if planar {
            pins.iter_mut().for_each(|fixed| fixed[2] = true);
        }
        let reference = RestMetric::new(&sheet)?;
        let reference = if terms.is_empty() { OnceLock::new() } else { reference.into() };
        let pinned = (0..pins.len()).filter(|&i| pins[i].contains(&true)).collect();
        let names = numbered(terms.iter().map(|e| e.name()));
        let constraint_names = numbered(constraints.iter().map(|e| e.name()));
        let read = terms.iter().chain(&constraints).flat_map(|term| term.reads().species);
        let read: BTreeSet<usize> = read.copied().collect();
        let pattern = OnceLock::new();
        let meters = names.iter().map(|name| tally.meter("effect", name)).collect();
        Ok(Arc::new(Self {
            sheet,
            reference,
            terms,
            names,
            pins,
            prescribed,
            constraints,
            constraint_names,
            species: read.into_iter().collect(),
            planar,
            pinned,
            pattern,
            tally,
            meters,
            not_finite: NotFinite::default(),
        }))
    }

    /// Counts an energy that is not a finite number; `who` says whose it is, of the first one.
    pub(super) fn note_not_finite(&self, who: impl FnOnce() -> Option<(String, f64)>) {
        self.not_finite.count.fetch_add(1, Ordering::Relaxed);
        if self.not_finite.first.get().is_none()
            && let Some(first) = who()
        {
            let _ = self.not_finite.first.set(first);
        }
    }

    /// How many energies were not finite numbers, and the effect that gave the first one, with the time in
    /// force then.
    #[must_use]
    pub fn not_finite(&self) -> (u64, Option<&(String, f64)>) {
        let NotFinite { count, first } = &self.not_finite;
        (count.load(Ordering::Relaxed), first.get())
    }

    /// What the work on the model costs.
    #[must_use]
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// The meters of the energies.
    pub(super) fn meters(&self) -> &[Meter] {
        &self.meters
    }

    /// The sheet.
    #[must_use]
    pub fn sheet(&self) -> &Arc<Sheet> {
        &self.sheet
    }

    /// The rest metric of the rest positions, Φ = 1.
    #[must_use]
    pub fn reference(&self) -> &RestMetric {
        // Lengths and areas of this sheet were inspected when it was put in.
        self.reference.get_or_init(|| RestMetric::new(&self.sheet).unwrap_or_default())
    }

    /// The energies.
    #[must_use]
    pub fn terms(&self) -> &[EnergyTerm] {
        &self.terms
    }

    /// The fixed directions.
    #[must_use]
    pub fn pins(&self) -> &Pins {
        &self.pins
    }

    /// Whether pins fix every degree of freedom; on a planar sheet z is none.
    #[must_use]
    pub fn all_pinned(&self) -> bool {
        let axes = if self.is_planar() { 2 } else { 3 };
        self.pins.iter().all(|fixed| fixed[..axes].iter().all(|fixed| *fixed))
    }

    /// Whether no vertex moves along z.
    #[must_use]
    pub fn is_planar(&self) -> bool {
        self.planar
    }

    /// Sets the fixed directions of `gradient` to zero.
    pub(super) fn fix(&self, gradient: &mut [Vec3]) {
        for &i in &self.pinned {
            for a in 0..3 {
                if self.pins[i][a] {
                    gradient[i][a] = 0.0;
                }
            }
        }
    }

    /// Puts the fixed directions of `to` where `from` has them.
    pub fn keep_pins(&self, from: &[Vec3], to: &mut [Vec3]) {
        for &i in &self.pinned {
            for a in (0..3).filter(|a| self.pins[i][*a]) {
                to[i][a] = from[i][a];
            }
        }
    }

    /// Whether positions are prescribed in time; what has no energy does not move.
    #[must_use]
    pub fn has_prescribed(&self) -> bool {
        !self.is_empty() && !self.prescribed.is_empty()
    }

    /// Sets the fixed directions whose positions are prescribed in time to where they are at `time`.
    pub(crate) fn set_prescribed(&self, time: f64, x: &mut [Vec3]) {
        for prescribed in self.prescribed.iter().filter(|_| self.has_prescribed()) {
            prescribed.set(self.sheet.rest(), time, x);
        }
    }

    /// How many of the six rigid motions of the sheet at rest the pins do not hold.
    #[must_use]
    pub fn free_motions(&self) -> usize {
        free_motions(self.sheet.rest(), &self.pins, self.sheet.reduction(), |_| 1.0).0.len()
    }

    /// Largest force on a vertex that each effect applies from outside to the sheet at rest, by
    /// [`Mechanics::names`].
    #[must_use]
    pub fn applied_forces(&self) -> Vec<f64> {
        let mut all: Vec<f64> = self.terms.iter().map(EnergyTerm::applied_force).collect();
        self.sheet.reduction().max_over_ranks(&mut all);
        all
    }

    /// Whether no effect has an energy.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Names of the effects with an energy, in the scene's order: no two are the same.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// What must be zero at every shape.
    #[must_use]
    pub fn constraints(&self) -> &[EnergyTerm] {
        &self.constraints
    }

    /// Whether anything must be zero at every shape.
    #[must_use]
    pub fn is_constrained(&self) -> bool {
        !self.constraints.is_empty()
    }

    /// Names of the constraints, in the scene's order: no two are the same.
    pub fn constraint_names(&self) -> impl Iterator<Item = &str> {
        self.constraint_names.iter().map(String::as_str)
    }

    /// Energies and constraints.
    fn all(&self) -> impl Iterator<Item = &EnergyTerm> {
        self.terms.iter().chain(&self.constraints)
    }

    /// Whether an energy depends on time other than through the optimal lengths.
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        self.all().any(|term| term.reads().time)
    }

    /// Numbers of the species that energies read, ascending.
    #[must_use]
    pub fn species(&self) -> &[usize] {
        &self.species
    }

    /// Zeros for the species that energies read.
    pub(super) fn zero_species(&self) -> Vec<Vec<f64>> {
        let read = self.species();
        let count = read.iter().max().map_or(0, |last| last + 1);
        let vertices = |s: usize| if read.contains(&s) { self.sheet().vertex_count() } else { 0 };
        (0..count).map(|s| vec![0.0; vertices(s)]).collect()
    }

    /// Whether an effect couples pairs of vertices that depend on the shape.
    #[must_use]
    pub(crate) fn couples_pairs(&self) -> bool {
        self.terms.iter().any(|term| term.interaction().pairs)
    }

    /// Whether an effect limits steps.
    #[must_use]
    pub fn limits_steps(&self) -> bool {
        self.terms.iter().any(|term| term.interaction().limits_steps)
    }

    /// Whether an effect is contact with what is fixed in space, rather than of the sheet with itself: an obstacle.
    #[must_use]
    pub(crate) fn meets_obstacles(&self) -> bool {
        let mut all = self.terms.iter().map(EnergyTerm::interaction);
        all.any(|does| does.touches && !does.pairs)
    }

    /// The effects of contact, as places among the energies.
    pub fn contacts(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.terms.len()).filter(|k| self.terms[*k].interaction().touches)
    }

    /// Whether an effect couples all vertices.
    #[must_use]
    pub(crate) fn has_low_rank(&self) -> bool {
        self.terms.iter().any(|term| term.coupling().low_rank)
    }

    /// Which vertices second derivatives couple, without pairs that depend on the shape and terms of low rank:
    /// as many rings as the furthest-reaching effect of the scene.
    #[must_use]
    pub fn pattern(&self) -> &Arc<BlockPattern> {
        self.pattern.get_or_init(|| self.pattern_with(&[]))
    }

    /// The same with these pairs.
    #[must_use]
    pub fn pattern_with(&self, pairs: &[[u32; 2]]) -> Arc<BlockPattern> {
        let rings = self.all().map(|term| term.coupling().rings).max().unwrap_or(0);
        let neighbours = self.sheet.vertex_edges();
        let each = |i: usize, f: &mut dyn FnMut(u32)| {
            neighbours.entries(i).iter().for_each(|&(_, j)| f(j));
        };
        let pattern = BlockPattern::of_rings(self.sheet.vertex_count(), rings, &each, pairs);
        let pattern = pattern.over(self.sheet.reduction());
        Arc::new(if self.planar { pattern.in_plane() } else { pattern })
    }
}

/// Names with a number after those that came before: load, load 2, load 3.
pub(super) fn numbered<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut seen: Vec<&str> = Vec::new();
    let number = |name: &'a str| {
        seen.push(name);
        match seen.iter().filter(|earlier| **earlier == name).count() {
            1 => name.to_owned(),
            count => format!("{name} {count}"),
        }
    };
    names.map(number).collect()
}
