//! One command, run with a limit, and what it did.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::Outcome;
use super::case::{Beside, Case};
use super::expected;
use super::ledger::Ledger;

/// Where programs, scenes and results are.
pub struct Where {
    pub program: PathBuf,
    pub models: PathBuf,
    pub results: PathBuf,
    pub patience: f64,
}

/// What a command did.
pub struct Trial {
    /// In words.
    pub seen: String,
    /// What is not as expected.
    pub faults: Vec<String>,
    /// Processor time of its steps, seconds; not a number if it made none.
    pub cpu: f64,
}

/// A command that has ended.
pub struct Ended {
    /// None if it was killed for its time.
    pub status: Option<ExitStatus>,
    /// What it wrote to standard output and standard error.
    pub said: String,
    pub ledger: Ledger,
    /// Resident memory in MB while it ran, at equal times.
    pub memory: Vec<f64>,
    pub cpu: f64,
}

impl Trial {
    /// A case with this value.
    ///
    /// # Errors
    /// A program that cannot be started, a ledger that cannot be read.
    pub fn of(place: &Where, case: &Case, value: &str) -> Outcome<Self> {
        let name = folder(&case.name, value);
        let ended = run(place, &name, &case.run, value, case.limit)?;
        let faults = expected::faults(case, &ended);
        let mut seen = seen(&ended);
        seen += &shown(case, &ended);
        if case.steady && ended.ledger.len() > 100 {
            seen += &format!(", {}", expected::steadiness(case, &ended));
        }
        Ok(Self { seen, faults, cpu: ended.cpu })
    }

    /// Another way.
    ///
    /// # Errors
    /// As [`Trial::of`].
    pub fn beside(place: &Where, case: &Case, other: &Beside, value: &str) -> Outcome<Self> {
        let name = folder(&format!("{}-beside", case.name), value);
        let ended = run(place, &name, &other.run, value, case.limit)?;
        let mut seen = seen(&ended);
        if ended.ledger.len() == 0 && ended.status.is_some_and(|status| status.success()) {
            // A program of another kind says itself what it did.
            seen = ended.said.lines().last().unwrap_or_default().to_owned();
        }
        seen += &shown(case, &ended);
        Ok(Self { seen, faults: Vec::new(), cpu: ended.cpu })
    }
}

/// Name of the folder of a trial.
fn folder(name: &str, value: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || ".-+".contains(c) { c } else { '_' };
    let value = value.chars().map(plain).collect::<String>();
    if value.is_empty() { name.to_owned() } else { format!("{name}-{value}") }
}

/// Runs a command for bash in a new folder.
///
/// # Errors
/// As [`Trial::of`].
pub fn run(place: &Where, name: &str, command: &str, value: &str, limit: f64) -> Outcome<Ended> {
    let folder = place.results.join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder)?;
    let (out, said) = (folder.join("out"), folder.join("said"));
    let file = File::create(&said)?;
    let mut child = Command::new("timeout")
        .args(["--kill-after=5", &format!("{}", place.patience * limit), "bash", "-c", command])
        .env("RUMPLE", &place.program)
        .env("MODELS", &place.models)
        .env("OUT", &out)
        .env("VALUE", value)
        .env("RUST_BACKTRACE", "0")
        .current_dir(&folder)
        .stdin(Stdio::null())
        .stdout(file.try_clone()?)
        .stderr(file)
        .spawn()?;
    let (status, memory) = wait(&mut child)?;
    const TIMED_OUT: i32 = 124;
    let status = (status.code() != Some(TIMED_OUT)).then_some(status);
    let cpu = cpu(&out);
    let said = String::from_utf8_lossy(&fs::read(&said)?).into_owned();
    Ok(Ended { status, said, ledger: Ledger::of(&out)?, memory, cpu })
}

/// Waits and samples the resident memory.
fn wait(child: &mut Child) -> Outcome<(ExitStatus, Vec<f64>)> {
    const POLL_INTERVAL: Duration = Duration::from_millis(20);
    let (mut memory, mut looked) = (Vec::new(), Instant::now());
    let mut between = POLL_INTERVAL;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok((status, memory));
        }
        if looked.elapsed() >= between {
            looked = Instant::now();
            memory.extend(resident(child.id()));
            // Long runs are sampled less often.
            between = (between + between / 50).min(Duration::from_secs(1));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Resident memory of the processes below this one, MB.
fn resident(process: u32) -> Option<f64> {
    let own = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let kilobytes = own.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let megabytes = kilobytes.split_whitespace().next()?.parse::<f64>().ok()? / 1e3;
    let below = fs::read_to_string(format!("/proc/{process}/task/{process}/children")).ok()?;
    let below = below.split_whitespace().filter_map(|child| resident(child.parse().ok()?));
    Some(megabytes + below.sum::<f64>())
}

/// Processor time of relaxing the start and of the steps.
fn cpu(out: &Path) -> f64 {
    let read = || {
        let text = fs::read_to_string(out.join("status.json")).ok()?;
        serde_json::from_str::<serde_json::Value>(&text).ok()?.get("cpu_seconds")?.as_f64()
    };
    read().unwrap_or(f64::NAN)
}

/// The last values of the columns that a case shows.
fn shown(case: &Case, ended: &Ended) -> String {
    let value =
        |column: &String| Some(format!(", {column} {}", short(ended.ledger.last(column).ok()?)));
    case.show.iter().filter_map(value).collect()
}

/// Four digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.3e}")
    }
}

/// What happened, in words.
fn seen(ended: &Ended) -> String {
    let Some(status) = ended.status else { return "**no end in its time**".into() };
    let steps = match (ended.ledger.len(), ended.ledger.column("rejected")) {
        (rows @ 2.., Ok(rejected)) => {
            let rejected: f64 = rejected.iter().sum();
            let time = ended.ledger.last("time").unwrap_or(f64::NAN);
            format!("{} steps to t = {time:.4}, {rejected} rejected", rows - 1)
        }
        _ => "no steps".to_owned(),
    };
    match status.code() {
        Some(0) => steps,
        Some(_) => {
            let error = error(&ended.said);
            if ended.ledger.len() > 1 {
                format!("{steps}; “{error}”")
            } else {
                format!("“{error}”")
            }
        }
        None => format!("{steps}; killed by a signal"),
    }
}

/// The error in what was said: up to its first sentence end, without paths of this machine.
fn error(said: &str) -> String {
    let lines = said.lines().map(str::trim).filter(|line| !line.is_empty());
    let from = lines
        .clone()
        .position(|l| l.starts_with("error") || l.starts_with("Error") || l.contains("×"));
    let text: Vec<&str> = lines.skip(from.unwrap_or(0)).take(6).collect();
    let text = text.join(" ").replace(['|', '\0'], "").replace("  ", " ");
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/");
    let text = text.replace(&format!("{own}target/"), "").replace(own, "");
    text.chars().take(300).collect()
}
