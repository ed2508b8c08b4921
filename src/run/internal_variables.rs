//! Internal variables of effects in frames, and read back from them.
//!
//! Those of vertices and triangles are fields of these. Those of edges are point fields of the means around every vertex,
//! for pictures, and cell fields `NAME of edges` with the values of the three edges of every triangle, each opposite the
//! corner of the same number: all digits of them.

use crate::effects::InternalVariables;
use crate::kinetics::Location;
use crate::model::{Model, State};
use crate::num::real;
use crate::output::Field;
use crate::sheet::{Array, Sheet, Surface};

/// The name of the cell field with all values of edges.
fn of_edges(name: &str) -> String {
    format!("{name} of edges")
}

/// Adds those that are among `names`.
pub(super) fn add_fields<'a>(
    (model, state): (&Model, &'a State),
    names: &[String],
    (point, cell): (&mut Vec<Field<'a>>, &mut Vec<Field<'a>>),
) {
    let sheet = model.sheet();
    for (term, values) in model.internal().iter().zip(&state.internal) {
        let title = term.name().to_owned();
        if !names.contains(&title) {
            continue;
        }
        match term.location() {
            Location::Vertex => point.push(Field::scalar(title, values.as_slice())),
            Location::Face => cell.push(Field::scalar(title, values.as_slice())),
            Location::Edge => {
                let of = |edges: &[u32; 3]| edges.map(|e| values[e as usize]);
                let data: Vec<f64> = sheet.triangle_edges().iter().flat_map(of).collect();
                let name = of_edges(&title);
                cell.push(Field { name, components: 3, data: data.into() });
                point.push(Field::scalar(title, vertex_means(sheet, |e| values[e])));
            }
        }
    }
}

/// Mean over its edges at every vertex.
pub(super) fn vertex_means(sheet: &Sheet, of: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..sheet.vertex_count())
        .map(|i| {
            let around = sheet.vertex_edges().entries(i);
            let sum: f64 = around.iter().map(|&(e, _)| of(e as usize)).sum();
            sum / real(around.len())
        })
        .collect()
}

/// The values of `term` that `surface`, a state of `sheet`, has, or why it has none.
pub(super) fn read(
    term: &dyn InternalVariables,
    sheet: &Sheet,
    surface: &Surface,
) -> Result<Vec<f64>, String> {
    let name = term.name();
    let (arrays, kind, title, components) = match term.location() {
        Location::Vertex => (&surface.point_arrays, "point", name.to_owned(), 1),
        Location::Face => (&surface.cell_arrays, "cell", name.to_owned(), 1),
        Location::Edge => (&surface.cell_arrays, "cell", of_edges(name), 3),
    };
    let places = if term.location() == Location::Vertex {
        sheet.vertex_count()
    } else {
        sheet.triangle_count()
    };
    let Some(array) = arrays.iter().find(|array| array.name == title) else {
        return Err(format!(
            "the state has no {kind} array `{title}`; list {name} in output.fields of its run"
        ));
    };
    let expected = components * places;
    if array.components != components || array.values.len() != expected {
        let given = array.values.len();
        return Err(format!(
            "array `{title}` of the state has {given} numbers, expected {expected}"
        ));
    }
    let values = match term.location() {
        Location::Vertex | Location::Face => array.values.clone(),
        Location::Edge => edges(array, sheet, surface),
    };
    let wrong = |q: &f64| !q.is_finite() || term.multiplies_lengths() && *q <= 0.0;
    match values.iter().position(wrong) {
        None => Ok(values),
        Some(place) => {
            let (value, noun) = (values[place], term.location().noun());
            Err(format!("{name} of the state is {value} at {noun} {place}"))
        }
    }
}

/// The values of all edges from those of the triangles, whose corners may begin elsewhere.
fn edges(array: &Array, sheet: &Sheet, surface: &Surface) -> Vec<f64> {
    let mut values = vec![f64::NAN; sheet.edges().len()];
    for (t, (corners, edges)) in sheet.triangles().iter().zip(sheet.triangle_edges()).enumerate() {
        let theirs = surface.triangles.get(t).unwrap_or(corners);
        for (k, corner) in theirs.iter().enumerate() {
            if let Some(place) = corners.iter().position(|c| c == corner) {
                values[edges[place] as usize] = array.values[3 * t + k];
            }
        }
    }
    values
}
