//! Dense linear algebra as a reference for tests.

/// Returns the real parts of the eigenvalues of the matrix of `n` rows with these `(row, column, value)`, which are added up.
///
/// # Panics
/// Where the iteration does not converge.
#[must_use]
pub fn real_parts(n: usize, entries: &[(usize, usize, f64)]) -> Vec<f64> {
    eigenvalues(n, entries).into_iter().map(|[re, _]| re).collect()
}

/// Returns real and imaginary parts of the same eigenvalues.
///
/// # Panics
/// Where the iteration does not converge.
#[must_use]
pub fn eigenvalues(n: usize, entries: &[(usize, usize, f64)]) -> Vec<[f64; 2]> {
    let mut dense = faer::Mat::<f64>::zeros(n, n);
    for &(i, j, value) in entries {
        dense[(i, j)] += value;
    }
    let eigenvalues = dense.eigenvalues().unwrap_or_else(|error| panic!("{error:?}"));
    eigenvalues.iter().map(|value| [value.re, value.im]).collect()
}

/// Returns the eigenvalues of the symmetric matrix of `n` rows with these `(row, column, value)`, ascending.
///
/// # Panics
/// Where the iteration does not converge.
#[must_use]
pub fn symmetric(n: usize, entries: &[(usize, usize, f64)]) -> Vec<f64> {
    let mut dense = faer::Mat::<f64>::zeros(n, n);
    for &(i, j, value) in entries {
        (dense[(i, j)], dense[(j, i)]) = (value, value);
    }
    let eigenvalues = dense.self_adjoint_eigenvalues(faer::Side::Lower);
    eigenvalues.unwrap_or_else(|error| panic!("{error:?}"))
}
