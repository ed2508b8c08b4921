//! Branches of mechanical equilibria: g = ∂U/∂x, whose derivative H is symmetric.

use super::bordered::Bordered;
use super::metric::Metric;
use super::system::{Equilibrium, System};
use super::{
    Block, Continuation, CriticalMode, Direction, Settings, Unknowns, UnstableDirections, check,
};
use crate::Vec3;
use crate::model::Potential;
use crate::solve::stability::Stability;
use crate::solve::{Control, SolveError};
use crate::tally::Tally;

/// No triangle's area may fall below this share in one correction.
const MIN_AREA_SHARE: f64 = 0.1;

/// The equilibria of the potentials U(x; λ) of one sheet.
pub struct Elastic<F> {
    /// The potential at λ, or why there is none: the same effects, fixed directions and vertices at every λ.
    family: F,
    bordered: Bordered,
    stability: Stability,
}

impl<F, E> Continuation<Elastic<F>>
where
    F: FnMut(f64) -> Result<Potential, E>,
    E: From<SolveError>,
{
    /// Follows the equilibria of `family`, which gives the potential at a value of the parameter: the same effects, fixed
    /// directions and vertices at every λ. Begins at the equilibrium of `parameter` near `x`, towards larger λ or smaller ones, as `forward` says.
    ///
    /// # Errors
    /// [`SolveError::Continuation`] if no equilibrium is near; effects that a branch cannot have; those of the family.
    pub fn new(
        mut family: F,
        (x, parameter): (Vec<Vec3>, f64),
        forward: bool,
        settings: Settings,
        control: &Control,
    ) -> Result<Self, E> {
        let potential = family(parameter)?;
        let mechanics = potential.mechanics();
        check(mechanics)?;
        let stability = Stability::new(mechanics)?.with_control(control);
        let metric = Metric::new(mechanics.sheet(), settings.scales(), (&[], 0));
        let bordered = Bordered::new(mechanics)?;
        let system = Elastic { family, bordered, stability };
        let start = (Unknowns { x, species: Vec::new() }, parameter);
        Self::begin((system, metric), start, forward, settings, control)
    }
}

impl<F, E> System for Elastic<F>
where
    F: FnMut(f64) -> Result<Potential, E>,
    E: From<SolveError>,
{
    type Error = E;
    type Member = Potential;

    fn evaluate(&mut self, mut at: Unknowns, parameter: f64) -> Result<Equilibrium<Potential>, E> {
        let mut potential = (self.family)(parameter)?;
        potential.mechanics().set_prescribed(potential.time(), &mut at.x);
        let mut imbalance = at.zeros_like();
        let energy = potential.energy_gradient(&at.x, &mut imbalance.x);
        let residual = potential.residual(&imbalance.x);
        let (member, iterations) = (potential, 0);
        Ok(Equilibrium { at, parameter, member, imbalance, energy, residual, iterations })
    }

    fn factorise(
        &mut self,
        equilibrium: &mut Equilibrium<Potential>,
        tolerance: f64,
    ) -> Result<(), SolveError> {
        let Equilibrium { member, at, imbalance, .. } = equilibrium;
        self.bordered.factorise(member, &at.x, (&imbalance.x, tolerance))
    }

    fn solve_bordered(
        &mut self,
        (column, form): (&Unknowns, &Direction),
        (f, g): (&Unknowns, f64),
    ) -> Result<Direction, SolveError> {
        let border = (&*column.x, (&*form.unknowns.x, form.parameter));
        let (x, parameter) = self.bordered.solve_bordered(border, (&f.x, g));
        Ok(Direction { unknowns: Unknowns { x, species: Vec::new() }, parameter })
    }

    fn unstable_directions(
        &mut self,
        at: &mut Equilibrium<Potential>,
    ) -> Result<UnstableDirections, SolveError> {
        let shape = self.stability.inertia(&mut at.member, &at.at.x)?.negative;
        Ok(UnstableDirections { shape, coupled: 0 })
    }

    fn modes(
        &mut self,
        at: &mut Equilibrium<Potential>,
        block: Block,
        count: usize,
    ) -> Result<Vec<CriticalMode>, SolveError> {
        if block != Block::Shape {
            return Ok(Vec::new());
        }
        let modes = self.stability.spectrum(&mut at.member, &at.at.x, count)?.modes;
        Ok(modes.into_iter().map(|mode| CriticalMode::of_shape(mode, Vec::new())).collect())
    }

    fn test_function(
        &mut self,
        _: &mut Equilibrium<Potential>,
        _: &CriticalMode,
    ) -> Result<Option<(f64, Unknowns)>, SolveError> {
        Ok(None)
    }

    fn allows(&self, at: &Equilibrium<Potential>, next: &Unknowns) -> bool {
        at.member.keeps_triangles(&at.at.x, &next.x, MIN_AREA_SHARE, 0.0)
    }

    fn tally(&self) -> &Tally {
        self.bordered.tally()
    }
}
