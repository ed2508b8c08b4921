//! The C functions of a model: each checks its arguments, runs the law at every point, and turns
//! whatever happens into a status.
#![allow(unsafe_code)]

use std::cell::Cell;
use std::ffi::c_void;

use rumple_plugin_abi::{Batch, ColumnMut, Report, Status};

use crate::columns::{Inputs, Outputs};
use crate::guard::guarded;
use crate::{Dual, Failure, LengthFactor, Model, Parameters, Point, Scalar, Signal};

/// Components of the signals of a model: one each, three for a vector.
pub(crate) fn signal_columns(signals: &[Signal]) -> usize {
    let vectors = [text(&Signal::POSITION.name), text(&Signal::NORMAL.name)];
    signals.iter().map(|signal| if vectors.contains(&text(&signal.name)) { 3 } else { 1 }).sum()
}

fn text(text: &rumple_plugin_abi::Str) -> &'static str {
    // SAFETY: made by `Str::new` from a `&'static str`: the fields of a Rust model are constants.
    unsafe {
        let bytes = std::slice::from_raw_parts(text.data, text.length);
        std::str::from_utf8(bytes).unwrap_or("")
    }
}

/// # Safety
/// As for [`rumple_plugin_abi::Create`].
pub(crate) unsafe extern "C" fn create<M: Model>(
    parameters: *const f64,
    count: usize,
    instance: *mut *mut c_void,
    report: *mut Report,
) -> Status {
    let body = |_: &Cell<usize>| {
        if count != M::PARAMETERS.len() || parameters.is_null() && count > 0 || instance.is_null() {
            return Err(Failure::Fatal(format!(
                "the engine gave {count} parameters; expected {}",
                M::PARAMETERS.len()
            )));
        }
        let values = if count == 0 {
            &[]
        } else {
            // SAFETY: `count` numbers, not null.
            unsafe { std::slice::from_raw_parts(parameters, count) }
        };
        let names: Vec<&str> = M::PARAMETERS.iter().map(|known| text(&known.name)).collect();
        let model = M::new(&Parameters { names: &names, values })?;
        // SAFETY: not null, and the caller's to write.
        unsafe { *instance = Box::into_raw(Box::new(model)).cast() };
        Ok(())
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

/// # Safety
/// `instance` comes from [`create`] of the same model and is not used again.
pub(crate) unsafe extern "C" fn destroy<M: Model>(instance: *mut c_void) {
    if instance.is_null() {
        return;
    }
    let body = |_: &Cell<usize>| {
        // SAFETY: made by `Box::into_raw` in `create`, and given back once.
        drop(unsafe { Box::from_raw(instance.cast::<M>()) });
        Ok(())
    };
    // SAFETY: no report. A panic while dropping has nobody to tell; it ends here.
    let _ = unsafe { guarded(std::ptr::null_mut(), body) };
}

/// # Safety
/// As for [`rumple_plugin_abi::Evaluate`].
pub(crate) unsafe extern "C" fn rates<M: Model>(
    instance: *const c_void,
    batch: *const Batch,
    values: *const ColumnMut,
    report: *mut Report,
) -> Status {
    let body = |at: &Cell<usize>| {
        // SAFETY: the caller's promises on instance, batch and columns.
        let (model, inputs, mut values) = unsafe {
            let inputs = Inputs::new(batch, M::SPECIES.len(), signal_columns(M::SIGNALS))?;
            let values = Outputs::new(values, M::SPECIES.len(), inputs.points)?;
            (model::<M>(instance)?, inputs, values)
        };
        let mut scratch = Scratch::new::<M>(f64::from);
        over_points(inputs.points, at, |point| {
            scratch.load(&inputs, point, |number, value| *number = value);
            let outcome = scratch.rates(model);
            for (column, rate) in scratch.rate.iter().enumerate() {
                values.set(column, point, *rate);
            }
            outcome
        })
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

/// # Safety
/// As for [`rumple_plugin_abi::EvaluatePartials`].
pub(crate) unsafe extern "C" fn rate_partials<M: Model>(
    instance: *const c_void,
    batch: *const Batch,
    values: *const ColumnMut,
    partials: *const ColumnMut,
    report: *mut Report,
) -> Status {
    let body = |at: &Cell<usize>| {
        let species = M::SPECIES.len();
        let signals = signal_columns(M::SIGNALS);
        // SAFETY: the caller's promises on instance, batch and columns.
        let (model, inputs, mut values, mut partials) = unsafe {
            let inputs = Inputs::new(batch, species, signals)?;
            let values = Outputs::new(values, species, inputs.points)?;
            let partials = Outputs::new(partials, species * (species + signals), inputs.points)?;
            (model::<M>(instance)?, inputs, values, partials)
        };
        let (values, partials) = (&mut values, &mut partials);
        // As few passes as possible, and none wider than it must be: the cost of a pass grows
        // with its width, and each pass evaluates the law anew.
        match species + signals {
            1 => differentiate_rates::<M, 1>(model, &inputs, values, partials, at),
            2 => differentiate_rates::<M, 2>(model, &inputs, values, partials, at),
            3 => differentiate_rates::<M, 3>(model, &inputs, values, partials, at),
            _ => differentiate_rates::<M, 4>(model, &inputs, values, partials, at),
        }
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

fn differentiate_rates<M: Model, const N: usize>(
    model: &M,
    inputs: &Inputs<'_>,
    values: &mut Outputs<'_>,
    partials: &mut Outputs<'_>,
    at: &Cell<usize>,
) -> Result<(), Failure> {
    let mut scratch = Scratch::new::<M>(Dual::<N>::from);
    let width = scratch.species.len() + scratch.signals.len();
    let mut unreliable = None;
    for start in (0..width).step_by(N) {
        for (input, number) in scratch.species.iter_mut().chain(&mut scratch.signals).enumerate() {
            *number = Dual::variable(0.0, input.wrapping_sub(start));
        }
        let outcome = over_points(inputs.points, at, |point| {
            scratch.load(inputs, point, |number, value| number.value = value);
            let outcome = scratch.rates(model);
            for (row, rate) in scratch.rate.iter().enumerate() {
                values.set(row, point, rate.value);
                for (input, derivative) in (start..width).zip(rate.derivatives) {
                    partials.set(row * width + input, point, derivative);
                }
            }
            outcome
        });
        match outcome {
            Ok(()) => {}
            Err(failure @ Failure::Unreliable(_)) => {
                unreliable.get_or_insert((at.get(), failure));
            }
            Err(failure) => return Err(failure),
        }
    }
    finish(unreliable, at)
}

/// # Safety
/// As for [`rumple_plugin_abi::Evaluate`].
pub(crate) unsafe extern "C" fn length_factor<M: LengthFactor>(
    instance: *const c_void,
    batch: *const Batch,
    values: *const ColumnMut,
    report: *mut Report,
) -> Status {
    let body = |at: &Cell<usize>| {
        // SAFETY: the caller's promises on instance, batch and columns.
        let (model, inputs, mut values) = unsafe {
            let inputs = Inputs::new(batch, M::SPECIES.len(), 0)?;
            let values = Outputs::new(values, 1, inputs.points)?;
            (model::<M>(instance)?, inputs, values)
        };
        let mut species = vec![0.0; M::SPECIES.len()];
        over_points(inputs.points, at, |point| {
            for (slot, value) in species.iter_mut().zip(inputs.species(point)) {
                *slot = value;
            }
            values.set(0, point, model.length_factor(&species)?);
            Ok(())
        })
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

/// # Safety
/// As for [`rumple_plugin_abi::EvaluatePartials`].
pub(crate) unsafe extern "C" fn length_factor_partials<M: LengthFactor>(
    instance: *const c_void,
    batch: *const Batch,
    values: *const ColumnMut,
    partials: *const ColumnMut,
    report: *mut Report,
) -> Status {
    let body = |at: &Cell<usize>| {
        let width = M::SPECIES.len();
        // SAFETY: the caller's promises on instance, batch and columns.
        let (model, inputs, mut values, mut partials) = unsafe {
            let inputs = Inputs::new(batch, width, 0)?;
            let values = Outputs::new(values, 1, inputs.points)?;
            let partials = Outputs::new(partials, width, inputs.points)?;
            (model::<M>(instance)?, inputs, values, partials)
        };
        let mut species = vec![Dual::<1>::from(0.0); width];
        over_points(inputs.points, at, |point| {
            for direction in 0..width {
                for (input, value) in inputs.species(point).enumerate() {
                    species[input] = Dual::variable(value, input.wrapping_sub(direction));
                }
                let factor = model.length_factor(&species)?;
                values.set(0, point, factor.value);
                partials.set(direction, point, factor.derivatives[0]);
            }
            Ok(())
        })
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

/// # Safety
/// `instance` is null or comes from [`create`] of the same model and is not yet destroyed.
unsafe fn model<'a, M: Model>(instance: *const c_void) -> Result<&'a M, Failure> {
    // SAFETY: the caller's promise; models are `Sync` and only ever shared.
    unsafe { instance.cast::<M>().as_ref() }.ok_or_else(|| Failure::fatal("there is no instance"))
}

/// Runs `law` at every point, keeping `at` up to date. Stops at the first point without a result;
/// a merely unreliable one is reported, as the first of its kind, after all are done.
fn over_points(
    points: usize,
    at: &Cell<usize>,
    mut law: impl FnMut(usize) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut unreliable = None;
    for point in 0..points {
        at.set(point);
        match law(point) {
            Ok(()) => {}
            Err(failure @ Failure::Unreliable(_)) => {
                unreliable.get_or_insert((point, failure));
            }
            Err(failure) => return Err(failure),
        }
    }
    finish(unreliable, at)
}

/// The first unreliable point, if any, as the outcome.
fn finish(unreliable: Option<(usize, Failure)>, at: &Cell<usize>) -> Result<(), Failure> {
    unreliable.map_or(Ok(()), |(point, failure)| {
        at.set(point);
        Err(failure)
    })
}

/// Inputs and outputs of the law at one point, allocated once a call.
struct Scratch<S> {
    species: Vec<S>,
    signals: Vec<S>,
    rate: Vec<S>,
}

impl<S: Scalar> Scratch<S> {
    fn new<M: Model>(from: impl Fn(f64) -> S) -> Self {
        Self {
            species: vec![from(0.0); M::SPECIES.len()],
            signals: vec![from(0.0); signal_columns(M::SIGNALS)],
            rate: vec![from(0.0); M::SPECIES.len()],
        }
    }

    fn load(&mut self, inputs: &Inputs<'_>, point: usize, set: impl Fn(&mut S, f64)) {
        for (number, value) in self.species.iter_mut().zip(inputs.species(point)) {
            set(number, value);
        }
        for (number, value) in self.signals.iter_mut().zip(inputs.signals(point)) {
            set(number, value);
        }
    }

    fn rates(&mut self, model: &impl Model) -> Result<(), Failure> {
        let point = Point { species: &self.species, signals: &self.signals };
        model.rates(&point, &mut self.rate)
    }
}
