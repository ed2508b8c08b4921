//! Safe views of the columns that the engine hands over.
#![allow(unsafe_code)]

use std::marker::PhantomData;

use rumple_plugin_abi::{Batch, Column, ColumnMut};

use crate::Failure;

/// Input columns, species first, then signals.
pub(crate) struct Inputs<'a> {
    pub(crate) points: usize,
    species: &'a [Column],
    signals: &'a [Column],
}

impl<'a> Inputs<'a> {
    /// # Safety
    /// `batch` is null or describes columns that are readable at `count` points for `'a`.
    pub(crate) unsafe fn new(
        batch: *const Batch,
        species: usize,
        signals: usize,
    ) -> Result<Self, Failure> {
        // SAFETY: null or valid by the caller's promise.
        let Some(batch) = (unsafe { batch.as_ref() }) else {
            return Err(Failure::fatal("the engine gave no batch"));
        };
        if batch.species_count != species || batch.signal_count != signals {
            return Err(Failure::Fatal(format!(
                "the engine gave {} species and {} signal columns; expected {species} and {signals}",
                batch.species_count, batch.signal_count
            )));
        }
        Ok(Self {
            points: batch.count,
            // SAFETY: the arrays hold as many columns as the batch says.
            species: unsafe { array(batch.species, species)? },
            // SAFETY: as above.
            signals: unsafe { array(batch.signals, signals)? },
        })
    }

    pub(crate) fn species(&self, at: usize) -> impl Iterator<Item = f64> {
        debug_assert!(at < self.points);
        // SAFETY: every column is readable at every point of the batch.
        self.species.iter().map(move |column| unsafe { *column.data.add(at * column.stride) })
    }

    pub(crate) fn signals(&self, at: usize) -> impl Iterator<Item = f64> {
        debug_assert!(at < self.points);
        // SAFETY: every column is readable at every point of the batch.
        self.signals.iter().map(move |column| unsafe { *column.data.add(at * column.stride) })
    }
}

/// Output columns.
pub(crate) struct Outputs<'a> {
    points: usize,
    columns: &'a [ColumnMut],
    exclusive: PhantomData<&'a mut f64>,
}

impl<'a> Outputs<'a> {
    /// # Safety
    /// `columns` is null or holds `count` columns that nobody else touches for `'a`, each
    /// writable at `points` points.
    pub(crate) unsafe fn new(
        columns: *const ColumnMut,
        count: usize,
        points: usize,
    ) -> Result<Self, Failure> {
        // SAFETY: the caller's promise.
        let columns = unsafe { array(columns, count)? };
        Ok(Self { points, columns, exclusive: PhantomData })
    }

    pub(crate) fn set(&mut self, column: usize, at: usize, value: f64) {
        debug_assert!(at < self.points);
        let column = &self.columns[column];
        // SAFETY: the column is ours alone and writable at every point of the batch.
        unsafe { *column.data.add(at * column.stride) = value };
    }
}

/// # Safety
/// `data` is null or the start of `count` elements that live for `'a`.
unsafe fn array<'a, T>(data: *const T, count: usize) -> Result<&'a [T], Failure> {
    if count == 0 {
        Ok(&[])
    } else if data.is_null() {
        Err(Failure::fatal("the engine gave no columns"))
    } else {
        // SAFETY: the caller's promise, and not null.
        Ok(unsafe { std::slice::from_raw_parts(data, count) })
    }
}
