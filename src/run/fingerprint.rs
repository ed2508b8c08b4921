//! What a run was made from, so that it is continued with the same.

use serde::{Deserialize, Serialize};
use toml::Value;

use super::{Error, Result, Simulation};
use crate::output::provenance::FileRecord;
use crate::scene::Scene;

/// Scene, mesh and files of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Fingerprint {
    /// The scene with all its defaults.
    scene: String,
    /// Hash of the mesh at rest.
    mesh: String,
    /// What every plugin and every file of parameters is, with its path and hash.
    files: Vec<[String; 3]>,
}

/// What the law of the host program is called among files.
const HOST_LAW: &str = "the law";

/// Keys of a scene that a run may be continued with other values of.
const CHANGEABLE_KEYS: [&str; 4] = ["time.until", "time.max_steps", STOP_WHEN_STEADY, "checkpoint"];
/// Key of the rate below which a run ends.
pub(super) const STOP_WHEN_STEADY: &str = "time.stop_when_steady";

impl Fingerprint {
    /// What `simulation` is made from.
    ///
    /// # Errors
    /// A file that cannot be read any more.
    pub(super) fn new(scene: &Scene, simulation: &Simulation) -> Result<Self> {
        let mut files = Vec::new();
        let plugins = simulation.plugins().iter().map(|path| ("the plugin".to_owned(), &**path));
        // The mesh has a hash of its own, and the start is over.
        let stay = |key: &str| {
            key.contains(".parameters")
                || key.starts_with("effect[")
                || key.starts_with("material.")
        };
        let fields = scene.files().into_iter().filter(|(key, _)| stay(key));
        for (what, path) in plugins.chain(fields) {
            let FileRecord { path, sha256 } = FileRecord::new(path)?;
            files.push([what, path.to_string_lossy().into_owned(), sha256]);
        }
        if let Some([name, digest]) = &simulation.host_law {
            files.push([HOST_LAW.to_owned(), name.clone(), digest.clone()]);
        }
        Ok(Self { scene: scene.resolved()?, mesh: simulation.mesh().sha256, files })
    }

    /// The name of the law of the host program.
    pub(super) fn host_law(&self) -> Option<&str> {
        self.files.iter().find(|[what, ..]| what == HOST_LAW).map(|[_, name, _]| name.as_str())
    }

    /// The rate below which the run was to end, 0 for none.
    pub(super) fn steady_rate(&self) -> f64 {
        let scene = self.scene.parse::<toml::Table>().ok();
        let rate = scene.as_ref().and_then(|scene| scene.get("time")?.get("stop_when_steady"));
        rate.and_then(Value::as_float).unwrap_or(0.0)
    }

    /// That `now` is the same, as far as it matters from here on.
    ///
    /// # Errors
    /// [`Error::Refused`] with all that is not.
    pub(super) fn check(&self, now: &Self) -> Result<()> {
        let mut changed = Vec::new();
        let (before, after) = (self.scene.parse(), now.scene.parse());
        if let (Ok(before), Ok(after)) = (before, after) {
            differences("", Some(&Value::Table(before)), Some(&Value::Table(after)), &mut changed);
        }
        if self.mesh != now.mesh {
            changed.push("the mesh has changed".to_owned());
        }
        for file in &self.files {
            let [what, path, hash] = file;
            match now.files.iter().find(|[other, place, _]| other == what && place == path) {
                Some([_, _, other]) if other == hash => {}
                Some(_) => changed.push(format!("{what} {path} has changed")),
                None => changed.push(format!("{what} {path} is not used any more")),
            }
        }
        for [what, path, _] in &now.files {
            if !self.files.iter().any(|[other, place, _]| other == what && place == path) {
                changed.push(format!("{what} {path} was not used before"));
            }
        }
        if changed.is_empty() {
            return Ok(());
        }
        Err(Error::Refused(changed.join("\n")))
    }
}

/// Where two scenes differ, key by key.
fn differences(path: &str, a: Option<&Value>, b: Option<&Value>, found: &mut Vec<String>) {
    if CHANGEABLE_KEYS.contains(&path) || a == b {
        return;
    }
    let nothing = || "nothing".to_owned();
    match (a, b) {
        (Some(Value::Table(a)), Some(Value::Table(b))) => {
            let mut keys: Vec<&String> = a.keys().chain(b.keys()).collect();
            keys.sort();
            keys.dedup();
            for key in keys {
                let below = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                differences(&below, a.get(key), b.get(key), found);
            }
        }
        (Some(Value::Array(a)), Some(Value::Array(b))) => {
            for k in 0..a.len().max(b.len()) {
                differences(&format!("{path}[{k}]"), a.get(k), b.get(k), found);
            }
        }
        _ => {
            let [a, b] = [a, b].map(|value| value.map_or_else(nothing, ToString::to_string));
            found.push(format!("{path} was {a} and is {b}"));
        }
    }
}
