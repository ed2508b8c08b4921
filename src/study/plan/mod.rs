//! Which members a study has, written down as `sweep.json`.
//!
//! Every member has a fingerprint: the hash of its scene with all defaults, of the files that this names
//! and of its plugins. A resumed study finds its members again by their values, and refuses to where
//! a fingerprint is another one.

mod axis;
mod difference;
pub mod integrator;
mod keys;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use self::axis::{Axis, MAX_VALUES};
use self::keys::{check_keys, disambiguate_titles};
pub use self::keys::{seed_axis, seed_keys};
use super::{read_document, write_document};
use crate::kinetics::{HostLaw, PluginSearch};
use crate::output::OutputError;
use crate::output::provenance::{FileRecord, fingerprint};
use crate::run::{Error, Result};
use crate::scene::{OVER, Scene};

/// A study: its scene, what it varies, its members.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name and version of this crate.
    pub version: String,
    /// The scene file, its full path.
    pub scene: PathBuf,
    /// Overrides that hold for all members.
    pub set: Vec<String>,
    /// Keys that are varied; the last one fastest.
    pub axes: Vec<Axis>,
    /// Value of the first species above which there is a spot; half way if none.
    pub level: Option<f64>,
    /// Threads of a member.
    pub threads: u16,
    /// Where plugins are looked for.
    pub plugin_path: Vec<PathBuf>,
    /// Whether members keep their states at output times.
    #[serde(default)]
    pub states: bool,
    /// Files that its scenes name, and plugins, with their hashes.
    #[serde(default)]
    pub files: BTreeMap<PathBuf, String>,
    /// The members.
    pub members: Vec<Member>,
    /// The law that the caller brings: to be given again wherever the plan is read.
    #[serde(skip)]
    pub law: Option<HostLaw>,
}

/// One member of a study.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    /// Name of its folder.
    pub folder: String,
    /// Which value of every axis it has.
    pub at: Vec<usize>,
    /// Hash of its scene and of the files of that.
    pub fingerprint: String,
    /// Wall time after which it is given up, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<u64>,
}

impl Plan {
    /// Name of its file.
    pub const FILE: &'static str = "sweep.json";
    /// Name of the folder of the members.
    pub const MEMBERS: &'static str = "members";

    /// All members of a sweep of the scene file `scene` over `axes`, each of them read and checked.
    /// Fingerprints are yet to be taken.
    ///
    /// # Errors
    /// No axes, keys that clash with one another or with `set`, too many members; a member whose scene
    /// is not valid, with its place.
    pub fn new(scene: &Path, set: &[String], mut axes: Vec<Axis>) -> Result<Self> {
        if axes.is_empty() {
            let message = "nothing to vary: give --over KEY=VALUES, as in \
                           --over material.thickness=0.5,1,1.5, --refine or --seeds N";
            return Err(Error::Refused(message.into()));
        }
        let count = axes.iter().try_fold(1usize, |n, axis| n.checked_mul(axis.values.len()));
        if count.is_none_or(|count| count > MAX_VALUES) {
            let message =
                format!("more than {MAX_VALUES} members; give fewer values, or several sweeps");
            return Err(Error::Refused(message));
        }
        check_keys(scene, set, &axes)?;
        disambiguate_titles(scene, set, &mut axes)?;
        let mut plan = Self {
            version: concat!("rumple ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene: std::path::absolute(scene).map_err(OutputError::read(scene))?,
            set: set.to_vec(),
            axes,
            threads: 1,
            ..Self::default()
        };
        // All combinations, the last key fastest.
        let mut all: Vec<Vec<usize>> = vec![Vec::new()];
        for axis in &plan.axes {
            let more =
                |at: Vec<usize>| (0..axis.values.len()).map(move |k| [&at[..], &[k]].concat());
            all = all.into_iter().flat_map(more).collect();
        }
        for at in all {
            Scene::varied(scene, set, &plan.overrides(&at), OVER)?;
            plan.members.push(Member { folder: plan.folder(&at), at, ..Member::default() });
        }
        plan.disambiguate_folders();
        Ok(plan)
    }

    /// The overrides of a member.
    fn overrides(&self, at: &[usize]) -> Vec<String> {
        self.axes.iter().zip(at).flat_map(|(axis, k)| axis.overrides(*k)).collect()
    }

    /// Which value of every axis member `number` has; empty if the member does not exist.
    fn value_numbers(&self, number: usize) -> &[usize] {
        self.members.get(number).map_or(&[], |point| &point.at)
    }

    /// The scene of member `number`.
    ///
    /// # Errors
    /// If it cannot be read any more.
    pub fn scene(&self, number: usize) -> Result<Scene> {
        Ok(Scene::varied(
            &self.scene,
            &self.set,
            &self.overrides(self.value_numbers(number)),
            OVER,
        )?)
    }

    /// The end time of member `number`.
    ///
    /// # Errors
    /// If its scene cannot be read any more.
    pub fn until(&self, number: usize) -> Result<f64> {
        Ok(self.scene(number)?.time.span.until.get())
    }

    /// Returns the search path of its plugins.
    pub(crate) fn search(&self) -> PluginSearch {
        PluginSearch::in_directories(self.plugin_path.clone()).with_law(self.law.clone())
    }

    /// Returns the name of a member: its keys and values.
    #[must_use]
    pub fn name(&self, number: usize) -> String {
        self.label(self.value_numbers(number), |_| true)
    }

    /// Keys and values at `at` of the axes that are kept, as in `D = 0.5, seed = 1`.
    pub(super) fn label(&self, at: &[usize], kept: impl Fn(usize) -> bool) -> String {
        let all = self.axes.iter().zip(at).enumerate().filter(|(k, _)| kept(*k));
        all.map(|(_, (axis, k))| axis.label(*k)).collect::<Vec<_>>().join(", ")
    }

    /// Returns the name of the plot against key `number`: the last word of the key, or all of it where two
    /// keys have the same.
    pub(crate) fn plot_name(&self, number: usize) -> String {
        let Some(axis) = self.axes.get(number) else { return String::new() };
        let alone = self.axes.iter().filter(|a| a.short() == axis.short()).count() == 1;
        let name = if alone { axis.short() } else { &axis.key };
        name.replace(|c: char| !c.is_ascii_alphanumeric() && !"._-".contains(c), "-")
    }

    /// The directory of a member, in that of the sweep.
    #[must_use]
    pub fn directory(&self, root: &Path, number: usize) -> PathBuf {
        let folder = self.members.get(number).map_or("", |point| &point.folder);
        root.join(Self::MEMBERS).join(folder)
    }

    fn folder(&self, at: &[usize]) -> String {
        let value = |(axis, k): (&Axis, &usize)| format!("{}={}", axis.short(), axis.value(*k));
        let all: Vec<String> = self.axes.iter().zip(at).map(value).collect();
        let usual = |c: char| c.is_ascii_alphanumeric() || "=,.+_-".contains(c);
        let name = all.join(",").replace(|c| !usual(c), "-");
        let name: String = name.chars().take(LONGEST_NAME).collect();
        // Hidden, or this folder or the one above, it would be otherwise.
        if name.starts_with('.') { format!("-{name}") } else { name }
    }

    /// Gives members whose folders have one name a part of their hash.
    fn disambiguate_folders(&mut self) {
        let mut count: BTreeMap<String, usize> = BTreeMap::new();
        for point in &self.members {
            *count.entry(point.folder.to_lowercase()).or_default() += 1;
        }
        for number in 0..self.members.len() {
            if count[&self.members[number].folder.to_lowercase()] > 1 {
                let hash = fingerprint(&self.overrides(self.value_numbers(number)).join("\n"));
                self.members[number].folder += &format!(",{}", &hash[..8]);
            }
        }
    }

    /// Takes the fingerprint of every member.
    ///
    /// # Errors
    /// A file or a plugin that is not there.
    pub fn seal(&mut self) -> Result<()> {
        let mut known = BTreeMap::new();
        for number in 0..self.members.len() {
            self.members[number].fingerprint = self.fingerprint(number, &mut known)?;
        }
        self.files = known;
        Ok(())
    }

    /// The fingerprint of a member as its scene and files are now, with the hashes of files that are `known`; others
    /// are added to these.
    pub(super) fn fingerprint(
        &self,
        number: usize,
        known: &mut BTreeMap<PathBuf, String>,
    ) -> Result<String> {
        let scene = self.scene(number)?;
        let mut text = scene.resolved()?;
        let mut files: Vec<PathBuf> = scene.files().iter().map(|f| f.1.to_owned()).collect();
        let home = scene.file().parent().unwrap_or(Path::new("."));
        let search = self.search();
        for plugin in scene.kinetics.iter().filter_map(|k| k.plugin.as_ref()) {
            if search.host_law_named(plugin).is_none() {
                files.push(search.resolve(plugin, home)?);
            }
        }
        if let Some(law) = &self.law {
            text += &format!("law {} {}\n", law.name(), law.digest());
        }
        for path in files {
            if !known.contains_key(&path) {
                known.insert(path.clone(), FileRecord::new(&path)?.sha256);
            }
            text += &format!("{} {}\n", path.display(), known[&path]);
        }
        Ok(fingerprint(&text))
    }

    /// Reads that of the sweep in `root`; none without a sweep.
    ///
    /// # Errors
    /// If its file cannot be read.
    pub fn read(root: &Path) -> Result<Option<Self>> {
        read_document(&root.join(Self::FILE), "sweep")
    }

    /// Reads that of the sweep in `root`.
    ///
    /// # Errors
    /// The directory holds no sweep, or its file cannot be read.
    pub fn load(root: &Path) -> Result<Self> {
        Self::read(root)?.ok_or_else(|| {
            let (path, file) = (root.display(), Self::FILE);
            Error::Refused(format!("{path}: no {file}: expected the directory of a sweep"))
        })
    }

    /// Writes it into `root`.
    ///
    /// # Errors
    /// From the operating system.
    pub fn write(&self, root: &Path) -> Result<()> {
        write_document(&root.join(Self::FILE), self)
    }

    /// Refuses to resume the sweep `earlier` in `root` if that is another one. Values may be added.
    ///
    /// # Errors
    /// The change.
    pub fn check_resumable(&self, earlier: &Self, root: &Path) -> Result<()> {
        let refuse = |what: String| {
            Err(Error::Refused(format!(
                "{}: holds another sweep: {what}; choose another with --out, or give --force to replace it",
                root.display()
            )))
        };
        let keys = |plan: &Self| {
            plan.axes.iter().map(|axis| axis.key.as_str()).collect::<Vec<_>>().join(", ")
        };
        if keys(self) != keys(earlier) {
            return refuse(format!("over {}, now over {}", keys(earlier), keys(self)));
        }
        if self.level != earlier.level {
            return refuse("with another --level".into());
        }
        for (number, old) in earlier.members.iter().enumerate() {
            let name = earlier.name(number);
            let Some(new) = self.members.iter().position(|new| new.folder == old.folder) else {
                return refuse(format!("its member {name} is not among those asked for now"));
            };
            if self.members[new].fingerprint != old.fingerprint {
                return refuse(self.difference(new, root)?);
            }
        }
        Ok(())
    }
}

/// Most characters of the name of a folder: systems allow 255 bytes.
const LONGEST_NAME: usize = 150;
