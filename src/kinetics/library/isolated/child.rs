//! A child as its parent sees it: started, asked, waited for, ended.

use std::fmt;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};
use std::time::{Duration, Instant};

use super::super::signal_meaning;
use super::memory::{ANSWERED, CALLS, IDLE, LOCATIONS, Lane, Memory, REQUESTED};
use super::reply::CallProblem;
use super::{Isolation, SERVE_ARGUMENT};
use crate::KineticsError;
use crate::descriptor::{Descriptor, Location};

/// Between two looks whether the child is still there.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// A process that serves a plugin.
#[derive(Debug)]
pub(super) struct Process {
    path: String,
    name: OnceLock<String>,
    limit: Duration,
    child: Mutex<Child>,
    /// Open for as long as the child is to live.
    _socket: UnixStream,
    /// Number of calls under way.
    under_way: AtomicUsize,
    lanes: Vec<Mutex<Lane>>,
    /// Why the child has ended.
    end: OnceLock<String>,
}

/// A call into a child: what to say if it does not come back.
pub(super) struct Asked {
    pub(super) call: &'static str,
    pub(super) location: Location,
    pub(super) first: usize,
    pub(super) count: usize,
    /// Number of the law.
    pub(super) law: u64,
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill(&mut lock(&self.child));
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Process {
    /// Starts a child for the plugin at this path, which is its name until it has another.
    pub(super) fn start(path: &Path, isolation: &Isolation) -> io::Result<Self> {
        let lanes = rayon::current_num_threads();
        let memory = Memory::new(lanes)?;
        let (socket, end) = UnixStream::pair()?;
        let mut command = Command::new(&isolation.program);
        // The two files come in the places of standard input and output: nothing else is inherited.
        command.arg(SERVE_ARGUMENT).arg(lanes.to_string());
        command.stdin(memory.file().try_clone()?).stdout(OwnedFd::from(end));
        // Ctrl-C is for the parent; and what the plugin starts can be ended with it.
        command.process_group(0);
        Ok(Self {
            path: path.display().to_string(),
            name: OnceLock::new(),
            limit: isolation.limit,
            under_way: AtomicUsize::new(0),
            lanes: (0..lanes).map(|k| memory.lane(k).map(Mutex::new)).collect::<io::Result<_>>()?,
            child: Mutex::new(command.stderr(Stdio::inherit()).spawn()?),
            _socket: socket,
            end: OnceLock::new(),
        })
    }

    /// Gives the plugin its name.
    pub(super) fn set_name(&self, name: &str) {
        let _ = self.name.set(name.to_owned());
    }

    fn title(&self) -> &str {
        self.name.get().unwrap_or(&self.path)
    }

    /// An unused lane; this thread's own, if it waits.
    pub(super) fn lane(&self) -> MutexGuard<'_, Lane> {
        let own = rayon::current_thread_index().unwrap_or(0);
        for k in 0..self.lanes.len() {
            match self.lanes[(own + k) % self.lanes.len()].try_lock() {
                Ok(lane) => return lane,
                Err(TryLockError::Poisoned(lane)) => return lane.into_inner(),
                Err(TryLockError::WouldBlock) => {}
            }
        }
        lock(&self.lanes[own % self.lanes.len()])
    }

    /// Has the child do what the lane says, and waits for it.
    pub(super) fn ask(&self, lane: &Lane, asked: &Asked) -> Result<(), KineticsError> {
        self.alive()?;
        let head = lane.head();
        let number =
            |position: Option<usize>| position.map_or(u32::MAX, rumple_numerics::num::index);
        head.call.store(number(CALLS.iter().position(|c| *c == asked.call)), Ordering::Relaxed);
        let location = LOCATIONS.iter().position(|l| *l == asked.location);
        head.location.store(number(location), Ordering::Relaxed);
        head.law.store(asked.law, Ordering::Relaxed);
        head.first.store(asked.first as u64, Ordering::Relaxed);
        head.count.store(asked.count as u64, Ordering::Relaxed);
        self.under_way.fetch_add(1, Ordering::Relaxed);
        lane.hand_over(REQUESTED);
        let answered = self.wait(lane, asked);
        self.under_way.fetch_sub(1, Ordering::Relaxed);
        answered?;
        lane.hand_over(IDLE);
        Ok(())
    }

    /// Waits for the answer to a call; ends the child if it does not come in time.
    fn wait(&self, lane: &Lane, asked: &Asked) -> Result<(), KineticsError> {
        let begin = Instant::now();
        while !lane.wait_for(ANSWERED, POLL_INTERVAL) {
            let mut child = lock(&self.child);
            if let Ok(Some(status)) = child.try_wait() {
                // It may have answered and then ended, for another call.
                if !lane.wait_for(ANSWERED, Duration::ZERO) {
                    self.record_exit(asked, status);
                }
            } else if begin.elapsed() > self.limit {
                let (plugin, call) = (self.title(), asked);
                let limit = self.limit.as_secs_f64();
                let text = format!(
                    "plugin `{plugin}` does not return from {call}: it has been there for {limit} s \
                     (--plugin-limit)"
                );
                let _ = self.end.set(text);
                self.kill(&mut child);
            }
            drop(child);
            self.alive()?;
        }
        Ok(())
    }

    /// The same with texts for inputs and outputs; refuses an answer that is none.
    pub(super) fn exchange_text(
        &self,
        call: &'static str,
        law: u64,
        text: &str,
        descriptor: Option<&Descriptor>,
    ) -> Result<String, KineticsError> {
        let mut lane = self.lane();
        let asked = Asked { call, location: Location::Vertex, first: 0, count: 0, law };
        lane.write(text).map_err(|e| self.no_room(&e))?;
        self.ask(&lane, &asked)?;
        let answer = lane.read().map_err(|e| self.no_room(&e))?;
        drop(lane);
        match serde_json::from_str::<Result<String, CallProblem>>(&answer) {
            Ok(Ok(text)) => Ok(text),
            Ok(Err(told)) => match (told, descriptor) {
                (CallProblem::Other(text), _) => Err(KineticsError::Isolated(text)),
                (told, Some(descriptor)) => {
                    told.outcome(descriptor, None).and_then(|_| Err(self.invalid_answer(call)))
                }
                (_, None) => Err(self.invalid_answer(call)),
            },
            Err(_) => Err(self.invalid_answer(call)),
        }
    }

    /// Notes that the child has ended, how, and in which call.
    fn record_exit(&self, asked: &Asked, status: ExitStatus) {
        let how = match (status.signal(), status.code()) {
            (Some(signal), _) => format!("{} (signal {signal})", signal_meaning(signal)),
            (_, code) => format!("it exits with status {}", code.unwrap_or_default()),
        };
        // The system does not say which thread has ended the process.
        let others = match self.under_way.load(Ordering::Relaxed) {
            0 | 1 => String::new(),
            calls => format!(", or in another of {calls} calls under way"),
        };
        let plugin = self.title();
        let text = format!("plugin `{plugin}` ends its process in {asked}{others}: {how}");
        let _ = self.end.set(text);
    }

    fn alive(&self) -> Result<(), KineticsError> {
        match self.end.get() {
            None => Ok(()),
            Some(text) => Err(KineticsError::Isolated(text.clone())),
        }
    }

    /// Ends the child and whatever it has started.
    fn kill(&self, child: &mut Child) {
        if let Ok(group) = libc::pid_t::try_from(child.id())
            && matches!(child.try_wait(), Ok(None))
        {
            // SAFETY: a signal to a group that the child leads, which is still there.
            unsafe { libc::kill(-group, libc::SIGKILL) };
        }
        let _ = child.kill();
        let _ = child.wait();
    }

    pub(super) fn invalid_answer(&self, call: &str) -> KineticsError {
        let name = self.title();
        KineticsError::Isolated(format!(
            "plugin `{name}` spoils the memory of its process: the answer to {call} makes no sense"
        ))
    }

    pub(super) fn no_room(&self, error: &io::Error) -> KineticsError {
        let name = self.title();
        KineticsError::Isolated(format!("no memory to share with plugin `{name}`: {error}"))
    }
}

impl fmt::Display for Asked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { call, location, first, count, .. } = self;
        f.write_str(call)?;
        match count.checked_sub(1) {
            None => Ok(()),
            Some(0) => write!(f, " at {} {first}", location.noun()),
            Some(more) => write!(f, " at {} {first} to {}", location.nouns(), first + more),
        }
    }
}
