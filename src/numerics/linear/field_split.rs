//! Newton matrices of shape and chemistry together: GMRES with a factor for each.
//!
//! ```text
//! A = | A_xx  A_xc |      P⁻¹ r:  z_c = A_cc⁻¹ r_c,   z_x = A_xx⁻¹ (r_x - A_xc z_c)
//!     | A_cx  A_cc |
//! ```
//!
//! `A_xx` is a mass plus a multiple of the elastic Hessian, and of what shapes do to lengths where species are carried
//! from faces to bonds. Its symmetric part, positive where the step is short enough or the shape stable, gets a Cholesky
//! factor in single precision, and where it is not positive an LDLᵀ factor. `A_cc` gets an incomplete factor. What
//! couples back, `A_cx`, and what is not symmetric are left to the iteration.

use std::sync::Arc;

use super::LinearError;
use super::gmres::Krylov;
use super::incomplete_lu::IncompleteLu;
use super::rows::ScaledRows;
use super::shifted::ShiftedJacobian;
use super::{Block, BlockLdlt, BlockMatrix, BlockPattern, MixedPrecisionCholesky, Sparse};
use crate::Vec3;
use crate::num::{index, real};
use crate::parallel;

/// Stands for a direction that is not an unknown.
const FIXED: u32 = u32::MAX;

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
pub struct FieldSplit {
    place: Vec<[u32; 3]>,
    /// Vertex and axis of every displacement.
    of: Vec<(u32, u8)>,
    rows: ScaledRows,
    shape: BlockMatrix,
    positive: MixedPrecisionCholesky,
    /// Of the last matrix that was not positive; none before the first.
    indefinite: Option<BlockLdlt>,
    /// Whether the last matrix has the Cholesky factor, and whether the next is to be tried with it.
    is_positive: (bool, bool),
    right: Vec<Vec3>,
    /// Of the second field, with room for its rows.
    rest: Option<(IncompleteLu, Vec<f64>)>,
    pub(super) krylov: Krylov<f64>,
    work: Vec<f64>,
}

/// What displacements of vertex `j` do to the rows of vertex `i`.
fn block(
    matrix: ShiftedJacobian<'_>,
    place: &[[u32; 3]],
    of: &[(u32, u8)],
    (i, j): (usize, usize),
) -> Block {
    let mut block = Block::zeros();
    let free = |axis: &u32| *axis != FIXED;
    let columns = place[j].into_iter().filter(free);
    let (Some(first), Some(last)) = (columns.clone().min(), columns.max()) else { return block };
    let pattern = matrix.jacobian().pattern();
    for (a, row) in place[i].into_iter().enumerate().filter(|(_, row)| free(row)) {
        let row = row as usize;
        let all = pattern.row(row);
        let begin = all.partition_point(|&column| column < first);
        for (place, &column) in (pattern.places(row).start + begin..).zip(&all[begin..]) {
            if column > last {
                break;
            }
            let (vertex, b) = of[column as usize];
            if vertex as usize == j {
                let on_diagonal = column as usize == row;
                block[(a, usize::from(b))] = matrix.entry(row, place, on_diagonal);
            }
        }
    }
    block
}

impl FieldSplit {
    /// For matrices with the pattern of this one.
    ///
    /// # Errors
    /// [`LinearError`] if the factor is too large.
    pub fn new(matrix: &Sparse, displacements: &Displacements) -> Result<Self, LinearError> {
        let (count, blocks) = (displacements.count, &displacements.pattern);
        let mut of = vec![(0u32, 0u8); count];
        let mut place = vec![[FIXED; 3]; displacements.place.len()];
        for (vertex, axes) in displacements.place.iter().enumerate() {
            for (axis, unknown) in axes.iter().enumerate() {
                if let Some(unknown) = unknown {
                    of[*unknown] = (index(vertex), u8::try_from(axis).unwrap_or_default());
                    place[vertex][axis] = index(*unknown);
                }
            }
        }
        let n = matrix.columns();
        let rest = (n > count).then(|| (IncompleteLu::new(matrix, count), vec![0.0; n - count]));
        Ok(Self {
            right: vec![Vec3::zeros(); place.len()],
            place,
            of,
            rows: ScaledRows::new(matrix.pattern()),
            shape: BlockMatrix::zeros(Arc::clone(blocks)),
            positive: MixedPrecisionCholesky::new(Arc::clone(blocks))?,
            indefinite: None,
            is_positive: (true, true),
            rest,
            krylov: Krylov::default(),
            work: vec![0.0; n],
        })
    }

    /// Factorises both fields of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] if one of them is singular.
    pub fn factorise(&mut self, matrix: ShiftedJacobian<'_>) -> Result<(), LinearError> {
        self.rows.load(matrix);
        self.krylov.set_tolerance(matrix);
        self.shape.clear();
        let Self { place, of, rows, shape, .. } = self;
        let sum = parallel::sum(of.len(), |unknown| rows.size(unknown));
        let scale = sum / real(of.len().max(1));
        let pattern = Arc::clone(shape.pattern());
        shape.update_rows(|i, row| {
            let mut fixed = Block::zeros();
            for axis in 0..3 {
                if place[i][axis] == FIXED {
                    fixed[(axis, axis)] = scale;
                }
            }
            row.add(i, &fixed);
            for &j in pattern.row(i) {
                let j = j as usize;
                let (above, below) =
                    (block(matrix, place, of, (i, j)), block(matrix, place, of, (j, i)));
                row.add(j, &(0.5 * (above + below.transpose())));
            }
        });
        self.factorise_shape()?;
        if let Some((factor, _)) = &mut self.rest {
            factor.load(matrix);
            factor.eliminate()?;
        }
        Ok(())
    }

    /// By Cholesky's factor, unless the last matrix was indefinite; by LDLᵀ where that fails.
    fn factorise_shape(&mut self) -> Result<(), LinearError> {
        let Self { shape, positive, indefinite, is_positive, .. } = self;
        if is_positive.1 && positive.factorise(shape, true).is_ok() {
            is_positive.0 = true;
            return Ok(());
        }
        let ldlt = match indefinite {
            Some(ldlt) => ldlt,
            None => indefinite.insert(BlockLdlt::new(Arc::clone(shape.pattern()))?),
        };
        let negative = ldlt.factorise(shape)?;
        // Round-off may let one of them find what the other does not: no second try with the same matrix.
        *is_positive = (false, negative == 0);
        Ok(())
    }

    /// Solves in place with the last matrix factorised.
    ///
    /// # Errors
    /// [`LinearError`] if the iteration does not converge; `x` is then anything.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let mut krylov = std::mem::take(&mut self.krylov);
        let mut right = std::mem::take(&mut self.work);
        let Self {
            place, of, rows, positive, indefinite, is_positive, right: forces, rest, ..
        } = self;
        rows.in_units_of_rows(x, &mut right);
        let product = |v: &[f64], out: &mut [f64]| rows.multiply(v, out);
        let precondition = |v: &mut [f64]| {
            rows.in_own_units(v);
            let (shape, species) = v.split_at_mut(of.len());
            if let Some((factor, work)) = rest {
                factor.rhs_to_rows(species, work);
                factor.substitute(work);
                factor.rows_to_unknowns(work, species);
            }
            rows.subtract_tail(of.len(), species, shape);
            parallel::fill(forces, |i| {
                Vec3::from_fn(|axis, _| match place[i][axis] {
                    FIXED => 0.0,
                    unknown => shape[unknown as usize],
                })
            });
            match indefinite {
                Some(ldlt) if !is_positive.0 => ldlt.solve(forces),
                _ => positive.solve(forces),
            }
            parallel::fill(shape, |unknown| {
                let (vertex, axis) = of[unknown];
                forces[vertex as usize][usize::from(axis)]
            });
        };
        let result = krylov.solve(product, precondition, &mut right, x);
        if result.is_ok() {
            x.copy_from_slice(&right);
        }
        (self.krylov, self.work) = (krylov, right);
        result
    }
}
