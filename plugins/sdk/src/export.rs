//! The exported table of a model.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::marker::PhantomData;

use rumple_plugin_abi::{
    self as abi, ABI_MAJOR, ABI_MINOR, Capabilities, Descriptor, Evaluate, EvaluatePartials, MAGIC,
    Observable, Parameter, PluginTable, Signal, Species, Str,
};

use crate::c_functions;
use crate::{LengthFactor, LengthFactorAcross, Model, Observables, SpontaneousCurvature};

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
    pub const fn new<M: Model, G: Given>() -> Self {
        let descriptor: &'static Descriptor = Tables::<M, G>::DESCRIPTOR;
        let (values, partials) = calls(G::LENGTH_FACTOR);
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
            get_extension: Some(get_extension::<G>),
        })
    }
}

const fn calls(of: Option<Calls>) -> (Evaluate, EvaluatePartials) {
    match of {
        None => (None, None),
        Some(calls) => (calls.values, calls.partials),
    }
}

struct Tables<M, G>(PhantomData<(M, G)>);

impl<M: Model, G: Given> Tables<M, G> {
    const ALWAYS: Capabilities =
        Capabilities::RATES.with(Capabilities::RATE_PARTIALS).with(Capabilities::PARAMETER_FIELDS);

    const DESCRIPTOR: &'static Descriptor = &Self::descriptor(Self::capabilities());

    const fn capabilities() -> Capabilities {
        let mut all = Self::ALWAYS;
        if G::LENGTH_FACTOR.is_some() {
            all = all.with(Capabilities::LENGTH_FACTOR).with(Capabilities::LENGTH_FACTOR_PARTIALS);
        }
        if G::LENGTH_FACTOR_ACROSS.is_some() {
            all = all.with(Capabilities::LENGTH_FACTOR_ACROSS);
        }
        if G::CURVATURE.is_some() {
            all = all.with(Capabilities::SPONTANEOUS_CURVATURE);
        }
        all
    }

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

/// The two C functions of a quantity of the species alone.
#[derive(Debug, Clone, Copy)]
pub struct Calls {
    values: Evaluate,
    partials: EvaluatePartials,
}

/// What a plugin gives besides rates; made by [`export_plugin!`](crate::export_plugin).
pub trait Given: 'static {
    /// Of a [`LengthFactor`].
    const LENGTH_FACTOR: Option<Calls>;
    /// Of a [`LengthFactorAcross`].
    const LENGTH_FACTOR_ACROSS: Option<Calls>;
    /// Of a [`SpontaneousCurvature`].
    const CURVATURE: Option<Calls>;
    /// [`Observables`].
    const OBSERVABLES: Option<&'static abi::Observables>;
}

/// Finds out at compile time which of its optional traits `M` has: an inherent
/// constant wins over the one of [`Without`], and exists only if it does.
#[derive(Debug)]
pub struct Probe<M>(PhantomData<M>);

impl<M: LengthFactor> Probe<M> {
    /// Its C functions.
    pub const LENGTH_FACTOR: Option<Calls> = Some(Calls {
        values: Some(c_functions::of_species::<M, c_functions::Factor>),
        partials: Some(c_functions::of_species_partials::<M, c_functions::Factor>),
    });
}

impl<M: LengthFactorAcross> Probe<M> {
    /// Its C functions.
    pub const LENGTH_FACTOR_ACROSS: Option<Calls> = Some(Calls {
        values: Some(c_functions::of_species::<M, c_functions::FactorAcross>),
        partials: Some(c_functions::of_species_partials::<M, c_functions::FactorAcross>),
    });
}

impl<M: SpontaneousCurvature> Probe<M> {
    /// Its C functions.
    pub const CURVATURE: Option<Calls> = Some(Calls {
        values: Some(c_functions::of_species::<M, c_functions::Curvature>),
        partials: Some(c_functions::of_species_partials::<M, c_functions::Curvature>),
    });
}

impl<M: Observables> Probe<M> {
    /// Its extension.
    pub const OBSERVABLES: Option<&'static abi::Observables> = Some(
        const {
            &abi::Observables {
                size: size_of::<abi::Observables>(),
                observables: M::OBSERVABLES.as_ptr(),
                observable_count: M::OBSERVABLES.len(),
                observable_stride: size_of::<Observable>(),
                observe: Some(c_functions::observe::<M>),
            }
        },
    );
}

/// What holds for a [`Probe`] of a model without one of the optional traits.
pub trait Without {
    /// None.
    const LENGTH_FACTOR: Option<Calls> = None;
    /// None.
    const LENGTH_FACTOR_ACROSS: Option<Calls> = None;
    /// None.
    const CURVATURE: Option<Calls> = None;
    /// None.
    const OBSERVABLES: Option<&'static abi::Observables> = None;
}

impl<M> Without for Probe<M> {}

/// # Safety
/// `id` is text by start and length.
unsafe extern "C" fn get_extension<G: Given>(id: Str) -> *const c_void {
    // SAFETY: the caller's promise.
    let id = unsafe { std::slice::from_raw_parts(id.data, id.length) };
    if id == abi::OBSERVABLES.as_bytes() {
        return G::OBSERVABLES.map_or(std::ptr::null(), |table| std::ptr::from_ref(table).cast());
    }
    if id == abi::FEEDBACK.as_bytes() {
        return std::ptr::from_ref::<abi::Feedback>(Extension::<G>::FEEDBACK).cast();
    }
    std::ptr::null()
}

struct Extension<G>(PhantomData<G>);

impl<G: Given> Extension<G> {
    const FEEDBACK: &'static abi::Feedback = &Self::feedback();

    const fn feedback() -> abi::Feedback {
        let (curvature, curvature_partials) = calls(G::CURVATURE);
        let (length_factor_across, length_factor_across_partials) = calls(G::LENGTH_FACTOR_ACROSS);
        abi::Feedback {
            size: size_of::<abi::Feedback>(),
            curvature,
            curvature_partials,
            length_factor_across,
            length_factor_across_partials,
        }
    }
}

/// Makes a [`Model`] loadable, with its [`LengthFactor`], [`LengthFactorAcross`], [`SpontaneousCurvature`] and
/// [`Observables`] if it has them: exports the one symbol of the boundary. Once in a library.
#[macro_export]
macro_rules! export_plugin {
    ($model:ty) => {
        /// The table of this plugin, read by the engine.
        #[unsafe(export_name = "rumple_plugin_entry")]
        pub static RUMPLE_PLUGIN_ENTRY: $crate::Exported = {
            #[allow(unused_imports)]
            use $crate::Without as _;
            type All = $crate::Probe<$model>;
            struct Given;
            impl $crate::Given for Given {
                const LENGTH_FACTOR: Option<$crate::Calls> = All::LENGTH_FACTOR;
                const LENGTH_FACTOR_ACROSS: Option<$crate::Calls> = All::LENGTH_FACTOR_ACROSS;
                const CURVATURE: Option<$crate::Calls> = All::CURVATURE;
                const OBSERVABLES: Option<&'static $crate::ObservablesTable> = All::OBSERVABLES;
            }
            $crate::Exported::new::<$model, Given>()
        };
    };
}
