//! The loop over the points of a block.
//!
//! This is where a plugin spends its time. A law is called in one place only, so that it is inlined
//! there; its numbers are arrays of known size that never leave the function, so that they become
//! registers; and every column of results is an argument of its own, so that the compiler knows that
//! none overlaps with another or with an input, and makes vector instructions of the loop.
#![allow(unsafe_code)]

use std::cell::Cell;

use crate::Failure;
use crate::columns::{BLOCK, Slot, Target};
use crate::law::{Law, Number, Size};

/// Laws with no more inputs and columns of results than this are evaluated in registers; others
/// through memory, where a call into the law costs more than that.
pub(crate) const SMALL: usize = 12;

/// The first point whose result cannot be relied on, and why.
pub(crate) type Unreliable = Option<(usize, Failure)>;

/// Contiguous points of a batch, with the start of every input column.
pub(crate) struct Block<'a, M> {
    pub(crate) model: &'a M,
    pub(crate) first: usize,
    pub(crate) count: usize,
    pub(crate) inputs: &'a [*const f64],
    /// The input that is the first direction.
    pub(crate) start: usize,
    /// Where results go: for each output its value, then its derivatives.
    pub(crate) targets: &'a [Target],
    pub(crate) at: &'a Cell<usize>,
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

/// The law at all points of a block.
///
/// # Safety
/// There are no more than [`BLOCK`] points, or [`needs_rows`] is false. Every input is readable at
/// all of them, every target writable, and none overlaps with another or with an input.
pub(crate) unsafe fn block<M, S: Number, L: Law<M, S>>(
    block: &Block<'_, M>,
    unreliable: &mut Unreliable,
) -> Result<(), Failure> {
    let (first, count) = (block.first, block.count);
    if const { large::<M, S, L>() } {
        let mut rows = vec![[Slot::uninit(); BLOCK]; columns::<M, S, L>()];
        through_memory::<M, S, L>(block, &mut rows, unreliable)?;
        for (target, row) in block.targets.iter().zip(&rows) {
            // SAFETY: as the caller promises; the first `count` numbers of each row are written.
            unsafe {
                if let Some(direct) = target.direct(first, count) {
                    direct.copy_from_slice(&row[..count]);
                }
                target.scatter(first, &row[..count]);
            }
        }
        return Ok(());
    }
    // Results go where they belong, or by way of a row if they are not to lie side by side.
    let mut rows = [const { [Slot::uninit(); BLOCK] }; SMALL];
    let mut to = rows.each_mut().map(|row| &mut row[..count.min(BLOCK)]);
    for (to, target) in to.iter_mut().zip(block.targets) {
        // SAFETY: as the caller promises.
        if let Some(direct) = unsafe { target.direct(first, count) } {
            *to = direct;
        }
    }
    let [a, b, c, d, e, f, g, h, i, j, k, l] = to;
    match const { columns::<M, S, L>() } {
        1 => one::<M, S, L>(block, unreliable, a),
        2 => two::<M, S, L>(block, unreliable, a, b),
        3 => three::<M, S, L>(block, unreliable, a, b, c),
        4 => four::<M, S, L>(block, unreliable, a, b, c, d),
        5 => five::<M, S, L>(block, unreliable, a, b, c, d, e),
        6 => six::<M, S, L>(block, unreliable, a, b, c, d, e, f),
        7 => seven::<M, S, L>(block, unreliable, a, b, c, d, e, f, g),
        8 => eight::<M, S, L>(block, unreliable, a, b, c, d, e, f, g, h),
        9 => nine::<M, S, L>(block, unreliable, a, b, c, d, e, f, g, h, i),
        10 => ten::<M, S, L>(block, unreliable, a, b, c, d, e, f, g, h, i, j),
        11 => eleven::<M, S, L>(block, unreliable, a, b, c, d, e, f, g, h, i, j, k),
        _ => twelve::<M, S, L>(block, unreliable, a, b, c, d, e, f, g, h, i, j, k, l),
    }?;
    for (target, row) in block.targets.iter().zip(&rows) {
        // SAFETY: as above; results that did not go directly are in the row.
        unsafe { target.scatter(first, &row[..count.min(BLOCK)]) };
    }
    Ok(())
}

/// Whether results go by way of rows, which are no longer than [`BLOCK`].
pub(crate) fn needs_rows<M, S: Number, L: Law<M, S>>(targets: &[Target]) -> bool {
    large::<M, S, L>() || targets.iter().any(|target| !target.side_by_side())
}

/// Whether there are too many numbers for registers.
const fn large<M, S: Number, L: Law<M, S>>() -> bool {
    L::SIZE.inputs > SMALL || columns::<M, S, L>() > SMALL
}

/// Columns of results: the outputs, each with its derivatives.
const fn columns<M, S: Number, L: Law<M, S>>() -> usize {
    L::SIZE.outputs * (1 + S::WIDTH)
}

/// What belongs in a column of results.
#[inline(always)]
fn found<S: Number>(results: &[S], column: usize) -> f64 {
    let result = &results[column / (1 + S::WIDTH)];
    match column % (1 + S::WIDTH) {
        0 => result.value(),
        direction => result.derivative(direction - 1),
    }
}

/// The law at one point.
#[inline(always)]
fn point<M, S: Number, L: Law<M, S>>(
    block: &Block<'_, M>,
    inputs: &[*const f64],
    k: usize,
    (arguments, results): (&mut [S], &mut [S]),
    unreliable: &mut Unreliable,
) -> Result<(), Failure> {
    // A constant where it can be.
    let start = if S::WIDTH >= L::SIZE.inputs { 0 } else { block.start };
    for (input, (argument, column)) in arguments.iter_mut().zip(inputs).enumerate() {
        // SAFETY: `block` was called with inputs that are readable at all its points.
        let value = unsafe { *column.add(k) };
        *argument = S::input(value, input.wrapping_sub(start));
    }
    // What a law leaves unwritten must not be taken for a result.
    results.fill(S::from(f64::NAN));
    match L::evaluate(block.model, arguments, results) {
        Err(failure @ Failure::Unreliable(_)) => {
            unreliable.get_or_insert((block.first + k, failure));
            Ok(())
        }
        outcome => outcome,
    }
}

macro_rules! loops {
    ($($name:ident: $($column:ident $number:literal)+;)+) => {$(
        #[inline(never)]
        #[allow(clippy::too_many_arguments)]
        fn $name<M, S: Number, L: Law<M, S>>(
            block: &Block<'_, M>,
            unreliable: &mut Unreliable,
            $($column: &mut [Slot]),+
        ) -> Result<(), Failure> {
            let Size { inputs, outputs } = L::SIZE;
            let mut starts = [std::ptr::null(); SMALL];
            starts[..inputs].copy_from_slice(block.inputs);
            let mut numbers = ([S::from(0.0); SMALL], [S::from(0.0); SMALL]);
            let (arguments, results) = (&mut numbers.0[..inputs], &mut numbers.1[..outputs]);
            let count = block.count;
            $(let $column = &mut $column[..count];)+
            let mut place = Place { at: block.at, point: block.first };
            for k in 0..count {
                place.point = block.first + k;
                let room = (&mut *arguments, &mut *results);
                point::<M, S, L>(block, &starts[..inputs], k, room, unreliable)?;
                $($column[k].write(found(results, $number));)+
            }
            Ok(())
        }
    )+};
}

loops! {
    one: a 0;
    two: a 0 b 1;
    three: a 0 b 1 c 2;
    four: a 0 b 1 c 2 d 3;
    five: a 0 b 1 c 2 d 3 e 4;
    six: a 0 b 1 c 2 d 3 e 4 f 5;
    seven: a 0 b 1 c 2 d 3 e 4 f 5 g 6;
    eight: a 0 b 1 c 2 d 3 e 4 f 5 g 6 h 7;
    nine: a 0 b 1 c 2 d 3 e 4 f 5 g 6 h 7 i 8;
    ten: a 0 b 1 c 2 d 3 e 4 f 5 g 6 h 7 i 8 j 9;
    eleven: a 0 b 1 c 2 d 3 e 4 f 5 g 6 h 7 i 8 j 9 k 10;
    twelve: a 0 b 1 c 2 d 3 e 4 f 5 g 6 h 7 i 8 j 9 k 10 l 11;
}

fn through_memory<M, S: Number, L: Law<M, S>>(
    block: &Block<'_, M>,
    rows: &mut [[Slot; BLOCK]],
    unreliable: &mut Unreliable,
) -> Result<(), Failure> {
    let Size { inputs, outputs } = L::SIZE;
    let mut arguments = vec![S::from(0.0); inputs];
    let mut results = vec![S::from(0.0); outputs];
    let mut place = Place { at: block.at, point: block.first };
    for k in 0..block.count {
        place.point = block.first + k;
        let room = (&mut arguments[..], &mut results[..]);
        point::<M, S, L>(block, block.inputs, k, room, unreliable)?;
        for (column, row) in rows.iter_mut().enumerate() {
            row[k].write(found(&results, column));
        }
    }
    Ok(())
}
