//! Reading the table and the descriptor of a plugin.
//!
//! Pointers, counts and sizes are checked before they are followed, as far as they can be.

use std::path::Path;
use std::ptr;

use rumple_plugin_abi as abi;

use crate::KineticsError;
use crate::descriptor::{
    Capabilities, Default, Descriptor, Location, Observable, Parameter, SignalRead, Species,
};
use crate::metadata::{self, Problem};

/// More elements than this in an array of a descriptor are taken for garbage.
const MAX_ELEMENTS: usize = 256;
/// More bytes than this in a text of a descriptor are taken for garbage.
const LONGEST_TEXT: usize = 1 << 16;

/// Copies the table.
///
/// # Safety
/// `entry` is the address of an exported object, unchanged for good, at least as long as magic,
/// versions and size; and if these are ours, as long as it says.
pub(super) unsafe fn table(
    entry: *const abi::PluginTable,
    path: &Path,
) -> Result<abi::PluginTable, KineticsError> {
    let path = || path.to_owned();
    // SAFETY: an exported object; a plugin's begins with at least magic, versions and size. Read
    // without regard to alignment, since what else may lie there is not known yet.
    let (found, major, minor, size) = unsafe {
        (
            (&raw const (*entry).magic).read_unaligned(),
            (&raw const (*entry).abi_major).read_unaligned(),
            (&raw const (*entry).abi_minor).read_unaligned(),
            (&raw const (*entry).size).read_unaligned(),
        )
    };
    if found != abi::MAGIC {
        return Err(KineticsError::WrongMagic { path: path(), found });
    }
    if (major, minor) != (abi::ABI_MAJOR, abi::ABI_MINOR) {
        return Err(KineticsError::WrongVersion { path: path(), major, minor });
    }
    if size < size_of::<abi::PluginTable>() {
        return Err(KineticsError::TruncatedTable { path: path(), size });
    }
    // SAFETY: a table of our version, at least as long as ours.
    Ok(unsafe { entry.read_unaligned() })
}

/// The capabilities that a plugin declares, rates included.
fn capabilities(given: abi::Capabilities) -> Result<Capabilities, Problem> {
    let problem = |problem: &str| ("capabilities".to_owned(), problem.to_owned());
    if !given.contains(abi::Capabilities::RATES) {
        return Err(problem("do not include rates"));
    }
    let known =
        abi::Capabilities::SPONTANEOUS_CURVATURE.with(abi::Capabilities::LENGTH_FACTOR_ACROSS);
    if (given.0 & !known.0) >> 32 != 0 {
        return Err(problem(
            "include something that this version of the engine cannot do (state of instances, or newer)",
        ));
    }
    let across = given.contains(abi::Capabilities::LENGTH_FACTOR_ACROSS);
    if across && !given.contains(abi::Capabilities::LENGTH_FACTOR) {
        return Err(problem("include a length factor across a fibre without one along it"));
    }
    Ok(Capabilities {
        rate_partials: given.contains(abi::Capabilities::RATE_PARTIALS),
        length_factor: given.contains(abi::Capabilities::LENGTH_FACTOR),
        length_factor_partials: given.contains(abi::Capabilities::LENGTH_FACTOR_PARTIALS),
        curvature: given.contains(abi::Capabilities::SPONTANEOUS_CURVATURE),
        length_factor_across: across,
        parameter_fields: given.contains(abi::Capabilities::PARAMETER_FIELDS),
    })
}

/// Copies the descriptor and checks it.
///
/// # Safety
/// The table was read by [`table`]; its descriptor, if not null, and all that this points to have
/// the lengths that they say, and are unchanged for good.
pub(super) unsafe fn descriptor(table: &abi::PluginTable) -> Result<Descriptor, Problem> {
    let problem = |place: &str, problem: &str| (place.to_owned(), problem.to_owned());
    if table.descriptor.is_null() || !table.descriptor.is_aligned() {
        return Err(problem("descriptor", "is null or not aligned"));
    }
    // SAFETY: the table is of our version, and its descriptor begins with its size.
    if unsafe { (*table.descriptor).size } < size_of::<abi::Descriptor>() {
        return Err(problem("descriptor", "is truncated"));
    }
    // SAFETY: not null, aligned, and of at least this size.
    let raw = unsafe { *table.descriptor };
    // SAFETY: as promised for all texts of the descriptor.
    let text = |place: &str, raw| unsafe { text(place, raw) };

    let capabilities = capabilities(raw.capabilities)?;
    // SAFETY: as promised for all arrays of the descriptor.
    let (species, parameters, signals) = unsafe {
        (
            elements("species", raw.species, raw.species_count, raw.species_stride)?,
            elements("parameters", raw.parameters, raw.parameter_count, raw.parameter_stride)?,
            elements("signals", raw.signals, raw.signal_count, raw.signal_stride)?,
        )
    };
    let names = parameters
        .iter()
        .map(|parameter| text("name of a parameter", parameter.name))
        .collect::<Result<Vec<_>, _>>()?;
    let descriptor = Descriptor {
        id: text("id", raw.id)?,
        name: text("name", raw.name)?,
        version: text("version", raw.version)?,
        author: text("author", raw.author)?,
        licence: text("licence", raw.licence)?,
        doc: text("doc", raw.doc)?,
        species: species
            .iter()
            // SAFETY: an element of the descriptor.
            .map(|raw| unsafe { read_species(raw) })
            .collect::<Result<_, _>>()?,
        parameters: parameters
            .iter()
            .enumerate()
            // SAFETY: an element of the descriptor.
            .map(|(position, raw)| unsafe { read_parameter(raw, position, &names) })
            .collect::<Result<_, _>>()?,
        signals: signals
            .iter()
            .map(|read| {
                let signal = text("name of a signal", read.name)?.parse();
                let signal = signal.map_err(|unknown: String| problem("signals", &unknown))?;
                Ok(SignalRead { signal, typical: read.typical })
            })
            .collect::<Result<_, Problem>>()?,
        capabilities,
        observables: Vec::new(),
        observed: Vec::new(),
    };
    metadata::check(&descriptor)?;
    Ok(descriptor)
}

/// Asks for the extension with observables: notes them in the descriptor and returns their
/// function, if there are any.
///
/// # Safety
/// As for [`descriptor`]; the plugin answers with what the extension's id stands for.
pub(super) unsafe fn observables(
    table: &abi::PluginTable,
    descriptor: &mut Descriptor,
) -> Result<abi::Evaluate, Problem> {
    let Some(get_extension) = table.get_extension else { return Ok(None) };
    // SAFETY: a function of the table.
    let answer = unsafe { get_extension(abi::Str::new(abi::OBSERVABLES)) };
    let answer = answer.cast::<abi::Observables>();
    if answer.is_null() {
        return Ok(None);
    }
    let place = format!("extension `{}`", abi::OBSERVABLES);
    let problem = |problem: &str| Err((place.clone(), problem.to_owned()));
    if !answer.is_aligned() {
        return problem("is not aligned");
    }
    // SAFETY: what the id stands for begins with its size.
    if unsafe { (*answer).size } < size_of::<abi::Observables>() {
        return problem("is truncated");
    }
    // SAFETY: aligned, and of at least this size.
    let raw = unsafe { *answer };
    if raw.observe.is_none() {
        return problem("its function `observe` is null");
    }
    let all =
        // SAFETY: as promised for all arrays.
        unsafe { elements(&place, raw.observables, raw.observable_count, raw.observable_stride) }?;
    for observable in all {
        // SAFETY: as promised for all texts.
        let text = |what, raw| unsafe { text(&format!("{what} of an observable"), raw) };
        descriptor.observables.push(Observable {
            name: text("name", observable.name)?,
            unit: text("unit", observable.unit)?,
            doc: text("doc", observable.doc)?,
        });
    }
    // They get the inputs of the rates.
    descriptor.observed.clone_from(&descriptor.signals);
    metadata::check(descriptor)?;
    Ok(raw.observe.filter(|_| !descriptor.observables.is_empty()))
}

/// A plugin without feedback besides the length factor.
const NO_FEEDBACK: abi::Feedback = abi::Feedback {
    size: size_of::<abi::Feedback>(),
    curvature: None,
    curvature_partials: None,
    length_factor_across: None,
    length_factor_across_partials: None,
};

/// Asks for the extension with the feedback that the capabilities declare.
///
/// # Safety
/// As for [`observables`].
pub(super) unsafe fn feedback(
    table: &abi::PluginTable,
    given: Capabilities,
) -> Result<abi::Feedback, Problem> {
    if !given.curvature && !given.length_factor_across {
        return Ok(NO_FEEDBACK);
    }
    let place = format!("extension `{}`", abi::FEEDBACK);
    let problem = |problem: &str| Err((place.clone(), problem.to_owned()));
    let answer = match table.get_extension {
        // SAFETY: a function of the table.
        Some(get_extension) => unsafe { get_extension(abi::Str::new(abi::FEEDBACK)) },
        None => ptr::null(),
    };
    let answer = answer.cast::<abi::Feedback>();
    if answer.is_null() {
        return problem("is missing, but the capabilities include what it gives");
    }
    if !answer.is_aligned() {
        return problem("is not aligned");
    }
    // SAFETY: what the id stands for begins with its size.
    if unsafe { (*answer).size } < size_of::<abi::Feedback>() {
        return problem("is truncated");
    }
    // SAFETY: aligned, and of at least this size.
    let raw = unsafe { *answer };
    if given.curvature && raw.curvature.is_none() {
        return problem("its function `curvature` is null");
    }
    if given.length_factor_across && raw.length_factor_across.is_none() {
        return problem("its function `length_factor_across` is null");
    }
    Ok(raw)
}

/// # Safety
/// The texts of `raw` have the lengths that they say, and are unchanged for good.
unsafe fn read_species(raw: &abi::Species) -> Result<Species, Problem> {
    // SAFETY: as promised.
    let text = |place: &str, raw| unsafe { text(place, raw) };
    let name = text("name of a species", raw.name)?;
    let location = match raw.location {
        abi::Location::VERTEX => Location::Vertex,
        abi::Location::FACE => Location::Face,
        abi::Location(other) => {
            let problem = format!("location is {other}; expected 0 (vertex) or 1 (face)");
            return Err((format!("species `{name}`"), problem));
        }
    };
    Ok(Species {
        unit: text(&format!("unit of species `{name}`"), raw.unit)?,
        doc: text(&format!("doc of species `{name}`"), raw.doc)?,
        name,
        typical: (raw.typical != 0.0).then_some(raw.typical),
        lower: raw.lower,
        upper: raw.upper,
        diffusion: raw.diffusion,
        location,
    })
}

/// # Safety
/// The texts of `raw` have the lengths that they say, and are unchanged for good.
unsafe fn read_parameter(
    raw: &abi::Parameter,
    position: usize,
    names: &[String],
) -> Result<Parameter, Problem> {
    // SAFETY: as promised.
    let text = |place: &str, raw| unsafe { text(place, raw) };
    let name = &names[position];
    let default_of = text(&format!("default of parameter `{name}`"), raw.default_of)?;
    let default = if default_of.is_empty() {
        Default::Value(raw.default)
    } else {
        let earlier = names[..position].iter().position(|known| *known == default_of);
        Default::SameAs(earlier.ok_or_else(|| {
            let problem = format!("defaults to `{default_of}`, which is not an earlier parameter");
            (format!("parameter `{name}`"), problem)
        })?)
    };
    Ok(Parameter {
        name: name.clone(),
        unit: text(&format!("unit of parameter `{name}`"), raw.unit)?,
        doc: text(&format!("doc of parameter `{name}`"), raw.doc)?,
        default,
        lower: raw.lower,
        lower_open: raw.open & abi::Parameter::LOWER_OPEN != 0,
        upper: raw.upper,
        upper_open: raw.open & abi::Parameter::UPPER_OPEN != 0,
    })
}

/// Copies an array of a descriptor.
///
/// # Safety
/// `first`, if not null, is the start of `count` elements, `stride` bytes apart.
unsafe fn elements<T: Copy>(
    place: &str,
    first: *const T,
    count: usize,
    stride: usize,
) -> Result<Vec<T>, Problem> {
    let problem = |problem: String| Err((place.to_owned(), problem));
    if count == 0 {
        return Ok(Vec::new());
    }
    if count > MAX_ELEMENTS {
        return problem(format!("there are {count}; expected at most {MAX_ELEMENTS}"));
    }
    if first.is_null() || !first.is_aligned() {
        return problem("the array is null or not aligned".to_owned());
    }
    if stride < size_of::<T>() || !stride.is_multiple_of(align_of::<T>()) || stride > LONGEST_TEXT {
        return problem(format!(
            "elements are {stride} bytes apart; expected {} or more",
            size_of::<T>()
        ));
    }
    // SAFETY: the plugin says that there are `count` elements, `stride` bytes apart; each is
    // aligned and at least as long as ours.
    Ok((0..count).map(|at| unsafe { *first.byte_add(at * stride) }).collect())
}

/// Copies a text of a descriptor.
///
/// # Safety
/// `raw.data`, if not null, is the start of `raw.length` bytes.
unsafe fn text(place: &str, raw: abi::Str) -> Result<String, Problem> {
    let problem = |problem: String| Err((place.to_owned(), problem));
    if raw.length == 0 {
        return Ok(String::new());
    }
    if raw.data.is_null() {
        return problem("the text is null".to_owned());
    }
    if raw.length > LONGEST_TEXT {
        return problem(format!("{} bytes long; expected at most {LONGEST_TEXT}", raw.length));
    }
    // SAFETY: the plugin says that there are `length` bytes.
    let bytes = unsafe { std::slice::from_raw_parts(raw.data, raw.length) };
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(_) => problem("the text is not UTF-8".to_owned()),
    }
}
