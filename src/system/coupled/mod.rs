//! The one coupled system that every policy weighs: `M dy/dt = F(t, y)`.
//!
//! ```text
//! y = (u, c),  u = x - X at the free directions of the vertices,  c point by point
//! F = ( -∂U/∂x (x; l̄(c)),  D Δ_x c + R(c, signals(x, c), t) )
//! M = diag( w_x · drag,  w_c )
//! ```
//!
//! A policy is the two weights of M and nothing else. Held directions are no unknowns, and where the
//! shape has no storage neither are its rigid motions, so that its rows stay regular. Displacements take the place of positions, so that relative
//! tolerances do not depend on where the origin is.

mod jacobian;
mod layout;

pub use layout::Layout;

use super::{Course, SignalColumns, System};
use std::sync::Arc;

use crate::solve::SolveError;
use crate::solve::linear::{BlockPattern, Displacements, Sparse};
use crate::state::State;
use crate::timescale::Storage;
use crate::{Result, Vec3};
use jacobian::Jacobian;

/// Work done since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CoupledWork {
    /// Evaluations of F.
    pub residuals: usize,
    /// Evaluations of ∂F/∂y.
    pub jacobians: usize,
}

/// F, its derivatives and M of one [`System`] under one policy.
pub struct Coupled {
    layout: Layout,
    mass: Vec<f64>,
    state: State,
    gradient: Vec<Vec3>,
    jacobian: Option<Box<Jacobian>>,
    course: Option<Course>,
    work: CoupledWork,
}

impl Coupled {
    /// The unknowns of `system`, weighed by `policy`.
    #[must_use]
    pub fn new(system: &mut System, policy: Storage) -> Self {
        let layout = Layout::new(system, policy.mechanics == 0.0);
        Self::of(layout, system, policy)
    }

    /// The chemistry of `system` at a shape that does not move.
    #[must_use]
    pub fn chemistry_alone(system: &mut System, policy: Storage) -> Self {
        let layout = Layout::of_chemistry(system);
        Self::of(layout, system, policy)
    }

    /// The shape of `system` with a chemistry that does not change.
    #[must_use]
    pub fn shape_alone(system: &mut System, policy: Storage) -> Self {
        let layout = Layout::of_shape(system);
        Self::of(layout, system, policy)
    }

    fn of(layout: Layout, system: &System, policy: Storage) -> Self {
        let mut mass = vec![policy.mechanics * system.drag(); layout.mechanical()];
        mass.resize(layout.unknowns(), policy.chemistry);
        Self {
            layout,
            mass,
            state: State::default(),
            gradient: Vec::new(),
            jacobian: None,
            course: None,
            work: CoupledWork::default(),
        }
    }

    /// Which unknown is what.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The diagonal of M; exactly 0 in rows without storage.
    #[must_use]
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Work so far.
    #[must_use]
    pub fn work(&self) -> CoupledWork {
        self.work
    }

    /// Which unknowns are displacements, for linear solvers that treat them apart; `None` without any.
    #[must_use]
    pub fn displacements(&self, system: &mut System) -> Option<Displacements> {
        let count = self.layout.mechanical();
        (count > 0).then(|| Displacements {
            place: self.layout.displacements().collect(),
            count,
            pattern: Arc::new(BlockPattern::two_rings(system.mechanics().sheet())),
        })
    }

    /// Absolute tolerances of the unknowns: `atol` times the mean edge for displacements, times the
    /// species' typical magnitude for species.
    #[must_use]
    pub fn tolerances(&self, system: &mut System, atol: f64) -> Vec<f64> {
        let edge = system.mechanics().metric().mean_edge();
        let mut all = vec![atol * edge; self.layout.mechanical()];
        if let Some(chemistry) = system.chemistry() {
            let typical: Vec<f64> =
                chemistry.descriptor().species.iter().map(|s| atol * s.typical).collect();
            for _ in 0..self.layout.points() {
                all.extend_from_slice(&typical);
            }
        }
        all
    }

    /// Writes the unknowns of `state` to `y`.
    pub fn pack(&self, system: &mut System, state: &State, y: &mut [f64]) {
        self.layout.pack(system.mechanics().sheet().rest(), state, y);
    }

    /// Writes `y` into `state`, whose held directions stay as they are.
    pub fn unpack(&self, system: &mut System, y: &[f64], time: f64, state: &mut State) {
        self.layout.unpack(system.mechanics().sheet().rest(), y, state);
        state.time = time;
    }

    /// Takes the held directions from `state`: before the first residual, and whenever they changed.
    pub fn start(&mut self, state: &State) {
        self.state.clone_from(state);
    }

    /// Lets what no unknown stands for go along `course`: the species where the shape is alone; the
    /// signals where the chemistry is, which then keeps the transport of the shape last followed.
    pub fn set_course(&mut self, course: Course) {
        self.course = Some(course);
    }

    /// The signals on their course, if they have one.
    fn given_signals(&self, time: f64) -> Option<SignalColumns> {
        let course = self.course.as_ref().filter(|_| self.layout.species() > 0)?;
        let mut signals = Vec::new();
        course.at(time, &mut signals);
        Some(signals)
    }

    /// Sets the species on their course, if they have one.
    fn follow_species(&self, state: &mut State) {
        if let Some(course) = self.course.as_ref().filter(|_| self.layout.species() == 0) {
            course.at(state.time, &mut state.species);
        }
    }

    /// Writes F. Every integration comes by here often: this is where it asks whether to go on.
    ///
    /// # Errors
    /// If the plugin fails, or optimal lengths make no triangle where strains are read;
    /// [`SolveError::Interrupted`].
    pub fn residual(
        &mut self,
        system: &mut System,
        time: f64,
        y: &[f64],
        out: &mut [f64],
    ) -> Result<()> {
        going_on(system)?;
        self.work.residuals += 1;
        let mut state = std::mem::take(&mut self.state);
        self.unpack(system, y, time, &mut state);
        self.follow_species(&mut state);
        let done = self.evaluate(system, &state, out);
        self.state = state;
        done
    }

    fn evaluate(&mut self, system: &mut System, state: &State, out: &mut [f64]) -> Result<()> {
        let given = self.given_signals(state.time);
        if given.is_none() {
            system.follow(state)?;
        }
        if self.layout.mechanical() > 0 {
            self.gradient.resize(state.x.len(), Vec3::zeros());
            system.mechanics().energy_gradient(&state.x, &mut self.gradient);
            self.layout.pack_forces(&self.gradient, out);
        }
        if self.layout.species() > 0 {
            let signals = given.unwrap_or_else(|| system.signals(state));
            let rates = system.rates(&state.species, &signals)?;
            self.layout.pack_species(&rates, out);
        }
        Ok(())
    }

    /// ∂F/∂y.
    ///
    /// Exact but for the derivatives of the Green-Gauss scheme by positions, and the second ones of
    /// mixed-Voronoi area fractions in the bending energy, which are left out.
    ///
    /// # Errors
    /// If the plugin fails; [`SolveError::Interrupted`].
    pub fn jacobian(&mut self, system: &mut System, time: f64, y: &[f64]) -> Result<&Sparse> {
        going_on(system)?;
        self.work.jacobians += 1;
        let mut state = std::mem::take(&mut self.state);
        self.unpack(system, y, time, &mut state);
        self.follow_species(&mut state);
        let given = self.given_signals(time);
        let layout = &self.layout;
        let jacobian = &mut self.jacobian;
        let mut fill = || -> Result<()> {
            if given.is_none() {
                system.follow(&state)?;
            }
            let given = given.as_ref();
            match jacobian {
                Some(jacobian) => jacobian.fill(system, layout, &state, given),
                None => {
                    let made = Jacobian::new(system, layout, &state, given)?;
                    *jacobian = Some(Box::new(made));
                    Ok(())
                }
            }
        };
        let done = fill();
        self.state = state;
        done?;
        Ok(self.jacobian.get_or_insert_default().matrix())
    }
}

fn going_on(system: &System) -> Result<()> {
    if system.interrupted() { Err(SolveError::Interrupted.into()) } else { Ok(()) }
}
