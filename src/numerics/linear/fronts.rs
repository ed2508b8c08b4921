//! Dense elimination of one front, in parallel where it is large.
//!
//! ```text
//! F₁₁ = L₁₁ L₁₁ᵀ      L₂₁ = F₂₁ L₁₁⁻ᵀ      F₂₂ ← F₂₂ - L₂₁ L₂₁ᵀ
//! ```
//!
//! Everything is halved until pieces are small, by sizes alone, so that the same operations are done in
//! the same order by any number of threads.

use std::mem::MaybeUninit;

use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt::factor::{LltRegularization, cholesky_in_place};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef, Par, Spec};

use super::{NotPositive, Precision};

/// Columns up to which a diagonal block is factorised in one piece.
const DIAGONAL_BLOCK: usize = 128;

/// Rows and columns up to which a product is made in one piece, and rows of a triangular solve.
const PRODUCT_BLOCK: usize = 256;

/// Rounded up to whole registers, so that pieces begin at the same places in them.
fn half(n: usize) -> usize {
    (n / 2).next_multiple_of(16)
}

/// Eliminates the columns of `panel`, whose upper part is square. The lower triangle of `rest` becomes
/// `-L₂₁ L₂₁ᵀ`.
///
/// # Errors
/// [`NotPositive`] where a pivot is not positive.
pub(super) fn eliminate<T: Precision>(
    panel: MatMut<'_, T>,
    rest: MatMut<'_, T>,
) -> Result<(), NotPositive> {
    let columns = panel.ncols();
    let (mut own, mut below) = panel.split_at_row_mut(columns);
    factorise(own.as_mut())?;
    if below.nrows() > 0 {
        divide(own.as_ref(), below.as_mut());
        subtract_square(rest, below.as_ref(), Accum::Replace);
    }
    Ok(())
}

/// The lower triangle of `a` becomes its Cholesky factor.
fn factorise<T: Precision>(a: MatMut<'_, T>) -> Result<(), NotPositive> {
    let n = a.nrows();
    if n <= DIAGONAL_BLOCK {
        // A column of workspace, and room to align it.
        let mut memory = [MaybeUninit::<u8>::uninit(); size_of::<f64>() * 2 * DIAGONAL_BLOCK];
        let stack = MemStack::new(&mut memory);
        let strict = LltRegularization::default();
        return match cholesky_in_place(a, strict, Par::Seq, stack, Spec::default()) {
            Ok(_) => Ok(()),
            Err(_) => Err(NotPositive),
        };
    }
    let (mut first, _, mut below, mut last) = split(a, half(n));
    factorise(first.as_mut())?;
    divide(first.as_ref(), below.as_mut());
    subtract_square(last.as_mut(), below.as_ref(), Accum::Add);
    factorise(last)
}

/// `b ← b L⁻ᵀ`.
fn divide<T: Precision>(lower: MatRef<'_, T>, b: MatMut<'_, T>) {
    let rows = b.nrows();
    if rows > PRODUCT_BLOCK {
        let (first, last) = b.split_at_row_mut(half(rows));
        rayon::join(|| divide(lower, first), || divide(lower, last));
        return;
    }
    solve_lower_triangular_in_place(lower, b.transpose_mut(), Par::Seq);
}

/// The lower triangle of `c - a aᵀ`, or of `-a aᵀ`.
fn subtract_square<T: Precision>(c: MatMut<'_, T>, a: MatRef<'_, T>, to: Accum) {
    let n = c.nrows();
    if n > PRODUCT_BLOCK {
        let middle = half(n);
        let (first, _, below, last) = split(c, middle);
        let (top, bottom) = a.split_at_row(middle);
        rayon::join(
            || {
                rayon::join(
                    || subtract_square(first, top, to),
                    || subtract_square(last, bottom, to),
                )
            },
            || subtract_product(below, bottom, top, to),
        );
        return;
    }
    triangular_matmul(
        c,
        BlockStructure::TriangularLower,
        to,
        a,
        BlockStructure::Rectangular,
        a.transpose(),
        BlockStructure::Rectangular,
        T::from_f64(-1.0),
        Par::Seq,
    );
}

/// `c - a bᵀ`, or `-a bᵀ`.
fn subtract_product<T: Precision>(c: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>, to: Accum) {
    let (rows, columns) = (c.nrows(), c.ncols());
    if rows.max(columns) <= PRODUCT_BLOCK {
        matmul(c, to, a, b.transpose(), T::from_f64(-1.0), Par::Seq);
    } else if rows >= columns {
        let (first, last) = c.split_at_row_mut(half(rows));
        let (top, bottom) = a.split_at_row(half(rows));
        rayon::join(
            || subtract_product(first, top, b, to),
            || subtract_product(last, bottom, b, to),
        );
    } else {
        let (first, last) = c.split_at_col_mut(half(columns));
        let (top, bottom) = b.split_at_row(half(columns));
        rayon::join(
            || subtract_product(first, a, top, to),
            || subtract_product(last, a, bottom, to),
        );
    }
}

type Quarters<'a, T> = (MatMut<'a, T>, MatMut<'a, T>, MatMut<'a, T>, MatMut<'a, T>);

/// Upper left, upper right, lower left, lower right.
fn split<T>(a: MatMut<'_, T>, middle: usize) -> Quarters<'_, T> {
    let (top, bottom) = a.split_at_row_mut(middle);
    let ((a, b), (c, d)) = (top.split_at_col_mut(middle), bottom.split_at_col_mut(middle));
    (a, b, c, d)
}
