//! Chunks of a data set: filters undone, rows copied.

use std::io::Read;

use super::read::{Dataset, MAX_BYTES, MAX_TIMES, short};

/// Rows that are wanted of a data set.
pub(crate) struct Wanted<'a> {
    pub(crate) set: &'a Dataset,
    /// Rows of a chunk.
    pub(crate) chunk: u64,
    pub(crate) columns: u64,
    pub(crate) start: u64,
    pub(crate) count: u64,
}

impl Wanted<'_> {
    /// Undoes the filters of a chunk, less those that `left_out` names by their bits.
    pub(crate) fn unpacked(&self, stored: Vec<u8>, left_out: u32) -> Result<Vec<u8>, String> {
        let size = self.set.number.size();
        let whole = self.chunk.checked_mul(self.columns).and_then(|n| n.checked_mul(size as u64));
        let most = (stored.len() as u64 + 64).saturating_mul(MAX_TIMES);
        let whole =
            whole.filter(|n| *n <= MAX_BYTES && *n <= most).ok_or("a chunk is too large")?;
        let mut bytes = stored;
        for (k, filter) in self.set.filters.iter().enumerate().rev() {
            if left_out >> k & 1 == 1 {
                continue;
            }
            bytes = match filter {
                1 => {
                    let mut out = Vec::new();
                    let mut decoder = flate2::read::ZlibDecoder::new(&bytes[..]).take(whole);
                    let read = decoder.read_to_end(&mut out);
                    read.map_err(|e| format!("a chunk cannot be inflated ({e}): it is damaged"))?;
                    out
                }
                2 => {
                    let n = bytes.len() / size;
                    let mut out = vec![0; bytes.len()];
                    for (i, byte) in bytes.iter().enumerate().take(n * size) {
                        out[i % n * size + i / n] = *byte;
                    }
                    out
                }
                _ => {
                    return Err(format!(
                        "filter {filter} of a data set; shuffle (2) and deflate (1) are read"
                    ));
                }
            };
        }
        Ok(bytes)
    }

    /// Copies the wanted rows of the chunk that begins at row `first`.
    pub(crate) fn copy(&self, first: u64, bytes: &[u8], values: &mut [f64]) -> Result<(), String> {
        let size = self.set.number.size();
        let columns = usize::try_from(self.columns).map_err(|_| short())?;
        let from = first.max(self.start);
        let end = first.saturating_add(self.chunk).min(self.start + self.count);
        let place = |row: u64, base: u64| usize::try_from(row - base).map_err(|_| short());
        let (source, target) = (place(from, first)? * columns, place(from, self.start)? * columns);
        let n = place(end, from)? * columns;
        let given = bytes.get(source * size..(source + n) * size).ok_or_else(short)?;
        let target = values.get_mut(target..target + n).ok_or_else(short)?;
        for (value, bytes) in target.iter_mut().zip(given.chunks_exact(size)) {
            *value = self.set.number.value(bytes);
        }
        Ok(())
    }
}
