//! The ranks of an MPI program.
//!
//! MPI and PETSc are started when they are first asked for, and ended by [`end`]. Calls come from one thread at a time.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use mpi::Threading;
use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::point_to_point::{Destination, Source};
use mpi::topology::{Communicator as _, SimpleCommunicator};
use mpi::traits::AsRaw;
use rumple_numerics::num::whole;
use rumple_numerics::reduction::Communicator;

use super::petsc;

/// Variables of the environment that launchers of MPI programs set: Open MPI, PMIx, MPICH and Intel MPI.
const LAUNCHERS: [&str; 4] = ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "MPI_LOCALNRANKS"];

/// Whether this program was started by a launcher of MPI programs.
#[must_use]
pub fn is_launched() -> bool {
    LAUNCHERS.iter().any(|name| std::env::var_os(name).is_some())
}

/// The universe, from the first call of [`world`] to [`end`].
static UNIVERSE: Mutex<Option<Running>> = Mutex::new(None);
static WORLD: OnceLock<Arc<World>> = OnceLock::new();

struct Running {
    _universe: Universe,
    petsc: bool,
}

// SAFETY: MPI is started for calls from any thread, one at a time (`Threading::Serialized`), and the lock sees to that.
unsafe impl Send for Running {}

fn universe() -> MutexGuard<'static, Option<Running>> {
    UNIVERSE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// All ranks of this program.
///
/// # Errors
/// If MPI cannot be started, or was ended.
pub fn world() -> Result<Arc<World>, String> {
    let mut running = universe();
    if let Some(world) = WORLD.get() {
        return Ok(Arc::clone(world));
    }
    let (universe, _) = mpi::initialize_with_threading(Threading::Serialized)
        .ok_or_else(|| "MPI was started elsewhere, or has ended".to_owned())?;
    let communicator = universe.world();
    let world = Arc::new(World { communicator });
    *running = Some(Running { _universe: universe, petsc: false });
    abort_on_panic();
    Ok(Arc::clone(WORLD.get_or_init(|| world)))
}

/// Starts PETSc, if it does not run.
pub(super) fn with_petsc(defaults: &[(&str, &str)]) -> Result<Arc<World>, String> {
    let world = world()?;
    if let Some(running) = &mut *universe()
        && !running.petsc
    {
        petsc::start(defaults).map_err(|e| e.0)?;
        running.petsc = true;
    }
    Ok(world)
}

/// Ends PETSc and MPI, if they run; no rank is to be used after it.
pub fn end() {
    if let Some(running) = universe().take() {
        if running.petsc {
            // SAFETY: PETSc runs, and this is the only call.
            let _ = unsafe { petsc::PetscFinalize() };
        }
        drop(running);
    }
}

/// Ends all ranks with `code`: where one has failed, and others would wait for it.
fn abort(code: i32) -> ! {
    match WORLD.get() {
        Some(world) => world.communicator.abort(code),
        None => std::process::exit(code),
    }
}

/// A rank that panics ends the others, which would wait for it.
fn abort_on_panic() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        usual(panic);
        abort(101);
    }));
}

/// How long a rank with an error waits for the others before it ends them.
const PATIENCE: Duration = Duration::from_secs(10);

/// All ranks of an MPI program.
pub struct World {
    communicator: SimpleCommunicator,
}

// SAFETY: MPI is started for calls from any thread, one at a time; solvers call it from the thread that steps.
unsafe impl Send for World {}
// SAFETY: as above.
unsafe impl Sync for World {}

impl World {
    /// Ends the ranks together with what each has to say: the worst exit code, and on the first rank the texts, each once.
    /// Where a rank has an error that the others do not know of, and wait for it elsewhere, they are ended.
    pub fn conclude(&self, code: u8, text: &str) -> (u8, Vec<String>) {
        // Without an error it waits as long as another one takes to write its results.
        let patience = if text.is_empty() { Duration::MAX } else { PATIENCE };
        if !self.all_arrive(patience) {
            eprintln!("rank {}: {text}", self.rank());
            self.communicator.abort(i32::from(code.max(1)));
        }
        let mut worst = [f64::from(code)];
        self.max(&mut worst);
        let texts = self.all_gather(text.as_bytes());
        let code = u8::try_from(whole(worst[0])).unwrap_or(1);
        if self.rank() > 0 {
            return (code, Vec::new());
        }
        let texts = texts.iter().map(|text| String::from_utf8_lossy(text).into_owned());
        let mut all: Vec<String> = Vec::new();
        for (rank, text) in texts.enumerate().filter(|(_, text)| !text.is_empty()) {
            if !all.contains(&text) {
                all.push(if rank == 0 { text } else { format!("rank {rank}: {text}") });
            }
        }
        (code, all)
    }

    /// Whether all ranks come to this place in time.
    fn all_arrive(&self, patience: Duration) -> bool {
        let (began, mut request) = (Instant::now(), self.communicator.immediate_barrier());
        loop {
            match request.test() {
                Ok(_) => return true,
                Err(pending) if began.elapsed() > patience => {
                    // All are ended next.
                    std::mem::forget(pending);
                    return false;
                }
                Err(pending) => request = pending,
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// The handle of MPI.
    pub(super) fn raw(&self) -> mpi::ffi::MPI_Comm {
        self.communicator.as_raw()
    }
}

fn count(number: i32) -> usize {
    usize::try_from(number).unwrap_or(0)
}

fn rank(number: usize) -> i32 {
    i32::try_from(number).unwrap_or(i32::MAX)
}

impl Communicator for World {
    fn rank(&self) -> usize {
        count(self.communicator.rank())
    }

    fn size(&self) -> usize {
        count(self.communicator.size())
    }

    fn sum(&self, values: &mut [f64]) {
        let own = values.to_vec();
        self.communicator.all_reduce_into(&own[..], values, SystemOperation::sum());
    }

    /// What MPI makes of NaN is left to it: they are counted beside.
    fn max(&self, values: &mut [f64]) {
        let number = |v: &f64| if v.is_nan() { f64::NEG_INFINITY } else { *v };
        let nan = |v: &f64| if v.is_nan() { 1.0 } else { 0.0 };
        let own: Vec<f64> = values.iter().map(number).chain(values.iter().map(nan)).collect();
        let mut all = vec![0.0; own.len()];
        self.communicator.all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
        let (numbers, nans) = all.split_at(values.len());
        for (value, (number, nan)) in values.iter_mut().zip(numbers.iter().zip(nans)) {
            *value = if *nan > 0.0 { f64::NAN } else { *number };
        }
    }

    fn exchange(&self, send: &[(usize, Vec<f64>)], receive: &mut [(usize, Vec<f64>)]) {
        let world = &self.communicator;
        mpi::request::multiple_scope(send.len() + receive.len(), |scope, all| {
            for (from, values) in receive {
                let from = world.process_at_rank(rank(*from));
                all.add(from.immediate_receive_into(scope, &mut values[..]));
            }
            for (to, values) in send {
                all.add(world.process_at_rank(rank(*to)).immediate_send(scope, &values[..]));
            }
            let mut done = Vec::new();
            all.wait_all(&mut done);
        });
    }

    fn all_gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        // Never nothing: the address of an empty slice may be what Open MPI takes for MPI_IN_PLACE.
        let bytes = &[bytes, &[0]].concat()[..];
        let mut lengths = vec![0.0; self.size()];
        lengths[self.rank()] = rumple_numerics::num::real(bytes.len());
        self.sum(&mut lengths);
        let lengths: Vec<usize> = lengths.into_iter().map(whole).collect();
        let counts: Vec<i32> = lengths.iter().map(|n| rank(*n)).collect();
        let places: Vec<i32> = lengths
            .iter()
            .scan(0, |place, n| Some(rank(std::mem::replace(place, *place + n))))
            .collect();
        let mut all = vec![0u8; lengths.iter().sum()];
        let mut into = PartitionMut::new(&mut all[..], counts, places);
        self.communicator.all_gather_varcount_into(bytes, &mut into);
        let mut rest = &all[..];
        let pieces = lengths.iter().map(|n| {
            let (piece, more) = rest.split_at(*n);
            rest = more;
            piece[..piece.len() - 1].to_vec()
        });
        pieces.collect()
    }
}
