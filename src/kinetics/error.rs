//! Why kinetics could not be found, loaded, made or evaluated.

use std::path::PathBuf;

use super::site::{BadValue, Site};
use rumple_numerics::num::Short;

/// Anything that can go wrong with kinetics.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KineticsError {
    /// No plugin of this name where plugins are looked for.
    #[error(
        "no plugin `{name}`{}\nfound: {}\nlooked in: {}; --plugin-path DIR adds a \
         directory, and ./{name}.so is a path",
        hint(nearest.as_deref()),
        list(found),
        list(searched)
    )]
    NotFound {
        /// The name asked for.
        name: String,
        /// The found name that is most like it.
        nearest: Option<String>,
        /// The names that were found.
        found: Vec<String>,
        /// The directories that were looked through.
        searched: Vec<String>,
    },
    /// No file at the path of a plugin.
    #[error(
        "plugin file {} does not exist (or is not a file){}",
        path.display(),
        hint(nearest.as_deref())
    )]
    MissingFile {
        /// The path.
        path: PathBuf,
        /// The plugin in that folder whose name is most like it.
        nearest: Option<String>,
    },
    /// A folder at the path of a plugin.
    #[error("plugin {} is a folder: {}", path.display(), inside(libraries))]
    Folder {
        /// The path.
        path: PathBuf,
        /// The plugins in it, or where a build leaves them.
        libraries: Vec<PathBuf>,
    },
    /// The system's loader refuses the file.
    #[error("{} cannot be loaded as a shared library: {reason}", path.display())]
    NotALibrary {
        /// The path.
        path: PathBuf,
        /// What the loader says.
        reason: String,
    },
    /// A shared library without the entry symbol.
    #[error(
        "{} is a shared library but not a plugin: it does not export `{}`",
        path.display(),
        rumple_plugin_abi::ENTRY_SYMBOL
    )]
    NotAPlugin {
        /// The path.
        path: PathBuf,
    },
    /// The entry symbol is not a plugin table.
    #[error("{} is not a plugin: its table starts with {found:02x?} instead of {:02x?} \
        (magic)", path.display(), rumple_plugin_abi::MAGIC)]
    WrongMagic {
        /// The path.
        path: PathBuf,
        /// The first eight bytes.
        found: [u8; 8],
    },
    /// Built for another version of the boundary.
    #[error(
        "plugin {} was built for version {major}.{minor} of the plugin boundary; this engine \
         needs {}.{}: rebuild it with the SDK or the header of this engine (plugins/sdk, plugins/abi/include)",
        path.display(),
        rumple_plugin_abi::ABI_MAJOR,
        rumple_plugin_abi::ABI_MINOR
    )]
    WrongVersion {
        /// The path.
        path: PathBuf,
        /// Its major version.
        major: u32,
        /// Its minor version.
        minor: u32,
    },
    /// The table is smaller than a valid one.
    #[error(
        "plugin {} has a truncated table: {size} bytes, expected at least {}",
        path.display(),
        size_of::<rumple_plugin_abi::PluginTable>()
    )]
    TruncatedTable {
        /// The path.
        path: PathBuf,
        /// Bytes it claims.
        size: usize,
    },
    /// The table or the descriptor says something impossible.
    #[error("plugin {} has an invalid descriptor: {place}: {problem}", path.display())]
    BadDescriptor {
        /// The path.
        path: PathBuf,
        /// Which part.
        place: String,
        /// What is wrong and what was expected.
        problem: String,
    },
    /// A parameter that the plugin does not have.
    #[error(
        "plugin `{plugin}` has no parameter `{name}`{}; it has: {}",
        hint(nearest.as_deref()),
        list(allowed)
    )]
    UnknownParameter {
        /// The plugin.
        plugin: String,
        /// The name given.
        name: String,
        /// The parameter most like it.
        nearest: Option<String>,
        /// All parameters.
        allowed: Vec<String>,
    },
    /// A parameter outside its bounds.
    #[error("parameter `{name}` of plugin `{plugin}` is {}; allowed: {range}", Short(*value))]
    ParameterOutOfBounds {
        /// The plugin.
        plugin: String,
        /// The parameter.
        name: String,
        /// The value given.
        value: f64,
        /// The bounds, in words.
        range: String,
    },
    /// A call ended without a result.
    #[error("plugin `{plugin}` failed in {call}{}: {message}", place(point.as_deref()))]
    Failed {
        /// The plugin.
        plugin: String,
        /// Which call.
        call: &'static str,
        /// The point to blame, if known.
        point: Option<Box<Site>>,
        /// What the plugin says.
        message: String,
    },
    /// A call asks for a shorter time step.
    #[error(
        "plugin `{plugin}` asks in {call}{} for {} times the time step: {message}",
        place(point.as_deref()),
        Short(*factor)
    )]
    Retry {
        /// The plugin.
        plugin: String,
        /// Which call.
        call: &'static str,
        /// The point to blame, if known.
        point: Option<Box<Site>>,
        /// By what to multiply the step, in (0, 1).
        factor: f64,
        /// What the plugin says.
        message: String,
    },
    /// An output that is not a finite number, or a length factor that is not positive.
    #[error("{0}")]
    BadOutput(Box<BadValue>),
    /// Two calls with the same inputs gave different results.
    #[error(
        "plugin `{plugin}` gave {} and then {} in {call} for {quantity} at {location} {point} from \
         the same inputs ({how}): a law must not keep internal state",
        Short(*first),
        Short(*second)
    )]
    Unsteady {
        /// The plugin.
        plugin: String,
        /// Which call.
        call: &'static str,
        /// What was returned.
        quantity: Box<str>,
        /// `vertex`, `face` or `edge`.
        location: &'static str,
        /// Number of the point.
        point: usize,
        /// The first value.
        first: f64,
        /// The other value.
        second: f64,
        /// How the calls differed.
        how: &'static str,
    },
    /// Both calls give the rates, and not the same ones.
    #[error(
        "{law} gives {} in rates and {} in rate_partials for the rate of species \
         {species} at {location} {point}: rate_partials writes the rates as well",
        Short(*alone),
        Short(*with_partials)
    )]
    TwoValues {
        /// The law, as messages call it.
        law: String,
        /// The species.
        species: String,
        /// `vertex`, `face` or `edge`.
        location: &'static str,
        /// Number of the point.
        point: usize,
        /// By `rates`.
        alone: f64,
        /// By `rate_partials`.
        with_partials: f64,
    },
    /// An output that a law leaves as it was.
    #[error(
        "{law} leaves output {output} of {columns} of {call} unwritten at {location} {point}: it \
         must write every output at every point"
    )]
    Unwritten {
        /// The law, as messages call it.
        law: String,
        /// Which call.
        call: &'static str,
        /// Number of the output column, from 1: values, then derivatives.
        output: usize,
        /// How many there are.
        columns: usize,
        /// `vertex`, `face` or `edge`.
        location: &'static str,
        /// Number of the point.
        point: usize,
    },
    /// Numbers written beside an output.
    #[error("{law} writes beyond the {points} points of output {output} of {call}")]
    WritesBeyond {
        /// The law, as messages call it.
        law: String,
        /// Which call.
        call: &'static str,
        /// Number of the output column, from 1.
        output: usize,
        /// How many points it has.
        points: usize,
    },
    /// An input that is not a finite number: the fault lies before the kinetics.
    #[error("{input} = {} at {location} {point}: kinetics need finite inputs", Short(*value))]
    BadInput {
        /// Name of the species or signal column.
        input: String,
        /// Its value.
        value: f64,
        /// `vertex` or `face`.
        location: &'static str,
        /// Number of the point.
        point: usize,
    },
    /// The caller's columns do not fit the descriptor.
    #[error("kinetics `{plugin}` were called with {what}: expected {expected}, found {found}")]
    Shape {
        /// The plugin.
        plugin: String,
        /// What does not fit.
        what: &'static str,
        /// How many were expected.
        expected: usize,
        /// How many were given.
        found: usize,
    },
}

impl KineticsError {
    /// Whether a smaller time step may do without this failure.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Retry { .. } | Self::BadOutput(_) | Self::BadInput { .. })
    }

    /// The point to blame, if it is known.
    #[must_use]
    pub fn site(&self) -> Option<&Site> {
        match self {
            Self::Failed { point, .. } | Self::Retry { point, .. } => point.as_deref(),
            Self::BadOutput(bad) => Some(&bad.site),
            _ => None,
        }
    }

    /// As [`KineticsError::site`], to say more of it.
    pub fn site_mut(&mut self) -> Option<&mut Site> {
        match self {
            Self::Failed { point, .. } | Self::Retry { point, .. } => point.as_deref_mut(),
            Self::BadOutput(bad) => Some(&mut bad.site),
            _ => None,
        }
    }
}

/// The candidate most like `name`, if one is like it.
pub(super) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    // Below this Jaro-Winkler similarity a suggestion is more puzzling than helpful.
    const MIN_SIMILARITY: f64 = 0.7;
    // Letters of a part that is taken for the whole.
    const MIN_PART_LETTERS: usize = 3;
    const MAX_LENGTH_RATIO: usize = 5;
    // No misspelt names are that long (bytes), and to compare two takes the product of their lengths.
    const MAX_NAME_BYTES: usize = 200;
    candidates
        .into_iter()
        .filter(|candidate| name.len() <= MAX_NAME_BYTES && candidate.len() <= MAX_NAME_BYTES)
        .map(|candidate| {
            let (name, other) = (name.to_lowercase(), candidate.to_lowercase());
            // A part of it, as in `feedback`, or parts in another order.
            let part = name.len() >= MIN_PART_LETTERS
                && (other.contains(&name) || same_words(&name, &other));
            // A few letters are like no word many times as long.
            let far = name.len() * MAX_LENGTH_RATIO < other.len();
            let likeness = if far { 0.0 } else { strsim::jaro_winkler(&name, &other) };
            (if part { likeness.max(MIN_SIMILARITY) } else { likeness }, candidate)
        })
        .filter(|(likeness, _)| *likeness >= MIN_SIMILARITY)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, candidate)| candidate.to_owned())
}

/// Whether two names are the same words in any order.
fn same_words(one: &str, other: &str) -> bool {
    let words = |name: &str| {
        let mut words: Vec<String> = name.split(['-', '_']).map(str::to_owned).collect();
        words.sort();
        words
    };
    words(one) == words(other)
}

fn hint(nearest: Option<&str>) -> String {
    nearest.map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default()
}

fn inside(libraries: &[PathBuf]) -> String {
    if libraries.is_empty() {
        let ending = std::env::consts::DLL_SUFFIX;
        return format!(
            "name the library in it, a file that ends in {ending}; there is none yet, so build it \
             first"
        );
    }

    let files: Vec<String> = libraries.iter().map(|l| l.display().to_string()).collect();
    format!("name the library in it, {}", files.join(" or "))
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "(none)".to_owned() } else { names.join(", ") }
}

fn place(site: Option<&Site>) -> String {
    site.map(|site| format!(" at {site}")).unwrap_or_default()
}
