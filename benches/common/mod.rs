//! What the benches share: CPU time of this process, numbers of `/proc`, the machine in words,
//! tables.
//!
//! Linux only: the numbers come from `/proc`.

use std::fmt::Write;
use std::fs;
use std::process::Command;

use rumple::scene::Scene;
use rumple::solve::equilibrium::Method;

/// Anything that stops a bench, in words.
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// CPU seconds that the threads of this process have used, the kernel's share included.
///
/// The kernel brings the numbers up to date at its ticks, so that differences are right to a few
/// milliseconds. Threads that have ended do not count; rayon's do not end.
pub fn cpu_seconds() -> Result<f64> {
    let mut total = 0u64;
    for task in fs::read_dir("/proc/self/task")? {
        let text = fs::read_to_string(task?.path().join("schedstat"))?;
        total +=
            text.split_ascii_whitespace().next().ok_or("an empty schedstat")?.parse::<u64>()?;
    }
    Ok(std::time::Duration::from_nanos(total).as_secs_f64())
}

/// Does `work` on one of `threads` threads of its own, as `rumple run` does: parallel loops begin there at
/// once. Another thread has to wake them and to wait for every loop, which adds a third to an evaluation.
pub fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
    const STACK: usize = 8 << 20;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK).build()?;
    Ok(pool.install(|| work().map_err(|error| error.to_string()))?)
}

/// A size that `/proc` gives in KiB, in GiB: `VmHWM:` in `/proc/self/status` is the largest memory
/// this process has used, `MemAvailable:` in `/proc/meminfo` what could be had now.
pub fn gibibytes(file: &str, key: &str) -> Result<f64> {
    let text = fs::read_to_string(file)?;
    let value = text.lines().find_map(|line| line.strip_prefix(key)?.split_whitespace().next());
    let kibibytes: f64 = value.ok_or_else(|| format!("no {key} in {file}"))?.parse()?;
    Ok(kibibytes / f64::from(1 << 20))
}

/// The first line that a program prints, or why there is none.
pub fn first_line(program: &str, arguments: &[&str]) -> String {
    match Command::new(program).args(arguments).output() {
        Err(e) => format!("{program}: {e}"),
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            text.lines().next().unwrap_or("no answer").to_owned()
        }
    }
}

/// Date, processor, memory, compiler and state of the source, as a Markdown list.
pub fn machine() -> String {
    let cpu = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |key: &str| {
        let line = cpu.lines().find(|line| line.starts_with(key));
        line.and_then(|line| line.split(':').nth(1)).unwrap_or("unknown").trim().to_owned()
    };
    let memory = gibibytes("/proc/meminfo", "MemTotal:").unwrap_or(f64::NAN);
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    format!(
        "* {}\n* {} at {} MHz, {threads} threads, {memory:.0} GiB\n* {}, rumple {} ({})\n",
        first_line("date", &["-u", "+%Y-%m-%d %H:%M UTC"]),
        field("model name"),
        field("cpu MHz"),
        first_line("rustc", &["--version"]),
        env!("CARGO_PKG_VERSION"),
        first_line("git", &["describe", "--always", "--dirty"]),
    )
}

/// The method of equilibrium called `method`, with the defaults of scenes and the overrides `set`.
pub fn equilibrium(method: &str, set: &[String]) -> Result<Method> {
    let text = format!(
        "sheet = {{ shape = \"disc\", radius = 1.0, vertices = 100 }}\n\
         material = {{ young = 1.0, poisson = 0.3, thickness = 0.1 }}\n\
         time = {{ until = 1.0 }}\nequilibrium = {{ method = \"{method}\" }}\n"
    );
    let scene = Scene::parse(&text, "--method", set).map_err(|error| error.rendered(false))?;
    Ok(scene.into_equilibrium())
}

/// A table in Markdown, padded so that it also reads well on a terminal.
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these column titles.
    pub fn new(titles: &[&str]) -> Self {
        Self { rows: vec![titles.iter().map(|t| (*t).to_owned()).collect()] }
    }

    /// Adds a row.
    pub fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }

    /// The table as text.
    pub fn markdown(&self) -> String {
        let columns = self.rows[0].len();
        let cell = |row: &Vec<String>, k: usize| row.get(k).cloned().unwrap_or_default();
        let width: Vec<usize> = (0..columns)
            .map(|k| self.rows.iter().map(|row| cell(row, k).chars().count()).max().unwrap_or(0))
            .collect();
        let mut text = String::new();
        for (number, row) in self.rows.iter().enumerate() {
            for (k, width) in width.iter().enumerate() {
                let _ = write!(text, "| {:width$} ", cell(row, k));
            }
            text += "|\n";
            if number == 0 {
                for width in &width {
                    let _ = write!(text, "| {} ", "-".repeat((*width).max(3)));
                }
                text += "|\n";
            }
        }
        text
    }
}

/// A number in a table: as an integer, with some digits, or with an exponent.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if !(1e-2..1e5).contains(&size) {
        format!("{value:.3e}")
    } else if size < 1.0 {
        format!("{value:.3}")
    } else if size < 100.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.0}")
    }
}
