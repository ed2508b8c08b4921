//! Newton matrices of shape and chemistry together: GMRES with a factor for each.
//!
//! ```text
//! A = | A_xx  A_xc |      P⁻¹ r:  z_c = A_cc⁻¹ r_c,   z_x = A_xx⁻¹ (r_x - A_xc z_c)
//!     | A_cx  A_cc |
//! ```
//!
//! `A_xx` is a mass plus a multiple of the elastic Hessian: symmetric and, where the step is short
//! enough or the shape stable, positive. It gets a Cholesky factor in single precision, and where it is
//! not positive an LDLᵀ factor. `A_cc` gets an incomplete factor. What couples back, `A_cx`, is left to
//! the iteration.

use std::sync::Arc;

use faer::sparse::{SparseColMat, SparseColMatRef, SymbolicSparseColMat, SymbolicSparseColMatRef};

use super::LinearError;
use super::gmres::solve_scaled;
use super::ilu::Ilu;
use super::{Block, BlockLdlt, BlockMatrix, BlockPattern, FrugalCholesky};
use crate::Vec3;
use crate::num::index;

/// Stands for a direction that is not an unknown.
const HELD: u32 = u32::MAX;

/// Which unknowns are displacements of which vertices.
#[derive(Debug, Clone)]
pub struct Displacements {
    /// For every vertex and axis the number of the unknown, if it is one.
    pub place: Vec<[Option<usize>; 3]>,
    /// How many there are; they come before all other unknowns.
    pub count: usize,
    /// Pairs of vertices that are coupled.
    pub pattern: Arc<BlockPattern>,
}

/// The factors and where their entries come from.
pub struct TwoFields {
    place: Vec<[u32; 3]>,
    count: usize,
    /// Place in the matrix, block and entry of every number of the first field.
    shape_from: Vec<(usize, u32, u8)>,
    shape: BlockMatrix,
    factor: Factor,
    right: Vec<Vec3>,
    /// Place in the matrix of every number of the second field.
    rest_from: Vec<usize>,
    rest: Option<(SparseColMat<usize, f64>, Ilu)>,
}

enum Factor {
    Positive(Box<FrugalCholesky>),
    Indefinite(Box<BlockLdlt>),
}

impl TwoFields {
    /// For matrices of this pattern.
    ///
    /// # Errors
    /// [`LinearError`] if the factor is too large.
    pub fn new(
        pattern: SymbolicSparseColMatRef<'_, usize>,
        displacements: &Displacements,
    ) -> Result<Self, LinearError> {
        let (count, blocks) = (displacements.count, &displacements.pattern);
        let mut of = vec![(0usize, 0usize); count];
        let mut place = vec![[HELD; 3]; displacements.place.len()];
        for (vertex, axes) in displacements.place.iter().enumerate() {
            for (axis, unknown) in axes.iter().enumerate() {
                if let Some(unknown) = unknown {
                    of[*unknown] = (vertex, axis);
                    place[vertex][axis] = index(*unknown);
                }
            }
        }
        let mut shape_from = Vec::new();
        for column in 0..count {
            let (j, b) = of[column];
            for k in pattern.col_range(column) {
                let row = pattern.row_idx()[k];
                if row < count {
                    let (i, a) = of[row];
                    if i <= j
                        && let Ok(found) = blocks.row(i).binary_search(&index(j))
                    {
                        let entry = u8::try_from(3 * b + a).unwrap_or_default();
                        shape_from.push((k, index(blocks.start(i) + found), entry));
                    }
                }
            }
        }
        let n = pattern.ncols();
        let (mut starts, mut rows, mut rest_from) = (vec![0], Vec::new(), Vec::new());
        for column in count..n {
            for k in pattern.col_range(column) {
                let row = pattern.row_idx()[k];
                if row >= count {
                    rows.push(row - count);
                    rest_from.push(k);
                }
            }
            starts.push(rows.len());
        }
        let rest = (n > count).then(|| {
            let size = n - count;
            let symbolic = SymbolicSparseColMat::new_checked(size, size, starts, None, rows);
            let ilu = Ilu::new(symbolic.as_ref());
            let values = vec![0.0; rest_from.len()];
            (SparseColMat::new(symbolic, values), ilu)
        });
        Ok(Self {
            right: vec![Vec3::zeros(); place.len()],
            place,
            count,
            shape_from,
            shape: BlockMatrix::zeros(Arc::clone(blocks)),
            factor: Factor::Positive(Box::new(FrugalCholesky::new(Arc::clone(blocks))?)),
            rest_from,
            rest,
        })
    }

    /// Factorises both fields of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] if one of them is singular.
    pub fn factorise(
        &mut self,
        matrix: SparseColMatRef<'_, usize, f64>,
    ) -> Result<(), LinearError> {
        let values = matrix.val();
        self.shape.clear();
        for &(from, block, entry) in &self.shape_from {
            let entry = usize::from(entry);
            self.shape.set(block as usize, (entry % 3, entry / 3), values[from]);
        }
        let scale = self.shape.mean_diagonal();
        let place = &self.place;
        self.shape.update_rows(|i, row| {
            let mut held = Block::zeros();
            for axis in 0..3 {
                if place[i][axis] == HELD {
                    held[(axis, axis)] = scale;
                }
            }
            row.add(i, &held);
        });
        self.factorise_shape()?;
        if let Some((rest, ilu)) = &mut self.rest {
            for (value, &from) in rest.val_mut().iter_mut().zip(&self.rest_from) {
                *value = values[from];
            }
            ilu.factorise(rest.as_ref())?;
        }
        Ok(())
    }

    fn factorise_shape(&mut self) -> Result<(), LinearError> {
        if let Factor::Positive(factor) = &mut self.factor {
            if factor.factorise(&self.shape, true).is_ok() {
                return Ok(());
            }
            let ldlt = BlockLdlt::new(Arc::clone(self.shape.pattern()))?;
            self.factor = Factor::Indefinite(Box::new(ldlt));
        }
        if let Factor::Indefinite(factor) = &mut self.factor
            && factor.factorise(&self.shape, |_| 0.0)? == 0
        {
            // Positive again: the cheaper factor from the next time on.
            let cholesky = FrugalCholesky::new(Arc::clone(self.shape.pattern()))?;
            self.factor = Factor::Positive(Box::new(cholesky));
            return self.factorise_shape();
        }
        Ok(())
    }

    /// Solves in place.
    ///
    /// # Errors
    /// [`LinearError`] if the iteration does not converge.
    pub fn solve(
        &mut self,
        matrix: SparseColMatRef<'_, usize, f64>,
        x: &mut [f64],
    ) -> Result<(), LinearError> {
        solve_scaled(matrix, |v| self.precondition(matrix, v), x)?;
        Ok(())
    }

    fn precondition(&mut self, matrix: SparseColMatRef<'_, usize, f64>, v: &mut [f64]) {
        let (shape, rest) = v.split_at_mut(self.count);
        if let Some((_, ilu)) = &mut self.rest {
            ilu.precondition(rest);
        }
        let (rows, values) = (matrix.symbolic().row_idx(), matrix.val());
        for (j, z) in rest.iter().enumerate() {
            for k in matrix.symbolic().col_range(self.count + j) {
                if rows[k] >= self.count {
                    break;
                }
                shape[rows[k]] -= values[k] * z;
            }
        }
        for (right, place) in self.right.iter_mut().zip(&self.place) {
            for axis in 0..3 {
                let at = place[axis];
                right[axis] = if at == HELD { 0.0 } else { shape[at as usize] };
            }
        }
        match &mut self.factor {
            Factor::Positive(factor) => factor.solve(&mut self.right),
            Factor::Indefinite(factor) => factor.solve(&mut self.right),
        }
        for (right, place) in self.right.iter().zip(&self.place) {
            for axis in 0..3 {
                if place[axis] != HELD {
                    shape[place[axis] as usize] = right[axis];
                }
            }
        }
    }
}
