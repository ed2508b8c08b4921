//! Physical groups in Gmsh's files: arrays, 1 in the group and 0 elsewhere, on triangles of groups of surfaces, and on points of
//! groups of curves.
//!
//! Version 2 has the number of the group at each element; version 4 has those of each entity, and the entity at each block
//! of elements. `$PhysicalNames` gives numbers a name; a group without one is called by its number.

use std::collections::{BTreeMap, HashMap};

use super::stream::{Coding, Scalar, Stream};
use crate::Surface;
use crate::surface::Array;

/// Dimensions of curves and surfaces.
const CURVE: usize = 1;
const SURFACE: usize = 2;

/// Groups that are read of every mesh, and numbers in all arrays together to which more are.
const MIN_GROUPS: usize = 32;
const MAX_NUMBERS: usize = 1 << 24;

/// What is read of them.
#[derive(Debug, Default)]
pub(super) struct PhysicalGroups {
    /// By their dimensions and numbers.
    names: HashMap<(usize, i64), String>,
    /// Groups of each entity, by its dimension and number, in version 4.
    of_entity: Option<HashMap<(usize, i64), Vec<i64>>>,
    /// Entity of every polygon, or its group in version 2.
    entities: Vec<i64>,
    /// Nodes of every line, and the same.
    lines: Vec<([u32; 2], i64)>,
}

impl PhysicalGroups {
    /// Reads `count` lines of `$PhysicalNames`: dimension, number and name in quotation marks, text in binary files too.
    pub(super) fn read_names(&mut self, stream: &mut Stream, count: usize) -> Result<(), String> {
        let coding = std::mem::replace(&mut stream.coding, Coding::Text);
        for k in 0..count {
            let what = format!("physical group {k}");
            let dimension = stream.count(Scalar::I32, &what)?;
            let number = stream.integer(Scalar::I32, &what)?;
            let name = String::from_utf8_lossy(stream.line().unwrap_or_default());
            if [CURVE, SURFACE].contains(&dimension) {
                self.names.insert((dimension, number), name.trim_matches('"').to_owned());
            }
        }
        stream.coding = coding;
        Ok(())
    }

    /// Reads `$Entities` of version 4; `box_of_point`: points have a bounding box in place of coordinates, as in 4.0.
    pub(super) fn read_entities(
        &mut self,
        stream: &mut Stream,
        box_of_point: bool,
    ) -> Result<(), String> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = stream.count(Scalar::U64, "the number of entities")?;
        }
        let mut of_entity = HashMap::new();
        for (dimension, &count) in counts.iter().enumerate() {
            for k in 0..count {
                let what = format!("entity {k} of dimension {dimension}");
                let entity = stream.integer(Scalar::I32, &what)?;
                let coordinates = if dimension > 0 || box_of_point { 6 } else { 3 };
                for _ in 0..coordinates {
                    stream.real(Scalar::F64, &what)?;
                }
                let mut numbers = || {
                    let count = stream.count(Scalar::U64, &what)?;
                    (0..count).map(|_| stream.integer(Scalar::I32, &what)).collect()
                };
                let groups: Result<Vec<i64>, String> = numbers();
                let groups = groups?;
                if dimension > 0 {
                    numbers()?;
                }
                if [CURVE, SURFACE].contains(&dimension) {
                    of_entity.insert((dimension, entity), groups);
                }
            }
        }
        self.of_entity = Some(of_entity);
        Ok(())
    }

    /// Adds a polygon of an entity, in version 2 of a group.
    pub(super) fn push(&mut self, entity: i64) {
        self.entities.push(entity);
    }

    /// Adds a line between two nodes, likewise.
    pub(super) fn push_line(&mut self, ends: [u32; 2], entity: i64) {
        self.lines.push((ends, entity));
    }

    /// Gives `surface` an array a group of surfaces; `polygons` are those of its triangles.
    pub(super) fn of_surfaces(
        &self,
        surface: &mut Surface,
        polygons: impl ExactSizeIterator<Item = usize>,
    ) {
        let count = polygons.len();
        let elements = polygons.enumerate().map(|(t, polygon)| ([t; 2], self.entities[polygon]));
        (surface.cell_arrays, _) = self.arrays(SURFACE, count, elements, &mut surface.notes);
    }

    /// Gives `surface` an array a group of curves, on the points that nodes have become, those from its number of points on being
    /// none; a name that surfaces have is theirs. The number of lines of no group.
    pub(super) fn of_curves(&self, surface: &mut Surface, points: &[u32]) -> usize {
        let count = surface.points.len();
        let place = |node: u32| points[node as usize] as usize;
        let elements = self.lines.iter().map(|(ends, entity)| (ends.map(place), *entity));
        let (mut arrays, loose) = self.arrays(CURVE, count, elements, &mut surface.notes);
        arrays.retain(|curve| {
            let free = surface.cell_arrays.iter().all(|array| array.name != curve.name);
            if !free {
                let name = &curve.name;
                let note = format!(
                    "the physical group `{name}` of curves is left out: surfaces have that name"
                );
                surface.notes.push(note);
            }
            free
        });
        surface.point_arrays = arrays;
        loose
    }

    /// For every group of a dimension 1 at those of `count` places that belong to it and 0 elsewhere, by elements with two places and
    /// an entity; the number of elements of no group.
    fn arrays(
        &self,
        dimension: usize,
        count: usize,
        elements: impl Iterator<Item = ([usize; 2], i64)>,
        notes: &mut Vec<String>,
    ) -> (Vec<Array>, usize) {
        let mut members = BTreeMap::<u64, Vec<f64>>::new();
        let most = MIN_GROUPS.max(MAX_NUMBERS / count.max(1));
        let (mut left_out, mut loose) = (false, 0);
        for (places, entity) in elements {
            let groups = match &self.of_entity {
                Some(of) => of.get(&(dimension, entity)).map_or(&[][..], Vec::as_slice),
                None => std::slice::from_ref(&entity),
            };
            // A negative number is that of a group with the opposite orientation.
            let groups = groups.iter().map(|group| group.unsigned_abs()).filter(|group| *group > 0);
            loose += usize::from(groups.clone().next().is_none());
            for group in groups {
                if members.len() < most || members.contains_key(&group) {
                    let values = members.entry(group).or_insert_with(|| vec![0.0; count]);
                    places.iter().filter(|k| **k < count).for_each(|k| values[*k] = 1.0);
                } else {
                    left_out = true;
                }
            }
        }
        if left_out {
            notes.push(format!("of the physical groups, {most} were read and the others ignored"));
        }
        let name = |number: u64| {
            let known = i64::try_from(number).ok();
            let known = known.and_then(|number| self.names.get(&(dimension, number)));
            known.cloned().unwrap_or_else(|| number.to_string())
        };
        let array = |(number, values)| Array { name: name(number), components: 1, values };
        (members.into_iter().map(array).collect(), loose)
    }
}
