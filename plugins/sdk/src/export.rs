//! The exported table of a model.
#![allow(unsafe_code)]

use std::marker::PhantomData;

use rumple_plugin_abi::{
    ABI_MAJOR, ABI_MINOR, Capabilities, Descriptor, Evaluate, EvaluatePartials, MAGIC, Parameter,
    PluginTable, Signal, Species, Str,
};

use crate::boundary;
use crate::{LengthFactor, Model};

/// The table as a static.
#[repr(transparent)]
#[derive(Debug)]
pub struct Exported(PluginTable);

// SAFETY: the table is constant, and so is everything that it points to.
unsafe impl Sync for Exported {}

impl Exported {
    /// The table of a model; made by [`export_plugin!`](crate::export_plugin).
    #[must_use]
    pub const fn new<M: Model>(length_factor: Option<LengthFactorCalls>) -> Self {
        let (descriptor, values, partials): (&'static Descriptor, _, _) = match length_factor {
            None => (Tables::<M>::RATES_ONLY, None, None),
            Some(calls) => {
                (Tables::<M>::WITH_LENGTH_FACTOR, Some(calls.values), Some(calls.partials))
            }
        };
        Self(PluginTable {
            magic: MAGIC,
            abi_major: ABI_MAJOR,
            abi_minor: ABI_MINOR,
            size: size_of::<PluginTable>(),
            descriptor,
            create: Some(boundary::create::<M>),
            destroy: Some(boundary::destroy::<M>),
            rates: Some(boundary::rates::<M>),
            rate_partials: Some(boundary::rate_partials::<M>),
            length_factor: values,
            length_factor_partials: partials,
            get_extension: None,
        })
    }
}

struct Tables<M>(PhantomData<M>);

impl<M: Model> Tables<M> {
    const RATES_ONLY: &'static Descriptor =
        &Self::descriptor(Capabilities::RATES.with(Capabilities::RATE_PARTIALS));

    const WITH_LENGTH_FACTOR: &'static Descriptor = &Self::descriptor(
        Capabilities::RATES
            .with(Capabilities::RATE_PARTIALS)
            .with(Capabilities::LENGTH_FACTOR)
            .with(Capabilities::LENGTH_FACTOR_PARTIALS),
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

/// Finds out at compile time whether `M` has a [`LengthFactor`]: an inherent constant wins over
/// the one of [`WithoutLengthFactor`], and exists only if it does.
#[derive(Debug)]
pub struct Probe<M>(PhantomData<M>);

impl<M: LengthFactor> Probe<M> {
    /// Its C functions.
    pub const LENGTH_FACTOR: Option<LengthFactorCalls> = Some(LengthFactorCalls {
        values: boundary::length_factor::<M>,
        partials: boundary::length_factor_partials::<M>,
    });
}

/// What holds for a [`Probe`] of a model without a length factor.
pub trait WithoutLengthFactor {
    /// None.
    const LENGTH_FACTOR: Option<LengthFactorCalls> = None;
}

impl<M> WithoutLengthFactor for Probe<M> {}

/// Makes a [`Model`] loadable, with its [`LengthFactor`] if it has one: exports the one symbol of
/// the boundary. Once in a library.
#[macro_export]
macro_rules! export_plugin {
    ($model:ty) => {
        /// The table of this plugin, read by the engine.
        #[unsafe(export_name = "rumple_plugin_entry")]
        pub static RUMPLE_PLUGIN_ENTRY: $crate::Exported = {
            #[allow(unused_imports)]
            use $crate::WithoutLengthFactor as _;
            $crate::Exported::new::<$model>($crate::Probe::<$model>::LENGTH_FACTOR)
        };
    };
}
