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
mod course;
mod heard;
mod mechanics;
mod parameters;
mod rigid;
mod signals;

pub use chemistry::{Chemistry, SignalColumns};
pub use coupled::{Coupled, CoupledWork, Layout};
pub use course::Course;
pub use heard::Heard;
pub use mechanics::{Mechanics, Pins};
pub use parameters::ParameterFields;
pub use rigid::{Motion, free_motions, holding};
pub use signals::{Signals, TensionReading};

use crate::num::real;
use crate::parallel;
use crate::sheet::SheetError;
use crate::solve::SolveError;
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
    listener: Box<Listener>,
    /// The shape that the transport belongs to.
    followed: Vec<Vec3>,
}

/// Who is told of long work; asks for the text only where it shows it.
type Listener = dyn Fn(&dyn Fn() -> String) + Send + Sync;

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
            listener: Box::new(|_| ()),
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

    /// Sets who is told, again and again, what long work within a step is about.
    pub fn set_listener(&mut self, tell: impl Fn(&dyn Fn() -> String) + Send + Sync + 'static) {
        self.listener = Box::new(tell);
    }

    /// Tells what is being done, and how far it is.
    pub fn tell(&self, text: impl Fn() -> String) {
        (self.listener)(&text);
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
        a: &State,
        b: &State,
        (rtol, atol): (f64, f64),
        quiet: f64,
    ) -> f64 {
        let Some(chemistry) = &self.chemistry else { return 0.0 };
        let (a, b) = (&a.species, &b.species);
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

    /// RMS of `|x_b - x_a| / (atol·edge + rtol·max|x_b - X|)` over the vertices that moved by more than
    /// `quiet` of that from `start` to `b`.
    #[must_use]
    pub fn shape_error(
        &self,
        start: &State,
        a: &State,
        b: &State,
        (rtol, atol): (f64, f64),
        quiet: f64,
    ) -> f64 {
        if !self.moves() {
            return 0.0;
        }
        let rest = self.mechanics.sheet().rest();
        let largest = parallel::max(rest.len(), |i| (b.x[i] - rest[i]).norm());
        let unit = atol * self.mechanics.metric().mean_edge() + rtol * largest;
        let (mut sum, mut points) = (0.0, 0usize);
        for ((start, a), b) in start.x.iter().zip(&a.x).zip(&b.x) {
            if (b - start).norm() > quiet * unit {
                sum += (b - a).norm_squared() / (unit * unit);
                points += 1;
            }
        }
        if points == 0 { 0.0 } else { (sum / real(points)).sqrt() }
    }

    /// Whether any species diffuses.
    #[must_use]
    pub fn diffuses(&self) -> bool {
        self.chemistry.as_ref().is_some_and(|chemistry| !chemistry.transport().is_empty())
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
