//! What effects of contact say about a shape: what touches, with what pressure, and what they refuse.

use std::sync::Arc;

use super::{Potential, energy};
use crate::effects::{AnyContact, Interaction, SeparatedStart, Touching, Work};
use crate::geometry::{Face, Shape, sum_at_corners};
use crate::{Vec3, parallel};

/// What of a contact is counted, and the interactions of which it is asked.
type Asked = (&'static str, fn(Interaction) -> bool);

const LIMITS_STEPS: Asked = (energy::STEPS, |does| does.limits_steps);

impl Potential {
    /// Calls `f` with every contact of which `asked` is true, its memory and the shape at `x`.
    pub(super) fn each_contact(
        &mut self,
        (what, asked): Asked,
        x: &[Vec3],
        mut f: impl FnMut(usize, &dyn AnyContact, &mut Work, &Shape<'_>),
    ) {
        let Self { mechanics, metric, time, work, .. } = self;
        let shape = Shape { sheet: mechanics.sheet(), metric, time: *time, x };
        for (k, (term, work)) in mechanics.terms().iter().zip(work).enumerate() {
            if let Some(contact) = term.answering(asked) {
                let _scope = mechanics.meters()[k].scope(what);
                f(k, contact, work, &shape);
            }
        }
    }

    /// What touches at `x` by effect number `which`.
    pub fn touching(&mut self, which: usize, x: &[Vec3]) -> Option<Touching> {
        let Self { mechanics, metric, time, work, .. } = self;
        let shape = Shape { sheet: mechanics.sheet(), metric, time: *time, x };
        let contact = mechanics.terms().get(which)?.answering(|does| does.touches)?;
        Some(contact.touching(&shape, work.get_mut(which)?))
    }

    /// The force per current area of the vertices that effects of contact exert at `x`.
    pub fn contact_pressure(&mut self, x: &[Vec3]) -> Vec<f64> {
        let mechanics = Arc::clone(&self.mechanics);
        let mut force = vec![Vec3::zeros(); x.len()];
        for k in mechanics.contacts() {
            let of = self.force_of(k, x);
            parallel::update(&mut force, |i, f| *f += of[i]);
        }
        let sheet = mechanics.sheet();
        let mut area = vec![0.0; x.len()];
        let face = |t: usize| Face::from_corners(&sheet.triangles()[t].map(|v| x[v as usize])).area;
        sum_at_corners(sheet, |t| face(t) / 3.0, &mut area);
        force.iter().zip(&area).map(|(f, a)| if *a > 0.0 { f.norm() / a } else { 0.0 }).collect()
    }

    /// Whether all effects let the shape `from`, at rest at the time `since`, pass along straight lines to `to` at the
    /// time in force.
    pub(crate) fn allows_path(&mut self, (from, since): (&[Vec3], f64), to: &[Vec3]) -> bool {
        let Self { mechanics, metric, time, work, .. } = self;
        let shape = Shape { sheet: mechanics.sheet(), metric, time: since, x: from };
        let terms = mechanics.terms().iter().zip(work).zip(mechanics.meters());
        let mut moving = terms.filter(|((term, _), _)| term.reads().time);
        moving.all(|((term, work), meter)| {
            let Some(contact) = term.answering(LIMITS_STEPS.1) else { return true };
            let _scope = meter.scope(energy::STEPS);
            contact.allows_path(&shape, work, (to, *time))
        })
    }

    /// The largest fraction of the step `direction` from `x` that all effects allow, up to 1.
    pub fn largest_step(&mut self, x: &[Vec3], direction: &[Vec3]) -> f64 {
        let mut share = 1.0f64;
        if !self.mechanics.limits_steps() {
            return share;
        }
        self.each_contact(LIMITS_STEPS, x, |_, term, work, shape| {
            share = share.min(term.largest_step(shape, work, direction));
        });
        let mut blocked = [-share];
        self.reduction().max_over_ranks(&mut blocked);
        -blocked[0]
    }

    /// A start near `x` that effects were asked to make of one that they refuse.
    pub fn separate(&mut self, x: &[Vec3]) -> Option<SeparatedStart> {
        let mechanics = Arc::clone(&self.mechanics);
        let mut first = None;
        self.each_contact(LIMITS_STEPS, x, |_, term, work, shape| {
            first = first.take().or_else(|| term.separate(shape, work, mechanics.pins()));
        });
        first
    }

    /// The first effect that cannot begin with `x`, and why.
    pub fn refusal(&mut self, x: &[Vec3]) -> Option<(String, String)> {
        let mut first = None;
        self.each_contact(LIMITS_STEPS, x, |k, term, work, shape| {
            first = first.take().or_else(|| Some((k, term.refusal(shape, work)?)));
        });
        let (k, why) = first?;
        Some((self.mechanics.names().nth(k)?.to_owned(), why))
    }
}
