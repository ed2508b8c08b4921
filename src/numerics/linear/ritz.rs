//! The eigenvalues of largest modulus of an operator without symmetry, by Rayleigh and Ritz in a block Krylov space.
//!
//! ```text
//! V = span(X, A X, A² X, …),   H = Vᵀ A V,   H s = θ s,   error |A V s - θ V s| / |θ|
//! ```
//!
//! Blocks have several columns, so that multiple eigenvalues are found. Sums are made in one order. Products and lengths are
//! those of the components on which an image depends; the others are carried along.
//!
//! Reference: Saad, Numerical Methods for Large Eigenvalue Problems (SIAM 2011), chapters 4 and 6,
//! doi:10.1137/1.9781611970739.

use faer::Mat;

use super::{LinearError, dot};

/// Columns of a block: multiplicities up to this are found.
const BLOCK_COLUMNS: usize = 6;
/// Most dimensions of the space.
const MAX_DIMENSION: usize = 120;
/// Relative error of an eigenvalue's equation below which it counts as found.
const EIGENVALUE_TOLERANCE: f64 = 1e-7;
/// What of a vector is left by orthogonalisation, relative, below which it is in the space already.
const DEPENDENCE_TOLERANCE: f64 = 1e-10;

/// Real and imaginary part of an eigenvalue, and the real part of its vector, of length 1 in the components that count.
pub type EigenPair = ((f64, f64), Vec<f64>);

/// The space with its images.
struct Space<'a> {
    /// Which components count.
    counted: &'a [bool],
    vectors: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
    /// The columns of Vᵀ A V that are known.
    reduced: Vec<Vec<f64>>,
}

/// a · b of the components that count.
fn product(counted: &[bool], a: &[f64], b: &[f64]) -> f64 {
    if counted.iter().all(|counts| *counts) {
        return dot(a, b);
    }
    let terms = counted.iter().zip(a.iter().zip(b));
    terms.map(|(counts, (a, b))| if *counts { a * b } else { 0.0 }).sum()
}

impl Space<'_> {
    /// |a|.
    fn norm(&self, a: &[f64]) -> f64 {
        product(self.counted, a, a).sqrt()
    }

    /// Adds what of `vector` is not in the space; whether anything is.
    fn add(&mut self, mut vector: Vec<f64>) -> bool {
        let before = self.norm(&vector);
        for _ in 0..2 {
            for known in &self.vectors {
                let share = product(self.counted, known, &vector);
                vector.iter_mut().zip(known).for_each(|(v, k)| *v -= share * k);
            }
        }
        let left = self.norm(&vector);
        if !(left > DEPENDENCE_TOLERANCE * before) {
            return false;
        }
        vector.iter_mut().for_each(|v| *v /= left);
        self.vectors.push(vector);
        true
    }

    /// Completes Vᵀ A V of the part that has images.
    fn reduce(&mut self) {
        let Self { counted, vectors, images, reduced } = self;
        let known = reduced.len();
        for (column, image) in reduced.iter_mut().zip(&*images) {
            column.extend(
                vectors[known..images.len()].iter().map(|vector| product(counted, vector, image)),
            );
        }
        for image in &images[known..] {
            reduced
                .push(vectors[..images.len()].iter().map(|v| product(counted, v, image)).collect());
        }
    }

    /// The `count` largest pairs of the part that has images, the largest first, each with its relative error.
    fn pairs(&mut self, count: usize) -> Result<Vec<(EigenPair, f64)>, LinearError> {
        self.reduce();
        let m = self.images.len();
        let reduced = Mat::from_fn(m, m, |i, j| self.reduced[j][i]);
        let eigen = reduced
            .eigen()
            .map_err(|error| LinearError::new(format!("the reduced eigenproblem: {error:?}")))?;
        let (values, vectors) = (eigen.S(), eigen.U());
        let values: Vec<(f64, f64)> = (0..m).map(|k| (values[k].re, values[k].im)).collect();
        let mut order: Vec<usize> = (0..m).collect();
        let size = |k: &usize| values[*k].0.hypot(values[*k].1);
        order.sort_by(|a, b| size(b).total_cmp(&size(a)));
        let pair = |k: usize| {
            let [re, im]: [Vec<f64>; 2] = [
                (0..m).map(|i| vectors[(i, k)].re).collect(),
                (0..m).map(|i| vectors[(i, k)].im).collect(),
            ];
            self.pair(values[k], (&re, &im))
        };
        Ok(order.into_iter().take(count).map(pair).collect())
    }

    /// The pair of the eigenvalue `theta` with these real and imaginary parts of its coefficients, and its relative error.
    fn pair(&self, theta: (f64, f64), (re, im): (&[f64], &[f64])) -> (EigenPair, f64) {
        let real = im.iter().all(|part| *part == 0.0);
        let [x, image] = [&self.vectors, &self.images].map(|rows| sum(rows, re));
        let [y, image_y] = match real {
            true => [Vec::new(), Vec::new()],
            false => [&self.vectors, &self.images].map(|rows| sum(rows, im)),
        };
        let off = |image: &[f64], (x, a): (&[f64], f64), (y, b): (&[f64], f64)| {
            let left: Vec<f64> = (0..image.len())
                .map(|i| image[i] - (a * x[i] + b * y.get(i).copied().unwrap_or(0.0)))
                .collect();
            self.norm(&left)
        };
        let error = off(&image, (&x, theta.0), (&y, -theta.1));
        let error = match real {
            true => error,
            false => error.hypot(off(&image_y, (&y, theta.0), (&x, theta.1))),
        };
        let error = error / (theta.0.hypot(theta.1) * self.norm(&x).hypot(self.norm(&y)));
        let mut vector = if self.norm(&x) >= self.norm(&y) { x } else { y };
        let length = self.norm(&vector);
        vector.iter_mut().for_each(|v| *v /= length);
        ((theta, vector), error)
    }
}

/// The sum of rows with these shares.
fn sum(rows: &[Vec<f64>], shares: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; rows[0].len()];
    for (row, share) in rows.iter().zip(shares) {
        sum.iter_mut().zip(row).for_each(|(s, r)| *s += share * r);
    }
    sum
}

/// Pseudo-random numbers between -1 and 1.
fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    let bits = u32::try_from(*seed >> 33).unwrap_or_default();
    f64::from(bits) / f64::from(1u32 << 30) - 1.0
}

/// The `count` eigenvalues of largest modulus of the operator `apply`, whose images depend on the components that are
/// `counted`, the largest first; fewer where there are no more, or from the first on that the space does not tell.
///
/// # Errors
/// Those of `apply`; a reduced problem that cannot be solved.
pub fn largest_eigenvalues<E: From<LinearError>>(
    counted: &[bool],
    apply: &mut dyn FnMut(&mut [f64]) -> Result<(), E>,
    count: usize,
) -> Result<Vec<EigenPair>, E> {
    let mut seed = 1;
    let n = counted.iter().filter(|counts| **counts).count();
    let (vectors, images, reduced) = (Vec::new(), Vec::new(), Vec::new());
    let mut space = Space { counted, vectors, images, reduced };
    for _ in 0..BLOCK_COLUMNS.min(n) {
        // An image is in the range of the operator.
        let mut start: Vec<f64> = counted.iter().map(|_| noise(&mut seed)).collect();
        apply(&mut start)?;
        space.add(start);
    }
    loop {
        let from = space.images.len();
        for k in from..space.vectors.len() {
            let mut image = space.vectors[k].clone();
            apply(&mut image)?;
            space.images.push(image);
        }
        let full = space.vectors.len() >= MAX_DIMENSION.min(n);
        let mut grown = false;
        for k in from..space.images.len() {
            if !full {
                grown |= space.add(space.images[k].clone());
            }
        }
        let enough = space.images.len() >= count + BLOCK_COLUMNS;
        if space.images.is_empty() || grown && !enough {
            if space.images.is_empty() {
                return Ok(Vec::new());
            }
            continue;
        }
        let pairs = space.pairs(count)?;
        // What B has no part in has the eigenvalue 0.
        let largest = pairs.first().map_or(0.0, |pair| pair.0.0.0.hypot(pair.0.0.1));
        let counts = |pair: &&(EigenPair, f64)| {
            pair.0.0.0.hypot(pair.0.0.1) > DEPENDENCE_TOLERANCE * largest
                && pair.1 <= EIGENVALUE_TOLERANCE
        };
        let found = pairs.iter().take_while(counts).count();
        if found == count.min(n) || !grown {
            return Ok(pairs.into_iter().take(found).map(|(pair, _)| pair).collect());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::real;

    /// A matrix of known eigenvalues: a double one, a complex pair, and many small ones.
    #[test]
    fn the_largest_eigenvalues_are_found() {
        let n = 60;
        let value = |i: usize| [5.0, 5.0, -4.0].get(i).copied().unwrap_or(1.0 / real(i));
        let mut apply = |v: &mut [f64]| {
            let mut out: Vec<f64> = (0..n).map(|i| value(i) * v[i]).collect();
            // A rotation in the plane of two, and what makes the matrix not normal.
            (out[3], out[4]) = (2.0 * v[3] - 3.0 * v[4], 3.0 * v[3] + 2.0 * v[4]);
            out[10] += v[0];
            v.copy_from_slice(&out);
            Ok::<_, LinearError>(())
        };
        let found = largest_eigenvalues(&[true; 60], &mut apply, 5).unwrap();
        let values: Vec<(f64, f64)> = found.iter().map(|pair| pair.0).collect();
        assert_eq!(values.len(), 5, "{values:?}");
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        assert!(near(values[0].0, 5.0) && near(values[1].0, 5.0) && near(values[2].0, -4.0));
        assert!(values[3..].iter().all(|v| near(v.0, 2.0) && near(v.1.abs(), 3.0)), "{values:?}");
    }
}
