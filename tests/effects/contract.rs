//! Pairs that depend on the shape and limits of steps, by an effect of the test; and an
//! effect that couples what it does not declare.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    Block, BlockMatrix, Contact, Coupling, Energy, EnergyTerm, HessianPart, Interaction, Material,
    Stretching,
};
use rumple::geometry::Shape;
use rumple::model::{Mechanics, ModelError, Potential};
use rumple::sheet::Sheet;
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec, Newton, NewtonSpec};
use rumple_numerics::linear::BlockMatrix as Matrix;

use crate::common::{Noise, lattice};

/// Springs between the first and the last row of a strip, wherever vertices are nearer than `reach`:
/// `u = k/2 [(r - ½ reach)² - (½ reach)²]`, which holds what is near at half that distance.
struct Adhesion {
    stiffness: f64,
    reach: f64,
    ends: [Vec<u32>; 2],
    declared: Interaction,
    ceiling: f64,
}

impl Adhesion {
    fn near(&self, x: &[Vec3]) -> Vec<[u32; 2]> {
        let mut all = Vec::new();
        for &a in &self.ends[0] {
            for &b in &self.ends[1] {
                if (x[a as usize] - x[b as usize]).norm() < self.reach {
                    all.push([a.min(b), a.max(b)]);
                }
            }
        }
        all
    }
}

impl Energy for Adhesion {
    type Work = ();

    fn name(&self) -> &'static str {
        "adhesion"
    }

    fn coupling(&self) -> Coupling {
        Coupling::ONE_RING
    }

    fn evaluate(&self, shape: &Shape<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        let mut gradient = gradient;
        let mut energy = 0.0;
        for [a, b] in self.near(shape.x) {
            let d = shape.x[b as usize] - shape.x[a as usize];
            let half = 0.5 * self.reach;
            let stretch = d.norm() - half;
            energy += 0.5 * self.stiffness * (stretch * stretch - half * half);
            if let Some(gradient) = &mut gradient {
                let pull = self.stiffness * stretch * d / d.norm();
                gradient[b as usize] += pull;
                gradient[a as usize] -= pull;
            }
        }
        energy
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        (): &mut (),
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let pairs = self.near(shape.x);
        into.update_rows(|i, row| {
            for &[a, b] in &pairs {
                let d = shape.x[b as usize] - shape.x[a as usize];
                let (r, n) = (d.norm(), d.normalize());
                let across = 1.0 - 0.5 * self.reach / r;
                let across = if part == HessianPart::Full { across } else { across.max(0.0) };
                let along = n * n.transpose();
                let block = self.stiffness * (along + across * (Block::identity() - along));
                let (a, b) = (a as usize, b as usize);
                if i == a {
                    row.add(a, &block);
                    row.add(b, &-block);
                } else if i == b {
                    row.add(b, &block);
                }
            }
        });
    }
}

impl Contact for Adhesion {
    fn interaction(&self) -> Interaction {
        self.declared
    }

    fn pairs(&self, shape: &Shape<'_>, (): &mut (), pairs: &mut Vec<[u32; 2]>) {
        pairs.extend(self.near(shape.x));
    }

    fn largest_step(&self, from: &Shape<'_>, (): &mut (), direction: &[Vec3]) -> f64 {
        let share = |(x, d): (&Vec3, &Vec3)| {
            if x.z + d.z > self.ceiling {
                ((self.ceiling - x.z) / d.z).clamp(0.0, 1.0)
            } else {
                1.0
            }
        };
        from.x.iter().zip(direction).map(share).fold(1.0, f64::min)
    }
}

/// A strip that is bent so far that its ends are near each other.
fn bent(declared: Interaction, ceiling: f64) -> (Potential, Vec<Vec3>) {
    let sheet: Arc<Sheet> = Arc::new(lattice(24, 4));
    let material = Material { young: 200.0, poisson: 1.0 / 3.0, thickness: 0.6 };
    let least = 0.6;
    let side = |left: bool| -> Vec<u32> {
        let at = |x: &Vec3| if left { x.x < least } else { x.x > 23.0 - least };
        (0..sheet.vertex_count())
            .filter(|&i| at(&sheet.rest()[i]))
            .map(|i| u32::try_from(i).unwrap())
            .collect()
    };
    let adhesion = Adhesion {
        stiffness: 30.0,
        reach: 2.5,
        ends: [side(true), side(false)],
        declared,
        ceiling,
    };
    let stretching = rumple::effects::BondStretching::new(&material, Stretching::default().weight);
    let bending = rumple::effects::HingeBending::new(&sheet, &material);
    let terms =
        vec![EnergyTerm::new(stretching), EnergyTerm::new(bending), EnergyTerm::contact(adhesion)];
    // The middle is fixed, so that nothing but the ends moves them apart.
    let pins = sheet.rest().iter().map(|x| [(x.x - 11.5).abs() < 0.8; 3]).collect();
    let radius = 23.5 / (2.0 * std::f64::consts::PI);
    let x = sheet.rest().iter().map(|x| {
        let angle = (x.x - 11.5) / radius;
        Vec3::new(radius * angle.sin(), x.y, radius * (1.0 - angle.cos()))
    });
    let x = x.collect();
    (Potential::new(&Mechanics::new(sheet, terms, pins).unwrap()), x)
}

const PAIRS: Interaction = Interaction { pairs: true, limits_steps: false, touches: false };

#[test]
fn pairs_of_the_moment_are_in_the_matrix() {
    let goal = Goal { tolerance: 1e-9, max_iterations: 3000, ..Goal::default() };
    let (mut potential, start) = bent(PAIRS, f64::INFINITY);
    let usual = potential.mechanics().pattern().clone();
    let now = potential.pattern(&start);
    let blocks = |p: &rumple_numerics::linear::BlockPattern| p.start(p.rows());
    assert!(blocks(&now) > blocks(&usual), "no pair is near");
    let mut x = start.clone();
    let mut lbfgs = Lbfgs::new(potential.mechanics(), LbfgsSpec::default()).unwrap();
    let done = lbfgs.relax(&mut potential, &mut x, &goal).unwrap();
    let rest = potential.pattern(&x);
    assert!(blocks(&rest) > blocks(&usual), "nothing is near at rest: the test tests nothing");
    // Derivatives that lacked the pairs would not converge as Newton's method does near rest.
    let mut noise = Noise::new(5);
    x.iter_mut().zip(potential.pins()).filter(|(_, pin)| !pin[0]).for_each(|(x, _)| {
        *x += 1e-4 * noise.vector();
    });
    let mut newton = Newton::new(potential.mechanics(), NewtonSpec::default()).unwrap();
    let other = newton.relax(&mut potential, &mut x, &goal).unwrap();
    assert!(other.iterations <= 12, "{other:?}");
    assert!((done.energy / other.energy - 1.0).abs() < 1e-6, "{done:?} {other:?}");
}

#[test]
fn an_effect_that_couples_what_it_does_not_declare_is_named() {
    let (mut potential, x) = bent(Interaction::default(), f64::INFINITY);
    let mut matrix = Matrix::zeros(potential.pattern(&x));
    match potential.hessian(&x, HessianPart::Full, &mut matrix) {
        Err(ModelError::Coupling { effect, pair: [a, b] }) => {
            assert_eq!(effect, "adhesion");
            assert!(a < b, "{a} {b}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn no_step_goes_beyond_what_an_effect_allows() {
    let (_, start) = bent(PAIRS, f64::INFINITY);
    let highest = |x: &[Vec3]| x.iter().map(|x| x.z).fold(f64::NEG_INFINITY, f64::max);
    let declared = Interaction { limits_steps: true, ..PAIRS };
    let goal = Goal { tolerance: 1e-9, max_iterations: 300, ..Goal::default() };
    for ceiling in [highest(&start) + 1e-3, f64::INFINITY] {
        let (mut potential, mut x) = bent(declared, ceiling);
        let higher: Vec<Vec3> = x.iter().map(|x| x + Vec3::new(0.0, 0.0, 1.0)).collect();
        assert_eq!(potential.allows(&x, &higher, 0.1), ceiling.is_infinite());
        let mut lbfgs = Lbfgs::new(potential.mechanics(), LbfgsSpec::default()).unwrap();
        // Whether it comes to rest below the ceiling or not, it stays there.
        let _ = lbfgs.relax(&mut potential, &mut x, &goal);
        assert!(highest(&x) <= ceiling, "{} {ceiling}", highest(&x));
    }
}
