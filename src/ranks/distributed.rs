//! Linear solvers of PETSc over all ranks of a sheet.
//!
//! ```text
//! gamg     one cycle of smoothed aggregation multigrid, with the rigid motions of the current shape as near null space
//! mumps    Cholesky factorisation; to compare with
//! ```
//!
//! The rows of owned vertices are complete on their rank. Vertices are numbered by rank, owned ones of a rank in a row.
//! Which options PETSC_OPTIONS has take precedence, with the prefix of the solver: `-gamg_ksp_type cg`.
//!
//! References: Balay et al., PETSc/TAO Users Manual, ANL-21/39; Adams, Bayraktar, Keaveny & Papadopoulos, SC'04,
//! doi:10.1109/SC.2004.62 (multigrid by aggregation for elasticity); Amestoy et al., SIAM J. Matrix Anal. Appl. 23 (2001),
//! doi:10.1137/S0895479899358194 (MUMPS).

use std::ffi::c_int;
use std::ptr;
use std::sync::Arc;

use rumple_core::registry::inventory;
use rumple_core::solve::linear_solvers::LinearSolverKind;
use rumple_numerics::Vec3;
use rumple_numerics::linear::{
    Block, BlockMatrix, BlockPattern, LinearError, LinearSolver, NotPositive,
};
use rumple_numerics::num::{real, whole};
use rumple_numerics::reduction::{Communicator, Reduction};

use super::petsc::{self as p, Error, PetscInt, ok, text};
use super::world::{World, with_petsc};

/// Options of PETSc for both solvers; those of gamg as tried on grown domes, where coarsening squares of the graph at
/// the first levels (the default) takes twice the iterations.
const OPTIONS: [(&str, &str); 11] = [
    ("-gamg_ksp_type", "preonly"),
    ("-gamg_pc_type", "gamg"),
    ("-gamg_pc_gamg_threshold", "0.0"),
    ("-gamg_pc_gamg_aggressive_coarsening", "0"),
    ("-gamg_pc_gamg_square_graph", "0"),
    ("-gamg_mg_levels_ksp_type", "chebyshev"),
    ("-gamg_mg_levels_pc_type", "jacobi"),
    ("-gamg_mg_levels_ksp_max_it", "2"),
    ("-mumps_ksp_type", "preonly"),
    ("-mumps_pc_type", "cholesky"),
    ("-mumps_pc_factor_mat_solver_type", "mumps"),
];

inventory::submit! {
    LinearSolverKind { name: "gamg", analyse: |pattern| PetscSolver::analyse("gamg_", pattern) }
}
inventory::submit! {
    LinearSolverKind { name: "mumps", analyse: |pattern| PetscSolver::analyse("mumps_", pattern) }
}

/// A block of a row that is complete here: its column by rank, where it is in the matrix, and whether it is transposed.
#[derive(Clone, Copy)]
struct Entry {
    column: PetscInt,
    row: usize,
    place: usize,
    transposed: bool,
}

/// A solver of PETSc.
pub struct PetscSolver {
    world: Arc<World>,
    axes: usize,
    /// Vertices owned, those of lower ranks, and all.
    owned: usize,
    before: usize,
    all: usize,
    rows: Vec<Vec<Entry>>,
    matrix: p::Matrix,
    solver: p::Solver,
    rhs: p::Vector,
    solution: p::Vector,
    /// The shape that the near null space is of.
    coordinates: p::Vector,
    prefix: &'static str,
}

// SAFETY: objects of PETSc are used by the owner of the solver, one thread at a time.
unsafe impl Send for PetscSolver {}

impl PetscSolver {
    /// Prepares what depends on the pattern only.
    ///
    /// # Errors
    /// If PETSc cannot be started, or has no memory.
    pub fn analyse(
        prefix: &'static str,
        pattern: &Arc<BlockPattern>,
    ) -> Result<Box<dyn LinearSolver>, LinearError> {
        let world = with_petsc(&OPTIONS).map_err(LinearError::new)?;
        let reduction = pattern.reduction();
        let owned = reduction.owned(pattern.rows());
        let numbers = numbers(&world, reduction, pattern.rows(), owned);
        let before = numbers.first().map_or(0, |n| whole(*n));
        let mut made = Self {
            world,
            axes: pattern.axes(),
            owned,
            before,
            all: whole(reduction.count(pattern.rows())),
            rows: entries(pattern, owned, &numbers),
            matrix: p::Matrix::NULL,
            solver: p::Solver::NULL,
            rhs: p::Vector::NULL,
            solution: p::Vector::NULL,
            coordinates: p::Vector::NULL,
            prefix,
        };
        made.create_vectors().map_err(|e| LinearError::new(e.0))?;
        Ok(Box::new(made))
    }

    /// Unknowns of this rank and of all.
    fn sizes(&self) -> [PetscInt; 2] {
        [int(self.axes * self.owned), int(self.axes * self.all)]
    }

    fn create_vectors(&mut self) -> Result<(), Error> {
        let (comm, size, [own, all]) = (self.world.raw(), int(self.axes), self.sizes());
        // SAFETY: handles are written before they are read.
        unsafe {
            ok(p::VecCreateMPI(comm, own, all, &raw mut self.rhs))?;
            ok(p::VecSetBlockSize(self.rhs, size))?;
            ok(p::VecDuplicate(self.rhs, &raw mut self.solution))?;
            ok(p::VecDuplicate(self.rhs, &raw mut self.coordinates))
        }
    }

    /// A new matrix, with room for its rows. What PETSc keeps of one with other values makes other bits in a run that is
    /// resumed.
    fn create_matrix(&mut self) -> Result<(), Error> {
        let (comm, size, [own, all]) = (self.world.raw(), int(self.axes), self.sizes());
        let range = int(self.before)..int(self.before + self.owned);
        let of = |inside: bool| -> Vec<PetscInt> {
            let counted = |e: &&Entry| range.contains(&e.column) == inside;
            self.rows.iter().map(|row| int(row.iter().filter(counted).count())).collect()
        };
        let (inside, outside) = (of(true), of(false));
        // SAFETY: handles are written before they are read, and the lists live until PETSc has copied them.
        unsafe {
            ok(p::MatDestroy(&raw mut self.matrix))?;
            ok(p::MatCreate(comm, &raw mut self.matrix))?;
            ok(p::MatSetSizes(self.matrix, own, own, all, all))?;
            ok(p::MatSetBlockSize(self.matrix, size))?;
            ok(p::MatSetType(self.matrix, text("aij")?.as_ptr()))?;
            let none = ptr::null();
            ok(p::MatXAIJSetPreallocation(
                self.matrix,
                size,
                inside.as_ptr(),
                outside.as_ptr(),
                none,
                none,
            ))?;
            ok(p::MatSetOption(self.matrix, p::MAT_SPD, p::PETSC_TRUE))
        }
    }

    /// Fills the rows that are owned.
    fn fill(&mut self, matrix: &BlockMatrix) -> Result<(), Error> {
        let axes = self.axes;
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        let blocks: Vec<Vec<Block>> = (0..self.owned).map(|i| matrix.row(i).collect()).collect();
        for (i, row) in self.rows.iter().enumerate() {
            columns.clear();
            columns.extend(row.iter().map(|entry| entry.column));
            values.clear();
            values.resize(axes * axes * row.len(), 0.0);
            for (k, entry) in row.iter().enumerate() {
                let block = blocks[entry.row][entry.place];
                for a in 0..axes {
                    for b in 0..axes {
                        let at = if entry.transposed { (b, a) } else { (a, b) };
                        values[a * axes * row.len() + axes * k + b] = block[at];
                    }
                }
            }
            let number = int(self.before + i);
            // SAFETY: one row of blocks, with as many values as its columns ask for.
            ok(unsafe {
                p::MatSetValuesBlocked(
                    self.matrix,
                    1,
                    &raw const number,
                    int(row.len()),
                    columns.as_ptr(),
                    values.as_ptr(),
                    p::INSERT_VALUES,
                )
            })?;
        }
        // SAFETY: a matrix whose rows were set by their owners.
        unsafe {
            ok(p::MatAssemblyBegin(self.matrix, p::MAT_FINAL_ASSEMBLY))?;
            ok(p::MatAssemblyEnd(self.matrix, p::MAT_FINAL_ASSEMBLY))
        }
    }

    /// The rigid motions of `x` as near null space.
    fn set_motions(&mut self, x: &[Vec3]) -> Result<(), Error> {
        self.write(self.coordinates, x)?;
        let mut motions = p::NullSpace::NULL;
        // SAFETY: PETSc copies what it needs; the matrix keeps its own reference.
        unsafe {
            ok(p::MatNullSpaceCreateRigidBody(self.coordinates, &raw mut motions))?;
            ok(p::MatSetNearNullSpace(self.matrix, motions))?;
            ok(p::MatNullSpaceDestroy(&raw mut motions))
        }
    }

    /// Copies what is owned of `from`.
    fn write(&self, to: p::Vector, from: &[Vec3]) -> Result<(), Error> {
        self.with(to, |values| {
            for (values, from) in values.chunks_exact_mut(self.axes).zip(from) {
                values.copy_from_slice(&from.as_slice()[..self.axes]);
            }
        })
    }

    /// The numbers of a vector that are here.
    fn with(&self, vector: p::Vector, f: impl FnOnce(&mut [f64])) -> Result<(), Error> {
        let mut values = ptr::null_mut();
        // SAFETY: the array has as many numbers as are owned, and is given back before anything else is asked of the vector.
        unsafe {
            ok(p::VecGetArray(vector, &raw mut values))?;
            f(std::slice::from_raw_parts_mut(values, self.axes * self.owned));
            ok(p::VecRestoreArray(vector, &raw mut values))
        }
    }

    fn set_up(&mut self, matrix: &BlockMatrix, x: &[Vec3]) -> Result<(), Error> {
        self.create_matrix()?;
        self.fill(matrix)?;
        self.set_motions(x)?;
        // A new one: what PETSc keeps of earlier matrices makes worse hierarchies.
        // SAFETY: handles are written before they are read.
        unsafe {
            ok(p::KSPDestroy(&raw mut self.solver))?;
            ok(p::KSPCreate(self.world.raw(), &raw mut self.solver))?;
            ok(p::KSPSetOptionsPrefix(self.solver, text(self.prefix)?.as_ptr()))?;
            ok(p::KSPSetOperators(self.solver, self.matrix, self.matrix))?;
            ok(p::KSPSetFromOptions(self.solver))?;
            ok(p::KSPSetUp(self.solver))
        }
    }

    fn solve_here(&mut self, rhs: &mut [Vec3]) -> Result<(), Error> {
        self.write(self.rhs, rhs)?;
        let mut reason: c_int = 0;
        // SAFETY: a solver that was set up, with vectors of its sizes.
        unsafe {
            ok(p::KSPSolve(self.solver, self.rhs, self.solution))?;
            ok(p::KSPGetConvergedReason(self.solver, &raw mut reason))?;
        }
        if reason < 0 && reason != p::KSP_DIVERGED_ITS {
            return Err(Error(format!(
                "the linear solver of PETSc failed: KSPConvergedReason {reason}"
            )));
        }
        self.with(self.solution, |values| {
            for (to, values) in rhs.iter_mut().zip(values.chunks_exact(self.axes)) {
                *to = Vec3::zeros();
                to.as_mut_slice()[..self.axes].copy_from_slice(values);
            }
        })
    }
}

impl Drop for PetscSolver {
    fn drop(&mut self) {
        // SAFETY: each handle is destroyed once; null ones are left alone.
        unsafe {
            let _ = p::KSPDestroy(&raw mut self.solver);
            let _ = p::MatDestroy(&raw mut self.matrix);
            for vector in [&raw mut self.rhs, &raw mut self.solution, &raw mut self.coordinates] {
                let _ = p::VecDestroy(vector);
            }
        }
    }
}

impl LinearSolver for PetscSolver {
    fn factorise(&mut self, matrix: &BlockMatrix, x: &[Vec3], _: bool) -> Result<(), NotPositive> {
        self.set_up(matrix, x).map_err(|_| NotPositive)
    }

    /// A solution with errors of PETSc is none: it has no finite numbers, and the step is rejected.
    fn solve(&mut self, rhs: &mut [Vec3]) {
        if self.solve_here(rhs).is_err() {
            rhs.fill(Vec3::repeat(f64::NAN));
        }
    }

    fn detects_indefinite(&self) -> bool {
        false
    }

    fn is_distributed(&self) -> bool {
        true
    }

    fn reads_shape(&self) -> bool {
        true
    }
}

/// A number as PETSc has it.
fn int(number: usize) -> PetscInt {
    PetscInt::try_from(number).unwrap_or(PetscInt::MAX)
}

/// The numbers by rank of all vertices here.
fn numbers(world: &World, reduction: &Reduction, rows: usize, owned: usize) -> Vec<f64> {
    let mut counts = vec![0.0; world.size()];
    counts[world.rank()] = real(owned);
    world.sum(&mut counts);
    let before: f64 = counts[..world.rank()].iter().sum();
    let mut numbers = vec![(0..rows).map(|i| before + real(i)).collect::<Vec<f64>>()];
    reduction.update_ghost_columns(&mut numbers);
    numbers.pop().unwrap_or_default()
}

/// Whole rows of what is owned, by ascending column.
fn entries(pattern: &BlockPattern, owned: usize, numbers: &[f64]) -> Vec<Vec<Entry>> {
    let column = |j: usize| int(whole(numbers[j]));
    let mut rows: Vec<Vec<Entry>> = vec![Vec::new(); owned];
    for row in 0..owned {
        for (place, &j) in pattern.row(row).iter().enumerate() {
            let j = j as usize;
            rows[row].push(Entry { column: column(j), row, place, transposed: false });
            if j != row && j < owned {
                rows[j].push(Entry { column: column(row), row, place, transposed: true });
            }
        }
    }
    rows.iter_mut().for_each(|row| row.sort_unstable_by_key(|entry| entry.column));
    rows
}
