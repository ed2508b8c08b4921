//! Lists of unequal lengths, one after the other in one vector.

/// The lists: that of number i is `item[start[i]..start[i + 1]]`.
pub(super) struct CompressedLists<T> {
    pub(super) start: Vec<usize>,
    pub(super) item: Vec<T>,
}

impl<T> CompressedLists<T> {
    /// None as yet.
    pub(super) fn new() -> Self {
        Self { start: vec![0], item: Vec::new() }
    }

    /// Adds a list.
    pub(super) fn push(&mut self, list: impl IntoIterator<Item = T>) {
        self.item.extend(list);
        self.start.push(self.item.len());
    }

    /// List number `i`.
    pub(super) fn list(&self, i: usize) -> &[T] {
        &self.item[self.start[i]..self.start[i + 1]]
    }
}

impl<T: Copy> CompressedLists<T> {
    /// `count` lists of the `pairs` (number of its list, item), each in the order of the pairs.
    pub(super) fn sorted<I>(count: usize, pairs: impl Fn() -> I) -> Self
    where
        I: Iterator<Item = (usize, T)>,
    {
        let mut start = vec![0; count + 1];
        pairs().for_each(|(list, _)| start[list + 1] += 1);
        (0..count).for_each(|list| start[list + 1] += start[list]);
        let Some((_, filler)) = pairs().next() else { return Self { start, item: Vec::new() } };
        let (mut next, mut item) = (start.clone(), vec![filler; start[count]]);
        for (list, value) in pairs() {
            item[next[list]] = value;
            next[list] += 1;
        }
        Self { start, item }
    }
}

impl CompressedLists<u32> {
    /// Adds the numbers in `scratch`, ascending, each once, and empties it.
    pub(super) fn push_set(&mut self, scratch: &mut Vec<u32>) {
        scratch.sort_unstable();
        scratch.dedup();
        self.push(scratch.drain(..));
    }
}
