//! Parameters of effects and of the material that may differ from place to place.
//!
//! ```text
//! thickness = 0.5                                        everywhere
//! thickness = "0.5 + 0.01*x"                             a formula of x, y, z (rest position, length) and of
//!                                                        distance_to_boundary (length)
//! thickness = { default = 0.5, regions = [{ where = "rim", value = 1.0 }] }
//!                                                        by region; a later region overrides an earlier one
//! thickness = { file = "plate.vtu", array = "h" }        an array of a mesh file
//! ```
//!
//! A field is read once, at the vertices or the triangles of a sheet. On triangles a formula is that of the
//! centroid, an array one of cells, or the mean over the corners of one of points. A number stays a number: nothing
//! is stored for it.

mod values;

use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error, IntoDeserializer};
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize as DeriveDeserialize, Serialize};

use super::{EffectError, Region};
use crate::kinetics::Location;
use crate::kinetics::formula::{FieldFormula, FormulaError, Places};
use crate::num::checked::{Checked, Finite};
use crate::sheet::{Sheet, Surface};

pub use values::FieldValues;

/// A reader of meshes: the engine itself reads no files.
pub type ReadSurface<'a> = dyn Fn(&Path) -> Result<Surface, String> + Sync + 'a;

/// A parameter as a scene gives it; N has its range.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Field<N = Finite> {
    /// The same everywhere.
    Number(N),
    /// A formula of `x`, `y` and `z`.
    Formula(String),
    /// An array of a mesh file with the same points or faces.
    Array {
        /// The file.
        file: PathBuf,
        /// Name of the array.
        array: String,
    },
    /// A number for each of several regions.
    Regions {
        /// The number outside of all of them.
        default: N,
        /// The regions; a later one overrides an earlier one.
        regions: Vec<RegionValue<N>>,
    },
}

/// A region with its number.
#[derive(Debug, Clone, PartialEq, Serialize, DeriveDeserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionValue<N> {
    /// Which vertices or triangles.
    #[serde(rename = "where")]
    pub region: Region,
    /// The number there.
    pub value: N,
}

impl<N: Checked> Field<N> {
    /// The number, if it is the same everywhere.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(value.value()),
            _ => None,
        }
    }

    /// Its values at the vertices or triangles of `sheet`; `key` is to blame.
    ///
    /// # Errors
    /// A formula or an array that cannot be read, a region without a vertex or triangle, a value out of range.
    pub fn on(
        &self,
        place: Location,
        sheet: &Sheet,
        read: Option<&ReadSurface<'_>>,
        key: &'static str,
    ) -> Result<FieldValues, EffectError> {
        let values = match self {
            Self::Number(value) => return Ok(FieldValues::Same(value.value())),
            Self::Formula(text) => {
                let formula = formula_on(sheet, text, false);
                let formula =
                    formula.map_err(|e| EffectError { key, message: e.message, help: e.help })?;
                formula_values(&formula, place, sheet, 0.0)
            }
            Self::Array { file, array } => of_file((file, array), place, sheet, read)
                .map_err(|(message, help)| EffectError { key, message, help })?,
            Self::Regions { default, regions } => {
                let mut values = vec![default.value(); count(place, sheet)];
                for (k, RegionValue { region, value }) in regions.iter().enumerate() {
                    let chosen = match place {
                        Location::Vertex => region.choose(sheet, "region"),
                        _ => region.choose_triangles(sheet, "region"),
                    };
                    let chosen = chosen.map_err(|e| EffectError {
                        key,
                        message: format!("regions[{k}].where: {}", e.message),
                        help: e.help,
                    })?;
                    let chosen = values.iter_mut().zip(chosen).filter(|(_, chosen)| *chosen);
                    chosen.for_each(|(place, _)| *place = value.value());
                }
                values
            }
        };
        match values.iter().position(|value| N::checked(*value).is_none()) {
            None => Ok(FieldValues::Each(values)),
            Some(i) => {
                let point = match place {
                    Location::Vertex => sheet.places()[i],
                    _ => sheet.place_of(&sheet.triangles()[i]),
                };
                let ([x, y, z], noun): ([f64; 3], _) = (point.into(), noun(place));
                let message = format!("it is {} at {noun} {i} ({x}, {y}, {z})", values[i]);
                let help =
                    Some(format!("it must be {} at the rest position of every {noun}", N::RANGE));
                Err(EffectError { key, message, help })
            }
        }
    }

    /// The file that it is read from.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Array { file, .. } => Some(file),
            _ => None,
        }
    }

    /// Makes the path of its file absolute: it counts from `folder`.
    pub fn resolve_path_against(&mut self, folder: &Path) {
        if let Self::Array { file, .. } = self {
            *file = folder.join(&*file);
        }
    }
}

impl<N> From<N> for Field<N> {
    fn from(value: N) -> Self {
        Self::Number(value)
    }
}

pub(super) fn noun(place: Location) -> &'static str {
    if place == Location::Vertex { "vertex" } else { "triangle" }
}

fn count(place: Location, sheet: &Sheet) -> usize {
    if place == Location::Vertex { sheet.vertex_count() } else { sheet.triangle_count() }
}

/// The formula of a field: of the rest position, the distance to the boundary and, if it may be `timed`, the time.
///
/// # Errors
/// If the text is not a formula, mentions anything else, or the distance to a boundary that the sheet does not have.
pub fn formula_on(sheet: &Sheet, text: &str, timed: bool) -> Result<FieldFormula, FormulaError> {
    let formula = FieldFormula::on_sheet(text, timed)?;
    check_distance(sheet, text, formula.depends_on_distance())?;
    Ok(formula)
}

/// Refuses a distance to a boundary that the sheet does not have, where `text` reads it.
pub(super) fn check_distance(sheet: &Sheet, text: &str, reads: bool) -> Result<(), FormulaError> {
    const NAME: &str = "distance_to_boundary";
    if !reads {
        return Ok(());
    }
    sheet.distances_to_boundary(false).map(drop).map_err(|message| {
        let start = text.find(NAME).unwrap_or(0);
        let help = format!("`{NAME}` is for sheets with a boundary");
        FormulaError { span: start..start + NAME.len(), message: message.into(), help: Some(help) }
    })
}

/// The values of a formula of [`formula_on`] at the vertices or triangles.
#[must_use]
pub fn formula_values(
    formula: &FieldFormula,
    place: Location,
    sheet: &Sheet,
    time: f64,
) -> Vec<f64> {
    let distances = distances(sheet, place, formula.depends_on_distance());
    match place {
        Location::Vertex => {
            formula.evaluate(Places::with_distances(sheet.places(), distances), time)
        }
        _ => formula.evaluate(Places::with_distances(&sheet.triangle_places(), distances), time),
    }
}

/// The vertices, with their distances to the boundary if a formula `reads` them.
pub(super) fn vertex_places(sheet: &Sheet, reads: bool) -> Places<'_> {
    Places::with_distances(sheet.places(), distances(sheet, Location::Vertex, reads))
}

fn distances(sheet: &Sheet, place: Location, reads: bool) -> &[f64] {
    let distances = |on_triangles| sheet.distances_to_boundary(on_triangles).unwrap_or_default();
    if reads { distances(place != Location::Vertex) } else { &[] }
}

/// The numbers of an array of a file, or why not and what would help.
fn of_file(
    (file, array): (&Path, &str),
    place: Location,
    sheet: &Sheet,
    read: Option<&ReadSurface<'_>>,
) -> Result<Vec<f64>, (String, Option<String>)> {
    let refuse = |message: String, help: Option<String>| {
        Err((format!("{}: {message}", file.display()), help))
    };
    let Some(read) = read else {
        return refuse("files are not read here".into(), Some("give numbers".into()));
    };
    let surface = read(file).map_err(|message| (message, None))?;
    let on_triangles = place != Location::Vertex;
    let on_cells = surface.cell_array(array).filter(|_| on_triangles).map(|found| (found, place));
    let on_points = || surface.point_array(array).map(|found| (found, Location::Vertex));
    let Some((found, on)) = on_cells.or_else(on_points) else {
        let cells = surface.cell_arrays.iter().filter(|_| on_triangles);
        let all = cells.chain(&surface.point_arrays);
        let names: Vec<&str> = all.map(|array| array.name.as_str()).collect();
        let help = match names.is_empty() {
            true => "the file has none".to_owned(),
            false => format!("its arrays there: {}", names.join(", ")),
        };
        return refuse(
            format!("no array `{array}` with one number per {}", noun(place)),
            Some(help),
        );
    };
    let (needed, given, name) = (count(on, sheet), found.values.len(), &found.name);
    if found.components != 1 {
        let message = format!(
            "array `{name}` has {} components, and a number per {} is needed",
            found.components,
            noun(on)
        );
        return refuse(message, Some("an array of one component".into()));
    }
    if given != needed {
        let noun = noun(on);
        let message = format!(
            "array `{name}` has {given} numbers; {needed} are needed, one per {noun} of the sheet"
        );
        return refuse(message, None);
    }
    if on_triangles && on == Location::Vertex {
        let mean = |corners: &[u32; 3]| {
            corners.iter().map(|v| found.values[*v as usize]).sum::<f64>() / 3.0
        };
        return Ok(sheet.triangles().iter().map(mean).collect());
    }
    Ok(found.values.clone())
}

/// Those of `files` that there are, by their keys: what [`EffectSpec::files`](super::EffectSpec::files) gives.
pub(super) fn named<'a, const K: usize>(
    files: [(&'static str, Option<&'a Path>); K],
) -> Vec<(&'static str, &'a Path)> {
    files.into_iter().filter_map(|(key, file)| Some((key, file?))).collect()
}

/// The keys of a table.
#[derive(DeriveDeserialize)]
#[serde(deny_unknown_fields)]
struct Table<N> {
    file: Option<PathBuf>,
    array: Option<String>,
    default: Option<N>,
    regions: Option<Vec<RegionValue<N>>>,
}

impl<N> Field<N> {
    /// The field of what a table has of its four keys.
    pub(crate) fn of_keys<E: Error>(
        of_file: (Option<PathBuf>, Option<String>),
        by_region: (Option<N>, Option<Vec<RegionValue<N>>>),
    ) -> Result<Self, E> {
        match (of_file, by_region) {
            ((Some(file), Some(array)), (None, None)) => Ok(Self::Array { file, array }),
            ((None, None), (Some(default), Some(regions))) => {
                Ok(Self::Regions { default, regions })
            }
            _ => Err(Error::custom(
                "a field has both keys `default` and `regions`, or both keys `file` and `array`",
            )),
        }
    }
}

impl<'de, N: Checked + DeserializeOwned> Deserialize<'de> for Field<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Seen<N>(PhantomData<N>);

        impl<'de, N: Checked + DeserializeOwned> Visitor<'de> for Seen<N> {
            type Value = Field<N>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(
                    f,
                    "{}, a formula of x, y and z, or a table by regions or of a file",
                    N::RANGE
                )
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Field<N>, E> {
                N::deserialize(value.into_deserializer()).map(Field::Number)
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Field<N>, E> {
                N::deserialize(value.into_deserializer()).map(Field::Number)
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Field<N>, E> {
                Ok(Field::Formula(text.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Field<N>, A::Error> {
                let table = Table::<N>::deserialize(MapAccessDeserializer::new(map))?;
                Field::of_keys((table.file, table.array), (table.default, table.regions))
            }
        }

        deserializer.deserialize_any(Seen(PhantomData))
    }
}
