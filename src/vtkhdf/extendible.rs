//! A file of groups and data sets of which some are extended by a fixed number of rows with every frame.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

/// Takes what is written, in this order.
pub trait Disk {
    /// Writes bytes from byte `at` on.
    ///
    /// # Errors
    /// Those of the operating system.
    fn write(&mut self, at: u64, bytes: &[u8]) -> io::Result<()>;

    /// Returns when everything written is on the disk.
    ///
    /// # Errors
    /// Those of the operating system.
    fn sync(&mut self) -> io::Result<()>;
}

impl Disk for File {
    fn write(&mut self, at: u64, bytes: &[u8]) -> io::Result<()> {
        self.seek(SeekFrom::Start(at))?;
        self.write_all(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.sync_data()
    }
}

use super::object::{Attribute, Kind, Layout, UNDEFINED, attribute, dataset, header, padded};
use super::tree::Tree;

/// Rows of a chunk of a data set that a frame extends by one number.
const ROWS_PER_CHUNK: u64 = 64;

/// Most links of a group: they stand in one node of the symbol table.
pub(crate) const MAX_LINKS: usize = 2 * MAX_LEAF_LINKS as usize;
const MAX_LEAF_LINKS: u16 = 128;

/// Where the address of the end of the file is in the superblock.
const END_AT: u64 = 40;

/// How a frame extends a data set.
#[derive(Debug, Clone)]
pub(crate) enum Extension {
    /// By one chunk of so many rows.
    Chunk(u64),
    /// By one number.
    Number,
    /// By one row that holds the fill value and is not stored.
    Constant(u64),
}

/// An extendible data set: type, columns if it has any, extension, compression.
#[derive(Debug, Clone)]
pub(crate) struct Spec {
    pub(crate) kind: Kind,
    pub(crate) columns: Option<u64>,
    pub(crate) extension: Extension,
    pub(crate) compressed: bool,
}

/// What a group holds under a name.
#[derive(Debug)]
pub(crate) enum Node {
    Group(BTreeMap<String, Node>, Vec<(String, Attribute)>),
    /// A contiguous data set of fixed extent: extent and bytes.
    Static(Kind, u64, Vec<u8>),
    /// The extendible data set of this number, with attributes; further names of it have none.
    Extendible(usize, Vec<(String, Attribute)>),
}

/// An extendible data set in the file.
#[derive(Debug)]
struct Set {
    spec: Spec,
    /// Where its first extent is written.
    extent_at: u64,
    tree: Tree,
    /// The chunk that takes further numbers.
    chunk: u64,
}

/// What a frame changes in the file, in three parts that follow one another.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    end: u64,
    appended: Vec<u8>,
    prepared: Vec<(u64, Vec<u8>)>,
    published: Vec<(u64, Vec<u8>)>,
}

impl Changes {
    fn at(end: u64) -> Self {
        Self { end, ..Self::default() }
    }

    /// Puts bytes behind the end; returns their address.
    pub(crate) fn append(&mut self, bytes: Vec<u8>) -> u64 {
        let address = self.end + self.appended.len() as u64;
        self.appended.extend(padded(bytes));
        address
    }

    /// Writes where nothing reads.
    pub(crate) fn prepare(&mut self, at: u64, bytes: Vec<u8>) {
        self.prepared.push((at, bytes));
    }

    /// Writes a number that makes what was prepared part of the file.
    pub(crate) fn publish(&mut self, at: u64, bytes: Vec<u8>) {
        self.published.push((at, bytes));
    }
}

/// A file of extendible data sets.
#[derive(Debug)]
pub(crate) struct ExtendibleFile<D> {
    disk: D,
    end: u64,
    sets: Vec<Set>,
    /// Where the number of frames is written.
    count_at: u64,
    pub(crate) count: u64,
    /// Whether a frame could not be written: what is known of the file is then ahead of it.
    failed: bool,
}

/// The content of one extendible data set in a frame.
#[derive(Debug)]
pub(crate) enum Row {
    /// The encoded bytes of a chunk.
    Chunk(Vec<u8>),
    Number([u8; 8]),
    Constant,
}

impl<D: Disk> ExtendibleFile<D> {
    /// Writes a file without frames: the group `name` with `members`, in which the attribute `NSteps` of the group `Steps`
    /// counts frames.
    pub(crate) fn create(
        mut disk: D,
        (name, members, attributes): (&str, BTreeMap<String, Node>, Vec<(String, Attribute)>),
        specs: Vec<Spec>,
    ) -> io::Result<Self> {
        let mut image = Image { bytes: vec![0; 96], sets: Vec::new(), specs, count_at: 0 };
        let links = links(&members);
        for number in 0..image.specs.len() {
            image.extendible(number, &members, links.get(&number).copied().unwrap_or(1));
        }
        let mut root = BTreeMap::new();
        root.insert(name.to_owned(), Node::Group(members, attributes));
        let root = image.group(&root, &[]);
        image.superblock(root);
        disk.write(0, &image.bytes)?;
        let (end, count_at) = (image.bytes.len() as u64, image.count_at);
        let sets = image.sets.into_iter().map(|(_, set)| set).collect();
        Ok(Self { disk, end, sets, count_at, count: 0, failed: false })
    }

    /// Adds a frame: one row for every extendible data set. After an error the file has the frames before, and takes no more.
    pub(crate) fn append(&mut self, rows: Vec<Row>) -> io::Result<()> {
        if std::mem::replace(&mut self.failed, true) {
            return Err(io::Error::other("a frame before could not be written"));
        }
        let mut changes = Changes::at(self.end);
        let number = self.count;
        for (set, row) in self.sets.iter_mut().zip(rows) {
            set.add(number, row, &mut changes);
        }
        let Changes { appended, prepared, published, .. } = changes;
        self.disk.write(self.end, &appended)?;
        for (at, bytes) in prepared {
            self.disk.write(at, &bytes)?;
        }
        self.disk.sync()?;
        self.end += appended.len() as u64;
        self.disk.write(END_AT, &self.end.to_le_bytes())?;
        self.disk.sync()?;
        for (at, bytes) in published {
            self.disk.write(at, &bytes)?;
        }
        self.disk.sync()?;
        self.disk.write(self.count_at, &(number + 1).to_le_bytes())?;
        self.disk.sync()?;
        self.count += 1;
        self.failed = false;
        Ok(())
    }
}

impl Set {
    fn add(&mut self, number: u64, row: Row, changes: &mut Changes) {
        let per_frame = match self.spec.extension {
            Extension::Chunk(rows) => rows,
            _ => 1,
        };
        match row {
            Row::Chunk(bytes) => {
                let size = bytes.len();
                let address = changes.append(bytes);
                self.tree.add(number * per_frame, size, address, changes);
            }
            Row::Number(bytes) if number.is_multiple_of(ROWS_PER_CHUNK) => {
                let mut chunk = bytes.to_vec();
                chunk.resize(8 * usize::try_from(ROWS_PER_CHUNK).unwrap_or(1), 0);
                let size = chunk.len();
                self.chunk = changes.append(chunk);
                self.tree.add(number, size, self.chunk, changes);
            }
            Row::Number(bytes) => {
                changes.prepare(self.chunk + 8 * (number % ROWS_PER_CHUNK), bytes.to_vec())
            }
            Row::Constant => {}
        }
        changes.publish(self.extent_at, (per_frame * (number + 1)).to_le_bytes().to_vec());
    }
}

/// How many names every extendible data set has.
fn links(members: &BTreeMap<String, Node>) -> BTreeMap<usize, u32> {
    let mut count = BTreeMap::new();
    for node in members.values() {
        match node {
            Node::Group(inner, _) => {
                for (number, more) in links(inner) {
                    *count.entry(number).or_default() += more;
                }
            }
            Node::Extendible(number, _) => *count.entry(*number).or_default() += 1,
            Node::Static(..) => {}
        }
    }
    count
}

/// The first attributes that a extendible data set is given.
fn attributes_of(
    members: &BTreeMap<String, Node>,
    wanted: usize,
) -> Option<&[(String, Attribute)]> {
    members.values().find_map(|node| match node {
        Node::Group(inner, _) => attributes_of(inner, wanted),
        Node::Extendible(number, attributes) if *number == wanted && !attributes.is_empty() => {
            Some(&attributes[..])
        }
        _ => None,
    })
}

/// The file before its first frame.
struct Image {
    bytes: Vec<u8>,
    specs: Vec<Spec>,
    /// Header and state of every extendible data set.
    sets: Vec<(u64, Set)>,
    count_at: u64,
}

impl Image {
    /// Adds bytes; returns their address.
    fn add(&mut self, bytes: Vec<u8>) -> u64 {
        let address = self.bytes.len() as u64;
        self.bytes.extend(padded(bytes));
        address
    }

    /// Adds the header of a extendible data set.
    fn extendible(&mut self, number: usize, members: &BTreeMap<String, Node>, links: u32) {
        let spec = self.specs[number].clone();
        let (rows, fill) = match spec.extension {
            Extension::Chunk(rows) => (rows, 0),
            Extension::Number => (ROWS_PER_CHUNK, 0),
            Extension::Constant(value) => (ROWS_PER_CHUNK, value),
        };
        let columns: Vec<u64> = spec.columns.into_iter().collect();
        let with = |first: u64| [&[first], &columns[..]].concat();
        let layout = Layout::Chunked { chunk: with(rows) };
        let mut messages = dataset(spec.kind, &with(0), &layout, fill, spec.compressed);
        let attributes = attributes_of(members, number).unwrap_or_default();
        messages.extend(attributes.iter().map(|(name, value)| attribute(name, value)));
        let (bytes, places) = header(messages, links);
        let address = self.add(bytes);
        // The extents follow the head of the first message, the tree's address that of the fourth.
        let extent_at = address + places[0] as u64 + 8;
        let tree = Tree::new(1 + columns.len(), rows, address + places[3] as u64 + 3);
        self.sets.push((address, Set { spec, extent_at, tree, chunk: UNDEFINED }));
    }

    /// Adds a group and what is in it; returns the address of its header.
    fn group(
        &mut self,
        members: &BTreeMap<String, Node>,
        attributes: &[(String, Attribute)],
    ) -> u64 {
        let mut entries = Vec::new();
        for (name, node) in members {
            let address = match node {
                Node::Group(members, attributes) => self.group(members, attributes),
                Node::Extendible(number, _) => self.sets[*number].0,
                Node::Static(kind, rows, bytes) => {
                    let size = bytes.len() as u64;
                    let address = self.add(bytes.clone());
                    let layout = Layout::Contiguous { address, size };
                    let (bytes, _) = header(dataset(*kind, &[*rows], &layout, 0, false), 1);
                    self.add(bytes)
                }
            };
            entries.push((name, address));
        }
        // Names: the empty one, then in order, each at a multiple of 8.
        let mut names = vec![0; 8];
        let mut table = b"SNOD\x01\x00".to_vec();
        table.extend(u16::try_from(entries.len()).unwrap_or(u16::MAX).to_le_bytes());
        let mut last = 0;
        for (name, address) in &entries {
            last = names.len() as u64;
            let mut text = name.as_bytes().to_vec();
            text.push(0);
            names.extend(padded(text));
            table.extend(last.to_le_bytes());
            table.extend(address.to_le_bytes());
            table.extend([0; 24]);
        }
        table.resize(8 + 40 * MAX_LINKS, 0);
        let table = self.add(table);
        let size = names.len() as u64;
        let names = self.add(names);
        let mut heap = b"HEAP\0\0\0\0".to_vec();
        // 1: no free space.
        heap.extend([size, 1, names].iter().flat_map(|n| n.to_le_bytes()));
        let heap = self.add(heap);
        let mut tree = b"TREE\0\0".to_vec();
        tree.extend(u16::from(!entries.is_empty()).to_le_bytes());
        tree.extend([UNDEFINED, UNDEFINED, 0, table, last].iter().flat_map(|n| n.to_le_bytes()));
        tree.resize(24 + 32 * 8 + 33 * 8, 0);
        let tree = self.add(tree);
        let mut messages = vec![(0x11, [tree, heap].map(u64::to_le_bytes).concat())];
        let count = attributes.iter().position(|(name, _)| name == "NSteps");
        messages.extend(attributes.iter().map(|(name, value)| attribute(name, value)));
        let data: Vec<usize> = messages.iter().map(|(_, data)| data.len()).collect();
        let (bytes, places) = header(messages, 1);
        let address = self.add(bytes);
        if let Some(k) = count {
            // The number ends the data of its message.
            self.count_at = address + (places[k + 1] + data[k + 1] - 8) as u64;
        }
        address
    }

    /// Writes the superblock with the root group at this address.
    fn superblock(&mut self, root: u64) {
        let mut out = b"\x89HDF\r\n\x1a\n".to_vec();
        // Versions, then the sizes of addresses and lengths.
        out.extend([0, 0, 0, 0, 0, 8, 8, 0]);
        out.extend(MAX_LEAF_LINKS.to_le_bytes());
        out.extend(16u16.to_le_bytes());
        out.extend([0; 4]);
        let end = self.bytes.len() as u64;
        out.extend([0, UNDEFINED, end, UNDEFINED, 0, root].iter().flat_map(|n| n.to_le_bytes()));
        out.resize(96, 0);
        self.bytes[..96].copy_from_slice(&out);
    }
}
