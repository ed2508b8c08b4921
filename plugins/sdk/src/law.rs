//! What the loops over points need of a law and of its numbers.

use crate::{Dual, Failure, Scalar};

/// A number that knows its derivatives, if it has any.
pub(crate) trait Number: Scalar {
    /// How many derivatives.
    const WIDTH: usize;

    /// An input: the independent variable of a direction if `direction < WIDTH`.
    fn input(value: f64, direction: usize) -> Self;

    /// The derivative in a direction.
    fn derivative(&self, direction: usize) -> f64;
}

impl Number for f64 {
    const WIDTH: usize = 0;

    #[inline(always)]
    fn input(value: f64, _direction: usize) -> Self {
        value
    }

    #[inline(always)]
    fn derivative(&self, _direction: usize) -> f64 {
        0.0
    }
}

impl<const N: usize> Number for Dual<N> {
    const WIDTH: usize = N;

    #[inline(always)]
    fn input(value: f64, direction: usize) -> Self {
        Self::variable(value, direction)
    }

    #[inline(always)]
    fn derivative(&self, direction: usize) -> f64 {
        self.derivatives[direction]
    }
}

/// How many numbers go into a law and come out of it.
#[derive(Clone, Copy)]
pub(crate) struct Size {
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
}

/// A law of a model. Its size is a constant, so that loops over inputs unroll.
pub(crate) trait Law<M, S> {
    const SIZE: Size;

    /// Reads the inputs and writes the outputs at one point.
    fn evaluate(model: &M, inputs: &[S], out: &mut [S]) -> Result<(), Failure>;
}
