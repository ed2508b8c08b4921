//! Where a result came from, so that a figure can be traced to its scene, mesh and plugin.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::{OutputError, ResultDirectory, atomic, clock};
use rumple_numerics::Vec3;

/// A file that took part, with the hash of its bytes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FileRecord {
    /// Where it was read from, absolute if it could be resolved.
    pub path: PathBuf,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

impl FileRecord {
    /// Hashes the file `path`.
    ///
    /// # Errors
    /// [`OutputError::Read`] if it cannot be read.
    pub fn new(path: &Path) -> Result<Self, OutputError> {
        let hash = hash_of(path)?;
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        Ok(Self { path, sha256: hexadecimal(&hash) })
    }
}

/// The first 64 bits of the SHA-256 of a file: enough to see that it has changed.
///
/// # Errors
/// [`OutputError::Read`] if it cannot be read.
pub fn digest_of(path: &Path) -> Result<u64, OutputError> {
    Ok(hash_of(path)?.first_chunk().map_or(0, |first| u64::from_le_bytes(*first)))
}

/// SHA-256 of a file.
fn hash_of(path: &Path) -> Result<Vec<u8>, OutputError> {
    let mut file = fs::File::open(path).map_err(OutputError::read(path))?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer).map_err(OutputError::read(path))? {
            0 => return Ok(hasher.finalize().to_vec()),
            n => hasher.update(&buffer[..n]),
        }
    }
}

/// SHA-256 of `text`, in hexadecimal.
#[must_use]
pub fn fingerprint(text: &str) -> String {
    hexadecimal(&Sha256::digest(text.as_bytes()))
}

/// The mesh of the rest state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MeshRecord {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// SHA-256 of the rest positions (x, y, z of each vertex as little-endian doubles) followed by
    /// the triangles (three little-endian 32-bit vertex numbers each), in hexadecimal.
    pub sha256: String,
}

impl MeshRecord {
    /// Hashes a mesh.
    #[must_use]
    pub fn new(
        positions: impl Iterator<Item = Vec3>,
        triangles: impl Iterator<Item = [u32; 3]>,
    ) -> Self {
        let (mut hasher, mut counts) = (Sha256::new(), [0; 2]);
        for point in positions {
            counts[0] += 1;
            [point.x, point.y, point.z].iter().for_each(|x| hasher.update(x.to_le_bytes()));
        }
        for corners in triangles {
            counts[1] += 1;
            corners.iter().for_each(|v| hasher.update(v.to_le_bytes()));
        }
        let [vertices, triangles] = counts;
        Self { vertices, triangles, sha256: hexadecimal(&hasher.finalize()) }
    }
}

/// Everything that is recorded beside the results of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Provenance {
    /// Name and version of this crate.
    pub version: String,
    /// The command line.
    pub command: Vec<String>,
    /// When the run was started, in UTC.
    pub started: String,
    /// Name of the machine.
    pub host: String,
    /// Number of threads of the run.
    pub threads: usize,
    /// The scene file as the user gave it.
    pub scene: Option<FileRecord>,
    /// The file whose state the run started from, if it did not start as its scene says.
    pub state: Option<FileRecord>,
    /// The time at which the run started: 0, unless such a state continues an earlier clock.
    pub start_time: f64,
    /// The mesh of the rest state.
    pub mesh: MeshRecord,
    /// The plugins that were loaded.
    pub plugins: Vec<FileRecord>,
}

impl Provenance {
    /// Collects the record at the start of a run, from the current process, clock and host.
    #[must_use]
    pub fn new(mesh: MeshRecord) -> Self {
        Self {
            version: concat!("rumple ", env!("CARGO_PKG_VERSION")).to_owned(),
            command: command(),
            started: clock::iso(SystemTime::now()),
            host: host(),
            threads: rayon::current_num_threads(),
            scene: None,
            state: None,
            start_time: 0.0,
            mesh,
            plugins: Vec::new(),
        }
    }

    /// Adds a continuation of the run to the record in `directory`.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the operating system refuses.
    pub fn resumed(directory: &ResultDirectory, time: f64, step: u64) -> Result<(), OutputError> {
        let path = directory.provenance();
        let text = fs::read_to_string(&path).unwrap_or_default();
        let record: Option<Value> = serde_json::from_str(&text).ok();
        let mut record = record.filter(Value::is_object).unwrap_or_else(|| json!({}));
        let now = json!({
            "time": time,
            "step": step,
            "started": clock::iso(SystemTime::now()),
            "command": command(),
            "host": host(),
            "threads": rayon::current_num_threads(),
        });
        match record.get_mut("resumed").and_then(Value::as_array_mut) {
            Some(all) => all.push(now),
            None => record["resumed"] = json!([now]),
        }
        atomic::replace(&path, |writer| writeln!(writer, "{record:#}"))
    }

    /// Writes the record and `resolved`, the text of the scene with every default written out.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the operating system refuses.
    pub fn write(&self, directory: &ResultDirectory, resolved: &str) -> Result<(), OutputError> {
        atomic::replace(&directory.resolved(), |writer| writer.write_all(resolved.as_bytes()))?;
        atomic::replace(&directory.provenance(), |writer: &mut dyn Write| {
            serde_json::to_writer_pretty(&mut *writer, self)?;
            writer.write_all(b"\n")
        })
    }
}

/// The command line.
fn command() -> Vec<String> {
    std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect()
}

/// The host name, where it is known without a system call.
fn host() -> String {
    ["/proc/sys/kernel/hostname", "/etc/hostname"]
        .iter()
        .find_map(|path| fs::read_to_string(path).ok())
        .or_else(|| std::env::var("HOSTNAME").or_else(|_| std::env::var("COMPUTERNAME")).ok())
        .map_or_else(|| "unknown".to_owned(), |name| name.trim().to_owned())
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
