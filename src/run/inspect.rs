//! Looking at one state without running: energies, forces, curvatures, signals, rates.

use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::{Error, Result, Simulation, internal, planar};
use crate::Stepper;
use crate::Vec3;
use crate::geometry::Curvature;
use crate::kinetics::Location;
use crate::num::Short;
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
    let n = simulation.sheet().vertex_count();
    if surface.points.len() != n {
        return Err(refuse(format!(
            "the state has {} points, but the scene's sheet has {n} vertices",
            surface.points.len()
        )));
    }
    if !surface.triangles.is_empty()
        && surface.triangles.len() != simulation.sheet().triangle_count()
    {
        return Err(refuse(format!(
            "the state has {} triangles, but the scene's sheet has {}",
            surface.triangles.len(),
            simulation.sheet().triangle_count()
        )));
    }
    if !surface.triangles.is_empty()
        && let Some(t) = different(simulation.sheet(), &surface.triangles)
    {
        return Err(refuse(format!(
            "triangle {t} of the state has the vertices {:?}, that of the scene's sheet {:?}: it is \
             a state of another mesh",
            surface.triangles[t],
            simulation.sheet().triangles()[t]
        )));
    }
    let wrong = |x: &Vec3| !x.iter().all(|x| x.is_finite());
    if let Some(v) = surface.points.iter().position(wrong) {
        let x = surface.points[v];
        return Err(refuse(format!(
            "vertex {v} of the state is at ({}, {}, {}), expected finite positions",
            x.x, x.y, x.z
        )));
    }
    if simulation.model().mechanics().is_planar()
        && let Some((v, z, plane)) = planar::leaving(simulation.sheet().rest(), &surface.points)
    {
        return Err(refuse(format!(
            "vertex {v} of the state is at z = {z}, but the scene's sheet is planar: it stays at \
             z = {plane}"
        )));
    }
    simulation.stepper.state.x.copy_from_slice(&surface.points);
    let model = Arc::clone(simulation.model());
    for (k, term) in model.internal().iter().enumerate() {
        let values = internal::read(&**term, model.sheet(), surface).map_err(refuse)?;
        simulation.stepper.state.internal[k] = values;
    }
    let Some(chemistry) = model.chemistry() else { return Ok(()) };
    let arrays = match chemistry.location() {
        Location::Vertex => &surface.point_arrays,
        _ => &surface.cell_arrays,
    };
    for (s, species) in chemistry.descriptor().species.iter().enumerate() {
        let prefix = format!("{} [", species.name);
        let named = |name: &str| name == species.name || name.starts_with(&prefix);
        let Some(array) = arrays.iter().find(|a| named(&a.name)) else {
            let names: Vec<&str> = arrays.iter().map(|a| a.name.as_str()).collect();
            return Err(refuse(format!(
                "the state has no {} array for species `{}`; it has: {}",
                if chemistry.location() == Location::Vertex { "point" } else { "cell" },
                species.name,
                if names.is_empty() { "none".to_owned() } else { names.join(", ") }
            )));
        };
        let place = &mut simulation.stepper.state.species[s];
        if array.components != 1 || array.values.len() != place.len() {
            return Err(refuse(format!(
                "array `{}` of the state has {} numbers, expected {}",
                array.name,
                array.values.len(),
                place.len()
            )));
        }
        if let Some(point) = array.values.iter().position(|c| !c.is_finite()) {
            return Err(refuse(format!(
                "species `{}` of the state is {} at {} {point}, expected finite values",
                species.name,
                array.values[point],
                chemistry.location().noun()
            )));
        }
        let valid = |c: &f64| *c >= species.lower && *c <= species.upper;
        if let Some(point) = array.values.iter().position(|c| !valid(c)) {
            return Err(refuse(format!(
                "species `{}` of the state is {} at {} {point}; it is valid from {} to {}",
                species.name,
                Short(array.values[point]),
                chemistry.location().noun(),
                Short(species.lower),
                Short(species.upper)
            )));
        }
        place.copy_from_slice(&array.values);
    }
    Ok(())
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
/// at the points where species live (vector signals as three columns); `length_factor`, Φ there.
///
/// # Errors
/// If the plugin fails, optimal lengths make no triangle, or an energy is not finite.
pub fn inspect(simulation: &mut Simulation) -> Result<Value> {
    let Stepper { workspace, state, area, .. } = &mut simulation.stepper;
    let (state, model) = (&*state, Arc::clone(&workspace.model));
    let sheet = model.sheet();
    let mut at = workspace.at(state);
    let names: Vec<String> = model.mechanics().names().map(str::to_owned).collect();
    let energies = at.energies()?;
    if !energies.iter().all(|energy| energy.is_finite()) {
        return Err(SolveError::NotFinite.into());
    }
    let potential = at.potential()?;
    let mut energy = Map::new();
    let mut force = Map::new();
    let mut total = vec![Vec3::zeros(); state.x.len()];
    for (which, name) in names.iter().enumerate() {
        let mine = potential.force_of(which, &state.x);
        for (t, f) in total.iter_mut().zip(&mine) {
            *t += f;
        }
        energy.insert(name.clone(), json!(energies[which]));
        force.insert(name.clone(), vectors(&mine));
    }
    let mut constraint = Map::new();
    let values = potential.constraint_values(&state.x);
    for (which, name) in model.mechanics().constraint_names().enumerate() {
        let mine = potential.constraint_force(which, &state.x);
        total.iter_mut().zip(&mine).for_each(|(t, f)| *t += f);
        let multiplier = potential.multipliers()[which];
        let about =
            json!({ "value": values[which], "multiplier": multiplier, "force": vectors(&mine) });
        constraint.insert(name.to_owned(), about);
    }
    energy.insert("total".into(), json!(energies.iter().sum::<f64>()));
    force.insert("total".into(), vectors(&total));
    let mut curvature = Curvature::of(&potential.shape(&state.x), area);
    if model.mechanics().is_planar() {
        curvature.mean.fill(0.0);
        curvature.gaussian.fill(0.0);
    }
    let length: Vec<f64> = sheet
        .edges()
        .iter()
        .map(|e| (state.x[e.vertices[0] as usize] - state.x[e.vertices[1] as usize]).norm())
        .collect();
    let mut result = json!({
        "time": state.time,
        "energy": energy,
        "force": force,
        "mean_curvature": curvature.mean,
        "gaussian_curvature": curvature.gaussian,
        "vertex_area": curvature.area,
        "bond": {
            "vertices": sheet.edges().iter().map(|e| e.vertices).collect::<Vec<_>>(),
            "length": length,
            "rest_length": potential.metric().reference_length(),
            "optimal_length": potential.metric().length(),
        },
    });
    if let (false, Value::Object(all)) = (constraint.is_empty(), &mut result) {
        all.insert("constraint".into(), constraint.into());
    }
    if let Some(chemistry) = model.chemistry() {
        let columns = at.signals()?.clone();
        let descriptor = chemistry.descriptor();
        let by_name = |columns: &[Vec<f64>]| -> Map<String, Value> {
            let named = descriptor.species.iter().zip(columns);
            named.map(|(s, values)| (s.name.clone(), json!(values))).collect()
        };
        let titles = chemistry.signals().wanted().iter().flat_map(|s| s.columns());
        let signals: Map<String, Value> = titles
            .zip(&columns)
            .map(|(name, values)| ((*name).to_owned(), json!(values)))
            .collect();
        let c: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
        let mut reaction: Vec<Vec<f64>> = c.iter().map(|c| vec![0.0; c.len()]).collect();
        let mut diffusion = reaction.clone();
        let mut out: Vec<&mut [f64]> = reaction.iter_mut().map(Vec::as_mut_slice).collect();
        chemistry.reaction(&c, &columns, &mut out)?;
        for (term, operator) in chemistry.transports().iter().zip(at.surface().operators()) {
            term.add_rate(sheet, operator, c[term.by()], &mut diffusion[term.species()]);
        }
        if let Value::Object(all) = &mut result {
            all.insert("species".into(), by_name(&state.species).into());
            all.insert("signals".into(), signals.into());
            all.insert("reaction".into(), by_name(&reaction).into());
            all.insert("diffusion".into(), by_name(&diffusion).into());
            all.insert(
                "length_factor".into(),
                json!(chemistry.point_length_factor(&state.species)?),
            );
        }
    }
    Ok(result)
}
