//! Makes a scene ready to run.

use std::cell::LazyCell;
use std::sync::Arc;

use super::beginning::Beginning;
use super::binding::{self, Bound};
use super::breakpoints::Breakpoints;
use super::built::Built;
use super::invariants::Invariants;
use super::processor::Processor;
use super::simulation::Simulation;
use super::{Error, Fields, Result, laws, notes, planar, scale_checks, start};
use crate::Vec3;
use crate::effects::{EffectContext, Material};
use crate::geometry::{Faces, VertexArea};
use crate::kinetics::{Kinetics, Location, Search, Signal, SignalRead};
use crate::model::{Chemistry, Drag, Mechanics, Model, ParameterFields, Signals};
use crate::scene::{Scene, SheetSource};
use crate::sheet::{self, Sheet};
use crate::solve::{Integrator, Relaxer, Workspace};

/// The material of a scene in plain numbers.
#[must_use]
pub fn material(scene: &Scene) -> Option<Material> {
    scene.material.as_ref().map(|material| Material {
        young: material.young.get(),
        poisson: material.poisson.get(),
        thickness: material.thickness.get(),
    })
}

/// Refuses what a scene without a material, or without space, cannot have.
fn check_basis(scene: &Scene, kinetics: Option<&dyn Kinetics>) -> Result<()> {
    let signals: Vec<SignalRead> = kinetics
        .map(Kinetics::descriptor)
        .map(|d| d.signals.iter().chain(&d.observed).copied().collect())
        .unwrap_or_default();
    if matches!(scene.sheet.source, SheetSource::Point { .. }) {
        if !scene.effects.is_empty() {
            let message = "a point has no shape and no neighbours: no effect acts on it";
            return Err(scene.error_at("effect[0]", message, None).into());
        }
        if let Some(read) = signals.iter().find(|read| read.signal != Signal::Time) {
            let message = format!(
                "this plugin reads the signal {}, which a point does not have",
                read.signal.name()
            );
            let help = "give the scene a sheet, as shape = \"disc\"";
            return Err(scene.error_at("kinetics", &message, Some(help)).into());
        }
        if kinetics.is_none() {
            let help = "a point has only chemistry";
            return Err(scene.missing_table("kinetics", help).into());
        }
    }
    let chemical = scene.effects.iter().position(|e| e.needs().species);
    if kinetics.is_none()
        && let Some(number) = chemical
    {
        let name = scene.effects[number].name();
        let message = format!("{name} needs species, and the scene has no kinetics");
        let path = format!("effect[{number}].kind");
        return Err(scene.error_at(&path, &message, Some("add a [kinetics] table")).into());
    }
    let needing = scene.effects.iter().find(|e| e.needs().material).map(|e| e.name());
    let tension = signals.iter().any(|read| read.signal == Signal::Tension);
    if scene.material.is_none() && (needing.is_some() || tension) {
        let what = needing.unwrap_or_else(|| "the signal tension".into());
        let help = format!("{what} needs young, poisson and thickness");
        return Err(scene.missing_table("material", &help).into());
    }
    Ok(())
}

/// Makes `scene` ready to run.
///
/// # Errors
/// A mesh, plugin, parameter, effect or field that does not fit, with its place in the scene.
pub(super) fn prepare(scene: &Scene, search: &Search) -> Result<Simulation> {
    let mut built = Built::begin();
    let mut notes = Vec::new();
    let sheet = Arc::new(read_sheet(scene, &mut notes)?);
    let material = material(scene);
    if let Some(material) = &material {
        scale_checks::check(scene, &sheet, material)?;
    }
    notes::on_scene(scene, &sheet, &mut notes);
    let laws = laws::load(scene, search, &mut notes)?;
    let kinetics = laws.as_ref().map(|laws| Arc::clone(&laws.kinetics));
    check_basis(scene, kinetics.as_deref())?;
    let planar = scene.sheet.planar;
    if planar {
        planar::check(scene, &sheet)?;
        planar::note_signals(kinetics.as_deref(), &mut notes);
    }
    let location = location(scene, kinetics.as_deref());

    let measure = scene.kinetics.first().map(|k| k.measure).unwrap_or_default();
    let context = EffectContext {
        sheet: &sheet,
        material: material.as_ref(),
        kinetics: kinetics.as_ref().map(|k| (k.descriptor(), location)),
        measure,
    };
    let Bound { mechanics, transports, growth } =
        binding::effects(scene, &context, &mut built, &mut notes)?;
    let mechanics = Mechanics::of(Arc::clone(&sheet), mechanics)?;
    if mechanics.is_empty() && scene.stability.as_ref().is_some_and(|s| s.watch) {
        let message = "the scene lists no effect with an energy: nothing to watch";
        return Err(scene.error_at("stability", message, None).into());
    }
    let relaxer = relaxer(scene, &mechanics, &mut notes)?;
    let rule = scene.effects.iter().find_map(|effect| effect.vertex_area());
    let area = VertexArea::when_asked(rule.unwrap_or_default());
    let rest_area: LazyCell<Arc<[f64]>, _> = LazyCell::new(|| rest_areas(&sheet).into());
    let rest_area = |wanted: &[Signal]| match wanted.contains(&Signal::AreaRatio) {
        true => Arc::clone(&rest_area),
        false => Arc::default(),
    };
    let parameters = match &laws {
        Some(laws) => laws::parameter_fields(scene, &sheet, location, laws)?,
        None => ParameterFields::default(),
    };
    let plugins = laws.map(|laws| laws.files).unwrap_or_default();
    let chemistry = kinetics.map(|kinetics| {
        let wanted = kinetics.descriptor().signals.iter().map(|read| read.signal);
        let wanted: Vec<Signal> = wanted.collect();
        let rest_area = rest_area(&wanted);
        let reading = scene.kinetics.first().map(|k| k.tension).unwrap_or_default();
        let of = material.as_ref();
        let signals =
            Signals::new(wanted, location, area.clone(), of, reading, rest_area).in_plane(planar);
        Chemistry::new(&sheet, kinetics, parameters, location, signals, transports, measure)
    });
    let state = start::state(scene, &sheet, chemistry.as_ref())?;
    let storage = scene.time.policy.storage();
    let integrator = integrator(scene, &mechanics)?;
    let fields =
        Fields::new(scene, chemistry.as_ref(), area.clone(), &rest_area, material.as_ref())?;
    let drag = drag(scene, &mechanics, &mut notes)?;
    let model = Arc::new(Model::new(mechanics, chemistry, storage, drag).growing(growth));
    let mut workspace = Workspace::new(model, relaxer);
    let invariants = Invariants::of(scene, &mut workspace, &state)?;
    let faults = Vec::new();
    built.end(workspace.model.tally());
    let spent = crate::tally::Spent::default();
    let mut simulation = Simulation {
        area,
        workspace,
        state,
        at_rest: false,
        integrator,
        plugins,
        fields,
        notes,
        faults,
        built,
        breakpoints: Breakpoints::default(),
        invariants,
        spent,
        processor: Processor::default(),
    };
    if let Some(path) = &scene.time.span.from {
        Beginning::take(path, scene, &mut simulation)?;
    }
    // A start that no sheet can have is refused; later a run would end with it.
    simulation.evaluate().length_factor()?;
    simulation.breakpoints = Breakpoints::of(scene, &mut simulation.evaluate());
    simulation.notes.extend(simulation.breakpoints.note.clone());
    Ok(simulation)
}

/// The integrator of `scene`, if it can do with what its effects ask for.
fn integrator(scene: &Scene, mechanics: &Mechanics) -> Result<Box<dyn Integrator>> {
    let storage = scene.time.policy.storage();
    let integrator = scene
        .time
        .integrator
        .build(storage)
        .map_err(|e| scene.error_at("time.integrator", &e.to_string(), None))?;
    if (mechanics.has_low_rank() || mechanics.couples_pairs())
        && scene.time.integrator.needs_sparse_motion(storage)
    {
        let message = "this integrator needs derivatives that couple neighbours only, but an \
            effect of the scene (such as volume) couples all vertices";
        let help = "integrator = \"staggered\" supports all effects under every policy";
        return Err(scene.error_at("time.integrator", message, Some(help)).into());
    }
    if mechanics.is_constrained() && !scene.time.integrator.keeps_constraints(storage) {
        let names = mechanics.constraint_names().collect::<Vec<_>>().join(", ");
        let message =
            format!("this integrator does not keep constraints, and the scene has some ({names})");
        let help = "integrator = \"staggered\" keeps them under every policy, and so does \
                    integrator = { kind = \"explicit\", method = \"euler\" }";
        return Err(scene.error_at("time.integrator", &message, Some(help)).into());
    }
    Ok(integrator)
}

/// The drag of `scene`, if its integrator knows it.
fn drag(scene: &Scene, mechanics: &Mechanics, notes: &mut Vec<String>) -> Result<Drag> {
    let storage = scene.time.policy.storage();
    let drag = scene.material.as_ref().map_or_else(Default::default, |material| material.drag);
    let drag = drag.on(mechanics);
    if storage.mechanics > 0.0 && !mechanics.is_empty() {
        notes::on_drag(scene, &drag, notes);
    }
    let known = storage.mechanics == 0.0 || scene.time.integrator.knows_directions_of_drag();
    if !drag.is_isotropic() && !known {
        let message = "this integrator takes drag to be the same in all directions";
        let help = "integrator = \"staggered\" with shape = \"sdirk2\" (its default) or \"euler\" knows \
            drag along the normal and in the plane";
        return Err(scene.error_at("material.drag", message, Some(help)).into());
    }
    Ok(drag)
}

/// How the shape is relaxed; `None` where it does not move.
fn relaxer(
    scene: &Scene,
    mechanics: &Arc<Mechanics>,
    notes: &mut Vec<String>,
) -> Result<Option<Relaxer>> {
    if mechanics.is_empty() {
        if let Some(name) = mechanics.constraint_names().next() {
            let message =
                format!("{name} is a constraint, but the scene lists no effect with an energy");
            let help = "add [[effect]] kind = \"stretching\"";
            return Err(scene.error_at("effect", &message, Some(help)).into());
        }
        return Ok(None);
    }
    let mut potential = crate::model::Potential::new(mechanics);
    if !(potential.force_scale() > 0.0) {
        let message = "no effect of the scene resists stretching";
        let help = "add [[effect]] kind = \"stretching\"";
        return Err(scene.error_at("effect", message, Some(help)).into());
    }
    if mechanics.is_planar() {
        planar::note_forces(&mut potential, notes);
    }
    if potential.constraints_depend() {
        let names = mechanics.constraint_names().collect::<Vec<_>>().join(", ");
        let message =
            format!("the constraints {names} act along the same force and cannot all be met");
        return Err(scene
            .error_at("effect", &message, Some("leave out all but one of them"))
            .into());
    }
    notes::on_rest_shape(scene, &mut potential, notes);
    notes::on_loads(
        &mut potential,
        scene.equilibrium.tolerance(),
        scene.time.span.until.get(),
        notes,
    );
    let (tolerance, max_iterations) =
        (scene.equilibrium.tolerance(), scene.equilibrium.max_iterations());
    let equilibrium = scene.equilibrium.build(mechanics)?;
    Ok(Some(Relaxer { equilibrium, tolerance, max_iterations }))
}

/// Says where the point is that an error blames.
pub(crate) fn located(mut error: Error, sheet: &Sheet, x: &[Vec3]) -> Error {
    if let Error::Kinetics(kinetics) = &mut error
        && let Some(site) = kinetics.site_mut()
    {
        let corners: &[u32] = match site.location {
            "vertex" => &[crate::num::index(site.point)],
            "edge" => sheet.edges().get(site.point).map_or(&[], |edge| &edge.vertices),
            _ => sheet.triangles().get(site.point).map_or(&[], |corners| corners),
        };
        let places: Vec<&Vec3> = corners.iter().filter_map(|v| x.get(*v as usize)).collect();
        if !places.is_empty() {
            let mean = places.iter().copied().sum::<Vec3>() / crate::num::real(places.len());
            site.position = Some(mean.into());
        }
    }
    error
}

pub(crate) fn rest_areas(sheet: &Sheet) -> Vec<f64> {
    let mut faces = Faces::default();
    faces.update(sheet, sheet.rest());
    faces.all().iter().map(|f| f.area).collect()
}

pub(crate) fn read_sheet(scene: &Scene, notes: &mut Vec<String>) -> Result<Sheet> {
    let refuse = |key: &str, e: &sheet::SheetError| {
        Error::Scene(scene.error_at(&format!("sheet.{key}"), &e.to_string(), None))
    };
    match &scene.sheet.source {
        SheetSource::File { file } => {
            let surface = sheet::read::surface(file).map_err(|e| refuse("file", &e))?;
            let (sheet, findings) = surface.into_sheet().map_err(|e| refuse("file", &e))?;
            notes.extend(findings.iter().map(ToString::to_string));
            Ok(sheet)
        }
        SheetSource::Point { .. } => {
            Sheet::new(vec![Vec3::zeros()], Vec::new()).map_err(|e| refuse("shape", &e))
        }
        SheetSource::Generated(shape) => {
            let (shape, vertices, seed) = start::shape(shape);
            sheet::generate(&shape, vertices, seed).map_err(|e| refuse("shape", &e))
        }
    }
}

pub(crate) fn location(scene: &Scene, kinetics: Option<&dyn Kinetics>) -> Location {
    let chosen = scene.kinetics.first().and_then(|k| k.location);
    let usual = || kinetics.and_then(|k| k.descriptor().species.first().map(|s| s.location));
    chosen.or_else(usual).unwrap_or(Location::Vertex)
}
