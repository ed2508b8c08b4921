//! Looking at one state without running: energies, forces, curvatures, signals, rates.

use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::{Error, Result, Simulation, internal_variables, planar};
use crate::Stepper;
use crate::Vec3;
use crate::geometry::Curvature;
use crate::kinetics::{Location, Species};
use crate::model::{Chemistry, Evaluation, Potential, Start};
use crate::num::Short;
use crate::scene::Scene;
use crate::sheet::{Sheet, SheetError, Surface};
use crate::solve::SolveError;

/// Puts the positions, species and internal variables of `surface` into the state of `simulation`.
///
/// Points are current positions; species are point arrays (cell arrays for species on faces) by
/// name, with or without a unit in brackets; internal variables as frames have them.
///
/// # Errors
/// A surface with another number of vertices or other triangles, a position that is not finite, a
/// species or an internal variable without an array, arrays of the wrong length, or a species that is not finite or out of its valid
/// range; with the vertex or triangle.
pub fn take_state(simulation: &mut Simulation, surface: &Surface) -> Result<()> {
    let refuse = |message: String| {
        Error::Sheet(match &surface.path {
            Some(path) => SheetError::File { path: path.clone(), message },
            None => SheetError::Unusable(message),
        })
    };
    let mut surface = surface.clone();
    simulation.sheet().add_images(&mut surface).map_err(refuse)?;
    let surface = &surface;
    same_mesh(simulation.sheet(), surface).map_err(refuse)?;
    valid_positions(simulation, &surface.points).map_err(refuse)?;
    simulation.stepper.state.x.copy_from_slice(&surface.points);
    let model = Arc::clone(simulation.model());
    for (k, term) in model.internal().iter().enumerate() {
        let values = internal_variables::read(&**term, model.sheet(), surface).map_err(refuse)?;
        simulation.stepper.state.internal[k] = values;
    }
    let Some(chemistry) = model.chemistry() else { return Ok(()) };
    for (species, place) in
        chemistry.descriptor().species.iter().zip(&mut simulation.stepper.state.species)
    {
        let values =
            species_values(surface, species, chemistry.location(), place.len()).map_err(refuse)?;
        place.copy_from_slice(values);
    }
    Ok(())
}

/// Lets the run of `scene` start from `surface`, at `time` by the clock of ramps, growth and laws that read t; without one
/// at 0, with a note where the surface has another time. A shape that moves under drag continues from there.
///
/// # Errors
/// As [`take_state`], and a time outside of the run.
pub fn start_from(
    simulation: &mut Simulation,
    scene: &Scene,
    surface: Surface,
    time: Option<f64>,
) -> Result<()> {
    let (start, end) = (time.unwrap_or_default(), scene.time.span.until.get());
    if !(0.0..end).contains(&start) {
        return Err(Error::Refused(format!(
            "--start-time is {}, expected at least 0 and less than time.until, {}",
            Short(start),
            Short(end)
        )));
    }
    if let Some(of) = surface.time.filter(|of| time.is_none() && *of != 0.0) {
        simulation.notes.push(format!(
            "the state is that of time {}; here time begins at 0, and with it ramps, growth and laws that read t: \
             --start-time {of} continues them",
            Short(of)
        ));
    }
    let surface = simulation.part_of(surface);
    take_state(simulation, &surface)?;
    simulation.stepper.state.time = start;
    // A shape that moves is where it is: brought to rest first, it would begin another motion.
    if scene.time.policy.mass_weights().mechanics > 0.0 {
        simulation.stepper.start = Start::Given;
    }
    Ok(())
}

/// Compares the numbers of vertices and triangles, and the triangles, with those of `sheet`.
fn same_mesh(sheet: &Sheet, surface: &Surface) -> Result<(), String> {
    let (n, count) = (sheet.vertex_count(), sheet.triangle_count());
    if surface.points.len() != n {
        return Err(format!(
            "the state has {} points, but the scene's sheet has {n} vertices",
            surface.points.len()
        ));
    }
    if surface.triangles.is_empty() {
        return Ok(());
    }
    if surface.triangles.len() != count {
        return Err(format!(
            "the state has {} triangles, but the scene's sheet has {count}",
            surface.triangles.len()
        ));
    }
    different(sheet, &surface.triangles).map_or(Ok(()), |t| {
        Err(format!(
            "triangle {t} of the state has the vertices {:?}, that of the scene's sheet {:?}: it is \
             a state of another mesh",
            surface.triangles[t],
            sheet.triangles()[t]
        ))
    })
}

/// Checks that positions are finite, and in the plane of a planar sheet.
fn valid_positions(simulation: &Simulation, points: &[Vec3]) -> Result<(), String> {
    let wrong = |x: &Vec3| !x.iter().all(|x| x.is_finite());
    if let Some(v) = points.iter().position(wrong) {
        let x = points[v];
        return Err(format!(
            "vertex {v} of the state is at ({}, {}, {}), expected finite positions",
            x.x, x.y, x.z
        ));
    }
    if simulation.model().mechanics().is_planar()
        && let Some((v, z, plane)) = planar::first_out_of_plane(simulation.sheet().rest(), points)
    {
        return Err(format!(
            "vertex {v} of the state is at z = {z}, but the scene's sheet is planar: it stays at \
             z = {plane}"
        ));
    }
    Ok(())
}

/// The `expected` values of `species` in the arrays of `surface`, finite and in the valid range.
fn species_values<'a>(
    surface: &'a Surface,
    species: &Species,
    location: Location,
    expected: usize,
) -> Result<&'a [f64], String> {
    let (arrays, found, kind) = match location {
        Location::Vertex => (&surface.point_arrays, surface.point_array(&species.name), "point"),
        _ => (&surface.cell_arrays, surface.cell_array(&species.name), "cell"),
    };
    let Some(array) = found else {
        let names: Vec<&str> = arrays.iter().map(|a| a.name.as_str()).collect();
        return Err(format!(
            "the state has no {kind} array for species `{}`; it has: {}",
            species.name,
            if names.is_empty() { "none".to_owned() } else { names.join(", ") }
        ));
    };
    if array.components != 1 || array.values.len() != expected {
        return Err(format!(
            "array `{}` of the state has {} numbers, expected {expected}",
            array.name,
            array.values.len(),
        ));
    }
    if let Some(point) = array.values.iter().position(|c| !c.is_finite()) {
        return Err(format!(
            "species `{}` of the state is {} at {} {point}, expected finite values",
            species.name,
            array.values[point],
            location.noun()
        ));
    }
    let valid = |c: &f64| *c >= species.lower && *c <= species.upper;
    if let Some(point) = array.values.iter().position(|c| !valid(c)) {
        return Err(format!(
            "species `{}` of the state is {} at {} {point}; it is valid from {} to {}",
            species.name,
            Short(array.values[point]),
            location.noun(),
            Short(species.lower),
            Short(species.upper)
        ));
    }
    Ok(&array.values)
}

/// The first triangle that is another, if any; one may begin with any of its corners, and be turned:
/// the sheet has all of them face the same way, whatever its file says.
fn different(sheet: &Sheet, triangles: &[[u32; 3]]) -> Option<usize> {
    let corners = |triangle: &[u32; 3]| {
        let mut corners = *triangle;
        corners.sort_unstable();
        corners
    };
    let mut pairs = sheet.triangles().iter().zip(triangles);
    pairs.position(|(ours, theirs)| corners(ours) != corners(theirs))
}

fn vectors(v: &[Vec3]) -> Value {
    v.iter().map(|v| json!([v.x, v.y, v.z])).collect()
}

/// Evaluates the current state of `simulation`.
///
/// Keys: `time`; `energy` by effect and `total`; `force` by effect and `total` (`-∂U/∂x`, before
/// pins); `constraint`, where there are some, by name with `value`, `multiplier` and `force` (part of the
/// total); `mean_curvature`, `gaussian_curvature`, `vertex_area` by vertex; `bond` with `vertices`,
/// `length`, `rest_length`, `optimal_length`; `species`, `signals`, `reaction`, `diffusion` by name
/// at the points where species live (vector signals as three columns); `length_factor`, Φ there. A periodic sheet has the
/// vertices, triangles and bonds of one period.
///
/// # Errors
/// If the plugin fails, optimal lengths make no triangle, or an energy is not finite.
pub fn inspect(simulation: &mut Simulation) -> Result<Value> {
    let Stepper { workspace, state, area, .. } = &mut simulation.stepper;
    let (state, model) = (&*state, Arc::clone(&workspace.model));
    let sheet = model.sheet();
    let mut at = workspace.at(state);
    let mut result = loads(&mut at)?;
    let potential = at.potential()?;
    let mut curvature = Curvature::evaluate(&potential.shape(&state.x), area);
    if model.mechanics().is_planar() {
        curvature.mean.fill(0.0);
        curvature.gaussian.fill(0.0);
    }
    result.insert("time".into(), json!(state.time));
    result.insert("mean_curvature".into(), json!(own(sheet, &curvature.mean)));
    result.insert("gaussian_curvature".into(), json!(own(sheet, &curvature.gaussian)));
    result.insert("vertex_area".into(), json!(own(sheet, &curvature.area)));
    result.insert("bond".into(), bonds(sheet, potential, &state.x));
    if let Some(chemistry) = model.chemistry() {
        result.extend(concentrations(chemistry, &mut at)?);
    }
    Ok(result.into())
}

/// The values of vertices or triangles that are no images.
#[must_use]
pub fn own<'a, T>(sheet: &Sheet, values: &'a [T]) -> &'a [T] {
    &values[..sheet.reduction().owned(values.len())]
}

/// Ends and lengths of the bonds, each once, the ends by the vertices that images are of.
fn bonds(sheet: &Sheet, potential: &Potential, x: &[Vec3]) -> Value {
    let edges = sheet.edges();
    let counted = (0..edges.len()).filter(|e| sheet.counts(&edges[*e].vertices));
    let counted: Vec<usize> = counted.collect();
    let ends = |e: &usize| edges[*e].vertices.map(|v| sheet.number(v as usize));
    let length = |[a, b]: [u32; 2]| (x[a as usize] - x[b as usize]).norm();
    let of = |values: &[f64]| counted.iter().map(|e| values[*e]).collect::<Vec<_>>();
    json!({
        "vertices": counted.iter().map(ends).collect::<Vec<_>>(),
        "length": counted.iter().map(|e| length(edges[*e].vertices)).collect::<Vec<_>>(),
        "rest_length": of(potential.metric().reference_length()),
        "optimal_length": of(potential.metric().length()),
    })
}

/// Energies and forces by effect, and values, multipliers and forces of constraints.
fn loads(at: &mut Evaluation<'_>) -> Result<Map<String, Value>> {
    let (model, state) = (at.model(), at.state());
    let energies = at.energies()?;
    if !energies.iter().all(|energy| energy.is_finite()) {
        return Err(SolveError::NotFinite.into());
    }
    let potential = at.potential()?;
    let (mut energy, mut force, mut constraint) = (Map::new(), Map::new(), Map::new());
    let mut total = vec![Vec3::zeros(); state.x.len()];
    for (which, name) in model.mechanics().names().enumerate() {
        let mine = potential.force_of(which, &state.x);
        total.iter_mut().zip(&mine).for_each(|(t, f)| *t += f);
        energy.insert(name.to_owned(), json!(energies[which]));
        force.insert(name.to_owned(), vectors(own(model.sheet(), &mine)));
    }
    let values = potential.constraint_values(&state.x);
    for (which, name) in model.mechanics().constraint_names().enumerate() {
        let mine = potential.constraint_force(which, &state.x);
        total.iter_mut().zip(&mine).for_each(|(t, f)| *t += f);
        let multiplier = potential.multipliers()[which];
        let about = json!({ "value": values[which], "multiplier": multiplier, "force": vectors(own(model.sheet(), &mine)) });
        constraint.insert(name.to_owned(), about);
    }
    energy.insert("total".into(), json!(energies.iter().sum::<f64>()));
    force.insert("total".into(), vectors(own(model.sheet(), &total)));
    let mut all = Map::new();
    all.insert("energy".into(), energy.into());
    all.insert("force".into(), force.into());
    if !constraint.is_empty() {
        all.insert("constraint".into(), constraint.into());
    }
    Ok(all)
}

/// Species, signals and the parts of the rates, by name, and the length factor.
fn concentrations(chemistry: &Chemistry, at: &mut Evaluation<'_>) -> Result<Map<String, Value>> {
    let (model, state) = (at.model(), at.state());
    let columns = at.signals()?.clone();
    let by_name = |columns: &[Vec<f64>]| -> Map<String, Value> {
        let named = chemistry.descriptor().species.iter().zip(columns);
        named.map(|(s, values)| (s.name.clone(), json!(own(model.sheet(), values)))).collect()
    };
    let titles = chemistry.signals().wanted().iter().flat_map(|s| s.columns());
    // The time is one number.
    let own_column = |values: &[f64]| match values.len() {
        1 => json!(values),
        _ => json!(own(model.sheet(), values)),
    };
    let signals: Map<String, Value> = titles
        .zip(&columns)
        .map(|(name, values)| ((*name).to_owned(), own_column(values)))
        .collect();
    let c: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
    let mut reaction: Vec<Vec<f64>> = c.iter().map(|c| vec![0.0; c.len()]).collect();
    let mut diffusion = reaction.clone();
    let mut out: Vec<&mut [f64]> = reaction.iter_mut().map(Vec::as_mut_slice).collect();
    chemistry.reaction(&c, &columns, &mut out)?;
    let read = (&c[..], chemistry.signal_values(&columns));
    for (term, operator) in chemistry.transports().iter().zip(at.surface().operators()) {
        let out = &mut diffusion[term.species()];
        chemistry.add_transport((model.sheet(), state.time), (term, operator), read, out)?;
    }
    let factor = chemistry.point_length_factor(&state.species)?;
    let factor = json!(own(model.sheet(), &factor));
    let mut all = Map::new();
    all.insert("species".into(), by_name(&state.species).into());
    all.insert("signals".into(), signals.into());
    all.insert("reaction".into(), by_name(&reaction).into());
    all.insert("diffusion".into(), by_name(&diffusion).into());
    all.insert("length_factor".into(), factor);
    Ok(all)
}
