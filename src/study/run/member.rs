//! A member in a process of its own, as [`Pool`](super::Pool) and the tasks of an array job start it.

use std::path::Path;
use std::{io, thread};

use crate::kinetics::HostLaw;
use crate::output::{Interrupt, Mode, Progress};
use crate::run::run::Ending;
use crate::run::{Error, Result};
use crate::solve::SolveError;
use crate::study::plan::Plan;

/// Runs member `number` of the study in `root` in this process, whose threads and signals it takes. With a `leash` it ends, as
/// if interrupted, when standard input is closed. `law` is the one that the study was planned with, if there was one.
///
/// # Errors
/// As [`run`](fn@super::run), and an interruption.
pub fn member(root: &Path, number: usize, law: Option<HostLaw>, leash: bool) -> Result<()> {
    let plan = Plan { law, ..Plan::load(root)? };
    let threads = plan.threads.max(1).into();
    // Only fails if a pool exists already, which then serves as well.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    let interrupt = Interrupt::install()?;
    if leash {
        // The parent process holds the other end: before it is closed comes the number of a signal,
        // or nothing from one that was killed.
        thread::spawn(move || {
            let said = io::read_to_string(io::stdin()).unwrap_or_default();
            interrupt.pass_on(said.parse().ok());
        });
    }
    let mut progress = Progress::new(Mode::Lines, plan.until(number)?);
    let done = super::run(&plan, root, number, &mut progress, interrupt);
    progress.finish();
    match done? {
        Some(summary) if summary.ending == Ending::Interrupted => {
            Err(Error::Solve(SolveError::Interrupted))
        }
        _ => Ok(()),
    }
}
