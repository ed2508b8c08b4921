//! The coupled system of a scene: effects, kinetics and policy put together.
//!
//! ```text
//! w_x · drag · dx/dt = -∂U/∂x (x; c)              mechanics
//! w_c ·        dc/dt = D Δ_x c + R(c, signals, t) chemistry
//! ```
//!
//! The policy chooses the weights w; solvers ask for the pieces: equilibrium of the first row,
//! rates of the second, signals and length factors in between.

mod chemistry;
mod coupled;
mod mechanics;
mod signals;

pub use chemistry::{Chemistry, SignalColumns};
pub use coupled::{Coupled, CoupledWork, Layout};
pub use mechanics::{Mechanics, Pins};
pub use signals::{Signals, TensionReading};

use crate::num::real;
use crate::parallel;
use crate::sheet::SheetError;
use crate::solve::SolveError;
use crate::solve::chebyshev::{Chebyshev, Tolerance};
use crate::solve::equilibrium::{Equilibrium, Goal, Relaxation, explained};
use crate::state::State;
use crate::{Error, Result, Vec3};

/// A sheet with its mechanics, its chemistry if the scene has kinetics, and how it is relaxed.
pub struct System {
    mechanics: Mechanics,
    chemistry: Option<Chemistry>,
    equilibrium: Option<Box<dyn Equilibrium>>,
    force_tolerance: f64,
    max_iterations: usize,
    drag: f64,
    interrupted: Box<dyn Fn() -> bool + Send + Sync>,
    chebyshev: Chebyshev,
    /// The shape that the transport belongs to.
    followed: Vec<Vec3>,
}

impl Default for System {
    /// No sheet and no effects: what stays behind where a system is lent.
    fn default() -> Self {
        Self::new(Mechanics::default(), None, None, 0.0, 0, 1.0)
    }
}

impl System {
    /// Puts the pieces together; without `equilibrium` the shape never moves. `drag` is that of a
    /// vertex, force per velocity.
    #[must_use]
    pub fn new(
        mechanics: Mechanics,
        chemistry: Option<Chemistry>,
        equilibrium: Option<Box<dyn Equilibrium>>,
        force_tolerance: f64,
        max_iterations: usize,
        drag: f64,
    ) -> Self {
        Self {
            mechanics,
            chemistry,
            equilibrium,
            force_tolerance,
            max_iterations,
            drag,
            interrupted: Box::new(|| false),
            chebyshev: Chebyshev::default(),
            followed: Vec::new(),
        }
    }

    /// Sets the question that long work asks now and then: `true` gives up.
    pub fn set_interrupt(&mut self, interrupted: impl Fn() -> bool + Send + Sync + 'static) {
        self.interrupted = Box::new(interrupted);
    }

    /// Whether the user asked to stop.
    #[must_use]
    pub fn interrupted(&self) -> bool {
        (self.interrupted)()
    }

    /// Drag of a vertex, force per velocity.
    #[must_use]
    pub fn drag(&self) -> f64 {
        self.drag
    }

    /// Whether the shape can move.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.equilibrium.is_some()
    }

    /// Both halves, if there is kinetics.
    pub(crate) fn chemistry_apart(&mut self) -> Option<(&Chemistry, &mut Mechanics)> {
        self.chemistry.as_ref().map(|chemistry| (chemistry, &mut self.mechanics))
    }

    /// The mechanical half.
    pub fn mechanics(&mut self) -> &mut Mechanics {
        &mut self.mechanics
    }

    /// Largest force on a vertex that counts as rest, in units of the force scale.
    #[must_use]
    pub fn force_tolerance(&self) -> f64 {
        self.force_tolerance
    }

    /// The chemical half, if there is kinetics.
    #[must_use]
    pub fn chemistry(&self) -> Option<&Chemistry> {
        self.chemistry.as_ref()
    }

    /// Sets optimal lengths from the species of `state`, and what of the chemistry depends on its
    /// shape.
    ///
    /// # Errors
    /// If the plugin fails, or reads strains where optimal lengths make no triangle.
    pub fn follow(&mut self, state: &State) -> Result<()> {
        let Some(chemistry) = &mut self.chemistry else { return Ok(()) };
        if self.followed != state.x {
            self.mechanics.with_shape(&state.x, |shape| chemistry.set_shape(shape));
            self.followed.clone_from(&state.x);
        }
        let sheet = self.mechanics.sheet().clone();
        if let Some(factor) = chemistry.length_factor(&sheet, &state.species)? {
            self.mechanics.set_length_factor(&factor);
            let metric = self.mechanics.metric();
            if chemistry.reads_strain()
                && let Some(t) = metric.impossible_triangle()
            {
                let message = metric.describe_impossible(&sheet, t);
                return Err(SheetError::Unusable(message).into());
            }
        }
        Ok(())
    }

    /// Brings the shape of `state` into equilibrium with its species.
    ///
    /// # Errors
    /// If the plugin or the relaxation fails.
    pub fn relax(&mut self, state: &mut State) -> Result<Relaxation> {
        self.follow(state)?;
        let Some(equilibrium) = &mut self.equilibrium else { return Ok(Relaxation::default()) };
        let interrupted = &self.interrupted;
        let goal = Goal {
            tolerance: self.force_tolerance,
            max_iterations: self.max_iterations,
            interrupted: &|| interrupted(),
        };
        let done = equilibrium
            .relax(&mut self.mechanics, &mut state.x, &goal)
            .map_err(|error| explained(error, &self.mechanics, &state.x))?;
        if let Some(chemistry) = &mut self.chemistry {
            self.mechanics.with_shape(&state.x, |shape| chemistry.set_shape(shape));
            self.followed.clone_from(&state.x);
        }
        Ok(done)
    }

    /// Largest force on a vertex at `state`, in units of the force scale; 0 where nothing moves.
    pub fn residual(&mut self, state: &State) -> f64 {
        if !self.moves() {
            return 0.0;
        }
        let mut gradient = vec![Vec3::zeros(); state.x.len()];
        self.mechanics.energy_gradient(&state.x, &mut gradient);
        self.mechanics.residual(&gradient)
    }

    /// The signals that the kinetics reads at `state`.
    pub fn signals(&mut self, state: &State) -> SignalColumns {
        match &self.chemistry {
            None => Vec::new(),
            Some(chemistry) => {
                self.mechanics.with_shape(&state.x, |shape| chemistry.read(shape, state.time))
            }
        }
    }

    /// `D Δc + R` of every species, with the transport of the last shape followed.
    ///
    /// # Errors
    /// If the plugin fails.
    pub fn rates(&self, species: &[Vec<f64>], signals: &SignalColumns) -> Result<Vec<Vec<f64>>> {
        let mut out: Vec<Vec<f64>> = species.iter().map(|c| vec![0.0; c.len()]).collect();
        if let Some(chemistry) = &self.chemistry {
            let c: Vec<&[f64]> = species.iter().map(Vec::as_slice).collect();
            let mut r: Vec<&mut [f64]> = out.iter_mut().map(Vec::as_mut_slice).collect();
            chemistry.reaction(&c, signals, &mut r)?;
            chemistry.add_transport(self.mechanics.sheet(), &c, &mut r);
        }
        Ok(out)
    }

    /// Integrates the chemistry from `state` to `until` with the shape's transport frozen and the
    /// signals going linearly from `now` to `then`; returns the species.
    ///
    /// # Errors
    /// If the plugin or the integrator fails.
    pub fn advance_chemistry(
        &mut self,
        state: &State,
        until: f64,
        now: &SignalColumns,
        then: &SignalColumns,
        (rtol, atol): (f64, f64),
    ) -> Result<Vec<Vec<f64>>> {
        let Some(chemistry) = &self.chemistry else { return Ok(state.species.clone()) };
        let sheet = self.mechanics.sheet().clone();
        let count = chemistry.points(&sheet);
        let mut y: Vec<f64> = state.species.concat();
        let absolute: Vec<f64> = chemistry
            .descriptor()
            .species
            .iter()
            .flat_map(|s| std::iter::repeat_n(atol * s.typical, count))
            .collect();
        let views: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
        let frozen = std::ptr::eq(now, then);
        let mut bound = chemistry.spectral_bound(&views, now)?;
        if !frozen {
            bound = bound.max(chemistry.spectral_bound(&views, then)?);
        }
        let mut between = now.clone();
        let rate = |t: f64, y: &[f64], out: &mut [f64]| -> Result<()> {
            if !frozen {
                let share = (t - state.time) / (until - state.time);
                for ((b, a), z) in between.iter_mut().zip(now).zip(then) {
                    parallel::fill(b, |i| a[i] + share * (z[i] - a[i]));
                }
            }
            let c: Vec<&[f64]> = y.chunks(count).collect();
            let mut r: Vec<&mut [f64]> = out.chunks_mut(count).collect();
            chemistry.reaction(&c, &between, &mut r)?;
            chemistry.add_transport(&sheet, &c, &mut r);
            Ok(())
        };
        let tolerance = Tolerance { relative: rtol, absolute: &absolute };
        self.chebyshev.integrate(state.time, until, &mut y, &tolerance, bound, rate)?;
        Ok(y.chunks(count).map(<[f64]>::to_vec).collect())
    }

    /// Brings values that left a species' valid range by less than the tolerance
    /// `atol·typical + rtol·max|c|` back to its edge.
    ///
    /// # Errors
    /// [`SolveError::OutOfRange`] for a value further out, or none at all (NaN).
    pub fn keep_in_range(
        &self,
        values: &mut [Vec<f64>],
        time: f64,
        (rtol, atol): (f64, f64),
    ) -> Result<()> {
        let Some(chemistry) = &self.chemistry else { return Ok(()) };
        for (species, c) in chemistry.descriptor().species.iter().zip(values) {
            let largest = c.iter().fold(0.0f64, |m, c| m.max(c.abs()));
            let slack = atol * species.typical + rtol * largest;
            let (least, greatest) = (species.lower - slack, species.upper + slack);
            for (point, c) in c.iter_mut().enumerate() {
                if !(*c >= least && *c <= greatest) {
                    return Err(Error::Solve(SolveError::OutOfRange {
                        species: species.name.clone(),
                        place: format!("{} {point}", chemistry.location().noun()),
                        value: *c,
                        range: (species.lower, species.upper),
                        time,
                    }));
                }
                *c = c.clamp(species.lower, species.upper);
            }
        }
        Ok(())
    }

    /// RMS of `|b - a| / (atol·typical + rtol·max|c|)` over the points that changed by more than
    /// `quiet` of that from `start` to `b`.
    #[must_use]
    pub fn coupling_error(
        &self,
        start: &State,
        a: &[Vec<f64>],
        b: &[Vec<f64>],
        (rtol, atol): (f64, f64),
        quiet: f64,
    ) -> f64 {
        let Some(chemistry) = &self.chemistry else { return 0.0 };
        let (mut sum, mut points) = (0.0, 0usize);
        for (s, species) in chemistry.descriptor().species.iter().enumerate() {
            let largest = b[s].iter().fold(0.0f64, |m, c| m.max(c.abs()));
            let unit = atol * species.typical + rtol * largest;
            for i in 0..b[s].len() {
                if (b[s][i] - start.species[s][i]).abs() > quiet * unit {
                    let error = (b[s][i] - a[s][i]) / unit;
                    sum += error * error;
                    points += 1;
                }
            }
        }
        if points == 0 { 0.0 } else { (sum / real(points)).sqrt() }
    }

    /// Largest `|dc/dt|` over all points, in units of each species' typical magnitude, 1/time.
    ///
    /// # Errors
    /// If the plugin fails.
    pub fn unrest(&mut self, state: &State) -> Result<f64> {
        let signals = self.signals(state);
        let rates = self.rates(&state.species, &signals)?;
        let Some(chemistry) = &self.chemistry else { return Ok(0.0) };
        let mut largest: f64 = 0.0;
        for (species, rate) in chemistry.descriptor().species.iter().zip(&rates) {
            let fastest = parallel::max(rate.len(), |i| rate[i].abs());
            largest = largest.max(fastest / species.typical);
        }
        Ok(largest)
    }
}
