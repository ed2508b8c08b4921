//! Kinetics from a shared library: the only file that knows dynamic loading, and the only unsafe
//! code of the engine.
//!
//! Everything that a library says is checked before it is believed, as far as it can be: a table
//! or pointer that lies about its own length cannot be told from an honest one. A library is never
//! unloaded.
#![allow(unsafe_code)]

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::path::{Path, PathBuf};
use std::ptr;
use std::sync::Arc;

use rumple_plugin_abi as abi;

use super::batch::{Batch, Column};
use super::descriptor::{
    Capabilities, Default, Descriptor, Location, Parameter, SignalRead, Species,
};
use super::error::KineticsError;
use super::metadata::{self, Problem};
use super::{Kinetics, Outcome, Unreliable, differences, parameters};

/// More elements than this in an array of a descriptor are taken for garbage.
const MOST_ELEMENTS: usize = 256;
/// More bytes than this in a text of a descriptor are taken for garbage.
const LONGEST_TEXT: usize = 1 << 16;
/// Bytes that a plugin has for a message.
const MESSAGE_CAPACITY: usize = 1024;

/// A loaded plugin: its description and its functions.
#[derive(Debug)]
pub struct Library {
    path: PathBuf,
    descriptor: Descriptor,
    create: abi::Create,
    destroy: abi::Destroy,
    rates: abi::Evaluate,
    rate_partials: Option<abi::EvaluatePartials>,
    length_factor: Option<abi::Evaluate>,
    length_factor_partials: Option<abi::EvaluatePartials>,
}

impl Library {
    /// Loads the plugin at a path and checks its table and descriptor.
    ///
    /// # Errors
    /// [`KineticsError`]: no such file, no library, no plugin, wrong magic or major version,
    /// truncated table, or a descriptor that makes no sense.
    pub fn load(path: &Path) -> Result<Arc<Self>, KineticsError> {
        let missing = || KineticsError::MissingFile { path: path.to_owned() };
        // A full path keeps the system from looking anywhere else for a file of this name.
        let path = path.canonicalize().map_err(|_| missing())?;
        if !path.is_file() {
            return Err(missing());
        }
        // SAFETY: runs the initialisers of the library: the user chose to trust it.
        let library = unsafe { libloading::Library::new(&path) }.map_err(|error| {
            KineticsError::NotALibrary { path: path.clone(), reason: error.to_string() }
        })?;
        // SAFETY: an address is only taken here; what it points to is read below.
        let entry = unsafe { library.get::<*const abi::PluginTable>(abi::ENTRY_SYMBOL) }
            .map(|symbol| *symbol)
            .ok()
            .filter(|table| !table.is_null())
            .ok_or_else(|| KineticsError::NotAPlugin { path: path.clone() })?;
        // Function pointers are kept from here on: the library must stay mapped for good.
        std::mem::forget(library);

        let table = read_table(entry, &path)?;
        let bad =
            |(place, problem)| KineticsError::BadDescriptor { path: path.clone(), place, problem };
        let descriptor = read_descriptor(&table).map_err(bad)?;
        let null = |name: &str| bad((format!("function `{name}`"), "is null".to_owned()));
        let given = descriptor.capabilities;
        Ok(Arc::new(Self {
            create: table.create.ok_or_else(|| null("create"))?,
            destroy: table.destroy.ok_or_else(|| null("destroy"))?,
            rates: table.rates.ok_or_else(|| null("rates"))?,
            rate_partials: given
                .rate_partials
                .then(|| table.rate_partials.ok_or_else(|| null("rate_partials")))
                .transpose()?,
            length_factor: given
                .length_factor
                .then(|| table.length_factor.ok_or_else(|| null("length_factor")))
                .transpose()?,
            length_factor_partials: given
                .length_factor_partials
                .then(|| table.length_factor_partials.ok_or_else(|| null("length_factor_partials")))
                .transpose()?,
            path,
            descriptor,
        }))
    }

    /// The full path of the file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the plugin says about itself.
    #[must_use]
    pub fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    /// The law with these parameters; those not given take their defaults.
    ///
    /// # Errors
    /// An unknown parameter, one out of bounds, or a failure that the plugin reports.
    pub fn instantiate(
        self: &Arc<Self>,
        given: &BTreeMap<String, f64>,
    ) -> Result<PluginKinetics, KineticsError> {
        let parameters = parameters::resolve(&self.descriptor, given)?;
        let mut instance = ptr::null_mut();
        let call = Call { library: self, name: "create", location: Location::Vertex, first: 0 };
        call.run(|report| {
            // SAFETY: as many parameters as the descriptor has; `instance` is ours to be written.
            unsafe {
                (self.create)(parameters.as_ptr(), parameters.len(), &raw mut instance, report)
            }
        })?;
        Ok(PluginKinetics { library: Arc::clone(self), parameters, instance })
    }
}

/// The law of a loaded plugin with its parameters.
#[derive(Debug)]
pub struct PluginKinetics {
    library: Arc<Library>,
    parameters: Vec<f64>,
    instance: *mut c_void,
}

// SAFETY: the boundary demands that instances may be used from any number of threads at once.
unsafe impl Send for PluginKinetics {}
// SAFETY: as above.
unsafe impl Sync for PluginKinetics {}

impl Drop for PluginKinetics {
    fn drop(&mut self) {
        // SAFETY: made by `create` of the same library, and never used again.
        unsafe { (self.library.destroy)(self.instance) };
    }
}

impl PluginKinetics {
    /// The library that the law comes from.
    #[must_use]
    pub fn library(&self) -> &Arc<Library> {
        &self.library
    }

    fn call(&self, name: &'static str, batch: &Batch<'_>) -> Call<'_> {
        Call { library: &self.library, name, location: batch.location, first: batch.first }
    }

    fn check(
        &self,
        what: &'static str,
        expected: usize,
        found: usize,
    ) -> Result<(), KineticsError> {
        if expected == found {
            return Ok(());
        }
        let plugin = self.library.descriptor.name.clone();
        Err(KineticsError::Shape { plugin, what, expected, found })
    }

    /// Checks that all columns are there and long enough, so that pointers to them may be given
    /// away.
    fn inputs(&self, batch: &Batch<'_>, signals: usize) -> Result<Inputs, KineticsError> {
        self.check("species columns", self.library.descriptor.species.len(), batch.species.len())?;
        self.check("signal columns", signals, batch.signals.len())?;
        for column in batch.inputs() {
            let readable =
                if column.covers(batch.count) { batch.count } else { column.parts().0.len() };
            self.check("values of an input", batch.count, readable)?;
        }
        let columns = |columns: &[Column<'_>]| -> Vec<abi::Column> {
            let raw = |column: &Column<'_>| {
                let (data, stride) = column.parts();
                abi::Column { data: data.as_ptr(), stride }
            };
            columns.iter().map(raw).collect()
        };
        Ok(Inputs {
            count: batch.count,
            species: columns(batch.species),
            signals: columns(batch.signals),
        })
    }

    fn outputs(
        &self,
        count: usize,
        columns: usize,
        outputs: &mut [&mut [f64]],
    ) -> Result<Vec<abi::ColumnMut>, KineticsError> {
        self.check("output columns", columns, outputs.len())?;
        outputs
            .iter_mut()
            .map(|column| {
                self.check("values of an output", count, column.len())?;
                Ok(abi::ColumnMut { data: column.as_mut_ptr(), stride: 1 })
            })
            .collect()
    }
}

impl Kinetics for PluginKinetics {
    fn descriptor(&self) -> &Descriptor {
        &self.library.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        let descriptor = self.descriptor();
        let inputs = self.inputs(batch, descriptor.signal_columns())?;
        let values = self.outputs(batch.count, descriptor.species.len(), rates)?;
        self.call("rates", batch).run(|report| {
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { (self.library.rates)(self.instance, &inputs.raw(), values.as_ptr(), report) }
        })
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let Some(function) = self.library.rate_partials else {
            return differences::rate_partials(self, batch, rates, partials);
        };
        let descriptor = self.descriptor();
        let species = descriptor.species.len();
        let inputs = self.inputs(batch, descriptor.signal_columns())?;
        let values = self.outputs(batch.count, species, rates)?;
        let partials = self.outputs(batch.count, species * descriptor.inputs(), partials)?;
        self.call("rate_partials", batch).run(|report| {
            let (values, partials) = (values.as_ptr(), partials.as_ptr());
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { function(self.instance, &inputs.raw(), values, partials, report) }
        })
    }

    fn length_factor(&self, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
        let inputs = self.inputs(batch, 0)?;
        let Some(function) = self.library.length_factor else {
            factor.fill(1.0);
            return Ok(None);
        };
        let values = self.outputs(batch.count, 1, &mut [factor])?;
        self.call("length_factor", batch).run(|report| {
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { function(self.instance, &inputs.raw(), values.as_ptr(), report) }
        })
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let Some(function) = self.library.length_factor_partials else {
            return differences::length_factor_partials(self, batch, factor, partials);
        };
        let inputs = self.inputs(batch, 0)?;
        let values = self.outputs(batch.count, 1, &mut [factor])?;
        let species = self.library.descriptor.species.len();
        let partials = self.outputs(batch.count, species, partials)?;
        self.call("length_factor_partials", batch).run(|report| {
            let (values, partials) = (values.as_ptr(), partials.as_ptr());
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { function(self.instance, &inputs.raw(), values, partials, report) }
        })
    }
}

/// Input columns as the boundary takes them.
struct Inputs {
    count: usize,
    species: Vec<abi::Column>,
    signals: Vec<abi::Column>,
}

impl Inputs {
    fn raw(&self) -> abi::Batch {
        abi::Batch {
            size: size_of::<abi::Batch>(),
            count: self.count,
            species: self.species.as_ptr(),
            species_count: self.species.len(),
            signals: self.signals.as_ptr(),
            signal_count: self.signals.len(),
        }
    }
}

/// One call into a plugin: what to say if it fails.
struct Call<'a> {
    library: &'a Library,
    name: &'static str,
    location: Location,
    first: usize,
}

impl Call<'_> {
    fn run(&self, function: impl FnOnce(*mut abi::Report) -> abi::Status) -> Outcome {
        // Without an answer to a retry, halve the step: what adaptive integrators do as well.
        const DEFAULT_FACTOR: f64 = 0.5;
        let mut buffer = [0_u8; MESSAGE_CAPACITY];
        let mut report = abi::Report {
            size: size_of::<abi::Report>(),
            message: buffer.as_mut_ptr(),
            capacity: buffer.len(),
            length: 0,
            point: abi::NO_POINT,
            factor: DEFAULT_FACTOR,
        };
        let status = function(&raw mut report);
        let (length, point, factor) = (report.length, report.point, report.factor);
        if status == abi::Status::OK {
            return Ok(None);
        }

        let text = String::from_utf8_lossy(&buffer[..length.min(buffer.len())]).trim().to_owned();
        let message = if text.is_empty() { "it gives no reason".to_owned() } else { text };
        let number = (point != abi::NO_POINT).then(|| self.first.saturating_add(point));
        let plugin = self.library.descriptor.name.clone();
        let point = number.map(|number| (self.location.noun(), number));
        let call = self.name;
        match status {
            abi::Status::UNRELIABLE => Ok(Some(Unreliable { message, point: number })),
            abi::Status::RETRY => {
                let usable = factor > 0.0 && factor < 1.0;
                let factor = if usable { factor } else { DEFAULT_FACTOR };
                Err(KineticsError::Retry { plugin, call, point, factor, message })
            }
            abi::Status::FATAL => Err(KineticsError::Failed { plugin, call, point, message }),
            abi::Status(other) => {
                let message = format!("it returned the unknown status {other} ({message})");
                Err(KineticsError::Failed { plugin, call, point, message })
            }
        }
    }
}

/// Copies the table, fields beyond its own size as null.
fn read_table(
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
    if major != abi::ABI_MAJOR {
        return Err(KineticsError::WrongVersion { path: path(), major, minor });
    }
    if size < abi::MINIMUM_TABLE_SIZE {
        return Err(KineticsError::TruncatedTable { path: path(), size });
    }
    let mut table = MaybeUninit::<abi::PluginTable>::zeroed();
    // SAFETY: no more bytes than either side has; all zeros are valid for every field.
    unsafe {
        let bytes = size.min(size_of::<abi::PluginTable>());
        ptr::copy_nonoverlapping(entry.cast::<u8>(), table.as_mut_ptr().cast::<u8>(), bytes);
        Ok(table.assume_init())
    }
}

fn read_descriptor(table: &abi::PluginTable) -> Result<Descriptor, Problem> {
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

    let given = raw.capabilities;
    if !given.contains(abi::Capabilities::RATES) {
        return Err(problem("capabilities", "do not include rates"));
    }
    if given.0 >> 32 != 0 {
        return Err(problem(
            "capabilities",
            "include something that this version of the engine cannot do (spontaneous curvature, \
             state of instances, or newer)",
        ));
    }
    let parameters =
        elements("parameters", raw.parameters, raw.parameter_count, raw.parameter_stride)?;
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
        species: elements("species", raw.species, raw.species_count, raw.species_stride)?
            .iter()
            .map(read_species)
            .collect::<Result<_, _>>()?,
        parameters: parameters
            .iter()
            .enumerate()
            .map(|(position, parameter)| read_parameter(parameter, position, &names))
            .collect::<Result<_, _>>()?,
        signals: elements("signals", raw.signals, raw.signal_count, raw.signal_stride)?
            .iter()
            .map(|signal| {
                let signal_read = text("name of a signal", signal.name)?
                    .parse()
                    .map_err(|unknown: String| problem("signals", &unknown))?;
                Ok(SignalRead { signal: signal_read, typical: signal.typical })
            })
            .collect::<Result<_, Problem>>()?,
        capabilities: Capabilities {
            rate_partials: given.contains(abi::Capabilities::RATE_PARTIALS),
            length_factor: given.contains(abi::Capabilities::LENGTH_FACTOR),
            length_factor_partials: given.contains(abi::Capabilities::LENGTH_FACTOR_PARTIALS),
        },
    };
    metadata::check(&descriptor)?;
    Ok(descriptor)
}

fn read_species(raw: &abi::Species) -> Result<Species, Problem> {
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
        typical: raw.typical,
        lower: raw.lower,
        upper: raw.upper,
        diffusion: raw.diffusion,
        location,
    })
}

fn read_parameter(
    raw: &abi::Parameter,
    position: usize,
    names: &[String],
) -> Result<Parameter, Problem> {
    let name = &names[position];
    let default_of = text(&format!("default of parameter `{name}`"), raw.default_of)?;
    let default = if default_of.is_empty() {
        Default::Value(raw.default)
    } else {
        let earlier = names[..position].iter().position(|known| *known == default_of);
        Default::SameAs(earlier.ok_or_else(|| {
            let problem = format!("defaults to `{default_of}`, which is no earlier parameter");
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
fn elements<T: Copy>(
    place: &str,
    first: *const T,
    count: usize,
    stride: usize,
) -> Result<Vec<T>, Problem> {
    let problem = |problem: String| Err((place.to_owned(), problem));
    if count == 0 {
        return Ok(Vec::new());
    }
    if count > MOST_ELEMENTS {
        return problem(format!("there are {count}; expected at most {MOST_ELEMENTS}"));
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
fn text(place: &str, raw: abi::Str) -> Result<String, Problem> {
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
