//! The index of the chunks of a data set: a B-tree of version 1 that grows at its right edge.
//!
//! ```text
//! node     "TREE", type 1, level, entries (u16), left, right, key 0, child 0, key 1, …, child n-1, key n
//! key      bytes of the chunk (u32), filters left out (u32), first row and column, 0
//! ```
//!
//! Key n bounds the node to the right; that of the last node is beyond any row. An entry is written behind the last one,
//! where nothing reads it, and then counted.

use super::extendible::Changes;
use super::object::UNDEFINED;

/// Most entries of a node; HDF5's default, which superblock 0 cannot change.
const MAX_ENTRIES: usize = 64;

/// Bytes before the first key.
const NODE_HEADER_BYTES: usize = 24;

/// The chunk that begins at a row.
#[derive(Debug, Clone, Copy)]
struct Key {
    bytes: u32,
    row: u64,
}

/// The node at the right edge of a level.
#[derive(Debug, Clone, Copy)]
struct Node {
    address: u64,
    used: usize,
}

/// The tree of one data set.
#[derive(Debug)]
pub(crate) struct Tree {
    /// Extents of the data set.
    rank: usize,
    /// Beyond all rows, and a multiple of the rows of a chunk.
    beyond: u64,
    /// Where the address of the root is written.
    root_at: u64,
    /// Right edge, leaves first.
    edge: Vec<Node>,
    first: Option<Key>,
}

impl Tree {
    /// A tree without nodes.
    pub(crate) fn new(rank: usize, chunk_rows: u64, root_at: u64) -> Self {
        let chunk_rows = chunk_rows.max(1);
        let beyond = (u64::MAX >> 2) / chunk_rows * chunk_rows;
        Self { rank, beyond, root_at, edge: Vec::new(), first: None }
    }

    /// Adds the chunk of `bytes` at `address`, which begins at `row`, after all others.
    pub(crate) fn add(&mut self, row: u64, bytes: usize, address: u64, changes: &mut Changes) {
        let key = Key { bytes: u32::try_from(bytes).unwrap_or(u32::MAX), row };
        self.first.get_or_insert(key);
        self.insert(0, key, address, changes);
    }

    fn insert(&mut self, level: usize, key: Key, child: u64, changes: &mut Changes) {
        let Some(node) = self.edge.get_mut(level) else {
            let address = changes.append(self.node(level, UNDEFINED, &[(key, child)]));
            self.edge.push(Node { address, used: 1 });
            changes.publish(self.root_at, address.to_le_bytes().to_vec());
            return;
        };
        if node.used < MAX_ENTRIES {
            let Node { address, used } = *node;
            node.used += 1;
            let at = address + (NODE_HEADER_BYTES + used * (8 + self.key_size())) as u64;
            let entry = [self.key(key), child.to_le_bytes().to_vec(), self.end()].concat();
            changes.prepare(at, entry);
            let count = u16::try_from(used + 1).unwrap_or(u16::MAX);
            changes.publish(address + 6, count.to_le_bytes().to_vec());
            return;
        }
        let old = node.address;
        let new = changes.append(self.node(level, old, &[(key, child)]));
        self.edge[level] = Node { address: new, used: 1 };
        changes.publish(old + 16, new.to_le_bytes().to_vec());
        if level + 1 < self.edge.len() {
            self.insert(level + 1, key, new, changes);
            return;
        }
        // The full node was the root: one above it and the new one takes its place.
        let first = self.first.unwrap_or(key);
        let root = changes.append(self.node(level + 1, UNDEFINED, &[(first, old), (key, new)]));
        self.edge.push(Node { address: root, used: 2 });
        changes.publish(self.root_at, root.to_le_bytes().to_vec());
    }

    fn key_size(&self) -> usize {
        8 + 8 * (self.rank + 1)
    }

    fn key(&self, key: Key) -> Vec<u8> {
        let mut out = key.bytes.to_le_bytes().to_vec();
        out.extend([0; 4]);
        out.extend(key.row.to_le_bytes());
        out.resize(self.key_size(), 0);
        out
    }

    /// The key to the right of all chunks.
    fn end(&self) -> Vec<u8> {
        self.key(Key { bytes: 0, row: self.beyond })
    }

    fn node(&self, level: usize, left: u64, entries: &[(Key, u64)]) -> Vec<u8> {
        let mut out = b"TREE\x01".to_vec();
        out.push(u8::try_from(level).unwrap_or(u8::MAX));
        out.extend(u16::try_from(entries.len()).unwrap_or(u16::MAX).to_le_bytes());
        out.extend(left.to_le_bytes());
        out.extend(UNDEFINED.to_le_bytes());
        for (key, child) in entries {
            out.extend(self.key(*key));
            out.extend(child.to_le_bytes());
        }
        out.extend(self.end());
        out.resize(NODE_HEADER_BYTES + MAX_ENTRIES * 8 + (MAX_ENTRIES + 1) * self.key_size(), 0);
        out
    }
}
