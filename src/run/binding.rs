//! Binds the effects of a scene to its sheet, and sums up what they bring.

use super::built::{Brought, Built};
use super::{Result, scale_checks};
use crate::effects::{Effect, EffectContext, LengthFactor, Prescribed, TransportTerm};
use crate::model::MechanicsParts;
use crate::scene::Scene;

/// What all effects of a scene bring.
#[derive(Default)]
pub(super) struct Bound {
    pub(super) mechanics: MechanicsParts,
    pub(super) transports: Vec<TransportTerm>,
    pub(super) growth: Vec<LengthFactor>,
}

/// Binds the effects of `scene` to the sheet of `context`; counts in `built` what they cost.
///
/// # Errors
/// An effect that does not fit, with its place in the scene.
pub(super) fn effects(
    scene: &Scene,
    context: &EffectContext<'_>,
    built: &mut Built,
    notes: &mut Vec<String>,
) -> Result<Bound> {
    let mut all = Bound::default();
    all.mechanics.planar = scene.sheet.planar;
    all.mechanics.pins = vec![[false; 3]; context.sheet.vertex_count()];
    for (number, spec) in scene.effects.iter().enumerate() {
        let mut brought = Brought::begin();
        let effect = spec.build(context).map_err(|e| {
            let path = format!("effect[{number}].{}", e.key);
            scene.error_at(&path, &e.message, e.help.as_deref())
        })?;
        brought.holds(&effect);
        built.effects.push(brought);
        let said = spec.notes(context).into_iter();
        notes.extend(said.map(|said| format!("effect[{number}] ({}): {said}", spec.name())));
        all.add(scene, context, number, effect)?;
    }
    Ok(all)
}

impl Bound {
    /// Adds effect `number`.
    fn add(
        &mut self,
        scene: &Scene,
        context: &EffectContext<'_>,
        number: usize,
        effect: Effect,
    ) -> Result<()> {
        for term in effect.energies {
            scale_checks::check_load(scene, number, &term, context.material)?;
            self.mechanics.terms.push(term);
        }
        for transport in effect.transports {
            scale_checks::check_transport(scene, number, &transport, context.sheet)?;
            self.transports.push(transport);
        }
        check_prescribed(scene, number, &self.mechanics.prescribed, &effect.prescribed)?;
        self.mechanics.prescribed.extend(effect.prescribed);
        self.mechanics.constraints.extend(effect.constraints);
        self.growth.extend(effect.growth);
        for (all, more) in self.mechanics.pins.iter_mut().zip(effect.pins.unwrap_or_default()) {
            for a in 0..3 {
                all[a] |= more[a];
            }
        }
        Ok(())
    }
}

/// Refuses prescribed positions of effect `number` that contradict those of an `earlier` one.
fn check_prescribed(
    scene: &Scene,
    number: usize,
    earlier: &[Prescribed],
    new: &[Prescribed],
) -> Result<()> {
    let until = scene.time.span.until.get();
    let times = [0.0, 0.31 * until, 0.62 * until, until];
    for new in new {
        let contradiction = earlier.iter().find_map(|old| new.contradicts(old, &times));
        if let Some((vertex, axis)) = contradiction {
            let axis = ["x", "y", "z"][axis];
            let message =
                format!("an earlier pin moves vertex {vertex} along {axis} to another place");
            let help = "let the regions or the axes of the two differ";
            let path = format!("effect[{number}].displacement");
            return Err(scene.error_at(&path, &message, Some(help)).into());
        }
    }
    Ok(())
}
