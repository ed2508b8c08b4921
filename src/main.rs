//! The command line; everything it does is in [`rumple::cli`].

use std::alloc::System;

use cap::Cap;
use rumple::tally::{Allocated, watch_memory};

/// The system's allocator, counted, for `explain`.
#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

fn main() -> std::process::ExitCode {
    watch_memory(|| Allocated { bytes: MEMORY.allocated(), times: 0 });
    rumple::cli::main()
}
