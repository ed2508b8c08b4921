//! A law at all points of a batch, with or without derivatives.
#![allow(unsafe_code)]

use std::cell::Cell;
use std::mem::MaybeUninit;
use std::ptr;

use crate::columns::{BLOCK, Inputs, Outputs};
use crate::{Dual, Failure, Model, Parameters, Scalar};

/// Laws with no more inputs and outputs than this are evaluated in registers and on the stack
/// (144 KiB of it).
const SMALL: usize = 8;

/// Numbers in a row of results: a block and a little more, so that rows do not lie at the same places
/// of different pages, where writing to one waits for the other.
const ROW: usize = BLOCK + 8;

/// The most derivatives that a number carries.
const WIDEST: usize = 8;

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

/// A law of a model. Its size is a constant, so that loops over inputs unroll and numbers live in
/// registers.
pub(crate) trait Law<M, S> {
    const SIZE: Size;

    /// Reads the inputs and writes the outputs at one point.
    fn evaluate(model: &M, inputs: &[S], out: &mut [S]) -> Result<(), Failure>;
}

/// One pass over a batch: values, and derivatives by the inputs from `start` on.
pub(crate) struct Pass<'a, 'b> {
    pub(crate) inputs: &'a Inputs<'b>,
    pub(crate) values: &'a mut Outputs<'b>,
    pub(crate) partials: Option<&'a mut Outputs<'b>>,
    pub(crate) start: usize,
    pub(crate) at: &'a Cell<usize>,
}

/// Runs a law at every point: all points by the model of the instance,
/// or, where parameters differ, each stretch of equal ones by a model of its own.
///
/// Stops at the first point without a result; a merely unreliable one is reported, as the first of
/// its kind, after all are done.
#[inline(always)]
pub(crate) fn run<M: Model, S: Number, L: Law<M, S>>(
    model: &M,
    mut pass: Pass<'_, '_>,
) -> Result<(), Failure> {
    let points = pass.inputs.points;
    let fields = pass.inputs.has_fields();
    let names: Vec<&str> = match fields {
        true => M::PARAMETERS.iter().map(|p| crate::boundary::text(&p.name)).collect(),
        false => Vec::new(),
    };
    let mut values = vec![0.0; names.len()];
    let mut unreliable = None;
    let mut from = 0;
    while from < points {
        let own;
        let (here, to) = if fields {
            pass.at.set(from);
            pass.inputs.parameters(from, &mut values);
            own = M::from_parameters(&Parameters { names: &names, values: &values })?;
            (&own, pass.inputs.same_parameters(from, points))
        } else {
            (model, points)
        };
        // The only call: a function that is called once is inlined, and the law with it.
        stretch::<M, S, L>(here, &mut pass, from, to, &mut unreliable)?;
        from = to;
    }
    unreliable.map_or(Ok(()), |(point, failure)| {
        pass.at.set(point);
        Err(failure)
    })
}

type Unreliable = Option<(usize, Failure)>;

/// The points from one to another, block by block.
#[inline(always)]
fn stretch<M: Model, S: Number, L: Law<M, S>>(
    model: &M,
    pass: &mut Pass<'_, '_>,
    from: usize,
    to: usize,
    unreliable: &mut Unreliable,
) -> Result<(), Failure> {
    let Size { inputs, outputs } = L::SIZE;
    let mut buffer = pass.inputs.buffer();
    let mut first = from;
    while first < to {
        let count = BLOCK.min(to - first);
        // Arrays of known size, which never leave this function, become registers, and results
        // that go to an array of its own can overlap with no input: the loop over points becomes
        // vector instructions. The other way is for laws with many species.
        if inputs <= SMALL && outputs <= SMALL {
            let mut starts = [ptr::null(); SMALL];
            pass.inputs.block(first, count, &mut buffer, &mut starts[..inputs]);
            let mut numbers = ([S::from(0.0); SMALL], [S::from(0.0); SMALL]);
            let mut found = [const { [MaybeUninit::uninit(); ROW] }; SMALL * (1 + WIDEST)];
            let room = Room {
                arguments: &mut numbers.0[..inputs],
                results: &mut numbers.1[..outputs],
                found: &mut found,
            };
            let block = Block { first, count, starts: &starts[..inputs] };
            points::<M, S, L>(model, pass, &block, room, unreliable)?;
        } else {
            let mut starts = vec![ptr::null(); inputs];
            pass.inputs.block(first, count, &mut buffer, &mut starts);
            let mut numbers = (vec![S::from(0.0); inputs], vec![S::from(0.0); outputs]);
            let mut found = vec![[MaybeUninit::uninit(); ROW]; outputs * (1 + WIDEST)];
            let room =
                Room { arguments: &mut numbers.0, results: &mut numbers.1, found: &mut found };
            let block = Block { first, count, starts: &starts };
            points::<M, S, L>(model, pass, &block, room, unreliable)?;
        }
        first += count;
    }
    Ok(())
}

/// Contiguous points, with the start of every input column.
struct Block<'a> {
    first: usize,
    count: usize,
    starts: &'a [*const f64],
}

/// What a block needs: numbers into and out of the law, and columns of results: for each output
/// its value and its derivatives.
struct Room<'a, S> {
    arguments: &'a mut [S],
    results: &'a mut [S],
    found: &'a mut [[MaybeUninit<f64>; ROW]],
}

/// Says where a panic happened: only when it does.
struct Place<'a> {
    at: &'a Cell<usize>,
    point: usize,
}

impl Drop for Place<'_> {
    #[inline(always)]
    fn drop(&mut self) {
        self.at.set(self.point);
    }
}

#[inline(always)]
fn points<M: Model, S: Number, L: Law<M, S>>(
    model: &M,
    pass: &mut Pass<'_, '_>,
    block: &Block<'_>,
    room: Room<'_, S>,
    unreliable: &mut Unreliable,
) -> Result<(), Failure> {
    let Room { arguments, results, found } = room;
    let width = L::SIZE.inputs;
    let start = if S::WIDTH >= width { 0 } else { pass.start };
    let count = block.count.min(BLOCK);
    let mut place = Place { at: pass.at, point: block.first };
    for k in 0..count {
        place.point = block.first + k;
        for (input, (argument, column)) in arguments.iter_mut().zip(block.starts).enumerate() {
            // SAFETY: every block column is readable at every point of the block.
            let value = unsafe { *column.add(k) };
            *argument = S::input(value, input.wrapping_sub(start));
        }
        if let Err(failure) = L::evaluate(model, arguments, results) {
            match failure {
                Failure::Unreliable(_) => {
                    unreliable.get_or_insert((place.point, failure));
                }
                _ => return Err(failure),
            }
        }
        for (row, result) in results.iter().enumerate() {
            let column = row * (1 + S::WIDTH);
            found[column][k].write(result.value());
            for direction in 0..S::WIDTH {
                found[column + 1 + direction][k].write(result.derivative(direction));
            }
        }
    }
    // The last pass may be narrower than the others: what is beyond goes nowhere.
    let wanted = S::WIDTH.min(width - start);
    for row in 0..L::SIZE.outputs {
        let column = row * (1 + S::WIDTH);
        // SAFETY: all of these were written above, one a point of the block.
        unsafe {
            pass.values.write(row, block.first, &found[column][..count]);
            if let Some(partials) = &mut pass.partials {
                for direction in 0..wanted {
                    let to = row * width + start + direction;
                    partials.write(to, block.first, &found[column + 1 + direction][..count]);
                }
            }
        }
    }
    Ok(())
}
