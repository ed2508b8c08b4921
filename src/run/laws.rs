//! The laws of a scene: loaded plugins and formulas, joined where there are several, and their
//! parameters over the sheet.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Error, Result, initial_state};
use crate::kinetics::descriptor::Default;
use crate::kinetics::formula::{
    Formula, FormulaError, FormulaIndex, FormulaKinetics, Law, LawError,
};
use crate::kinetics::validation;
use crate::kinetics::{
    Descriptor, JointKinetics, Kinetics, KineticsError, Library, Location, Member, Parameter,
    PluginSearch,
};
use crate::model::{Evaluation, ParameterFields};
use crate::num::Short;
use crate::scene::{KineticsSpec, ParameterSpec, Scene, path_to};
use crate::sheet::Sheet;

/// The laws of a scene as one.
pub struct Laws {
    /// All of them.
    pub kinetics: Arc<dyn Kinetics>,
    /// Files of the plugins among them.
    pub files: Vec<PathBuf>,
    /// The law of the host program among them, by its name and its hash.
    pub host_law: Option<[String; 2]>,
    /// The parameters of each table of the scene.
    parameters: Vec<Vec<Parameter>>,
}

/// Loads every law of the scene; `None` if it has none. A law of the host program that no table names comes last.
///
/// # Errors
/// A plugin that is not found or refused, a formula or a parameter that is wrong, names that
/// clash; with the place.
pub fn load(scene: &Scene, search: &PluginSearch, notes: &mut Vec<String>) -> Result<Option<Laws>> {
    let mut members = Vec::new();
    let mut host_law = search.host_law();
    let (mut files, mut parameters) = (Vec::new(), Vec::new());
    for (number, spec) in scene.kinetics.iter().enumerate() {
        let path = scene.kinetics_path(number);
        let (kinetics, file): (Arc<dyn Kinetics>, _) = match spec.law() {
            Some(law) => {
                let law = Law { name: path.clone(), ..law };
                (Arc::new(written(scene, &path, spec, &law, notes)?), None)
            }
            None => {
                let (kinetics, file) = loaded(scene, &path, spec, search)?;
                host_law = host_law.filter(|_| file.is_some());
                (kinetics, file)
            }
        };
        files.extend(file);
        parameters.push(kinetics.descriptor().parameters.clone());
        let (rename, shared) = (spec.rename.clone(), spec.shared.clone());
        members.push(Member { kinetics, rename, shared });
    }
    if let Some(host_law) = host_law {
        let kinetics = host_law.instantiate(&BTreeMap::new())?;
        members.push(Member { kinetics, rename: BTreeMap::new(), shared: Vec::new() });
    }
    let plain = |member: &Member| member.rename.is_empty() && member.shared.is_empty();
    let kinetics: Arc<dyn Kinetics> = match members.as_slice() {
        [] => return Ok(None),
        [one] if plain(one) => Arc::clone(&one.kinetics),
        _ => {
            let joint = JointKinetics::new(members).map_err(|e| {
                // The law of the host program has no table.
                let table = scene.kinetics_path(e.member.min(scene.kinetics.len().max(1) - 1));
                let path = if e.key.is_empty() { table } else { format!("{table}.{}", e.key) };
                scene.error_at(&path, &e.message, None)
            })?;
            Arc::new(joint)
        }
    };
    for (number, spec) in scene.kinetics.iter().enumerate() {
        check_names(scene, number, spec, kinetics.descriptor())?;
    }
    let host_law = search.host_law().map(|law| [law.name(), law.digest()].map(str::to_owned));
    Ok(Some(Laws { kinetics, files, host_law, parameters }))
}

/// Refuses names that frames use for something else.
fn check_names(scene: &Scene, number: usize, spec: &KineticsSpec, all: &Descriptor) -> Result<()> {
    let names = all.species.iter().map(|s| &s.name).chain(all.observables.iter().map(|o| &o.name));
    for name in names.filter(|name| super::fields::is_built_in(name)) {
        let table = scene.kinetics_path(number);
        let under = |part: &str, key: &str| path_to(&format!("{table}.{part}"), key);
        let renamed = spec.rename.iter().find(|(_, new)| *new == name);
        let (path, help) = if let Some((old, _)) = renamed {
            (under("rename", old), None)
        } else if spec.observables.contains_key(name) {
            (under("observables", name), None)
        } else if spec.rates.contains_key(name) {
            (under("rates", name), None)
        } else if spec.plugin.is_some() {
            let help = format!("rename = {{ {name} = \"…\" }} gives it another name here");
            (format!("{table}.plugin"), Some(help))
        } else {
            continue;
        };
        let message = format!("frames have a field `{name}` of their own");
        return Err(scene.error_at(&path, &message, help.as_deref()).into());
    }
    Ok(())
}

/// The laws of a scene and the values of parameters that vary over its sheet, without the rest of the scene.
///
/// # Errors
/// As for [`load`] and [`parameter_fields`], and if the scene has no law.
pub fn load_with_parameter_fields(
    scene: &Scene,
    search: &PluginSearch,
) -> Result<(Laws, ParameterFields)> {
    let none = || scene.missing_table("kinetics", "this scene has no law");
    let laws = load(scene, search, &mut Vec::new())?.ok_or_else(none)?;
    if !vary(scene) {
        return Ok((laws, ParameterFields::default()));
    }
    let sheet = super::read_sheet(scene, &mut Vec::new())?;
    let location = super::location(scene, Some(laws.kinetics.as_ref()));
    let fields = parameter_fields(scene, &sheet, location, &laws)?;
    Ok((laws, fields))
}

/// Whether some parameter differs from place to place.
fn vary(scene: &Scene) -> bool {
    let mut parameters = scene.kinetics.iter().flat_map(|spec| spec.parameters.values());
    parameters.any(|value| value.uniform().is_none())
}

/// Inspects the laws where a run begins: whether they are pure, and whether derivatives are right.
///
/// # Errors
/// A law that fails there, or gives different results for the same inputs.
pub fn validate(at: &mut Evaluation<'_>) -> Result<Vec<String>> {
    let (model, state) = (at.model(), at.state());
    let Some(chemistry) = model.chemistry() else { return Ok(Vec::new()) };
    let mut tried = || -> Result<Vec<String>> {
        let species: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
        Ok(chemistry.with_inputs(&species, at.signals()?, validation::trial)?)
    };
    tried().map_err(|error| super::located(error, model.sheet(), &state.x))
}

/// A law that the scene writes out.
fn written(
    scene: &Scene,
    path: &str,
    spec: &KineticsSpec,
    law: &Law,
    notes: &mut Vec<String>,
) -> Result<FormulaKinetics> {
    let taken = |name: &String| law.species.iter().any(|s| s.name == *name);
    for (table, mut names) in [
        ("parameters", spec.parameters.keys().collect::<Vec<_>>().into_iter()),
        ("observables", spec.observables.keys().collect::<Vec<_>>().into_iter()),
    ] {
        if let Some(name) = names.find(|name| taken(name)) {
            let path = path_to(&format!("{path}.{table}"), name);
            return Err(scene.error_at(&path, "a species has this name already", None).into());
        }
    }
    let kinetics = FormulaKinetics::new(law).map_err(|e| formula_error(scene, path, law, &e))?;
    let measured: Vec<&str> =
        spec.parameters.keys().chain(spec.observables.keys()).map(String::as_str).collect();
    if let Some(name) = spec.units.keys().find(|name| !measured.contains(&name.as_str())) {
        let table = format!("{path}.units");
        return Err(scene.unknown_key(&table, name, "parameter or observable", &measured).into());
    }
    if let Some(species) = law.species.iter().find(|s| s.lower >= s.upper) {
        let table = path_to(&format!("{path}.species"), &species.name);
        let message =
            format!("the range from {} to {} is empty", Short(species.lower), Short(species.upper));
        return Err(scene
            .error_at(&table, &message, Some("lower is the lesser of the two"))
            .into());
    }
    let shared = |name: &String| scene.kinetics.iter().any(|spec| spec.shared.contains(name));
    let still = |name: &&String| !spec.rates.contains_key(*name) && !shared(name);
    for name in spec.species.keys().filter(still) {
        notes.push(format!(
            "the species `{name}` of {path} has no rate, and changes by diffusion only; if it is \
             another law's, say shared = [\"{name}\"]"
        ));
    }
    unread(scene, path, (spec, &kinetics), notes)?;
    Ok(kinetics)
}

/// Notes parameters and `let`s that nothing of a law reads.
///
/// # Errors
/// One that an override gives: runs that differ in nothing else would be the same.
fn unread(
    scene: &Scene,
    path: &str,
    (spec, kinetics): (&KineticsSpec, &FormulaKinetics),
    notes: &mut Vec<String>,
) -> Result<()> {
    let tables = [
        (
            "parameters",
            "parameter",
            spec.parameters.keys().collect::<Vec<_>>(),
            kinetics.unused_parameters(),
        ),
        ("let", "`let`", spec.r#let.keys().collect(), kinetics.unused_lets()),
    ];
    for (table, noun, all, unused) in tables {
        let table = format!("{path}.{table}");
        for name in unused {
            if scene.is_overridden(&path_to(&table, name)) {
                let all = all.iter().map(|name| name.as_str());
                let read: Vec<&str> =
                    all.filter(|name| !unused.iter().any(|u| u == name)).collect();
                let message =
                    format!("no formula of the law reads this {noun}: its value changes nothing");
                return Err(scene.unread_key(&table, name, &message, &read).into());
            }
            notes.push(format!("no formula of {path} reads its {noun} `{name}`"));
        }
    }
    Ok(())
}

/// The law of a plugin, with its file; or that of the caller, which has none.
fn loaded(
    scene: &Scene,
    path: &str,
    spec: &KineticsSpec,
    search: &PluginSearch,
) -> Result<(Arc<dyn Kinetics>, Option<PathBuf>)> {
    let plugin = spec.plugin.as_deref().unwrap_or_default();
    let blame = |error: KineticsError| {
        let path = match &error {
            KineticsError::UnknownParameter { name, .. }
            | KineticsError::ParameterOutOfBounds { name, .. } => {
                path_to(&format!("{path}.parameters"), name)
            }
            _ => format!("{path}.plugin"),
        };
        Error::Scene(scene.error_at(&path, &error.to_string(), None))
    };
    if let Some(host_law) = search.host_law_named(plugin) {
        let given = uniform(spec, host_law.descriptor());
        return Ok((host_law.instantiate(&given).map_err(blame)?, None));
    }
    let file = search.resolve(plugin, Path::new("")).map_err(blame)?;
    let plugin = Library::load(&file).map_err(blame)?;
    let given = uniform(spec, plugin.descriptor());
    Ok((Arc::new(plugin.instantiate(&given).map_err(blame)?), Some(file)))
}

/// The parameters that are numbers. A field leaves the instance its default; a name that is not known gets a number, and
/// is refused with it.
fn uniform(spec: &KineticsSpec, descriptor: &Descriptor) -> BTreeMap<String, f64> {
    let known = |name: &String| descriptor.parameters.iter().any(|p| p.name == *name);
    let number = |(name, value): (&String, &ParameterSpec)| {
        let value = value.uniform().or((!known(name)).then_some(0.0))?;
        Some((name.clone(), value))
    };
    spec.parameters.iter().filter_map(number).collect()
}

/// The error with its place in the scene.
fn formula_error(scene: &Scene, table: &str, law: &Law, error: &LawError) -> Error {
    let named = |part: &str, formula: &Formula| {
        (path_to(&format!("{table}.{part}"), &formula.name), formula.text.clone())
    };
    let (path, text) = match error.formula {
        FormulaIndex::Let(k) => named("let", &law.lets[k]),
        FormulaIndex::Rate(k) => named("rates", &law.rates[k]),
        FormulaIndex::Feedback(k) => {
            let (which, text) = &law.feedback[k];
            (format!("{table}.{}", which.name()), text.clone())
        }
        FormulaIndex::Observable(k) => {
            let (observable, text) = &law.observables[k];
            (path_to(&format!("{table}.observables"), &observable.name), text.clone())
        }
    };
    let FormulaError { span, message, help } = &error.error;
    let unknown = text.get(span.clone()).unwrap_or_default();
    let elsewhere = |spec: &&KineticsSpec| {
        spec.rates.contains_key(unknown)
            || spec.plugin.is_some() && spec.initial.contains_key(unknown)
    };
    let foreign =
        help.is_some() && !law.has(unknown) && scene.kinetics.iter().any(|spec| elsewhere(&spec));
    let hint = format!(
        "`{unknown}` is a species of another law: to read it here, add species.{unknown} = {{}}; the \
         later of the two tables says shared = [\"{unknown}\"]"
    );
    let product = format!("`{unknown}` is a value of this law: to multiply, write {unknown}*(…)");
    let called = message.starts_with("unknown function") && law.has(unknown);
    let help = match (called, foreign) {
        (true, _) => Some(product.as_str()),
        (_, true) => Some(hint.as_str()),
        _ => help.as_deref(),
    };
    Error::Scene(scene.error_within(&path, &text, span, message, help))
}

/// The parameters at every point where species live, if any differ from point to point.
///
/// # Errors
/// A field that cannot be read, or with a value out of bounds; with the place and the point.
pub fn parameter_fields(
    scene: &Scene,
    sheet: &Sheet,
    location: Location,
    laws: &Laws,
) -> Result<ParameterFields> {
    if !vary(scene) {
        return Ok(ParameterFields::default());
    }
    let points = initial_state::points(sheet, location);
    let mut all: Vec<Vec<f64>> = Vec::new();
    let uniform = laws.kinetics.parameters();
    for (number, spec) in scene.kinetics.iter().enumerate() {
        let table = format!("{}.parameters", scene.kinetics_path(number));
        let first = all.len();
        for parameter in &laws.parameters[number] {
            let path = path_to(&table, &parameter.name);
            let values = match (spec.parameters.get(&parameter.name), parameter.default) {
                (Some(ParameterSpec::Formula(text)), _) => {
                    let path = format!("{path}.formula");
                    initial_state::from_formula(scene, &path, &text.formula, (sheet, location))?
                }
                (Some(ParameterSpec::File(file)), _) => {
                    initial_state::from_file(scene, &path, file, (sheet, location))?
                }
                (Some(ParameterSpec::Regions(field)), _) => {
                    initial_state::by_region(scene, &path, field, (sheet, location))?
                }
                (None, Default::SameAs(earlier)) => all[first + earlier].clone(),
                _ => vec![uniform[all.len()]],
            };
            if let Some(point) = values.iter().position(|value| !parameter.allows(*value)) {
                let message = format!(
                    "is {} at {} {point} (x = {}, y = {}, z = {}); allowed: {}",
                    Short(values[point]),
                    location.noun(),
                    Short(points[point].x),
                    Short(points[point].y),
                    Short(points[point].z),
                    parameter.range()
                );
                return Err(scene.error_at(&path, &message, None).into());
            }
            all.push(values);
        }
    }
    // The law of the caller comes last.
    all.extend(uniform[all.len()..].iter().map(|value| vec![*value]));
    Ok(ParameterFields::new(all))
}
