//! The C functions of a model: each checks its arguments, runs the law at every point, and turns
//! whatever happens into a status.
#![allow(unsafe_code)]

use std::cell::Cell;
use std::ffi::c_void;

use rumple_plugin_abi::{Batch, ColumnMut, Report, Status};

use crate::columns::{Inputs, Outputs, text};
use crate::evaluate::{Pass, run};
use crate::guard::guarded;
use crate::law::{Law, Size};
use crate::{
    Dual, Failure, LengthFactor, LengthFactorAcross, Model, Observables, Parameters, Point, Scalar,
    Signal, SpontaneousCurvature,
};

/// Components of the signals of a model: one each, three for a vector.
pub(crate) const fn signal_columns(signals: &[Signal]) -> usize {
    let mut columns = 0;
    let mut at = 0;
    while at < signals.len() {
        let name = &signals[at].name;
        let vector = same(name, &Signal::POSITION.name) || same(name, &Signal::NORMAL.name);
        columns += if vector { 3 } else { 1 };
        at += 1;
    }
    columns
}

const fn same(a: &rumple_plugin_abi::Str, b: &rumple_plugin_abi::Str) -> bool {
    let (a, b) = (text(a).as_bytes(), text(b).as_bytes());
    let mut at = 0;
    while at < a.len() && at < b.len() && a[at] == b[at] {
        at += 1;
    }
    at == a.len() && at == b.len()
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
        let model = M::from_parameters(&Parameters { names: &names, values })?;
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
    // SAFETY: no report. A panic while dropping cannot be reported; it ends here.
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
        let call = unsafe { Call::<M>::new(instance, batch, values, M::RATE_SIZE)? };
        run::<M, f64, Rates>(call.model, &call.pass(0, at))
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
        // SAFETY: the caller's promises on instance, batch and columns.
        let mut call = unsafe { Call::<M>::new(instance, batch, values, M::RATE_SIZE)? };
        // SAFETY: as above.
        unsafe { call.with_partials(partials)? };
        // As few passes as possible, and none wider than it must be: the cost of a pass grows
        // with its width, and each pass evaluates the law again.
        match M::RATE_SIZE.inputs {
            1 => differentiate_rates::<M, 1>(&mut call, at),
            2 => differentiate_rates::<M, 2>(&mut call, at),
            3 => differentiate_rates::<M, 3>(&mut call, at),
            4 => differentiate_rates::<M, 4>(&mut call, at),
            5 | 6 => differentiate_rates::<M, 6>(&mut call, at),
            _ => differentiate_rates::<M, 8>(&mut call, at),
        }
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

fn differentiate_rates<M: Model, const N: usize>(
    call: &mut Call<'_, M>,
    at: &Cell<usize>,
) -> Result<(), Failure> {
    differentiate_in_passes(M::RATE_SIZE.inputs, N, at, |start| {
        run::<M, Dual<N>, Rates>(call.model, &call.pass(start, at))
    })
}

/// Differentiates by all inputs, some at a time. A result that is merely unreliable does not keep
/// the others from being computed.
fn differentiate_in_passes(
    inputs: usize,
    width: usize,
    at: &Cell<usize>,
    mut pass: impl FnMut(usize) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut unreliable = None;
    for start in (0..inputs).step_by(width) {
        match pass(start) {
            Ok(()) => {}
            Err(failure @ Failure::Unreliable(_)) => {
                unreliable.get_or_insert((at.get(), failure));
            }
            Err(failure) => return Err(failure),
        }
    }
    unreliable.map_or(Ok(()), |(point, failure)| {
        at.set(point);
        Err(failure)
    })
}

/// A quantity `L` of the species alone.
///
/// # Safety
/// As for [`rumple_plugin_abi::Evaluate`].
pub(crate) unsafe extern "C" fn of_species<M: Model, L: Law<M, f64>>(
    instance: *const c_void,
    batch: *const Batch,
    values: *const ColumnMut,
    report: *mut Report,
) -> Status {
    let body = |at: &Cell<usize>| {
        // SAFETY: the caller's promises on instance, batch and columns.
        let call = unsafe { Call::<M>::new(instance, batch, values, M::FACTOR_SIZE)? };
        run::<M, f64, L>(call.model, &call.pass(0, at))
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

/// The same with its partial derivatives.
///
/// # Safety
/// As for [`rumple_plugin_abi::EvaluatePartials`].
pub(crate) unsafe extern "C" fn of_species_partials<M, L>(
    instance: *const c_void,
    batch: *const Batch,
    values: *const ColumnMut,
    partials: *const ColumnMut,
    report: *mut Report,
) -> Status
where
    M: Model,
    L: Law<M, Dual<1>> + Law<M, Dual<2>> + Law<M, Dual<4>>,
{
    let body = |at: &Cell<usize>| {
        // SAFETY: the caller's promises on instance, batch and columns.
        let mut call = unsafe { Call::<M>::new(instance, batch, values, M::FACTOR_SIZE)? };
        // SAFETY: as above.
        unsafe { call.with_partials(partials)? };
        match M::FACTOR_SIZE.inputs {
            1 => differentiate::<M, L, 1>(&mut call, at),
            2 => differentiate::<M, L, 2>(&mut call, at),
            _ => differentiate::<M, L, 4>(&mut call, at),
        }
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

fn differentiate<M: Model, L: Law<M, Dual<N>>, const N: usize>(
    call: &mut Call<'_, M>,
    at: &Cell<usize>,
) -> Result<(), Failure> {
    differentiate_in_passes(M::FACTOR_SIZE.inputs, N, at, |start| {
        run::<M, Dual<N>, L>(call.model, &call.pass(start, at))
    })
}

/// # Safety
/// As for [`rumple_plugin_abi::Evaluate`].
pub(crate) unsafe extern "C" fn observe<M: Observables>(
    instance: *const c_void,
    batch: *const Batch,
    values: *const ColumnMut,
    report: *mut Report,
) -> Status {
    let body = |at: &Cell<usize>| {
        let size = <Observed as Law<M, f64>>::SIZE;
        // SAFETY: the caller's promises on instance, batch and columns.
        let call = unsafe { Call::<M>::new(instance, batch, values, size)? };
        run::<M, f64, Observed>(call.model, &call.pass(0, at))
    };
    // SAFETY: `report` comes from the caller under the same contract.
    unsafe { guarded(report, body) }
}

/// The sizes of the laws of a model.
trait Sizes: Model {
    const RATE_SIZE: Size = Size {
        inputs: Self::SPECIES.len() + signal_columns(Self::SIGNALS),
        outputs: Self::SPECIES.len(),
    };
    const FACTOR_SIZE: Size = Size { inputs: Self::SPECIES.len(), outputs: 1 };

    #[inline(always)]
    fn point<S>(inputs: &[S]) -> Point<'_, S> {
        let (species, signals) = inputs.split_at(Self::SPECIES.len());
        Point { species, signals }
    }
}

impl<M: Model> Sizes for M {}

struct Rates;

impl<M: Model, S: Scalar> Law<M, S> for Rates {
    const SIZE: Size = M::RATE_SIZE;

    #[inline(always)]
    fn evaluate(model: &M, inputs: &[S], out: &mut [S]) -> Result<(), Failure> {
        model.rates(&M::point(inputs), out)
    }
}

pub(crate) struct Factor;

impl<M: LengthFactor, S: Scalar> Law<M, S> for Factor {
    const SIZE: Size = M::FACTOR_SIZE;

    #[inline(always)]
    fn evaluate(model: &M, species: &[S], out: &mut [S]) -> Result<(), Failure> {
        out[0] = model.length_factor(species)?;
        Ok(())
    }
}

/// [`LengthFactorAcross`].
pub(crate) struct FactorAcross;

impl<M: LengthFactorAcross, S: Scalar> Law<M, S> for FactorAcross {
    const SIZE: Size = M::FACTOR_SIZE;

    #[inline(always)]
    fn evaluate(model: &M, species: &[S], out: &mut [S]) -> Result<(), Failure> {
        out[0] = model.length_factor_across(species)?;
        Ok(())
    }
}

/// [`SpontaneousCurvature`].
pub(crate) struct Curvature;

impl<M: SpontaneousCurvature, S: Scalar> Law<M, S> for Curvature {
    const SIZE: Size = M::FACTOR_SIZE;

    #[inline(always)]
    fn evaluate(model: &M, species: &[S], out: &mut [S]) -> Result<(), Failure> {
        out[0] = model.curvature(species)?;
        Ok(())
    }
}

struct Observed;

impl<M: Observables> Law<M, f64> for Observed {
    const SIZE: Size = Size { outputs: M::OBSERVABLES.len(), ..M::RATE_SIZE };

    #[inline(always)]
    fn evaluate(model: &M, inputs: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        model.observe(&M::point(inputs), out)
    }
}

/// The checked arguments of a call.
struct Call<'a, M> {
    model: &'a M,
    size: Size,
    inputs: Inputs<'a>,
    values: Outputs<'a>,
    partials: Option<Outputs<'a>>,
}

impl<'a, M: Model> Call<'a, M> {
    /// # Safety
    /// `instance` is null or comes from [`create`] of the same model and is not yet destroyed;
    /// batch and columns are null or as the boundary promises.
    unsafe fn new(
        instance: *const c_void,
        batch: *const Batch,
        values: *const ColumnMut,
        size: Size,
    ) -> Result<Self, Failure> {
        // SAFETY: the caller's promise; models are `Sync` and only ever shared.
        let model = unsafe { instance.cast::<M>().as_ref() };
        let model = model.ok_or_else(|| Failure::fatal("the instance is null"))?;
        let (species, parameters) = (M::SPECIES.len(), M::PARAMETERS.len());
        // SAFETY: the caller's promise.
        unsafe {
            let inputs = Inputs::new(batch, species, size.inputs - species, parameters)?;
            let values = Outputs::new(values, size.outputs)?;
            Ok(Self { model, size, inputs, values, partials: None })
        }
    }

    /// # Safety
    /// The columns are null or as the boundary promises.
    unsafe fn with_partials(&mut self, partials: *const ColumnMut) -> Result<(), Failure> {
        let columns = self.size.outputs * self.size.inputs;
        // SAFETY: the caller's promise.
        self.partials = Some(unsafe { Outputs::new(partials, columns)? });
        Ok(())
    }

    fn pass<'b>(&'b self, start: usize, at: &'b Cell<usize>) -> Pass<'b, 'a> {
        Pass {
            inputs: &self.inputs,
            values: &self.values,
            partials: self.partials.as_ref(),
            start,
            at,
        }
    }
}
