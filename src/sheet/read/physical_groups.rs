//! Physical groups of surfaces in Gmsh's files: arrays on triangles, 1 in the group and 0 elsewhere.
//!
//! Version 2 has the number of the group at each element; version 4 has those of each entity, and the entity at each block
//! of elements. `$PhysicalNames` gives numbers a name; a group without one is called by its number.

use std::collections::{BTreeMap, HashMap};

use super::stream::{Coding, Scalar, Stream};
use crate::Surface;
use crate::surface::Array;

/// Dimension of a surface.
const SURFACE: usize = 2;

/// Groups that are read of every mesh, and numbers in all arrays together to which more are.
const MIN_GROUPS: usize = 32;
const MAX_NUMBERS: usize = 1 << 24;

/// What is read of them.
#[derive(Debug, Default)]
pub(super) struct PhysicalGroups {
    /// By their numbers.
    names: HashMap<i64, String>,
    /// Groups of each surface entity, in version 4.
    of_entity: Option<HashMap<i64, Vec<i64>>>,
    /// Entity of every polygon, or its group in version 2.
    entities: Vec<i64>,
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
            if dimension == SURFACE {
                self.names.insert(number, name.trim_matches('"').to_owned());
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
                if dimension == SURFACE {
                    of_entity.insert(entity, groups);
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

    /// Gives `surface` an array a group; `polygons` are those of its triangles.
    pub(super) fn finish(
        self,
        surface: &mut Surface,
        polygons: impl ExactSizeIterator<Item = usize>,
    ) {
        let (mut members, triangles) = (BTreeMap::<u64, Vec<f64>>::new(), polygons.len());
        let most = MIN_GROUPS.max(MAX_NUMBERS / triangles.max(1));
        let mut left_out = false;
        for (t, polygon) in polygons.enumerate() {
            let entity = &self.entities[polygon];
            let groups = match &self.of_entity {
                Some(of_entity) => of_entity.get(entity).map_or(&[][..], Vec::as_slice),
                None => std::slice::from_ref(entity),
            };
            // A negative number is that of a group with the opposite orientation.
            for group in groups.iter().map(|group| group.unsigned_abs()).filter(|group| *group > 0)
            {
                if members.len() < most || members.contains_key(&group) {
                    members.entry(group).or_insert_with(|| vec![0.0; triangles])[t] = 1.0;
                } else {
                    left_out = true;
                }
            }
        }
        if left_out {
            let note = format!("of the physical groups, {most} were read and the others ignored");
            surface.notes.push(note);
        }
        let name = |number: u64| {
            let known = i64::try_from(number).ok().and_then(|number| self.names.get(&number));
            known.cloned().unwrap_or_else(|| number.to_string())
        };
        let array = |(number, values)| Array { name: name(number), components: 1, values };
        surface.cell_arrays = members.into_iter().map(array).collect();
    }
}
