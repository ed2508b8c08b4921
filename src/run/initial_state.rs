//! The start of a run: sheet shapes of a scene, displaced positions, species.

use std::cell::LazyCell;
use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::Result;
use crate::Vec3;
use crate::effects::{EffectError, Field, FieldValues, formula_on, formula_values};
use crate::geometry::vertex_normals;
use crate::kinetics::{Descriptor, Location, formula};
use crate::model::{Chemistry, Model, Positions, State};
use crate::num::Short;
use crate::num::checked::{Finite, Positive};
use crate::num::index;
use crate::scene::{
    self, Direction, FieldFile, Imperfection, Initial, Pattern, Scene, Sequence, SheetSource,
    path_to,
};
use crate::sheet::{self, Lattice, Sheet, SheetError, Surface};

/// The generator's shape; none for the graph of a formula.
fn shape(shape: &scene::ShapeSpec) -> Option<sheet::SheetShape> {
    use scene::ShapeSpec as S;
    use sheet::SheetShape as G;
    Some(match shape {
        S::Disc(d) => G::Disc { radius: d.radius.get() },
        S::Rectangle(r) => {
            let (width, height) = (r.width.get(), r.height.get());
            match r.periodic {
                None => G::Rectangle { width, height },
                Some(along) => {
                    let both = along == scene::Periodic::Xy;
                    G::PeriodicRectangle { width, height, both }
                }
            }
        }
        S::Lattice(l) => G::Lattice { width: l.width.get(), height: l.height.get() },
        S::Annulus(a) => G::Annulus { inner: a.inner.get(), outer: a.outer.get() },
        S::Polygon(p) => {
            let corners =
                |ring: &Vec<[Finite; 2]>| ring.iter().map(|p| p.map(Finite::get)).collect();
            G::Polygon { points: corners(&p.points), holes: p.holes.iter().map(corners).collect() }
        }
        S::Sphere(s) => G::Sphere { radius: s.radius.get(), irregular: s.irregular },
        S::Cylinder(c) => {
            G::Cylinder { radius: c.radius.get(), height: c.height.get(), caps: c.caps }
        }
        S::Cap(c) => G::Cap { radius: c.radius.get(), height: c.height.get() },
        S::Torus(t) => G::Torus { major: t.major.get(), minor: t.minor.get() },
        S::Ellipsoid(e) => G::Ellipsoid { semi_axes: e.semi_axes.map(Positive::get) },
        S::WavyStrip(w) => G::WavyStrip {
            width: w.width.get(),
            height: w.height.get(),
            amplitude: w.amplitude.get(),
            wavelength: w.wavelength.get(),
        },
        S::Graph(_) => return None,
    })
}

/// Generates the sheet of `scene`.
///
/// # Errors
/// Shapes that cannot be made, at `sheet.shape`, and formulas that are none, at `sheet.z`.
pub(super) fn generated(scene: &Scene, spec: &scene::ShapeSpec) -> Result<Sheet> {
    let (vertices, seed) = (spec.vertices(), spec.seed());
    if let Some(lattice) = lattice(scene)? {
        let place = |e: SheetError| scene.error_at("sheet.shape", &e.to_string(), None).into();
        return lattice.sheet().map_err(place);
    }
    let made = if let scene::ShapeSpec::Graph(graph) = spec {
        let formula = formula::FieldFormula::new(&graph.z, false).map_err(|e| {
            scene.error_within("sheet.z", &graph.z, &e.span, &e.message, e.help.as_deref())
        })?;
        let size = [graph.width.get(), graph.height.get()];
        sheet::generate_graph(size, &|points| formula.evaluate(points, 0.0), vertices, seed)
    } else if let scene::ShapeSpec::Polygon(scene::Polygon { outline: Some(file), width, .. }) =
        spec
    {
        let place = |e: SheetError, help| scene.error_at("sheet.outline", &e.to_string(), help);
        let rings = sheet::read::outline(file, width.map(Positive::get));
        let (points, holes) = rings.map_err(|e| place(e, None))?;
        let scaled =
            "places are those of the sheet, after the outline has been scaled to its width";
        let help = width.map(|_| scaled);
        return sheet::generate(&sheet::SheetShape::Polygon { points, holes }, vertices, seed)
            .map_err(|e| place(e, help).into());
    } else {
        let shape = shape(spec).ok_or_else(|| {
            scene.error_at("sheet.shape", "no generator of this shape is registered", None)
        })?;
        sheet::generate(&shape, vertices, seed)
    };
    made.map_err(|e| scene.error_at("sheet.shape", &e.to_string(), None).into())
}

/// The start: rest positions with the imperfection and the bump, the species' first values and those of `internal`
/// variables.
pub(super) fn state(scene: &Scene, sheet: &Sheet, model: &Model) -> Result<State> {
    let x = positions(scene, sheet, scene.sheet.imperfection.as_ref());
    let species = match model.chemistry() {
        None => Vec::new(),
        Some(chemistry) => species(scene, sheet, chemistry)?,
    };
    Ok(State { time: 0.0, step: 0, x, species, internal: model.initial_internal() })
}

/// The lattice of `scene`, if its sheet is one.
///
/// # Errors
/// Too few or too many vertices for its sizes.
pub(super) fn lattice(scene: &Scene) -> Result<Option<Lattice>> {
    let SheetSource::Generated(scene::ShapeSpec::Lattice(spec)) = &scene.sheet.source else {
        return Ok(None);
    };
    let made = Lattice::new([spec.width.get(), spec.height.get()], spec.vertices.get());
    let place = |e: SheetError| scene.error_at("sheet.shape", &e.to_string(), None).into();
    made.map(Some).map_err(place)
}

/// The positions of the start without the imperfection.
pub(super) fn smooth_positions(scene: &Scene, sheet: &Sheet) -> Positions {
    positions(scene, sheet, None)
}

fn positions(scene: &Scene, sheet: &Sheet, imperfection: Option<&Imperfection>) -> Positions {
    let mut x = Positions::from(sheet);
    let normals = LazyCell::new(|| vertex_normals(sheet, sheet.rest()));
    let along = |direction: Direction, i: usize| match direction {
        Direction::Z => Vec3::z(),
        Direction::Normal => normals[i],
    };
    let interior: Vec<usize> = (0..x.len()).filter(|&i| !sheet.boundary()[i]).collect();
    if let Some(imperfection) = imperfection {
        let mut random = Sequence::new(imperfection.seed, -1.0..=1.0);
        // Of a lattice every vertex has a number drawn, so that a part need not know how many lie in the interior.
        let by_number =
            matches!(scene.sheet.source, SheetSource::Generated(scene::ShapeSpec::Lattice(_)));
        for (k, &i) in interior.iter().enumerate() {
            let share = random.draw(if by_number { sheet.number(i) } else { index(k) });
            x[i] += imperfection.amplitude.get() * share * along(imperfection.direction, i);
        }
    }
    if let Some(bump) = &scene.sheet.bump {
        let centre = Vec3::from(bump.centre.map(Finite::get));
        for &i in &interior {
            let distance = (sheet.rest()[i] - centre).norm() / bump.width.get();
            let height = bump.amplitude.get() * (-0.5 * distance * distance).exp();
            x[i] += height * along(bump.direction, i);
        }
    }
    if !sheet.reduction().periods().is_empty() {
        let mut displacement: Vec<Vec3> =
            x.iter().zip(sheet.rest()).map(|(x, rest)| x - rest).collect();
        sheet.reduction().update_ghosts(&mut displacement);
        x = sheet
            .rest()
            .iter()
            .zip(&displacement)
            .map(|(rest, by)| rest + by)
            .collect::<Vec<_>>()
            .into();
    }
    x
}

/// Rest positions of the points that carry species.
pub(super) fn points(sheet: &Sheet, location: Location) -> Vec<Vec3> {
    match location {
        Location::Vertex => sheet.places().to_vec(),
        _ => sheet.triangle_places(),
    }
}

/// What the laws of `scene` give as first values, by species, with the places.
fn given<'a>(
    scene: &'a Scene,
    descriptor: &Descriptor,
) -> Result<BTreeMap<&'a str, (String, &'a Initial)>> {
    let names: Vec<&str> = descriptor.species.iter().map(|s| s.name.as_str()).collect();
    let mut given: BTreeMap<&str, (String, &Initial)> = BTreeMap::new();
    for (number, spec) in scene.kinetics.iter().enumerate() {
        let table = format!("{}.initial", scene.kinetics_path(number));
        for (name, initial) in &spec.initial {
            if let Some(new) = spec.rename.get(name)
                && !spec.rename.values().any(|new| new == name)
            {
                let path = path_to(&table, name);
                let message = format!("this species is called `{new}` here");
                return Err(scene.error_at(&path, &message, None).into());
            }
            if descriptor.species_index(name).is_none() {
                return Err(scene.unknown_key(&table, name, "species", &names).into());
            }
            let path = path_to(&table, name);
            if given.contains_key(name.as_str()) {
                let message = "an earlier [[kinetics]] gives the start of this species already";
                return Err(scene.error_at(&path, message, None).into());
            }
            given.insert(name, (path, initial));
        }
    }
    Ok(given)
}

fn species(scene: &Scene, sheet: &Sheet, chemistry: &Chemistry) -> Result<Vec<Vec<f64>>> {
    let descriptor = chemistry.descriptor();
    let mut given = given(scene, descriptor)?;
    let at = points(sheet, chemistry.location());
    let number = |i: usize| match chemistry.location() {
        Location::Vertex => sheet.number(i),
        _ => sheet.triangle_number(i),
    };
    let mut all = Vec::new();
    for species in &descriptor.species {
        let none = || ("kinetics".to_owned(), &Initial::Uniform(Finite::ZERO));
        let (path, initial) = given.remove(species.name.as_str()).unwrap_or_else(none);
        let values = match initial {
            Initial::File(file) => from_file(scene, &path, file, (sheet, chemistry.location()))?,
            Initial::Regions(field) => {
                by_region(scene, &path, field, (sheet, chemistry.location()))?
            }
            Initial::Pattern(Pattern::Formula(text)) => {
                let path = format!("{path}.formula");
                from_formula(scene, &path, text, (sheet, chemistry.location()))?
            }
            initial => initial.values(&at, &number).unwrap_or_default(),
        };
        let wrong = values.iter().position(|c| !(*c >= species.lower && *c <= species.upper));
        if let Some(i) = wrong {
            let message = format!(
                "species `{}` starts with {} at {} {i}; it is valid from {} to {}",
                species.name,
                Short(values[i]),
                chemistry.location().noun(),
                Short(species.lower),
                Short(species.upper)
            );
            return Err(scene.error_at(&path, &message, None).into());
        }
        all.push(values);
    }
    sheet.reduction().update_ghost_columns(&mut all);
    Ok(all)
}

/// The values of a formula, one a point.
pub(super) fn from_formula(
    scene: &Scene,
    path: &str,
    text: &str,
    (sheet, location): (&Sheet, Location),
) -> Result<Vec<f64>> {
    let formula = formula_on(sheet, text, false)
        .map_err(|e| scene.error_within(path, text, &e.span, &e.message, e.help.as_deref()))?;
    Ok(formula_values(&formula, location, sheet, 0.0))
}

/// The values of a field by region, one a point.
pub(super) fn by_region(
    scene: &Scene,
    path: &str,
    field: &Field,
    (sheet, location): (&Sheet, Location),
) -> Result<Vec<f64>> {
    let place = |e: EffectError| scene.error_at(path, &e.message, e.help.as_deref());
    match field.on(location, sheet, None, "regions").map_err(place)? {
        FieldValues::Each(values) => Ok(values),
        FieldValues::Same(value) => Ok(vec![value; points(sheet, location).len()]),
    }
}

/// Reads a file that an effect, a field or a species names, if `scene` does not give it; a frame of `sheet`, if that is periodic,
/// with all images.
pub(crate) fn read_surface(
    scene: &Scene,
    sheet: &Sheet,
    file: &Path,
) -> std::result::Result<Surface, String> {
    let mut surface = match scene.given_surface(file) {
        Some(surface) => surface.clone(),
        None => sheet::read::surface(file).map_err(|e| e.to_string())?,
    };
    sheet.add_images(&mut surface)?;
    Ok(surface)
}

/// The values of the field `value`, as a scene has it, at the vertices and at the triangles of `sheet`.
///
/// # Errors
/// A value of another type, or one that cannot be evaluated there.
pub(crate) fn field_values(
    scene: &Scene,
    sheet: &Sheet,
    value: toml::Value,
) -> std::result::Result<[Vec<f64>; 2], String> {
    let field = Field::<Finite>::deserialize(value).map_err(|error| error.to_string())?;
    let read = |file: &Path| read_surface(scene, sheet, file);
    let on = |place, count: usize| match field.on(place, sheet, Some(&read), "value") {
        Ok(FieldValues::Each(values)) => Ok(values),
        Ok(FieldValues::Same(value)) => Ok(vec![value; count]),
        Err(error) => Err(error.message),
    };
    let at_vertices = on(Location::Vertex, sheet.vertex_count())?;
    Ok([at_vertices, on(Location::Face, sheet.triangle_count())?])
}

/// The values of an array of a file, one a point.
pub(super) fn from_file(
    scene: &Scene,
    path: &str,
    file: &FieldFile,
    (sheet, location): (&Sheet, Location),
) -> Result<Vec<f64>> {
    let surface = read_surface(scene, sheet, &file.file)
        .map_err(|message| scene.error_at(&format!("{path}.file"), &message, None))?;
    let (arrays, found) = match location {
        Location::Vertex => (&surface.point_arrays, surface.point_array(&file.array)),
        _ => (&surface.cell_arrays, surface.cell_array(&file.array)),
    };
    match found {
        Some(a) => {
            let on_faces = location != Location::Vertex;
            let periodic = !sheet.reduction().periods().is_empty();
            let here = match a.components {
                1 if periodic && a.values.len() == points(sheet, location).len() => {
                    Some(a.values.clone())
                }
                1 => sheet.part_of(&a.values, on_faces),
                _ => None,
            };
            if let Some(values) = here {
                return Ok(values);
            }
            let (found, points) = (a.values.len(), sheet.counts_of_whole()[usize::from(on_faces)]);
            let message = match a.components {
                1 => format!(
                    "array `{}` has {found} numbers; {points} are needed, one per {}",
                    a.name,
                    location.noun()
                ),
                many => format!("array `{}` has {many} components, and one is needed", a.name),
            };
            Err(scene.error_at(&format!("{path}.array"), &message, None).into())
        }
        None => {
            let names: Vec<&str> = arrays.iter().map(|a| a.name.as_str()).collect();
            let path = format!("{path}.array");
            Err(scene.unknown_name(&path, "array", &file.array, &names).into())
        }
    }
}
