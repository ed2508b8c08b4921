//! Cases and what is expected of them, as `models/hard/cases.toml` has them.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::Outcome;

/// The file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cases {
    pub case: Vec<Case>,
    #[serde(default)]
    pub rescaled: Vec<Rescaled>,
}

/// A hard case: a command and what is expected of it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    pub name: String,
    /// In words; `{}` stands for the value.
    pub tried: String,
    /// What `$VALUE` in the command is, one after the other.
    #[serde(default)]
    values: Vec<String>,
    /// For bash, with `$RUMPLE` the program, `$MODELS` the folder of scenes, `$OUT` a folder that is not there yet,
    /// `$VALUE`.
    pub run: String,
    /// Exit code.
    #[serde(default)]
    pub code: i32,
    /// What is expected beside it, in words.
    #[serde(default)]
    pub because: String,
    /// Parts of what is said.
    #[serde(default)]
    pub says: Vec<String>,
    /// Least and largest value of columns of the ledger in every row.
    #[serde(default)]
    pub always: BTreeMap<String, [f64; 2]>,
    /// The same in the last row.
    #[serde(default)]
    pub finally: BTreeMap<String, [f64; 2]>,
    /// How far columns of the ledger may drift from their first value, relative to it.
    #[serde(default)]
    pub kept: BTreeMap<String, f64>,
    /// Columns whose last value is shown.
    #[serde(default)]
    pub show: Vec<String>,
    /// Whether memory and speed are to be the same in the first and the last tenth of the run.
    #[serde(default)]
    pub steady: bool,
    /// Seconds that it may take.
    #[serde(default = "minute")]
    pub limit: f64,
    /// Only run if asked for.
    #[serde(default)]
    pub slow: bool,
    /// Other ways to do the same, shown beside it.
    #[serde(default)]
    pub beside: Vec<Beside>,
}

/// Another way to do the same.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beside {
    pub by: String,
    /// As that of the case.
    pub run: String,
    /// Variable that must be set, or it is left out.
    #[serde(default)]
    needs: Option<String>,
}

impl Beside {
    /// Whether what it needs is there.
    pub fn possible(&self) -> bool {
        self.needs.as_ref().is_none_or(|name| std::env::var_os(name).is_some())
    }
}

/// A scene in other units.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rescaled {
    pub name: String,
    /// In the folder of scenes.
    pub scene: String,
    /// Overrides of all runs.
    #[serde(default)]
    pub set: Vec<String>,
    /// Factors for each of length, time and stress.
    pub factors: Vec<f64>,
    /// Keys with their value and powers of length, time and stress.
    pub keys: BTreeMap<String, [f64; 4]>,
    /// Columns of the ledger whose last value is compared, with powers.
    pub columns: BTreeMap<String, [f64; 3]>,
    /// Largest relative difference.
    pub within: f64,
    /// Only run if asked for.
    #[serde(default)]
    pub slow: bool,
}

fn minute() -> f64 {
    60.0
}

impl Cases {
    /// # Errors
    /// A file that cannot be read, with the place.
    pub fn read(path: &Path) -> Outcome<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(toml::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?)
    }

    /// All names.
    pub fn names(&self) -> Vec<&str> {
        let names = self.case.iter().map(|case| case.name.as_str());
        names.chain(self.rescaled.iter().map(|scales| scales.name.as_str())).collect()
    }

    /// Whether there is one of this name.
    pub fn has(&self, name: &str) -> bool {
        self.names().contains(&name)
    }
}

impl Case {
    /// The values; one that is empty if there are none.
    pub fn values(&self) -> Vec<String> {
        if self.values.is_empty() { vec![String::new()] } else { self.values.clone() }
    }

    /// What is expected, in words.
    pub fn expected(&self) -> String {
        let end = match self.code {
            0 => "complete".to_owned(),
            2 => "refused".to_owned(),
            code => format!("stops, code {code}"),
        };
        match self.because.as_str() {
            "" => end,
            because => format!("{end}: {because}"),
        }
    }
}
