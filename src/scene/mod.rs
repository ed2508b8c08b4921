//! Scenes: one TOML file that says what is simulated.
//!
//! Text becomes a tree of values with places (`document`), changed by `overrides`, read by serde
//! into checked structs; whatever is wrong ends as a [`SceneError`] that points to its place.
//! What a scene does not list does not exist.

mod checkpoint;
mod error;
mod excerpt;
mod files;
mod initial;
mod invariants;
mod kinetics;
mod law;
mod material;
mod misplaced_key;
mod output;
mod overrides;
mod schema;
mod sections;
mod sheet;
mod source;
mod stability;
mod time;
mod toml_tree;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use crate::effects::EffectSpec;
use crate::sheet::Surface;
use crate::solve::EquilibriumSpec;
use crate::solve::equilibrium::Method;

pub use self::checkpoint::CheckpointSpec;
pub use self::error::SceneError;
pub(crate) use self::initial::Sequence;
pub use self::initial::{FieldFile, Gaussian, Initial, Pattern, Random, RectangularSpot, Stripe};
pub use self::invariants::{Bound, InvariantsSpec};
pub use self::kinetics::{KineticsSpec, ParameterSpec, PositionFormula};
pub use self::material::{Material, PoissonRatio};
pub use self::output::OutputSpec;
pub use self::schema::schema;
pub use self::sheet::{
    Annulus, Bump, Cylinder, Direction, Disc, Imperfection, Periodic, Point, Polygon, Rectangle,
    ShapeSpec, SheetSource, SheetSpec, Sphere,
};
pub use self::stability::StabilitySpec;
pub use self::time::{Span, TimeSpec};
pub use crate::document::{DocumentError, Node, Place};
pub use crate::model::{Coefficient, Directions, DragSpec};
pub use crate::scene::kinetics::SpeciesSpec;

use self::error::Origin;
use self::sections::Sections;
pub use self::source::OVER;
use crate::document::{Segment, Value, read};

/// Tables of a scene.
#[rustfmt::skip]
const TABLES: [&str; 10] = [
    "sheet", "material", "effect", "kinetics", "time", "equilibrium", "stability", "invariants", "output",
    "checkpoint",
];

/// A checked scene, with the places of everything it was read from.
#[derive(Debug, Serialize)]
pub struct Scene {
    /// The sheet and its start.
    pub sheet: SheetSpec,
    /// Elastic constants and drag; needed where the shape moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// The effects, in the order of the scene.
    #[serde(rename = "effect")]
    pub effects: Vec<Box<dyn EffectSpec>>,
    /// Species and their laws, if the scene has any.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "kinetics::one_or_all")]
    pub kinetics: Vec<KineticsSpec>,
    /// Time stepping.
    pub time: TimeSpec,
    /// How mechanical equilibrium is found.
    pub(crate) equilibrium: Box<dyn EquilibriumSpec>,
    /// The watch on stability, if the scene has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stability: Option<StabilitySpec>,
    /// The laws of nature that a run monitors, if the scene lists some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invariants: Option<InvariantsSpec>,
    /// What is written.
    pub output: OutputSpec,
    /// Times of checkpoints, where the scene sets them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<CheckpointSpec>,
    #[serde(skip)]
    origin: Origin,
    /// Full path of its file; empty for one that was parsed.
    #[serde(skip)]
    file: PathBuf,
    /// Surfaces that are given in memory, in place of the files of these paths.
    #[serde(skip)]
    surfaces: BTreeMap<PathBuf, Arc<Surface>>,
}

impl Scene {
    /// Reads and checks the scene file at `path`, after the `key.path=value` overrides.
    ///
    /// Paths in it count from the folder of the file, also those of overrides; the result's are absolute.
    ///
    /// # Errors
    /// The file cannot be read, or is not a valid scene; all that was found wrong, with places.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        Self::varied(path, overrides, &[], OVER)
    }

    /// [`Scene::load`] with a second group of overrides, which errors call `option`: what a member of a sweep changes.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn varied(
        path: &Path,
        set: &[String],
        over: &[String],
        option: &'static str,
    ) -> Result<Self, SceneError> {
        let (root, (origin, _)) = source::changed(path, set, (over, option))?;
        let mut scene = check(root, origin)?;
        let unreadable = |error| SceneError::unreadable(path, &error);
        let path = std::path::absolute(path).map_err(unreadable)?;
        scene.resolve_paths_against(path.parent().unwrap_or(&path));
        scene.file = path;
        Ok(scene)
    }

    /// Checks the scene `text`, after the overrides; `name` stands for its file in messages. Paths stay as they are.
    ///
    /// # Errors
    /// `text` is not a valid scene; all that was found wrong, with places.
    pub fn parse(text: &str, name: &str, overrides: &[String]) -> Result<Self, SceneError> {
        let (root, (origin, _)) = source::document(text, name, overrides, (&[], OVER))?;
        check(root, origin)
    }

    /// What every override of the scene file at `path` sets, `set` before `over`: paths of keys with
    /// list elements by their numbers, so that two names of one place are the same.
    ///
    /// # Errors
    /// The file cannot be read or is not TOML, or an override cannot be applied.
    pub fn overridden_keys(
        path: &Path,
        set: &[String],
        over: &[String],
        option: &'static str,
    ) -> Result<Vec<String>, SceneError> {
        let (_, (_, keys)) = source::changed(path, set, (over, option))?;
        Ok(keys)
    }

    /// The same of the scene `text`.
    ///
    /// # Errors
    /// As for [`Scene::overridden_keys`].
    pub fn overridden_keys_in(
        text: &str,
        name: &str,
        overrides: &[String],
    ) -> Result<Vec<String>, SceneError> {
        Ok(source::document(text, name, overrides, (&[], OVER))?.1.1)
    }

    /// Gives `surface` in place of the file of this full path: an array of it is a field or a start without a file.
    pub fn give_surface(&mut self, path: PathBuf, surface: Surface) {
        self.surfaces.insert(path, Arc::new(surface));
    }

    /// The surface that is given in memory in place of the file `path`.
    pub(crate) fn given_surface(&self, path: &Path) -> Option<&Surface> {
        self.surfaces.get(path).map(|surface| &**surface)
    }

    /// The scene as TOML with every default written out; reads back as the same scene.
    ///
    /// # Errors
    /// An effect, policy or solver has parameters that TOML cannot hold.
    pub fn resolved(&self) -> Result<String, SceneError> {
        // By way of a value: serializing every type to text by itself is a tenth of the build.
        toml::Value::try_from(self).and_then(|value| toml::to_string(&value)).map_err(|error| {
            self.origin.error(&DocumentError::plain(format!("cannot be written as TOML: {error}")))
        })
    }

    /// An error about the table `[table]`, which is missing.
    #[must_use]
    pub fn missing_table(&self, table: &str, help: &str) -> SceneError {
        self.origin.error(&DocumentError::missing_table(table).help(help))
    }

    /// Its method to find equilibrium, for use on its own.
    #[must_use]
    pub fn into_equilibrium(self) -> Method {
        Method::new(self.equilibrium)
    }

    /// Where `path` is written, as `line 12`, or which `--set` gives it; none if the scene leaves it to a
    /// default.
    #[must_use]
    pub fn written(&self, path: &str) -> Option<String> {
        let (_, place) = self.origin.index.find_exact(path)?;
        Some(match place.source {
            0 => {
                let before = self.origin.text.get(..place.span.start).unwrap_or_default();
                format!("line {}", before.matches('\n').count() + 1)
            }
            number => self.origin.option(number - 1).1,
        })
    }

    /// Whether `--set` or `--over` gives the value at `path`, or a part of it.
    #[must_use]
    pub fn is_overridden(&self, path: &str) -> bool {
        self.origin.index.overridden(path)
    }

    /// Name of the scene's file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.origin.name
    }

    /// An error found later that the value at `path` causes, as in
    /// `error_at("kinetics.parameters.c_star", "…", None)`.
    ///
    /// It points to the value, or where the scene leaves that to a default to the innermost table
    /// around it.
    #[must_use]
    pub fn error_at(&self, path: &str, message: &str, help: Option<&str>) -> SceneError {
        let place = self.origin.index.find_nearest(path).map(|(_, value)| value);
        self.error_placed(place, DocumentError::plain(format!("{path}: {message}")), help)
    }

    /// An error about a part of the text at `path`: `span` are bytes of the text's value, which is
    /// pointed to where the scene spells it without escapes.
    #[must_use]
    pub fn error_within(
        &self,
        path: &str,
        text: &str,
        span: &Range<usize>,
        message: &str,
        help: Option<&str>,
    ) -> SceneError {
        let place =
            self.origin.index.find_nearest(path).map(|(_, value)| self.within(value, text, span));
        self.error_placed(place.as_ref(), DocumentError::plain(format!("{path}: {message}")), help)
    }

    fn within(&self, place: &Place, text: &str, span: &Range<usize>) -> Place {
        let source = match place.source {
            0 => &self.origin.text,
            k => match self.origin.overrides.get(k - 1) {
                Some(source) => source,
                None => return place.clone(),
            },
        };
        let written = source.get(place.span.clone()).unwrap_or_default();
        match written.find(text) {
            Some(offset) => {
                let start = place.span.start + offset + span.start;
                // Where something is missing there is still one character to point to.
                let end = (start + span.len().max(1)).min(place.span.end);
                Place { source: place.source, span: start..end }
            }
            None => place.clone(),
        }
    }

    /// An error about the key `key` of the table at `table`: it is none of the names `allowed`.
    ///
    /// `noun` says what it should name ("species", "parameter"). Help lists the allowed names and
    /// the nearest one.
    #[must_use]
    pub fn unknown_key(&self, table: &str, key: &str, noun: &str, allowed: &[&str]) -> SceneError {
        let place = self.origin.index.find_nearest(&path_to(table, key)).map(|(key, _)| key);
        self.error_placed(place, DocumentError::unknown_name(noun, key, allowed), None)
    }

    /// An error about the key `key` of the table at `table`, which is given and has no effect: nothing reads it.
    ///
    /// Help lists the keys `read` that have one, and the nearest of them.
    #[must_use]
    pub fn unread_key(&self, table: &str, key: &str, message: &str, read: &[&str]) -> SceneError {
        let path = path_to(table, key);
        let place = self.origin.index.find_nearest(&path).map(|(key, _)| key);
        let read: Vec<String> = read.iter().map(|name| (*name).to_owned()).collect();
        let help = crate::document::choices_in_words(key, "read", &read);
        self.error_placed(place, DocumentError::plain(format!("{path}: {message}")), Some(&help))
    }

    /// An error about the text at `path`: it is none of the names `allowed`.
    #[must_use]
    pub fn unknown_name(&self, path: &str, noun: &str, name: &str, allowed: &[&str]) -> SceneError {
        let place = self.origin.index.find_nearest(path).map(|(_, value)| value);
        self.error_placed(place, DocumentError::unknown_name(noun, name, allowed), None)
    }

    fn error_placed(
        &self,
        place: Option<&Place>,
        problem: DocumentError,
        help: Option<&str>,
    ) -> SceneError {
        let mut problem = problem;
        if let Some(help) = help {
            problem = problem.help(help);
        }
        if let Some(place) = place {
            problem = problem.placed(place);
        }
        self.origin.error(&problem)
    }
}

impl Scene {
    /// The key path of the k-th table of kinetics: `kinetics`, or `kinetics[k]` where there are
    /// several.
    #[must_use]
    pub fn kinetics_path(&self, k: usize) -> String {
        if self.kinetics.len() == 1 { "kinetics".to_owned() } else { format!("kinetics[{k}]") }
    }
}

/// The key path of the entry `key` of the table at `table`, for [`Scene::error_at`]; a key that
/// is not a bare word gets quotes.
#[must_use]
pub fn path_to(table: &str, key: &str) -> String {
    format!("{table}.{}", crate::document::key_path(&[Segment::Key(key.to_owned())]))
}

/// Reads every table; the first problem of each is reported.
fn check(mut root: Node, origin: Origin) -> Result<Scene, SceneError> {
    let mut problems = Vec::new();
    if let Value::Table(entries) = &root.value {
        for (key, _) in entries.iter().filter(|(key, _)| !TABLES.contains(&key.name.as_str())) {
            let problem = DocumentError::unknown_key(&key.name, &TABLES).placed(&key.place);
            problems.push(match misplaced_key::find(&key.name) {
                Some(path) => problem.help(format!("did you mean {path}?")),
                None => problem,
            });
        }
    }
    let mut section = Sections { root: &mut root, problems: &mut problems };
    let sheet = section.required("sheet", sheet::read_sheet);
    let material = section.optional("material", read);
    let effects = section.effects();
    let kinetics = section.optional("kinetics", kinetics::read_kinetics).unwrap_or_default();
    let source = sheet.as_ref().map(|sheet| &sheet.source);
    let point = matches!(source, Some(SheetSource::Point { .. }));
    let time = section.required("time", |node| time::read_time(node, point));
    let equilibrium = section.equilibrium();
    let stability = section.optional("stability", read);
    let invariants = section.optional("invariants", read);
    let output: OutputSpec = section.optional("output", output::read_output).unwrap_or_default();
    let checkpoint = section.optional("checkpoint", read);
    if let Some(error) = origin.report(&problems) {
        return Err(error);
    }
    let (Some(sheet), Some(time), Some(equilibrium)) = (sheet, time, equilibrium) else {
        return Err(origin.error(&DocumentError::plain("the scene is incomplete")));
    };
    let saved = |checkpoint: &CheckpointSpec| checkpoint.every;
    let saved =
        checkpoint.as_ref().and_then(saved).map_or(Ok(()), |e| time.span.check_multiples(e));
    for (table, checked) in [("output", output.check_frames(&time.span)), ("checkpoint", saved)] {
        let Err(mut problem) = checked else { continue };
        if let Some((_, every)) = origin.index.find_nearest(&format!("{table}.every")) {
            problem = problem.placed(every);
        }
        return Err(origin.error(&problem.under(table)));
    }
    Ok(Scene {
        sheet,
        material,
        effects,
        kinetics,
        time,
        equilibrium,
        stability,
        invariants,
        output,
        checkpoint,
        origin,
        file: PathBuf::new(),
        surfaces: BTreeMap::new(),
    })
}
