//! How the columns of a call lie in the data of a lane, as both sides reckon it.
//!
//! First a word for each input, 1 where it varies and 0 where one value serves all points; then the
//! inputs, then the outputs. Each begins on a line of the cache of its own, and behind every output
//! is a guard line, to which no write is permitted.

use smallvec::SmallVec;

use super::memory::Lane;

/// Bytes of a line of the cache.
const CACHE_LINE: usize = 64;
const WORD_BYTES: usize = size_of::<u64>();

/// Where the columns are: offset into the data, and values.
#[derive(Debug)]
pub(super) struct ColumnLayout {
    pub(super) inputs: SmallVec<[(usize, usize); 8]>,
    pub(super) outputs: SmallVec<[(usize, usize); 8]>,
    pub(super) bytes: usize,
}

impl ColumnLayout {
    /// Of inputs that vary or do not, and so many outputs, at so many points; `None` if there are too
    /// many for an address.
    pub(super) fn new(
        vary: impl ExactSizeIterator<Item = bool>,
        outputs: usize,
        count: usize,
    ) -> Option<Self> {
        let mut bytes = vary.len().checked_mul(WORD_BYTES)?.checked_next_multiple_of(CACHE_LINE)?;
        let mut next = |values: usize, margin: usize| -> Option<(usize, usize)> {
            let start = bytes;
            let end = start.checked_add(values.checked_mul(WORD_BYTES)?)?;
            bytes = end.checked_next_multiple_of(CACHE_LINE)?.checked_add(margin)?;
            Some((start, values))
        };
        let inputs =
            vary.map(|v| next(if v { count } else { 1 }, 0)).collect::<Option<SmallVec<_>>>()?;
        let outputs =
            (0..outputs).map(|_| next(count, CACHE_LINE)).collect::<Option<SmallVec<_>>>()?;
        Some(Self { inputs, outputs, bytes })
    }

    /// The words from the end of an output to the next column.
    pub(super) fn guard(&self, output: usize) -> (usize, usize) {
        let (start, values) = self.outputs[output];
        let end = start + values * WORD_BYTES;
        let next = self.outputs.get(output + 1).map_or(self.bytes, |next| next.0);
        (end, (next - end) / WORD_BYTES)
    }
}

impl Lane {
    /// Numbers of the data.
    ///
    /// # Safety
    /// They fit into the [room](Lane::room), the offset is that of a word, and no write is concurrent.
    pub(super) unsafe fn values(&self, (offset, values): (usize, usize)) -> &[f64] {
        // SAFETY: as promised; the data begin on a page boundary.
        unsafe { std::slice::from_raw_parts(self.data().add(offset).cast(), values) }
    }

    /// Numbers of the data, to be written.
    ///
    /// # Safety
    /// There is [room](Lane::room) for them, the offset is that of a word, and no other thread uses them meanwhile.
    #[allow(clippy::mut_from_ref)]
    pub(super) unsafe fn values_mut(&self, (offset, values): (usize, usize)) -> &mut [f64] {
        // SAFETY: as promised; the data begin on a page boundary.
        unsafe { std::slice::from_raw_parts_mut(self.data().add(offset).cast(), values) }
    }
}
