//! What a scene is allowed to say and its author may not have meant: told before a run.

use crate::system::Mechanics;

/// Loads this many times the tolerance move a sheet before it counts as at rest.
const FELT: f64 = 1e3;

/// Looks at the effects with an energy.
pub(super) fn on_effects(mechanics: &mut Mechanics, tolerance: f64, notes: &mut Vec<String>) {
    let names: Vec<String> = mechanics.names().map(str::to_owned).collect();
    for name in ["stretching", "bending"] {
        // Effects of one kind are numbered.
        if names.contains(&format!("{name} 2")) {
            notes.push(format!("the scene lists {name} more than once: the energies add up"));
        }
    }
    let loads = mechanics.applied_forces();
    let rest = mechanics.sheet().rest().to_vec();
    for (which, _) in loads.iter().enumerate().filter(|(_, load)| **load > 0.0) {
        let force = mechanics.force_of(which, &rest);
        let mut felt = force.iter().zip(mechanics.pins());
        if !felt.any(|(f, held)| (0..3).any(|a| f[a] != 0.0 && !held[a])) {
            notes.push(format!(
                "effect {} ({}) acts only where pins hold the sheet, and moves nothing",
                which + 1,
                names[which]
            ));
        }
    }
    let load = loads.into_iter().fold(0.0, f64::max);
    if load > 0.0 && load < FELT * tolerance {
        notes.push(format!(
            "the largest load on a vertex is {load:.1e} Y times the edge length, and a sheet counts \
             as at rest below equilibrium.tolerance = {tolerance:e}: its answer to the load is \
             found badly or not at all; {:.0e} would do",
            1e-4 * load
        ));
    }
}
