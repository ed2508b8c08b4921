//! A law at all points of a batch, with or without derivatives.

#![allow(unsafe_code)]

use std::cell::Cell;
use std::ops::Range;

use crate::block::{Block, SMALL, Unreliable, block, needs_rows};
use crate::columns::{BLOCK, Inputs, Outputs, Target, text};
use crate::law::{Law, Number};
use crate::{Failure, Model, Parameters};

/// One pass over a batch: values, and derivatives by the inputs from `start` on.
pub(crate) struct Pass<'a, 'b> {
    pub(crate) inputs: &'a Inputs<'b>,
    pub(crate) values: &'a Outputs<'b>,
    pub(crate) partials: Option<&'a Outputs<'b>>,
    pub(crate) start: usize,
    pub(crate) at: &'a Cell<usize>,
}

/// Runs a law at every point: all points by the model of the instance,
/// or, where parameters differ, each stretch of equal ones by a model of its own.
///
/// Stops at the first point without a result; a merely unreliable one is reported, as the first of
/// its kind, after all are done.
pub(crate) fn run<M: Model, S: Number, L: Law<M, S>>(
    model: &M,
    pass: &Pass<'_, '_>,
) -> Result<(), Failure> {
    let points = pass.inputs.points;
    let fields = pass.inputs.has_fields();
    let names: Vec<&str> = match fields {
        true => M::PARAMETERS.iter().map(|p| text(&p.name)).collect(),
        false => Vec::new(),
    };
    let mut values = vec![0.0; names.len()];
    let mut unreliable = None;
    with_list(L::SIZE.outputs * (1 + S::WIDTH), Target::NOWHERE, |targets| {
        fill_targets::<M, S, L>(pass, targets);
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
            evaluate_range::<M, S, L>(here, pass, targets, from..to, &mut unreliable)?;
            from = to;
        }
        Ok(())
    })?;
    unreliable.map_or(Ok(()), |(point, failure)| {
        pass.at.set(point);
        Err(failure)
    })
}

/// Fills in where the results of a pass are written: for each output its value, then its derivatives.
fn fill_targets<M, S: Number, L: Law<M, S>>(pass: &Pass<'_, '_>, targets: &mut [Target]) {
    let inputs = L::SIZE.inputs;
    for (row, targets) in targets.chunks_exact_mut(1 + S::WIDTH).enumerate() {
        targets[0] = pass.values.target(row);
        // The last pass may be narrower than the others; what is beyond it goes nowhere.
        for (input, target) in (pass.start..inputs).zip(&mut targets[1..]) {
            *target = pass.partials.map_or(Target::NOWHERE, |all| all.target(row * inputs + input));
        }
    }
}

/// Hands on a list, which lies on the stack if it is as short as it mostly is.
fn with_list<T: Copy, R>(length: usize, fill: T, use_it: impl FnOnce(&mut [T]) -> R) -> R {
    match [fill; SMALL].get_mut(..length) {
        Some(list) => use_it(list),
        None => use_it(&mut vec![fill; length]),
    }
}

/// Evaluates the law at the points of a range, block by block.
fn evaluate_range<M: Model, S: Number, L: Law<M, S>>(
    model: &M,
    pass: &Pass<'_, '_>,
    targets: &[Target],
    range: Range<usize>,
    unreliable: &mut Unreliable,
) -> Result<(), Failure> {
    let mut buffer = pass.inputs.buffer();
    // If everything lies side by side the whole range is one block.
    let by_the_row = !buffer.is_empty() || needs_rows::<M, S, L>(targets);
    with_list(L::SIZE.inputs, std::ptr::null(), |inputs| {
        let step = if by_the_row { BLOCK } else { range.len() };
        for first in range.clone().step_by(step) {
            let count = step.min(range.end - first);
            pass.inputs.block(first, count, &mut buffer, inputs);
            let (start, at) = (pass.start, pass.at);
            let here = Block { model, first, count, inputs, start, at, targets };
            // SAFETY: columns as the engine promises them: each is writable at all points of the
            // batch and overlaps with no other.
            unsafe { block::<M, S, L>(&here, unreliable)? };
        }
        Ok(())
    })
}
