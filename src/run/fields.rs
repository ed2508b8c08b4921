//! The fields of a frame: what a scene can ask for, by name, and how it is evaluated.

use std::borrow::Cow;
use std::sync::Arc;

use crate::Vec3;
use crate::effects::MaterialField;
use crate::geometry::{Curvature, VertexArea};
use crate::kinetics::{Location, Signal};
use crate::model::{Evaluation, Model, Potential, Signals, TensionReading};
use crate::output::{Field, Frame};
use crate::parallel;
use crate::scene::Scene;
use crate::sheet::Sheet;
use crate::sheet::quality::triangle_quality;

use super::internal_variables::vertex_means;
use super::{Result, internal_variables};

/// Fields besides species and signals: name, unit, and what they are.
const OTHER_FIELDS: [(&str, &str); 5] = [
    ("vertex_area", "length^2"),
    ("force", "force"),
    ("length_factor", "1"),
    ("quality", "1"),
    ("rest_position", "length"),
];

/// The rest areas of triangles, if one of these signals reads them.
pub(super) type RestAreas<'a> = dyn Fn(&[Signal]) -> Arc<[f64]> + 'a;

/// Whether frames use this name for something that is of no law.
pub(super) fn is_built_in(name: &str) -> bool {
    name == "displacement"
        || OTHER_FIELDS.iter().any(|(known, _)| *known == name)
        || Signal::ALL.iter().any(|signal| *signal != Signal::Time && signal.name() == name)
}

/// The fields that a scene wants in its frames.
#[derive(Clone)]
pub struct Fields {
    names: Vec<String>,
    area: VertexArea,
    signals: Signals,
    /// What observables read, where species live; if any are asked for.
    observed: Option<Signals>,
}

/// `name [unit]`, or the bare name of a number without unit.
#[must_use]
pub fn titled(name: &str, unit: &str) -> String {
    if unit == "1" || unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

impl Fields {
    /// The fields of `scene.output.fields`; without any, the species and the mean curvature.
    ///
    /// # Errors
    /// A name that nothing has, with its place.
    pub(super) fn new(
        scene: &Scene,
        model: &Model,
        area: VertexArea,
        rest_area: &RestAreas<'_>,
        material: Option<&MaterialField>,
    ) -> Result<Self> {
        let chemistry = model.chemistry();
        let species: Vec<&str> = chemistry
            .map(|c| c.descriptor().species.iter().map(|s| s.name.as_str()).collect())
            .unwrap_or_default();
        let mut allowed = species.clone();
        let observables = chemistry.map(|c| c.descriptor().observables.as_slice());
        allowed.extend(observables.unwrap_or_default().iter().map(|o| o.name.as_str()));
        allowed.extend(Signal::ALL.iter().filter(|s| **s != Signal::Time).map(|s| s.name()));
        allowed.extend(OTHER_FIELDS.map(|(name, _)| name));
        allowed.extend(model.internal().iter().map(|term| term.name()));
        for (k, name) in scene.output.fields.iter().enumerate() {
            if !allowed.contains(&name.as_str()) {
                let path = format!("output.fields[{k}]");
                return Err(scene.unknown_name(&path, "field", name, &allowed).into());
            }
            if scene.output.fields[..k].contains(name) {
                let path = format!("output.fields[{k}]");
                return Err(scene.error_at(&path, "this field is listed twice", None).into());
            }
        }
        let names: Vec<String> = if scene.output.fields.is_empty() {
            species.iter().copied().chain(["mean_curvature"]).map(str::to_owned).collect()
        } else {
            scene.output.fields.clone()
        };
        let wanted = Signal::ALL.into_iter().filter(|s| names.iter().any(|n| n == s.name()));
        let wanted: Vec<Signal> = wanted.collect();
        let reading: TensionReading = scene.kinetics.first().map(|k| k.tension).unwrap_or_default();
        let observed = chemistry.and_then(|chemistry| {
            let d = chemistry.descriptor();
            let wanted: Vec<Signal> = d.observed.iter().map(|read| read.signal).collect();
            let place = chemistry.location();
            let signals = || {
                let rest_area = rest_area(&wanted);
                Signals::new(wanted, place, area.clone(), material, reading, rest_area)
                    .in_plane(scene.sheet.planar)
                    .with_boundary(scene.kinetics[0].boundary, model.sheet())
            };
            d.observables.iter().any(|o| names.contains(&o.name)).then(signals)
        });
        let rest_area = rest_area(&wanted);
        let signals =
            Signals::new(wanted, Location::Vertex, area.clone(), material, reading, rest_area)
                .in_plane(scene.sheet.planar)
                .with_boundary(scene.output.boundary, model.sheet());
        Ok(Self { names, area, signals, observed })
    }

    /// The frame of `state`: current positions, displacement, and the chosen fields.
    ///
    /// Species on faces appear as cell fields, and carried to the vertices as point fields.
    ///
    /// # Errors
    /// If the plugin fails.
    pub fn frame<'a>(&self, at: &mut Evaluation<'a>) -> Result<Frame<'a>> {
        let (model, state) = (at.model(), at.state());
        let sheet = model.sheet();
        let moved = sheet.rest().iter().zip(&state.x).map(|(r, x)| x - r);
        let mut displacement = Field::vector("displacement [length]", &[]);
        displacement.data = moved.flat_map(|d| [d.x, d.y, d.z]).collect();
        let (mut point, mut cell) = (vec![displacement], Vec::new());
        self.add_species(at, &mut point, &mut cell);
        self.observe(at, &mut point, &mut cell)?;
        let columns = at.values_of(&self.signals)?;
        let mut next = columns.into_iter();
        for signal in self.signals.wanted() {
            let parts: Vec<Vec<f64>> = next.by_ref().take(signal.columns().len()).collect();
            point.push(interleaved(titled(signal.name(), signal.unit()), &parts));
        }
        self.add_others(at, &mut point, &mut cell)?;
        internal_variables::add_fields((model, state), &self.names, (&mut point, &mut cell));
        let field_data = global_values(at)?;
        Ok(Frame {
            time: state.time,
            step: state.step,
            points: &state.x,
            triangles: sheet.triangles(),
            point,
            cell,
            field_data,
        })
    }
}

impl Fields {
    /// What is in a frame besides positions and displacements.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Adds the species that are listed: on the vertices, and on the faces where they live there.
    fn add_species<'a>(
        &self,
        at: &mut Evaluation<'a>,
        point: &mut Vec<Field<'a>>,
        cell: &mut Vec<Field<'a>>,
    ) {
        let (model, state) = (at.model(), at.state());
        let Some(chemistry) = model.chemistry() else { return };
        let on_vertices = chemistry.location() == Location::Vertex;
        let mut carried = (!on_vertices).then(|| at.species_at_vertices());
        for (s, species) in chemistry.descriptor().species.iter().enumerate() {
            if !self.names.contains(&species.name) {
                continue;
            }
            let title = titled(&species.name, &species.unit);
            let values = match &mut carried {
                None => Cow::Borrowed(&*state.species[s]),
                Some(carried) => std::mem::take(&mut carried[s]).into(),
            };
            point.push(Field::scalar(title.clone(), values));
            if chemistry.location() == Location::Face {
                cell.push(Field::scalar(title, &*state.species[s]));
            }
        }
    }

    /// Adds the fields of [`OTHER_FIELDS`] that are listed.
    fn add_others(
        &self,
        at: &mut Evaluation<'_>,
        point: &mut Vec<Field<'_>>,
        cell: &mut Vec<Field<'_>>,
    ) -> Result<()> {
        let (sheet, x) = (at.model().sheet(), &at.state().x);
        for (name, unit) in OTHER_FIELDS {
            if !self.names.iter().any(|n| n == name) {
                continue;
            }
            let title = titled(name, unit);
            point.push(match name {
                "quality" => {
                    cell.push(Field::scalar(title, qualities(sheet, x)));
                    continue;
                }
                "vertex_area" => {
                    let curvature = Curvature::evaluate(&at.potential()?.shape(x), &self.area);
                    Field::scalar(title, curvature.area)
                }
                "force" => Field::vector(title, &at.potential()?.forces(x)),
                "length_factor" => Field::scalar(title, vertex_factor(at.potential()?)),
                _ => Field::vector(title, sheet.rest()),
            });
        }
        Ok(())
    }

    /// Adds the observables that are asked for; without any the law is not called.
    fn observe(
        &self,
        at: &mut Evaluation<'_>,
        point: &mut Vec<Field<'_>>,
        cell: &mut Vec<Field<'_>>,
    ) -> Result<()> {
        let Some(observed) = &self.observed else { return Ok(()) };
        let (model, state) = (at.model(), at.state());
        let signals = at.values_of(observed)?;
        let Some(chemistry) = model.chemistry() else { return Ok(()) };
        let known = &chemistry.descriptor().observables;
        let species: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
        let values = chemistry.observe(&species, &signals)?;
        let at_vertices = at.at_vertices(&values);
        for (k, observable) in known.iter().enumerate() {
            if self.names.contains(&observable.name) {
                let title = titled(&observable.name, &observable.unit);
                point.push(Field::scalar(title.clone(), at_vertices[k].clone()));
                if chemistry.location() == Location::Face {
                    cell.push(Field::scalar(title, values[k].clone()));
                }
            }
        }
        Ok(())
    }
}

/// One field from one column a component.
fn interleaved(name: String, parts: &[Vec<f64>]) -> Field<'static> {
    match parts {
        [single] => Field::scalar(name, single.clone()),
        _ => {
            let count = parts.first().map_or(0, Vec::len);
            let data: Vec<f64> = (0..count).flat_map(|i| parts.iter().map(move |p| p[i])).collect();
            Field { name, components: parts.len(), data: data.into() }
        }
    }
}

/// Quality 4√3 A/Σl² of every triangle.
pub(super) fn qualities(sheet: &Sheet, x: &[Vec3]) -> Vec<f64> {
    let mut all = vec![0.0; sheet.triangles().len()];
    parallel::fill(&mut all, |t| triangle_quality(sheet.triangles()[t].map(|v| x[v as usize])));
    all
}

/// Mean over its edges of `l̄/l⁰` at every vertex.
pub(super) fn vertex_factor(potential: &Potential) -> Vec<f64> {
    let (sheet, metric) = (potential.sheet(), potential.metric());
    let (length, reference) = (metric.length(), metric.reference_length());
    vertex_means(sheet, |e| length[e] / reference[e])
}

/// Values of the whole sheet: energies by effect, constraints and their multipliers.
fn global_values(at: &mut Evaluation<'_>) -> Result<Vec<(String, f64)>> {
    let mechanics = at.model().mechanics();
    let named = mechanics.names().zip(at.energies()?);
    let mut all: Vec<_> =
        named.map(|(name, value)| (format!("energy of {name} [energy]"), value)).collect();
    if mechanics.is_constrained() {
        let x = &at.state().x;
        let potential = at.potential()?;
        let values = potential.constraint_values(x);
        let both = values.iter().zip(potential.multipliers());
        for (name, (value, multiplier)) in mechanics.constraint_names().zip(both) {
            all.push((format!("constraint {name}"), *value));
            all.push((format!("multiplier of {name} [energy]"), *multiplier));
        }
    }
    Ok(all)
}
