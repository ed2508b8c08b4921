//! Sparse Cholesky factors of block matrices.
//!
//! The tree of supernodes is found once for a pattern; every numeric factorisation reuses it and its
//! memory. Factorisations and solutions run in parallel, with the same bits for any number of threads.

use std::sync::Arc;

use super::multifrontal::{Factorisation, FrontWorkspace};
use super::substitution::{Substitution, workspace};
use super::supernodes::Supernodes;
use super::{BlockMatrix, BlockPattern, LinearError, NotPositive, Precision};
use crate::{Vec3, parallel};

/// Symbolic and numeric factorisation of matrices of one pattern.
pub struct BlockCholesky<T: Precision = f64> {
    tree: Supernodes,
    factor: Vec<T>,
    rooms: FrontWorkspace<T>,
    rhs: Vec<T>,
    workspace: Vec<T>,
    /// What the matrix was divided by.
    unit: f64,
}

impl<T: Precision> BlockCholesky<T> {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`LinearError`] if the pattern is too large for the index type.
    pub fn new(pattern: Arc<BlockPattern>) -> Result<Self, LinearError> {
        let tree = Supernodes::new(&pattern)?;
        let (size, n) = (tree.values_before(tree.count()), tree.unknowns());
        Ok(Self {
            factor: vec![T::from_f64(0.0); size],
            rooms: FrontWorkspace::new(&tree),
            rhs: vec![T::from_f64(0.0); n],
            workspace: vec![T::from_f64(0.0); workspace(&tree)],
            unit: 1.0,
            tree,
        })
    }

    /// Numbers in the factor.
    #[must_use]
    pub fn factor_size(&self) -> usize {
        self.factor.len()
    }

    /// Factorises `matrix`, which must have the pattern this was made for.
    ///
    /// # Errors
    /// [`NotPositive`] if it is not positive definite (or not finite); the factor is unusable then.
    pub fn factorise(&mut self, matrix: &BlockMatrix) -> Result<(), NotPositive> {
        // Entries are of order one in the factor, whatever the units.
        self.unit = matrix.mean_diagonal();
        if !(self.unit > 0.0 && self.unit.is_finite()) {
            return Err(NotPositive);
        }
        let (tree, rooms) = (&self.tree, &self.rooms);
        Factorisation { tree, matrix, scale: self.unit.recip(), rooms }.run(&mut self.factor)
    }

    /// Replaces `rhs` by the solution for the last matrix factorised.
    pub fn solve(&mut self, rhs: &mut [Vec3]) {
        // Single precision has a narrow range.
        let largest = parallel::max(rhs.len(), |i| rhs[i].amax());
        if !(largest > 0.0 && largest.is_finite()) {
            return;
        }
        let (scale, back) = (largest.recip(), largest / self.unit);
        let (tree, axes) = (&self.tree, self.tree.axes());
        let order = tree.order();
        parallel::fill(&mut self.rhs, |k| {
            T::from_f64(scale * rhs[order[k / axes] as usize][k % axes])
        });
        Substitution { tree, values: &self.factor }.solve(&mut self.rhs, &mut self.workspace);
        let (solved, rank) = (&self.rhs, tree.rank());
        parallel::fill(rhs, |vertex| {
            let place = axes * rank[vertex] as usize;
            let number =
                |axis: usize| if axis < axes { back * solved[place + axis].number() } else { 0.0 };
            Vec3::from_fn(|axis, _| number(axis))
        });
    }
}

/// A factor in single precision for as long as that does, in double precision afterwards.
///
/// Single precision takes half the memory and about two thirds of the time, of a factorisation and
/// of a solve (`cargo bench --bench mechanics`). A method that corrects itself (quasi-Newton,
/// conjugate gradients) does not mind until the matrix is worse conditioned than single precision
/// can hold.
pub struct MixedPrecisionCholesky {
    pattern: Arc<BlockPattern>,
    single: Option<BlockCholesky<f32>>,
    double: Option<BlockCholesky<f64>>,
}

impl MixedPrecisionCholesky {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// As [`BlockCholesky::new`].
    pub fn new(pattern: Arc<BlockPattern>) -> Result<Self, LinearError> {
        let single = Some(BlockCholesky::new(Arc::clone(&pattern))?);
        Ok(Self { pattern, single, double: None })
    }

    /// As [`MixedPrecisionCholesky::new`], in double precision from the start.
    ///
    /// # Errors
    /// As [`BlockCholesky::new`].
    pub fn in_double_precision(pattern: Arc<BlockPattern>) -> Result<Self, LinearError> {
        let double = Some(BlockCholesky::new(Arc::clone(&pattern))?);
        Ok(Self { pattern, single: None, double })
    }

    /// Whether it is in double precision.
    #[must_use]
    pub fn is_double(&self) -> bool {
        self.double.is_some()
    }

    /// Prepares for double precision, or for single precision.
    ///
    /// # Errors
    /// As [`BlockCholesky::new`].
    pub fn set_double(&mut self, double: bool) -> Result<(), LinearError> {
        if double == self.is_double() {
            return Ok(());
        }
        let pattern = Arc::clone(&self.pattern);
        *self = if double { Self::in_double_precision(pattern)? } else { Self::new(pattern)? };
        Ok(())
    }

    /// Factorises `matrix`; with `insist`, in double precision if single precision fails, and from
    /// then on always.
    ///
    /// # Errors
    /// [`NotPositive`] as [`BlockCholesky::factorise`], or out of memory for the larger
    /// factor.
    pub fn factorise(&mut self, matrix: &BlockMatrix, insist: bool) -> Result<(), NotPositive> {
        if let Some(double) = &mut self.double {
            return double.factorise(matrix);
        }
        if let Some(single) = &mut self.single {
            match single.factorise(matrix) {
                Err(_) if insist => self.single = None,
                result => return result,
            }
        }
        let mut double = BlockCholesky::new(Arc::clone(&self.pattern)).map_err(|_| NotPositive)?;
        let result = double.factorise(matrix);
        self.double = Some(double);
        result
    }

    /// Replaces `rhs` by the solution for the last matrix factorised.
    pub fn solve(&mut self, rhs: &mut [Vec3]) {
        if let Some(double) = &mut self.double {
            double.solve(rhs);
        } else if let Some(single) = &mut self.single {
            single.solve(rhs);
        }
    }
}
