//! Linear systems of periodic sheets: the columns of images are added to those of their owners.
//!
//! ```text
//! A_iJ = Σ_j B_ij        over the vertices j that are J or images of it, i owned; A is symmetric as B is periodic
//! ```
//!
//! B is the matrix over all vertices of the sheet, images included, whose rows are complete where they are owned.

use std::sync::Arc;

use super::{BlockMatrix, BlockPattern, LinearError, LinearSolver, NotPositive};
use crate::Vec3;
use crate::num::{index, real, whole};
use crate::record::{Malformed, Record};
use crate::reduction::Reduction;

/// Any solver, for the vertices of one period.
pub struct PeriodicSolver {
    inner: Box<dyn LinearSolver>,
    folded: BlockMatrix,
    /// The owner of every vertex.
    owners: Vec<u32>,
    /// Of the owned rows of B by turns, for every block its column in A; none where A has it by symmetry.
    columns: Vec<Option<u32>>,
}

impl PeriodicSolver {
    /// The solver that `make` makes for matrices of `pattern`, around which one for periodic sheets stands if it is of one.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn boxed(
        pattern: &Arc<BlockPattern>,
        make: impl FnOnce(&Arc<BlockPattern>) -> Result<Box<dyn LinearSolver>, LinearError>,
    ) -> Result<Box<dyn LinearSolver>, LinearError> {
        match pattern.reduction().periods() {
            [] => make(pattern),
            _ => Ok(Box::new(Self::new(pattern, make)?)),
        }
    }

    /// One for matrices of `pattern`; `make` analyses the pattern of A.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn new(
        pattern: &BlockPattern,
        make: impl FnOnce(&Arc<BlockPattern>) -> Result<Box<dyn LinearSolver>, LinearError>,
    ) -> Result<Self, LinearError> {
        let reduction = pattern.reduction();
        let owned = reduction.owned(pattern.rows());
        let owners = owners(reduction, pattern.rows());
        let mut columns = Vec::with_capacity(pattern.start(owned));
        let rows = (0..owned).map(|i| {
            let first = columns.len();
            let upper = |j: &u32| Some(owners[*j as usize]).filter(|owner| *owner >= index(i));
            columns.extend(pattern.row(i).iter().map(upper));
            let mut row: Vec<u32> = columns[first..].iter().flatten().copied().collect();
            row.sort_unstable();
            row.dedup();
            row
        });
        let folded = BlockPattern::from_rows(rows);
        let folded = Arc::new(if pattern.is_planar() { folded.in_plane() } else { folded });
        let inner = make(&folded)?;
        Ok(Self { inner, folded: BlockMatrix::zeros(folded), owners, columns })
    }
}

/// The owner of every vertex.
fn owners(reduction: &Reduction, rows: usize) -> Vec<u32> {
    let mut numbers = vec![(0..rows).map(real).collect::<Vec<f64>>()];
    reduction.update_ghost_columns(&mut numbers);
    numbers.iter().flatten().map(|number| index(whole(*number))).collect()
}

impl LinearSolver for PeriodicSolver {
    fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        x: &[Vec3],
        insist: bool,
    ) -> Result<(), NotPositive> {
        let Self { inner, folded, columns, .. } = self;
        let rows = folded.pattern().rows();
        folded.clear();
        folded.update_rows(|i, row| {
            let columns = &columns[matrix.pattern().start(i)..];
            for (block, column) in matrix.row(i).zip(columns) {
                if let Some(column) = column {
                    row.add(*column as usize, &block);
                }
            }
        });
        inner.factorise(folded, &x[..rows.min(x.len())], insist)
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        let rows = self.folded.pattern().rows();
        self.inner.solve(&mut rhs[..rows]);
        for (i, owner) in self.owners.iter().enumerate().skip(rows) {
            rhs[i] = rhs[*owner as usize];
        }
    }

    fn detects_indefinite(&self) -> bool {
        self.inner.detects_indefinite()
    }

    fn negative_eigenvalues(&self) -> Option<usize> {
        self.inner.negative_eigenvalues()
    }

    fn is_distributed(&self) -> bool {
        true
    }

    fn reads_shape(&self) -> bool {
        self.inner.reads_shape()
    }

    fn memory(&self) -> Record {
        self.inner.memory()
    }

    fn restore(&mut self, memory: &Record) -> Result<(), Malformed> {
        self.inner.restore(memory)
    }
}
