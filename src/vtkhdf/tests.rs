//! Files read back, whole after every single write, and refused where they are damaged.

use std::io::{self, Cursor};

use super::{Disk, Field, FrameReader, FrameWriter, State, Topology};

/// A disk that keeps what was written, one after another.
#[derive(Debug, Default)]
struct Log(Vec<(u64, Vec<u8>)>);

impl Disk for &mut Log {
    fn write(&mut self, at: u64, bytes: &[u8]) -> io::Result<()> {
        self.0.push((at, bytes.to_vec()));
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn put(disk: &mut Vec<u8>, at: u64, bytes: &[u8]) {
    let at = usize::try_from(at).unwrap();
    disk.resize(disk.len().max(at + bytes.len()), 0);
    disk[at..at + bytes.len()].copy_from_slice(bytes);
}

const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [2, 1, 3]];

/// Frame `k` of a sheet of four points: positions, c, u and m.
fn content(k: usize) -> ([[f64; 3]; 4], Vec<f64>, Vec<f64>, Vec<f64>) {
    let x = |i: usize| f64::from(u32::try_from(1000 * k + i).unwrap());
    let points = [0, 1, 2, 3].map(|i| [x(i), x(i) + 0.25, -x(i)]);
    let of = |n: usize, shift: f64| (0..n).map(|i| x(i) * 0.1 + shift).collect();
    (points, of(4, 0.0), of(12, 0.5), of(2, 0.75))
}

fn written(log: &mut Log, frames: usize, compressed: bool) -> Vec<u8> {
    let topology = Topology { points: 4, triangles: &TRIANGLES };
    let mut writer = None;
    for k in 0..frames {
        let (points, c, u, m) = content(k);
        let numbers = [("energy of b [energy]".to_owned(), m[0])];
        let field = |name, components, values| Field { name, components, values };
        let state = State {
            time: m[1],
            points: &points,
            point_fields: vec![field("c [1/length]", 1, &c[..]), field("u", 3, &u)],
            cell_fields: vec![field("m", 1, &m)],
            scalars: &numbers,
        };
        if writer.is_none() {
            writer = Some(FrameWriter::create(&mut *log, topology, &state, compressed).unwrap());
        }
        // The borrow of the log ends with the writer.
        let writer = writer.as_mut().unwrap();
        writer.append(&state).unwrap();
        assert_eq!(writer.count(), k as u64 + 1);
    }
    drop(writer);
    let mut disk = Vec::new();
    log.0.iter().for_each(|(at, bytes)| put(&mut disk, *at, bytes));
    disk
}

/// Checks all frames of a file; how many there are.
fn checked(disk: &[u8]) -> usize {
    let mut reader = FrameReader::open(Cursor::new(disk)).unwrap();
    assert_eq!(reader.triangles(), TRIANGLES);
    let count = reader.times().len();
    for k in 0..count {
        let (points, c, u, m) = content(k);
        assert_eq!(reader.times()[k], m[1]);
        assert_eq!(reader.points(k).unwrap(), points);
        let [point, cell, numbers] = reader.arrays(k).unwrap();
        let of = |name: &str| point.iter().find(|a| a.name == name).unwrap();
        assert_eq!((of("c [1/length]").components, &of("c [1/length]").values), (1, &c));
        assert_eq!((of("u").components, &of("u").values), (3, &u));
        assert_eq!((cell[0].name.as_str(), &cell[0].values), ("m", &m));
        assert_eq!(
            (numbers[0].name.as_str(), numbers[0].values[0]),
            ("energy of b [energy]", m[0])
        );
    }
    assert!(reader.points(count).unwrap_err().contains("is not among them"));
    count
}

#[test]
fn frames_are_read_back_from_trees_of_every_depth() {
    // 64 entries a node: one node, two levels, three levels.
    for frames in [1, 3, 64, 65, 129, 4200] {
        let disk = written(&mut Log::default(), frames, frames != 3);
        assert_eq!(checked(&disk), frames);
    }
}

#[test]
fn a_file_is_whole_after_every_single_write() {
    let mut log = Log::default();
    written(&mut log, 70, true);
    let mut disk = Vec::new();
    let mut seen = [false; 71];
    for (k, (at, bytes)) in log.0.iter().enumerate() {
        // A write of many bytes may end anywhere: only where it adds to what nothing reads.
        if bytes.len() > 8 && k > 0 {
            let mut torn = disk.clone();
            put(&mut torn, *at, &bytes[..bytes.len() / 2]);
            seen[checked(&torn)] = true;
        }
        put(&mut disk, *at, bytes);
        seen[checked(&disk)] = true;
    }
    assert!(seen.iter().all(|seen| *seen));
}

#[test]
fn damaged_files_are_refused_or_read_but_never_break() {
    let whole = written(&mut Log::default(), 2, true);
    let (mut refused, mut accepted) = (0, 0);
    let mut inspect = |disk: &[u8]| match FrameReader::open(Cursor::new(disk)) {
        Err(message) => {
            assert!(!message.is_empty());
            refused += 1;
        }
        Ok(mut reader) => match reader.points(0).and_then(|_| reader.arrays(1)) {
            Ok(_) => accepted += 1,
            Err(_) => refused += 1,
        },
    };
    for at in (0..whole.len()).step_by(3) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        inspect(&flipped);
        if at % 30 == 0 {
            inspect(&whole[..at]);
        }
    }
    assert!(refused > 200 && accepted > 200, "{refused} refused, {accepted} accepted");
}

#[test]
fn other_fields_than_the_first_are_refused_and_change_nothing() {
    let mut log = Log::default();
    let topology = Topology { points: 4, triangles: &TRIANGLES };
    let (points, c, ..) = content(0);
    let field = |name| Field { name, components: 1, values: &c[..] };
    let state = |names: &[&'static str]| State {
        time: 0.0,
        points: &points,
        point_fields: names.iter().map(|name| field(name)).collect(),
        cell_fields: Vec::new(),
        scalars: &[],
    };
    let twice = FrameWriter::create(&mut log, topology, &state(&["a/b", "a per b"]), true);
    assert!(twice.unwrap_err().to_string().contains("the same HDF5 name"));
    let mut writer = FrameWriter::create(&mut log, topology, &state(&["a"]), true).unwrap();
    writer.append(&state(&["a"])).unwrap();
    let message = writer.append(&state(&["b"])).unwrap_err().to_string();
    assert!(message.contains("other fields"), "{message}");
    assert_eq!(writer.count(), 1);
}

/// A disk that is full after some writes.
struct Full(usize);

impl Disk for Full {
    fn write(&mut self, _: u64, _: &[u8]) -> io::Result<()> {
        self.0 = self.0.checked_sub(1).ok_or_else(|| io::Error::other("the disk is full"))?;
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_and_nothing_is_added_after_it() {
    let topology = Topology { points: 4, triangles: &TRIANGLES };
    let (points, ..) = content(0);
    let state = State {
        time: 0.0,
        points: &points,
        point_fields: Vec::new(),
        cell_fields: Vec::new(),
        scalars: &[],
    };
    let mut writer = FrameWriter::create(Full(4), topology, &state, true).unwrap();
    let message = |writer: &mut FrameWriter<Full>| writer.append(&state).unwrap_err().to_string();
    assert_eq!(message(&mut writer), "the disk is full");
    assert_eq!(message(&mut writer), "a frame before could not be written");
    assert_eq!(writer.count(), 0);
}

/// Writes the file that `check_vtkhdf.py` reads, where it is asked for.
#[test]
fn a_file_for_other_readers() {
    let Some(path) = std::env::var_os("RUMPLE_VTKHDF") else { return };
    std::fs::write(path, written(&mut Log::default(), 200, true)).unwrap();
}
