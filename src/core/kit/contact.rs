//! What an energy of contact says of shapes, against its energy.

use super::report::moved;
use crate::Vec3;
use crate::model::Potential;

/// Shares of the largest step at which the energy is evaluated.
const STEP_SHARES: [f64; 3] = [0.25, 0.5, 1.0];

/// Inspects the steps, paths and starts that the one energy of `potential` allows from the shape `x`, which steps of an
/// edge length leave.
pub(super) fn examine(
    potential: &mut Potential,
    (x, time, edge): (&[Vec3], f64, f64),
    directions: &[Vec<Vec3>],
    fault: &mut impl FnMut(String),
) {
    if let Some(touching) = potential.touching(0, x)
        && (touching.pairs == 0) != (touching.gap == f64::INFINITY)
    {
        let (pairs, gap) = (touching.pairs, touching.gap);
        fault(format!("{pairs} pairs touch at a smallest distance of {gap:e} (time {time})"));
    }
    if let Some(made) = potential.separate(x)
        && let Some((_, why)) = potential.refusal(&made.x)
    {
        fault(format!("it refuses the start that it has separated: {why}"));
    }
    if potential.refusal(x).is_some() {
        return;
    }
    if !potential.allows_path((x, time), x) {
        fault(format!("it does not allow a shape to stay (time {time})"));
    }
    for d in directions {
        let d: Vec<Vec3> = d.iter().map(|d| edge * d).collect();
        let share = potential.largest_step(x, &d);
        if !(0.0..=1.0).contains(&share) {
            fault(format!("the largest step is {share:e}, not a share (time {time})"));
            continue;
        }
        // Of a step that is shortened the end itself may touch.
        let inside = if share < 1.0 { 0.999 * share } else { share };
        if STEP_SHARES.iter().any(|s| !potential.energy(&moved(x, &d, s * inside)).is_finite()) {
            fault(format!("the energy is not finite on a step that it allows (time {time})"));
        }
    }
}
