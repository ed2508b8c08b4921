//! The exported table of a model.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::marker::PhantomData;

use rumple_plugin_abi::{
    self as abi, ABI_MAJOR, ABI_MINOR, Capabilities, Descriptor, Evaluate, EvaluatePartials,
    GetExtension, MAGIC, Observable, Parameter, PluginTable, Signal, Species, Str,
};

use crate::c_functions;
use crate::{LengthFactor, Model, Observables};

/// The table as a static.
#[repr(transparent)]
#[derive(Debug)]
pub struct Exported(PluginTable);

// SAFETY: the table is constant, and so is everything that it points to.
unsafe impl Sync for Exported {}

impl Exported {
    /// What an engine reads.
    #[must_use]
    pub const fn table(&self) -> &PluginTable {
        &self.0
    }

    /// The table of a model; made by [`export_plugin!`](crate::export_plugin).
    #[must_use]
    pub const fn new<M: Model>(
        length_factor: Option<LengthFactorCalls>,
        get_extension: GetExtension,
    ) -> Self {
        let (descriptor, values, partials): (&'static Descriptor, Evaluate, EvaluatePartials) =
            match length_factor {
                None => (Tables::<M>::RATES_ONLY, None, None),
                Some(calls) => (Tables::<M>::WITH_LENGTH_FACTOR, calls.values, calls.partials),
            };
        Self(PluginTable {
            magic: MAGIC,
            abi_major: ABI_MAJOR,
            abi_minor: ABI_MINOR,
            size: size_of::<PluginTable>(),
            descriptor,
            create: Some(c_functions::create::<M>),
            destroy: Some(c_functions::destroy::<M>),
            rates: Some(c_functions::rates::<M>),
            rate_partials: Some(c_functions::rate_partials::<M>),
            length_factor: values,
            length_factor_partials: partials,
            get_extension,
        })
    }
}

struct Tables<M>(PhantomData<M>);

impl<M: Model> Tables<M> {
    const ALWAYS: Capabilities =
        Capabilities::RATES.with(Capabilities::RATE_PARTIALS).with(Capabilities::PARAMETER_FIELDS);

    const RATES_ONLY: &'static Descriptor = &Self::descriptor(Self::ALWAYS);

    const WITH_LENGTH_FACTOR: &'static Descriptor = &Self::descriptor(
        Self::ALWAYS.with(Capabilities::LENGTH_FACTOR).with(Capabilities::LENGTH_FACTOR_PARTIALS),
    );

    const fn descriptor(capabilities: Capabilities) -> Descriptor {
        Descriptor {
            size: size_of::<Descriptor>(),
            id: Str::new(M::ABOUT.id),
            name: Str::new(M::ABOUT.name),
            version: Str::new(M::ABOUT.version),
            author: Str::new(M::ABOUT.author),
            licence: Str::new(M::ABOUT.licence),
            doc: Str::new(M::ABOUT.doc),
            species: M::SPECIES.as_ptr(),
            species_count: M::SPECIES.len(),
            species_stride: size_of::<Species>(),
            parameters: M::PARAMETERS.as_ptr(),
            parameter_count: M::PARAMETERS.len(),
            parameter_stride: size_of::<Parameter>(),
            signals: M::SIGNALS.as_ptr(),
            signal_count: M::SIGNALS.len(),
            signal_stride: size_of::<Signal>(),
            capabilities,
        }
    }
}

/// The two C functions of a length factor.
#[derive(Debug, Clone, Copy)]
pub struct LengthFactorCalls {
    values: Evaluate,
    partials: EvaluatePartials,
}

/// Finds out at compile time whether `M` has a [`LengthFactor`] or [`Observables`]: an inherent
/// constant wins over the one of [`Without`], and exists only if it does.
#[derive(Debug)]
pub struct Probe<M>(PhantomData<M>);

impl<M: LengthFactor> Probe<M> {
    /// Its C functions.
    pub const LENGTH_FACTOR: Option<LengthFactorCalls> = Some(LengthFactorCalls {
        values: Some(c_functions::length_factor::<M>),
        partials: Some(c_functions::length_factor_partials::<M>),
    });
}

impl<M: Observables> Probe<M> {
    /// Its answer when asked for extensions.
    pub const EXTENSIONS: GetExtension = Some(observables::<M>);
}

/// What holds for a [`Probe`] of a model without a length factor, or without observables.
pub trait Without {
    /// None.
    const LENGTH_FACTOR: Option<LengthFactorCalls> = None;
    /// None.
    const EXTENSIONS: GetExtension = None;
}

impl<M> Without for Probe<M> {}

/// # Safety
/// `id` is text by start and length.
unsafe extern "C" fn observables<M: Observables>(id: Str) -> *const c_void {
    // SAFETY: the caller's promise.
    let id = unsafe { std::slice::from_raw_parts(id.data, id.length) };
    if id != abi::OBSERVABLES.as_bytes() {
        return std::ptr::null();
    }
    let table: &'static abi::Observables = const {
        &abi::Observables {
            size: size_of::<abi::Observables>(),
            observables: M::OBSERVABLES.as_ptr(),
            observable_count: M::OBSERVABLES.len(),
            observable_stride: size_of::<Observable>(),
            observe: Some(c_functions::observe::<M>),
        }
    };
    std::ptr::from_ref(table).cast()
}

/// Makes a [`Model`] loadable, with its [`LengthFactor`] and its [`Observables`] if it has them:
/// exports the one symbol of the boundary. Once in a library.
#[macro_export]
macro_rules! export_plugin {
    ($model:ty) => {
        /// The table of this plugin, read by the engine.
        #[unsafe(export_name = "rumple_plugin_entry")]
        pub static RUMPLE_PLUGIN_ENTRY: $crate::Exported = {
            #[allow(unused_imports)]
            use $crate::Without as _;
            $crate::Exported::new::<$model>(
                $crate::Probe::<$model>::LENGTH_FACTOR,
                $crate::Probe::<$model>::EXTENSIONS,
            )
        };
    };
}
