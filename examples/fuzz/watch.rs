//! The process that watches: starts the one that reads, again after every crash and hang; the table.

use std::error::Error;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use crate::Options;
use crate::readers::{Reader, root};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Longer than this nothing may take.
const TIME_LIMIT: Duration = Duration::from_secs(10);
/// Until the process is ready, with runs that some readers need.
const START_UP_LIMIT: Duration = Duration::from_secs(120);
/// Address space of the process that reads, KiB: a larger allocation ends it.
const ADDRESS_SPACE_KIB: usize = 8 << 20;

/// What all inputs of a reader came to.
#[derive(Default)]
struct Row {
    inputs: u64,
    accepted: u64,
    refused: u64,
    panics: u64,
    crashes: u64,
    hangs: u64,
    greedy: u64,
    slowest: f64,
    /// The largest share of the bound, with the bytes and the size of that input.
    memory: (f64, usize, usize),
}

impl Row {
    fn faults(&self) -> u64 {
        self.panics + self.crashes + self.hangs + self.greedy
    }
}

/// Tries all readers and prints the table.
///
/// # Errors
/// A process that cannot be started.
pub fn table(options: &Options) -> Outcome<ExitCode> {
    println!(
        "| reader | inputs | accepted | refused | slowest, s | most memory, MiB | bound of that, MiB | \
         bound | panics | crashes | over 10 s | over the bound |"
    );
    println!("| --- | --: | --: | --: | --: | --: | --: | --- | --: | --: | --: | --: |");
    let mut faults = 0;
    for reader in &options.readers {
        let row = row(reader, options)?;
        let (_, peak, size) = row.memory;
        let bound = reader.bound;
        println!(
            "| {} | {} | {} | {} | {:.3} | {:.2} | {:.2} | {} MiB + {} × size | {} | {} | {} | {} |",
            reader.name,
            row.inputs,
            row.accepted,
            row.refused,
            row.slowest,
            mebibytes(peak),
            mebibytes(bound.of(size)),
            bound.fixed,
            bound.per_byte,
            row.panics,
            row.crashes,
            row.hangs,
            row.greedy
        );
        faults += row.faults();
    }
    Ok(if faults == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

#[allow(clippy::cast_precision_loss, reason = "for people")]
fn mebibytes(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

fn row(reader: &Reader, options: &Options) -> Outcome<Row> {
    let room = tempfile::tempdir_in(if Path::new("/dev/shm").is_dir() { "/dev/shm" } else { "." })?;
    let seeds = reader.all_seeds();
    let folder = room.path().join("seeds");
    fs::create_dir(&folder)?;
    for (number, seed) in seeds.iter().enumerate() {
        fs::write(folder.join(number.to_string()), seed)?;
    }
    let mut row = Row::default();
    while row.inputs < options.inputs {
        let mut process = start(reader, options, row.inputs, &folder, room.path())?;
        let lines = lines(&mut process)?;
        let ended = watch(reader, options, &seeds, &lines, &mut row);
        process.kill().ok();
        process.wait()?;
        if let Some(what) = ended {
            // The input after the last one logged.
            let count = if what == "hang" { &mut row.hangs } else { &mut row.crashes };
            *count += 1;
            keep(reader, options, &seeds, row.inputs, what);
            row.inputs += 1;
        }
    }
    Ok(row)
}

fn start(
    reader: &Reader,
    options: &Options,
    from: u64,
    seeds: &Path,
    room: &Path,
) -> std::io::Result<Child> {
    let limit = format!("ulimit -v {ADDRESS_SPACE_KIB}; exec \"$@\"");
    Command::new("sh")
        .args(["-c", &limit, "sh"])
        .arg(std::env::current_exe()?)
        .args([reader.name, "--seed", &options.seed.to_string()])
        .args(["--inputs", &options.inputs.to_string(), "--child", &from.to_string()])
        .arg(seeds)
        .env("TMPDIR", room)
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
}

/// What the process says, line by line.
fn lines(process: &mut Child) -> Outcome<Receiver<String>> {
    let out = process.stdout.take().ok_or("no output")?;
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    Ok(receiver)
}

/// Counts what the process tells; why it ended, if that was too early.
fn watch(
    reader: &Reader,
    options: &Options,
    seeds: &[Vec<u8>],
    lines: &Receiver<String>,
    row: &mut Row,
) -> Option<&'static str> {
    let mut patience = START_UP_LIMIT;
    while row.inputs < options.inputs {
        match lines.recv_timeout(patience) {
            Ok(line) => {
                if line != "ready" && tell(reader, options, seeds, &line, row).is_none() {
                    return Some("crash");
                }
            }
            Err(RecvTimeoutError::Timeout) => return Some("hang"),
            Err(RecvTimeoutError::Disconnected) => return Some("crash"),
        }
        patience = TIME_LIMIT;
    }
    None
}

/// Counts one line; none if it is not one of ours.
fn tell(
    reader: &Reader,
    options: &Options,
    seeds: &[Vec<u8>],
    line: &str,
    row: &mut Row,
) -> Option<()> {
    let mut words = line.splitn(6, ' ');
    let number: u64 = words.next()?.parse().ok()?;
    let outcome = words.next()?;
    let seconds: f64 = words.next()?.parse().ok()?;
    let (peak, size) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
    row.inputs = number + 1;
    match outcome {
        "accepted" => row.accepted += 1,
        "refused" => row.refused += 1,
        _ => {
            row.panics += 1;
            keep(reader, options, seeds, number, words.next()?);
        }
    }
    row.slowest = row.slowest.max(seconds);
    let share = mebibytes(peak) / mebibytes(reader.bound.of(size));
    if share > row.memory.0 {
        row.memory = (share, peak, size);
    }
    if share > 1.0 {
        row.greedy += 1;
        let bound = reader.bound.of(size);
        keep(
            reader,
            options,
            seeds,
            number,
            &format!("{peak} bytes of at most {bound} for {size}"),
        );
    }
    Some(())
}

/// Keeps an input that is a fault, and says how to read it again.
fn keep(reader: &Reader, options: &Options, seeds: &[Vec<u8>], number: u64, what: &str) {
    let folder = root().join("results/fuzz");
    let name = reader.name;
    let path: PathBuf = folder.join(format!("{name}-{}-{number}", options.seed));
    let input = reader.input(seeds, options.seed, number);
    let kept = fs::create_dir_all(&folder).and_then(|()| fs::write(&path, input));
    let short: String = what.chars().take(300).collect();
    eprintln!("{name}, input {number} of seed {}: {short}", options.seed);
    match kept {
        Ok(()) => {
            let path = path.display();
            eprintln!("  again: cargo run --release --example 05_fuzz -- {name} --file {path}");
        }
        Err(error) => eprintln!("  {}: {error}", path.display()),
    }
}
