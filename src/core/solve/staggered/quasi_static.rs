//! The quasi-static shape: the motion under a small drag, and rest where an equilibrium is near.
//!
//! ```text
//! 0 = -∂U/∂x (x; q(t_n+1))                                        within a quarter of an edge
//! η W dx/dt = -∂U/∂x (x; q(t))          η W̄ ≤ 10⁻⁴ S Y T           elsewhere
//! ```
//!
//! A step from an equilibrium leads to the one within a quarter of an edge of where the velocities point, so that smooth
//! paths are as exact as equilibria are. Where there is none, or where the last correction of the species leads to another
//! one, the step is one of `simultaneous` under a small drag, with the same stages, error estimate and control. Users of finite
//! elements know this as automatic stabilisation: an artificial drag, so small that its work does not count, lets the shape
//! go through instabilities. At the end of such a step the equilibrium within a quarter of an edge replaces the shape; where
//! there is none a snap is under way, and continues under drag in the next step.
//!
//! S is `time.stabilisation`, the relative tolerance if the scene gives none; W is the drag of the scene with the mean W̄; Y
//! the stretching stiffness, force/length; T the time in which the fastest species changes by its typical magnitude at first,
//! at most the span of the run. η begins at its largest. A step outside of a snap whose drag takes up more than the share S of
//! the energy supplied lowers it in proportion, to a tenth at most; later steps raise it again.
//!
//! ```text
//! U(x_n+1; q_n+1) - U(x_n; q_n) = supplied - dissipated
//! ```
//!
//! What the shape loses on the way to rest is dissipated too. In a snap the sheet dissipates more than is supplied, however
//! small the drag is.
//!
//! References: Agostiniani & Rossi, J. Differential Equations 263 (2017) (the limit of vanishing drag); Scilla &
//! Solombrino, arXiv:1712.06182 (minimising movements with a drag that vanishes).

use super::spec::{Snap, Stabilised, Staggered};
use crate::model::State;
use crate::sheet::is_turned;
use crate::solve::equilibrium::Relaxation;
use crate::solve::{Result, SolveError, Workspace};

/// Iterations of relaxations between two checks of the stability of the shape: a check costs about as much as ten.
const CHECK_INTERVAL: usize = 20;
/// What a step counts for at least: a path of equilibria that takes an iteration or two a step loses its stability without
/// being hard to follow, and is left after two steps.
const LEAST_ITERATIONS: usize = 10;
/// A step that leaves an equilibrium and ends under way lags, unless the drag takes up more than so many times the energy supplied,
/// and is cut back: soft sheets move many edges in a step without an instability.
const LARGEST_LAG: f64 = 4.0;
/// Steps are not cut back for it below this share of the longest that led from one equilibrium to another.
const SHORTEST_REST_STEP: f64 = 1.0 / 64.0;
/// The largest drag in units of `S Y T`: a share of about S of T is then the time in which soft bending waves relax, whose
/// stiffness is some 10⁻⁴ of that of stretching. Smaller ones cost steps in snaps.
const LARGEST_DRAG: f64 = 1e-4;
/// The least in units of the largest. Where a sheet crumples in many small snaps they dissipate as much under any drag, and a
/// smaller one only shortens the steps; without any adaptation some strips stay far above their least energy.
const LEAST_DRAG: f64 = 0.1;
/// The drag changes by factors between these from step to step.
const DRAG_FACTORS: (f64, f64) = (0.1, 2.0);
/// In a snap the work of the drag is at least so many times the energy supplied; where a sheet that is free of stress grows under
/// drag, the two are the same.
const SNAP_RATIO: f64 = 2.0;
/// On a smooth path the energy rises at the old conditions by at least this share of what it drops by at the new ones.
const SMOOTH_SHARE: f64 = 0.5;
/// Work of the drag below this share of the energy is round-off.
const ROUND_OFF: f64 = 1e-9;

impl Stabilised {
    /// Whether the shape is at rest, so that the next equilibrium may be near.
    pub(super) fn rests(&self) -> bool {
        !self.moves
    }

    /// The shape leaves its equilibrium.
    pub(super) fn set_off(&mut self) {
        self.moves = true;
    }
}

impl Staggered {
    /// Whether a step of this length that left an equilibrium lags behind the next ones, rather than snaps: after a shorter one
    /// the next equilibrium may be near the last.
    pub(super) fn lags(&self, step: f64, done: &Relaxation) -> bool {
        let usual = self.stabilised.longest.max(self.first.unwrap_or(0.0));
        let snaps = done.dissipated > LARGEST_LAG * done.supplied.abs();
        done.moving && !snaps && step > SHORTEST_REST_STEP * usual
    }

    /// η, a factor on the drag of the scene.
    pub(super) fn stabilising_drag(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
    ) -> Result<f64> {
        if let Some((drag, _)) = self.stabilised.drag {
            return Ok(drag);
        }
        let most = LARGEST_DRAG * self.largest_share(workspace) * workspace.unit_drag(state)?;
        self.stabilised.drag = Some((most, most));
        Ok(most)
    }

    /// S, the largest share of the energy supplied that the drag takes up.
    fn largest_share(&self, workspace: &Workspace) -> f64 {
        workspace.stabilisation.share.unwrap_or(self.spec.rtol.get())
    }

    /// By what the shortest step of a stabilised shape is shorter than that of others: in a snap steps are to follow stretching,
    /// which relaxes in a time in proportion to η.
    ///
    /// ```text
    /// min(1, S / √rtol · η / η_most)
    /// ```
    pub(super) fn relaxing_share(&self, workspace: &Workspace) -> f64 {
        let Some((drag, most)) = self.stabilised.drag else { return 1.0 };
        (self.largest_share(workspace) / self.spec.rtol.get().sqrt() * drag / most).min(1.0)
    }

    /// Lowers η after a step whose drag took up more than the share S of the energy supplied, and raises it again.
    fn adapt_drag(&mut self, workspace: &Workspace, done: &Relaxation) {
        let share = done.dissipated / (done.dissipated + done.supplied.abs());
        let factor = (self.largest_share(workspace) / share).clamp(DRAG_FACTORS.0, DRAG_FACTORS.1);
        if let Some((drag, most)) = &mut self.stabilised.drag
            && factor.is_finite()
        {
            *drag = (*drag * factor).clamp(LEAST_DRAG * *most, *most);
        }
    }

    /// Brings the shape of `next`, which has moved from that of `state` under drag, to rest if an equilibrium is near.
    pub(super) fn rest(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        next: &mut State,
        done: &mut Relaxation,
    ) -> Result<()> {
        let total = |energies: &[f64]| energies.iter().sum::<f64>();
        let begin = workspace.energies(state)?;
        if !self.motion.rests() {
            done.dissipated = self.come_to_rest(workspace, state, next, done)?;
        }
        if self.stabilised.rests() {
            self.stabilised.longest = self.stabilised.longest.max(next.time - state.time);
        }
        let end = workspace.energies(next)?;
        let mut after = total(&end);
        // The work of a constraint is not in U.
        if !workspace.model.mechanics().is_constrained() {
            let lost = lost_in_snap(workspace, (state, &begin), (next, &end))?;
            done.dissipated = done.dissipated.max(lost);
        }
        done.supplied = after - total(&begin) + done.dissipated;
        self.stabilised.unchecked += done.iterations.max(LEAST_ITERATIONS);
        if self.stabilised.rests() && self.stabilised.unchecked >= CHECK_INTERVAL {
            self.stabilised.unchecked = 0;
            let left = workspace.leave_saddle(next, done)?;
            // Displaced along the unstable mode, with no equilibrium near: a snap begins.
            if left && workspace.reported_residual(next)? > workspace.force_tolerance() {
                self.stabilised.set_off();
            }
            let left = workspace.energy(next)?;
            done.dissipated += after - left;
            after = left;
        }
        done.moving = !self.stabilised.rests();
        done.residual = workspace.reported_residual(next)?;
        self.note_snap(workspace, state, next, (after, done));
        Ok(())
    }

    /// Ends a step under drag at rest if an equilibrium is near; the work that the drag took up.
    fn come_to_rest(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        next: &mut State,
        done: &mut Relaxation,
    ) -> Result<f64> {
        if is_turned(workspace.model.sheet(), &state.x, &next.x) {
            return Err(SolveError::InsideOut);
        }
        let by_drag = self.motion.dissipated(workspace.model.mechanics(), &next.x);
        let moved = workspace.energy(next)?;
        let near = workspace.rest_nearby(next, None)?;
        self.stabilised.moves = near.is_none();
        let Some(near) = near else { return Ok(by_drag) };
        done.add(&near);
        Ok(by_drag + moved - workspace.energy(next)?)
    }

    /// Follows a snap: it is over in the first step that dissipates less than is supplied.
    fn note_snap(
        &mut self,
        workspace: &Workspace,
        state: &State,
        next: &State,
        (energy, done): (f64, &mut Relaxation),
    ) {
        let snaps = done.dissipated > SNAP_RATIO * done.supplied.abs()
            && done.dissipated > ROUND_OFF * energy.abs();
        let (dissipated, supplied) = &mut self.stabilised.work;
        if !snaps {
            *dissipated += done.dissipated;
            *supplied += done.supplied.abs();
        }
        done.drag_share = if *supplied > 0.0 { *dissipated / *supplied } else { 0.0 };
        if !snaps {
            self.adapt_drag(workspace, done);
            if let Some(snap) = self.stabilised.snap.take() {
                (done.snaps, done.released, done.snapped) = (1, snap.released, Some(snap.vertex));
            }
            return;
        }
        let (vertex, moved) = workspace.farthest(&state.x, &next.x);
        let new = Snap { released: 0.0, vertex, moved };
        let snap = self.stabilised.snap.get_or_insert(new);
        snap.released += done.dissipated;
        if moved > snap.moved {
            (snap.vertex, snap.moved) = (vertex, moved);
        }
    }
}

/// Energy lost in a step from the shape of `state` to that of `next`, if it snaps: where the new shape has little more energy
/// than the old one before the step, or less,
///
/// ```text
/// drop = U(x_n; q_n+1) - U(x_n+1; q_n+1) + f_n+1·(p_n+1 - p_n)
/// rise = U(x_n+1; q_n) - U(x_n; q_n)     - f_n·(p_n+1 - p_n)          lost ≈ ½ (drop - rise)
/// ```
///
/// by the trapezoidal rule for the energy supplied, with the forces f on pins and obstacles that move from p_n to p_n+1: these
/// are not displaced without the sheet. On a smooth path of equilibria the two are the same to third order in the step, and
/// nothing is lost.
fn lost_in_snap(
    workspace: &mut Workspace,
    (state, begin): (&State, &[f64]),
    (next, end): (&State, &[f64]),
) -> Result<f64> {
    let [forth, work_forth] = supplied_towards(workspace, (state, begin), next)?;
    let [back, work_back] = supplied_towards(workspace, (next, end), state)?;
    let fall: f64 = begin.iter().zip(end).map(|(begin, end)| begin - end).sum();
    let (drop, rise) = (fall + forth - work_back, back - fall - work_forth);
    let snaps = rise.is_finite() && drop.is_finite() && rise < SMOOTH_SHARE * drop;
    Ok(if snaps { 0.5 * (drop - rise) } else { 0.0 })
}

/// The energy supplied to the shape of `state`, of these energies, on the way to the conditions of `other`, and f·(p' - p).
fn supplied_towards(
    workspace: &mut Workspace,
    (state, at): (&State, &[f64]),
    other: &State,
) -> Result<[f64; 2]> {
    let moved = workspace.energies(&with_shape(other, state))?;
    let mut all = [0.0, workspace.work_of_pins(state, &other.x)?];
    for (k, obstacle) in workspace.work_of_obstacles(state, other.time)?.into_iter().enumerate() {
        match obstacle {
            Some(work) => all[1] += work,
            None => all[0] += moved[k] - at[k],
        }
    }
    Ok(all)
}

/// The conditions of one state with the shape of another.
fn with_shape(conditions: &State, shape: &State) -> State {
    State { x: shape.x.clone(), ..conditions.clone() }
}
