//! A user-defined linear solver: faer's sparse LLᵀ in place of the engine's multifrontal Cholesky factor.
//!
//! Registered, it can be named in scenes of this program, as `equilibrium.preconditioner = "faer-llt"`. Here both relax
//! the same sheet, a square that is bent by a load:
//! `cargo run --release --example 06_linear_solver [vertices]`

use std::sync::Arc;
use std::time::Instant;

use faer::prelude::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{Argsort, Pair, SparseColMat, SymbolicSparseColMat};
use faer::{Col, Side};
use rumple::effects::{Axes, Bending, Load, LoadForce, Material, Pin, Region, Stretching};
use rumple::linear::{BlockMatrix, BlockPattern, LinearError, LinearSolver, NotPositive};
use rumple::num::checked::Finite;
use rumple::solve::equilibrium::{FactorPrecision, LbfgsSpec, Preconditioner};
use rumple::{Problem, Vec3, sheet};

struct FaerLlt {
    symbolic: SymbolicSparseColMat<u32>,
    order: Argsort<u32>,
    analysis: SymbolicLlt<u32>,
    factor: Option<Llt<u32, f64>>,
}

/// Rows and columns within block (i, j) of the upper triangle that are kept.
fn kept(n: usize, i: usize, j: usize) -> impl Iterator<Item = (usize, usize)> {
    let all = (0..n).flat_map(move |a| (0..n).map(move |b| (a, b)));
    all.filter(move |(a, b)| i != j || a <= b)
}

impl FaerLlt {
    fn analyse(pattern: &Arc<BlockPattern>) -> Result<Box<dyn LinearSolver>, LinearError> {
        let (n, failed) = (pattern.axes(), |_| LinearError::new("faer cannot analyse the pattern"));
        let at = |i: usize, a: usize| u32::try_from(n * i + a).unwrap_or(u32::MAX);
        let blocks =
            (0..pattern.rows()).flat_map(|i| pattern.row(i).iter().map(move |j| (i, *j as usize)));
        // The lower triangle: block (i, j) of the upper one, transposed.
        let pairs: Vec<_> = blocks
            .flat_map(|(i, j)| {
                kept(n, i, j).map(move |(a, b)| Pair { row: at(j, b), col: at(i, a) })
            })
            .collect();
        let size = n * pattern.rows();
        let (symbolic, order) = SymbolicSparseColMat::try_new_from_indices(size, size, &pairs)
            .map_err(|_| LinearError::new("the pattern is too large for faer"))?;
        let analysis = SymbolicLlt::try_new(symbolic.as_ref(), Side::Lower).map_err(failed)?;
        Ok(Box::new(Self { symbolic, order, analysis, factor: None }))
    }
}

impl LinearSolver for FaerLlt {
    fn factorise(&mut self, matrix: &BlockMatrix, _: &[Vec3], _: bool) -> Result<(), NotPositive> {
        let (pattern, n) = (matrix.pattern(), matrix.pattern().axes());
        let mut values = Vec::new();
        for i in 0..pattern.rows() {
            for (j, block) in pattern.row(i).iter().zip(matrix.row(i)) {
                values.extend(kept(n, i, *j as usize).map(|(a, b)| block[(a, b)]));
            }
        }
        let matrix = SparseColMat::new_from_argsort(self.symbolic.clone(), &self.order, &values)
            .map_err(|_| NotPositive)?;
        let factor =
            Llt::try_new_with_symbolic(self.analysis.clone(), matrix.as_ref(), Side::Lower);
        self.factor = Some(factor.map_err(|_| NotPositive)?);
        Ok(())
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        let Some(factor) = &self.factor else { return };
        let n = self.symbolic.nrows() / rhs.len();
        let mut x = Col::from_fn(n * rhs.len(), |k| rhs[k / n][k % n]);
        factor.solve_in_place(x.as_mat_mut());
        rhs.iter_mut().enumerate().for_each(|(i, v)| (0..n).for_each(|a| v[a] = x[n * i + a]));
    }

    fn detects_indefinite(&self) -> bool {
        true
    }
}

rumple::register_linear_solver!("faer-llt", FaerLlt::analyse);

/// Compares on as many vertices as the argument says.
///
/// # Errors
/// As [`compare`].
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given = std::env::args().nth(1).and_then(|text| text.parse().ok());
    compare(given.unwrap_or(2000))
}

/// Relaxes a disc that is held at its boundary under a load along its normal by both, and compares.
///
/// # Errors
/// None is expected.
pub fn compare(vertices: usize) -> Result<(), Box<dyn std::error::Error>> {
    let sheet = Arc::new(sheet::generate(&sheet::SheetShape::Disc { radius: 10.0 }, vertices, 1)?);
    let mut energies = Vec::new();
    for name in ["factor", "faer-llt"] {
        let preconditioner = Preconditioner::named(name).ok_or("not registered")?;
        let precision = FactorPrecision::Double;
        let problem = Problem::on(Arc::clone(&sheet))
            .material(Material { young: 1e5, poisson: 0.3, thickness: 0.2 })
            .effect(Stretching::default())
            .effect(Bending::default())
            .effect(Pin {
                region: Region::Boundary,
                axes: Axes([true; 3]),
                displacement: None,
                ramp: None,
            })
            .effect(Load {
                region: Region::All,
                force: LoadForce::AlongNormal(Finite::ONE.into()),
                ramp: None,
            })
            .equilibrium(LbfgsSpec { preconditioner, precision, ..LbfgsSpec::default() });
        let mut stepper = problem.stepper()?;
        let began = Instant::now();
        let done = stepper.relax()?;
        println!(
            "{name:>9}: {} vertices, {} iterations, {:.3} s, energy {:.9}",
            sheet.vertex_count(),
            done.iterations,
            began.elapsed().as_secs_f64(),
            done.energy
        );
        energies.push(done.energy);
    }
    assert!((energies[1] / energies[0] - 1.0).abs() < 1e-6, "{energies:?}");
    Ok(())
}
