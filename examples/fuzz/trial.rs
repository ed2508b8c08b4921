//! The process that reads: a line for every input, written when that has been read.
//!
//! ```text
//! ready
//! 17 accepted 0.000123 4096 812        number, outcome, seconds, most bytes allocated, bytes of the input
//! 18 panic 0.000042 512 77 src/sheet/read/obj.rs:7: index out of bounds
//! ```

use std::cell::RefCell;
use std::error::Error;
use std::fs;
use std::io::Write;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use crate::Options;
use crate::counting::peak_of;
use crate::readers::Reader;

thread_local! {
    static MESSAGE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// What reading an input came to.
struct Tried {
    outcome: &'static str,
    seconds: f64,
    peak: usize,
    message: String,
}

fn try_one(reader: &Reader, input: &[u8]) -> Tried {
    let began = Instant::now();
    let (result, peak) = peak_of(|| panic::catch_unwind(AssertUnwindSafe(|| (reader.read)(input))));
    let seconds = began.elapsed().as_secs_f64();
    let outcome = match result {
        Ok(true) => "accepted",
        Ok(false) => "refused",
        Err(_) => "panic",
    };
    let message = MESSAGE.with_borrow_mut(std::mem::take).replace('\n', " ");
    Tried { outcome, seconds, peak, message }
}

/// A panic is logged in the line of its input.
fn quiet() {
    panic::set_hook(Box::new(|info| {
        let text = info.to_string();
        MESSAGE.with_borrow_mut(|message| message.clone_from(&text));
    }));
}

/// Valid inputs as `watch` has written them, in their order.
fn written(folder: &Path) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let count = fs::read_dir(folder)?.count();
    (0..count).map(|k| Ok(fs::read(folder.join(k.to_string()))?)).collect()
}

/// Reads the inputs from number `from` on.
///
/// # Errors
/// Valid inputs that are not there.
pub fn all(options: &Options, from: u64, seeds: &Path) -> Result<ExitCode, Box<dyn Error>> {
    let [reader] = options.readers[..] else { return Err("one reader a process".into()) };
    let seeds = written(seeds)?;
    // One-time set-up of a reader is excluded.
    seeds.first().map(|first| (reader.read)(first));
    quiet();
    let mut out = std::io::stdout().lock();
    writeln!(out, "ready")?;
    for number in from..options.inputs {
        let input = reader.input(&seeds, options.seed, number);
        let Tried { outcome, seconds, peak, message } = try_one(reader, &input);
        let size = input.len();
        writeln!(out, "{number} {outcome} {seconds:.6} {peak} {size} {message}")?;
        out.flush()?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Reads the file at `path` and says what came of it.
///
/// # Errors
/// A file that cannot be read.
pub fn one(options: &Options, path: &Path) -> Result<ExitCode, Box<dyn Error>> {
    let input = fs::read(path)?;
    for reader in &options.readers {
        if let Some(first) = (reader.seeds)().first() {
            (reader.read)(first);
        }
        let Tried { outcome, seconds, peak, .. } = try_one(reader, &input);
        let (bound, size) = (reader.bound.of(input.len()), input.len());
        println!(
            "{}: {outcome} in {seconds:.3} s, {peak} bytes of at most {bound} for {size}",
            reader.name
        );
    }
    Ok(ExitCode::SUCCESS)
}
