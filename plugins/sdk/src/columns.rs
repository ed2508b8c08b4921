//! Safe views of the columns that the engine hands over, block by block.
//!
//! Laws read and write plain contiguous numbers: a column that is stored otherwise (one value for
//! all points, or one component of many) is copied to a buffer first.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;
use std::ptr;

use rumple_plugin_abi::{Batch, Column, ColumnMut};

use crate::Failure;

/// Points in a block: small enough for its columns to stay on the stack and in the first-level cache.
pub(crate) const BLOCK: usize = 256;

/// The input columns of a batch.
pub(crate) struct Inputs<'a> {
    pub(crate) points: usize,
    species: &'a [Column],
    signals: &'a [Column],
    parameters: &'a [Column],
}

impl<'a> Inputs<'a> {
    /// # Safety
    /// `batch` is null or describes columns that are readable at `count` points for `'a`.
    pub(crate) unsafe fn new(
        batch: *const Batch,
        species: usize,
        signals: usize,
        parameters: usize,
    ) -> Result<Self, Failure> {
        // SAFETY: null or valid by the caller's promise.
        let Some(batch) = (unsafe { batch.as_ref() }) else {
            return Err(Failure::fatal("the engine gave no batch"));
        };
        let (points, given, read) = (batch.count, batch.species_count, batch.signal_count);
        if given != species || read != signals {
            return Err(Failure::Fatal(format!(
                "the engine gave {given} species and {read} signal columns; expected {species} and \
                 {signals}",
            )));
        }
        if batch.parameter_count != 0 && batch.parameter_count != parameters {
            return Err(Failure::Fatal(format!(
                "the engine gave {} parameter columns; expected {parameters} or none",
                batch.parameter_count
            )));
        }
        // SAFETY: the arrays hold as many columns as the batch says.
        let (species, signals, fields) = unsafe {
            (
                array(batch.species, species)?,
                array(batch.signals, signals)?,
                array(batch.parameters, batch.parameter_count)?,
            )
        };
        Ok(Self { points, species, signals, parameters: fields })
    }

    /// Species first, then signals.
    fn columns(&self) -> impl Iterator<Item = &Column> {
        self.species.iter().chain(self.signals)
    }

    /// Whether parameters differ from point to point.
    pub(crate) fn has_fields(&self) -> bool {
        !self.parameters.is_empty()
    }

    /// The parameters at a point.
    pub(crate) fn parameters(&self, at: usize, out: &mut [f64]) {
        debug_assert!(at < self.points);
        for (out, column) in out.iter_mut().zip(self.parameters) {
            // SAFETY: every column is readable at every point of the batch.
            *out = unsafe { *column.data.add(at * column.stride) };
        }
    }

    /// Where parameters begin to differ from those at `start`, at or before `end`.
    pub(crate) fn same_parameters(&self, start: usize, end: usize) -> usize {
        // SAFETY: every column is readable at every point of the batch.
        let value = |column: &Column, at: usize| unsafe { *column.data.add(at * column.stride) };
        let same = |at: usize| {
            self.parameters.iter().all(|c| value(c, at).to_bits() == value(c, start).to_bits())
        };
        (start + 1..end).find(|at| !same(*at)).unwrap_or(end)
    }

    /// A buffer for [`Inputs::block`].
    pub(crate) fn buffer(&self) -> Vec<f64> {
        let scattered = self.columns().filter(|column| column.stride != 1).count();
        vec![0.0; scattered * BLOCK]
    }

    /// Contiguous columns of `count` points from `start` on, at most [`BLOCK`] if there is a buffer:
    /// one start a column, which is readable at `count` points until the buffer is used again.
    pub(crate) fn block(
        &self,
        start: usize,
        count: usize,
        buffer: &mut [f64],
        out: &mut [*const f64],
    ) {
        debug_assert!(start + count <= self.points);
        let mut rest = buffer.chunks_exact_mut(BLOCK);
        for (out, column) in out.iter_mut().zip(self.columns()) {
            // SAFETY: every column is readable at every point of the batch.
            let from = unsafe { column.data.add(start * column.stride) };
            *out = from;
            if column.stride != 1
                && let Some(copy) = rest.next()
            {
                for (at, copy) in copy[..count].iter_mut().enumerate() {
                    // SAFETY: as above.
                    *copy = unsafe { *from.add(at * column.stride) };
                }
                *out = copy.as_ptr();
            }
        }
    }
}

/// Output columns.
pub(crate) struct Outputs<'a>(&'a [ColumnMut]);

impl<'a> Outputs<'a> {
    /// # Safety
    /// `columns` is null or holds `count` columns for `'a`.
    pub(crate) unsafe fn new(columns: *const ColumnMut, count: usize) -> Result<Self, Failure> {
        // SAFETY: the caller's promise.
        Ok(Self(unsafe { array(columns, count)? }))
    }

    /// Where the values of a column go.
    pub(crate) fn target(&self, column: usize) -> Target {
        Target(self.0[column])
    }
}

/// Room for a number.
pub(crate) type Slot = MaybeUninit<f64>;

/// Where the results of one kind go: a column of the batch, or nowhere.
#[derive(Clone, Copy)]
pub(crate) struct Target(ColumnMut);

impl Target {
    /// A sink for results that were not requested.
    pub(crate) const NOWHERE: Self = Self(ColumnMut { data: ptr::null_mut(), stride: 0 });

    /// Whether the values of successive points lie side by side.
    pub(crate) fn side_by_side(self) -> bool {
        self.0.stride == 1
    }

    /// The points from one on as they lie in memory, if they lie side by side.
    ///
    /// # Safety
    /// The column is writable at these points, and not accessed otherwise during `'a`.
    pub(crate) unsafe fn direct<'a>(self, first: usize, count: usize) -> Option<&'a mut [Slot]> {
        self.side_by_side().then(|| {
            // SAFETY: the caller's promise.
            unsafe { std::slice::from_raw_parts_mut(self.0.data.add(first).cast(), count) }
        })
    }

    /// Writes values from a point on, if the points do not lie side by side.
    ///
    /// # Safety
    /// The column is writable at these points, not accessed otherwise, and the values are
    /// initialised.
    pub(crate) unsafe fn scatter(self, first: usize, values: &[Slot]) {
        let ColumnMut { data, stride } = self.0;
        if data.is_null() || self.side_by_side() {
            return;
        }
        for (k, value) in values.iter().enumerate() {
            // SAFETY: the caller's promise.
            unsafe { *data.add((first + k) * stride) = value.assume_init() };
        }
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

pub(crate) const fn text(text: &rumple_plugin_abi::Str) -> &'static str {
    // SAFETY: made by `Str::new` from a `&'static str`: the fields of a Rust model are constants.
    unsafe { str::from_utf8_unchecked(std::slice::from_raw_parts(text.data, text.length)) }
}
