//! Arrays of a mesh file, by whose values vertices and triangles are chosen.

use crate::surface::{Attributes, named};
use crate::{Array, Sheet};

impl Sheet {
    /// The names of the arrays of one component that the mesh file has: on points, on cells.
    #[must_use]
    pub fn array_names(&self) -> [Vec<&str>; 2] {
        let arrays = self.attributes().map(|attributes| &attributes.arrays);
        [0, 1].map(|kind| {
            let names = arrays.iter().flat_map(|arrays| &arrays[kind]);
            names.map(|array| array.name.as_str()).collect()
        })
    }

    /// For every vertex, or every triangle, whether the value of the array `name` of the mesh file lies from `least` to
    /// `most`. Of an array on cells the vertices are those of the triangles; of one on points a triangle is one of which a
    /// corner is. `None` where no array has this name.
    #[must_use]
    pub fn where_array(
        &self,
        name: &str,
        [least, most]: [f64; 2],
        on_triangles: bool,
    ) -> Option<Vec<bool>> {
        let Attributes { arrays, triangles } = &**self.attributes()?;
        let find = |kind: usize| named(&arrays[kind], name);
        let own = usize::from(on_triangles);
        let chosen = |array: &Array| -> Vec<bool> {
            array.values.iter().map(|value| (least..=most).contains(value)).collect()
        };
        if let Some(array) = find(own) {
            return self.part_of(&chosen(array), on_triangles);
        }
        let other = chosen(find(1 - own)?);
        let mut mask = vec![false; self.counts_of_whole()[own]];
        for (t, corners) in triangles.iter().enumerate() {
            for &v in corners {
                match on_triangles {
                    true => mask[t] |= other[v as usize],
                    false => mask[v as usize] |= other[t],
                }
            }
        }
        self.part_of(&mask, on_triangles)
    }
}
