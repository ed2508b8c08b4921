//! Sets a scene up: reads its sheet and laws, binds its effects, takes its start.

use std::cell::LazyCell;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::invariants::Invariants;
use super::laws::{self, Laws};
use super::ranks::RankPart;
use super::simulation::{Simulation, mesh_record};
use super::{
    Error, Fields, Result, initial_state, lints, planar, scale_checks, typical_magnitudes,
};
use crate::Stepper;
use crate::effects::{
    Effect, EffectContext, EffectError, EffectParts, EffectSpec, MaterialField, ReadSurface,
    SceneSummary,
};
use crate::geometry::face_areas;
use crate::kinetics::{Kinetics, Location, PluginSearch, Signal};
use crate::model::{Model, ParameterFields, Potential, State};
use crate::output::provenance::MeshRecord;
use crate::problem::{Law, Problem, ProblemError, ProblemPart};
use crate::reduction::Communicator;
use crate::run::initial_state::read_surface;
use crate::run::{location, read_sheet};
use crate::scene::{Scene, SheetSource};
use crate::sheet::{self, Sheet, Subdomain};
use crate::tally::Tally;

/// The material of a scene on its sheet.
///
/// # Errors
/// A field that cannot be read there, with its place.
pub fn material(scene: &Scene, sheet: &Sheet) -> Result<Option<MaterialField>> {
    material_read_by(scene, sheet, &|file| read_surface(scene, sheet, file))
}

fn material_read_by(
    scene: &Scene,
    sheet: &Sheet,
    read: &ReadSurface<'_>,
) -> Result<Option<MaterialField>> {
    let Some(material) = &scene.material else { return Ok(None) };
    let placed = |key: &'static str| {
        move |e: EffectError| {
            scene.error_at(&format!("material.{key}"), &e.message, e.help.as_deref())
        }
    };
    let (place, read) = (Location::Face, Some(read));
    let young = material.young.on(place, sheet, read, "young").map_err(placed("young"))?;
    let poisson = material.poisson.on(place, sheet, read, "poisson").map_err(placed("poisson"))?;
    let thickness =
        material.thickness.on(place, sheet, read, "thickness").map_err(placed("thickness"))?;
    Ok(Some(MaterialField { young, poisson, thickness }))
}

/// Refuses what a point cannot have.
fn check_point(scene: &Scene, kinetics: Option<&dyn Kinetics>) -> Result<()> {
    if !matches!(scene.sheet.source, SheetSource::Point { .. }) {
        return Ok(());
    }
    if !scene.effects.is_empty() {
        let message = "a point has no shape and no neighbours: no effect acts on it";
        return Err(scene.error_at("effect[0]", message, None).into());
    }
    let Some(kinetics) = kinetics else {
        let help = "a point has only chemistry";
        return Err(scene.missing_table("kinetics", help).into());
    };
    let descriptor = kinetics.descriptor();
    let mut signals = descriptor.signals.iter().chain(&descriptor.observed);
    if let Some(read) = signals.find(|read| read.signal != Signal::Time) {
        let message = format!(
            "this plugin reads the signal {}, which a point does not have",
            read.signal.name()
        );
        let help = "give the scene a sheet, as shape = \"disc\"";
        return Err(scene.error_at("kinetics", &message, Some(help)).into());
    }
    Ok(())
}

impl Simulation {
    /// Makes `scene` ready to run; plugins are looked for as `search` says.
    ///
    /// # Errors
    /// A mesh, plugin, parameter, effect or field that does not fit, with its place in the scene.
    pub fn new(scene: &Scene, search: &PluginSearch) -> Result<Self> {
        let mut notes = Vec::new();
        let sheet = Arc::new(read_sheet(scene, &mut notes)?);
        if !sheet.reduction().periods().is_empty() {
            super::ranks::check(scene, true)?;
        }
        set_up(scene, search, (sheet, None), notes)
    }

    /// The same on the sheet of an earlier simulation of the scene, or of one that differs in no key of `[sheet]`.
    ///
    /// # Errors
    /// As for [`Simulation::new`].
    pub fn on_sheet(scene: &Scene, search: &PluginSearch, sheet: &Arc<Sheet>) -> Result<Self> {
        set_up(scene, search, (Arc::clone(sheet), None), Vec::new())
    }

    /// The same over several ranks: each keeps its part of the sheet, and all take the same steps.
    ///
    /// # Errors
    /// As for [`Simulation::new`], on any rank; what does not go over ranks; fewer vertices than ranks.
    pub fn over(
        scene: &Scene,
        search: &PluginSearch,
        ranks: Arc<dyn Communicator>,
    ) -> Result<Self> {
        super::ranks::check(scene, false)?;
        let mut notes = Vec::new();
        let place = |e: sheet::SheetError| scene.error_at("sheet", &e.to_string(), None);
        let (around, part, mesh) = match initial_state::lattice(scene)? {
            Some(lattice) => {
                let (around, part) = Subdomain::of_lattice(&lattice, ranks).map_err(place)?;
                (around, part, MeshRecord::new(lattice.points(), lattice.triangles()))
            }
            None => {
                let whole = read_sheet(scene, &mut notes)?;
                let part = Subdomain::cut(&whole, ranks).map_err(place)?;
                let mesh = mesh_record(&whole);
                (whole, part, mesh)
            }
        };
        let sheet = Arc::new(part.sheet.clone());
        set_up(scene, search, (sheet, Some((around, RankPart::new(part, mesh)))), notes)
    }
}

/// Makes `scene` ready to run on its sheet, or on a part of the whole.
fn set_up(
    scene: &Scene,
    search: &PluginSearch,
    (sheet, of): (Arc<Sheet>, Option<(Sheet, RankPart)>),
    mut notes: Vec<String>,
) -> Result<Simulation> {
    let began = Instant::now();
    let read = |file: &Path| {
        let mut surface = read_surface(scene, &sheet, file)?;
        if let Some((_, rank_part)) = &of {
            rank_part.part.restrict_surface(&mut surface);
        }
        Ok(surface)
    };
    let material = material_read_by(scene, &sheet, &read)?;
    for of in material.iter().flat_map(|material| [material.largest(), material.smallest()]) {
        scale_checks::check(scene, &sheet, &of)?;
    }
    lints::on_scene(scene, &sheet, material.as_ref(), &mut notes);
    let laws = laws::load(scene, search, &mut notes)?;
    let kinetics = laws.as_ref().map(|laws| laws.kinetics.as_ref());
    check_point(scene, kinetics)?;
    if scene.sheet.planar {
        planar::note_curvature_signals(kinetics, &mut notes);
    }
    let problem = problem(scene, &sheet, material.as_ref(), laws.as_ref(), of.as_ref())?;
    let problem = problem.with_surface_reader(&read);
    let (mut stepper, effects) = bound(scene, &problem, &mut notes)?;
    let model = Arc::clone(stepper.model());
    note_model(scene, &model, &mut notes)?;
    stepper.state = initial_state(scene, &sheet, of.as_ref(), &model)?;
    let fields = fields(scene, &stepper, material.as_ref())?;
    let invariants = Invariants::new(scene, &mut stepper)?;
    let tally = stepper.model().tally();
    let known: Duration = tally.costs().into_iter().map(|cost| cost.time).sum();
    tally.meter("preparation", "setup").add(began.elapsed().saturating_sub(known));
    let (plugins, host_law) = laws.map(|laws| (laws.files, laws.host_law)).unwrap_or_default();
    let mut simulation = Simulation {
        stepper,
        plugins,
        host_law,
        fields,
        notes,
        faults: Vec::new(),
        effects,
        began,
        invariants,
        spent: crate::tally::Spent::default(),
        rank_part: of.map(|(_, part)| part),
    };
    start(scene, &mut simulation)?;
    Ok(simulation)
}

/// The start, in which the imperfection displaces nothing along fixed directions: what it displaced there would stay.
fn initial_state(
    scene: &Scene,
    sheet: &Sheet,
    of: Option<&(Sheet, RankPart)>,
    model: &Model,
) -> Result<State> {
    let around = of.map_or(sheet, |(around, _)| around);
    let here = |state| match of {
        None => state,
        Some((_, rank_part)) => super::ranks::restricted(&rank_part.part, state),
    };
    let mut state = here(initial_state::state(scene, around, model)?);
    if scene.sheet.imperfection.is_some() {
        let x = initial_state::smooth_positions(scene, around);
        let smooth = here(State { x, ..State::default() });
        model.mechanics().keep_pins(&smooth.x, &mut state.x);
    }
    Ok(state)
}

/// Refuses a start that no sheet can have: later a run would end with it.
fn start(scene: &Scene, simulation: &mut Simulation) -> Result<()> {
    typical_magnitudes::set(scene, &mut simulation.stepper, &mut simulation.notes);
    let factor = simulation.evaluate().length_factor()?.map(std::borrow::Cow::into_owned);
    let sheet = simulation.stepper.model().sheet();
    scale_checks::check_length_factor(scene, sheet, &factor.unwrap_or_default())?;
    simulation.evaluate().curvature()?;
    simulation.notes.extend(simulation.stepper.find_breakpoints());
    let Stepper { workspace, state, .. } = &simulation.stepper;
    lints::on_diffusion(&workspace.model, state, &mut simulation.notes);
    lints::on_stability(scene, workspace, &mut simulation.notes);
    Ok(())
}

/// What is written in frames.
fn fields(scene: &Scene, stepper: &Stepper, material: Option<&MaterialField>) -> Result<Fields> {
    let model = stepper.model();
    let rest_area: LazyCell<Arc<[f64]>, _> =
        LazyCell::new(|| face_areas(model.sheet(), model.sheet().rest()).into());
    let rest_area = |wanted: &[Signal]| match wanted.contains(&Signal::AreaRatio) {
        true => Arc::clone(&rest_area),
        false => Arc::default(),
    };
    Fields::new(scene, model, stepper.area.clone(), &rest_area, material)
}

/// The model of `scene` on `sheet`, which is that of the scene, with the shape at rest and no species. Its work is counted
/// with `tally`.
///
/// # Errors
/// What does not fit, with its place in the scene.
pub(super) fn model(
    scene: &Scene,
    sheet: &Arc<Sheet>,
    (search, tally): (&PluginSearch, &Tally),
) -> Result<(Model, State)> {
    let material = material(scene, sheet)?;
    let laws = laws::load(scene, search, &mut Vec::new())?;
    let problem = problem(scene, sheet, material.as_ref(), laws.as_ref(), None)?;
    let read = |file: &Path| read_surface(scene, sheet, file);
    let problem = problem.with_surface_reader(&read);
    problem.with_tally(tally.clone()).model().map_err(|error| placed(scene, &error))
}

/// The same with the start of `scene`.
///
/// # Errors
/// As for [`model`], and a start that no sheet can have.
pub(crate) fn model_with_start(
    scene: &Scene,
    sheet: &Arc<Sheet>,
    with: (&PluginSearch, &Tally),
) -> Result<(Model, State)> {
    let (model, _) = model(scene, sheet, with)?;
    let start = initial_state(scene, sheet, None, &model)?;
    Ok((model, start))
}

/// The problem that `scene` states.
fn problem<'a>(
    scene: &'a Scene,
    sheet: &Arc<Sheet>,
    material: Option<&MaterialField>,
    laws: Option<&Laws>,
    of: Option<&(Sheet, RankPart)>,
) -> Result<Problem<'a>> {
    let location = location(scene, laws.map(|laws| laws.kinetics.as_ref()));
    let parameters = match laws {
        Some(laws) => match of {
            None => laws::parameter_fields(scene, sheet, location, laws)?,
            Some((around, rank_part)) => {
                let mut fields = laws::parameter_fields(scene, around, location, laws)?;
                fields.at_points.iter_mut().for_each(|values| rank_part.part.restrict(values));
                fields
            }
        },
        None => ParameterFields::default(),
    };
    let first = scene.kinetics.first();
    let law = laws.map(|laws| Law {
        kinetics: Arc::clone(&laws.kinetics),
        parameters,
        location: Some(location),
        measure: first.map(|k| k.measure).unwrap_or_default(),
        tension: first.map(|k| k.tension).unwrap_or_default(),
        boundary: first.map(|k| k.boundary).unwrap_or_default(),
    });
    let drag =
        scene.material.as_ref().map_or_else(Default::default, |material| material.drag.clone());
    Ok(Problem::on(Arc::clone(sheet))
        .planar(scene.sheet.planar)
        .elasticity(material.cloned())
        .effects(&scene.effects)
        .law(law)
        .policy(scene.time.policy)
        .drag(drag)
        .stabilisation(scene.time.span.stabilisation.map(f64::from))
        .start(scene.time.span.start)
        .until(scene.time.span.until.get())
        .with_solvers(&*scene.time.integrator, &*scene.equilibrium))
}

/// The stepper of `problem`, which `scene` states, and what each of its effects contributes.
fn bound(
    scene: &Scene,
    problem: &Problem<'_>,
    notes: &mut Vec<String>,
) -> Result<(Stepper, Vec<EffectParts>)> {
    let mut parts = Vec::new();
    let names: Vec<String> = scene.effects.iter().map(|effect| effect.name()).collect();
    let sheet_file = matches!(scene.sheet.source, SheetSource::File { .. });
    let summary = SceneSummary { effects: &names, sheet_file };
    let mut on_effect =
        |number: usize, spec: &dyn EffectSpec, context: &EffectContext<'_>, effect: &Effect| {
            parts.push(effect.parts());
            notes.extend(spec.notes(context, &summary).into_iter().map(|said| {
                let (label, said) = match said.strip_prefix("warning: ") {
                    Some(said) => ("warning: ", said),
                    None => ("", said.as_str()),
                };
                format!("{label}effect[{number}] ({}): {said}", spec.name())
            }));
            for term in &effect.energies {
                scale_checks::check_load(number, term, context.material)?;
            }
            for transport in &effect.transports {
                scale_checks::check_transport(number, transport, context.sheet)?;
            }
            Ok(())
        };
    let stepper = problem.stepper_with(&mut on_effect).map_err(|error| placed(scene, &error))?;
    Ok((stepper, parts))
}

/// `error` at its place in `scene`.
fn placed(scene: &Scene, error: &ProblemError) -> Error {
    let ProblemError { part, message, help } = error;
    let at = |path: &str| scene.error_at(path, message, help.as_deref());
    let error = match part {
        ProblemPart::Material => scene.missing_table("material", message),
        ProblemPart::Effects => at("effect"),
        ProblemPart::Effect(number, key) if key.is_empty() => at(&format!("effect[{number}]")),
        ProblemPart::Effect(number, key) => at(&format!("effect[{number}].{key}")),
        ProblemPart::Sheet => at("sheet"),
        ProblemPart::Planar => at("sheet.planar"),
        ProblemPart::Law => at("kinetics"),
        ProblemPart::Integrator => at("time.integrator"),
        ProblemPart::Drag => at("material.drag"),
        ProblemPart::Equilibrium => at("equilibrium"),
    };
    error.into()
}

/// Notes on what holds, loads and damps the sheet.
fn note_model(scene: &Scene, model: &Model, notes: &mut Vec<String>) -> Result<()> {
    lints::on_law(model, notes);
    let mechanics = model.mechanics();
    if mechanics.is_empty() {
        if scene.stability.as_ref().is_some_and(|s| s.watch) {
            let message = "the scene lists no effect with an energy: nothing to watch";
            return Err(scene.error_at("stability", message, None).into());
        }
        return Ok(());
    }
    let mut potential = Potential::new(mechanics);
    if mechanics.is_planar() {
        planar::note_forces(&mut potential, notes);
    }
    let tolerance = scene.equilibrium.tolerance();
    lints::on_loads(&mut potential, tolerance, notes);
    if scene.time.policy.mass_weights().mechanics > 0.0 {
        lints::on_drag(scene, model.drag(), notes);
    }
    Ok(())
}
