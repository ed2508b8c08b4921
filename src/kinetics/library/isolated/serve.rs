//! The child's side: loads a library and calls it, one thread a lane.

use std::fs::File;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock, PoisonError, RwLock};
use std::thread;
use std::time::Duration;

use super::super::global_state::{check_global_state, keep_open};
use super::super::{Library, PluginKinetics, take_destroy_error};
use super::column_layout::ColumnLayout;
use super::grown::Grown;
use super::memory::{ANSWERED, CALLS, Head, LOCATIONS, Lane, Memory, REQUESTED};
use super::reply::{CallProblem, CreateRequest};
use crate::batch::{Batch, Column, UNWRITTEN_BITS};
use crate::{Kinetics, KineticsError, Location, Outcome, Quantity};

/// Bytes of stack of a thread: what the main one has elsewhere.
const STACK: usize = 8 << 20;
/// How long a thread waits until it checks again whether there is something to do.
const CHECK_INTERVAL: Duration = Duration::from_secs(3600);

/// What the threads share.
#[derive(Debug, Default)]
struct ServerState {
    library: OnceLock<Arc<Library>>,
    laws: RwLock<Vec<Option<Arc<PluginKinetics>>>>,
    grown: Grown,
}

/// Serves one plugin until the parent ends.
pub(super) fn serve(lanes: usize) -> ! {
    match begin(lanes) {
        Ok(parent_socket) => wait_for_parent(parent_socket),
        // Only the exit status can report it.
        Err(_) => leave(),
    }
}

/// Takes the two files that the parent gives, and starts a thread for each lane.
fn begin(lanes: usize) -> io::Result<RawFd> {
    let memory = duplicate(libc::STDIN_FILENO)?;
    let parent_socket = duplicate(libc::STDOUT_FILENO)?;
    let nothing = File::open("/dev/null")?;
    // SAFETY: files that are open: from now on nothing is read, and prints go where errors go.
    unsafe {
        libc::dup2(nothing.as_raw_fd(), libc::STDIN_FILENO);
        libc::dup2(libc::STDERR_FILENO, libc::STDOUT_FILENO);
    }
    // The parent says when the run ends, also where a signal is sent to all. It sees a stack overflow as a fault:
    // the standard library's handler would abort.
    let ignored = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP].map(|signal| (signal, libc::SIG_IGN));
    let default = [libc::SIGSEGV, libc::SIGBUS].map(|signal| (signal, libc::SIG_DFL));
    for (signal, action) in ignored.into_iter().chain(default) {
        // SAFETY: neither action calls a handler.
        unsafe { libc::signal(signal, action) };
    }
    check_global_state();
    keep_open(memory.as_raw_fd());
    keep_open(parent_socket.as_raw_fd());
    let memory = Memory::of(memory);
    let state = Arc::new(ServerState::default());
    for number in 0..lanes {
        let mut lane = memory.lane(number)?;
        let state = Arc::clone(&state);
        let work = move || {
            loop {
                if lane.wait_for(REQUESTED, CHECK_INTERVAL) {
                    state.answer(&mut lane);
                    lane.hand_over(ANSWERED);
                }
            }
        };
        thread::Builder::new().stack_size(STACK).spawn(work)?;
    }
    // Both stay open for good.
    std::mem::forget(memory);
    Ok(std::os::fd::IntoRawFd::into_raw_fd(parent_socket))
}

/// A duplicate of a file, under a number that is not one of the standard ones.
fn duplicate(file: RawFd) -> io::Result<OwnedFd> {
    // SAFETY: makes a new number for an open file.
    let new = unsafe { libc::fcntl(file, libc::F_DUPFD_CLOEXEC, 3) };
    if new < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: just made, and not shared.
    Ok(unsafe { OwnedFd::from_raw_fd(new) })
}

/// Waits for the parent to end.
fn wait_for_parent(parent_socket: RawFd) -> ! {
    loop {
        let mut poll = libc::pollfd { fd: parent_socket, events: libc::POLLIN, revents: 0 };
        // SAFETY: one entry.
        unsafe { libc::poll(&raw mut poll, 1, -1) };
        if poll.revents & (libc::POLLHUP | libc::POLLERR) != 0 {
            // SAFETY: this group consists of this process and of what the plugin has started.
            unsafe { libc::kill(0, libc::SIGKILL) };
        }
        if poll.revents & libc::POLLNVAL != 0 {
            // A plugin has closed it; the call under way reports that.
            thread::sleep(Duration::from_millis(100));
            leave();
        }
    }
}

/// Ends this process without exit hooks, which may be the plugin's.
fn leave() -> ! {
    // SAFETY: ends the process and cannot fail.
    unsafe { libc::_exit(1) }
}

impl ServerState {
    /// Does what the lane asks for.
    fn answer(&self, lane: &mut Lane) {
        let asked = lane.head().call.load(Ordering::Relaxed) as usize;
        let call = CALLS.get(asked).copied().unwrap_or_default();
        match call {
            "loading" | "create" | "typical" | "destroy" => {
                let number = lane.head().law.load(Ordering::Relaxed);
                let answer =
                    lane.read().map_err(|e| CallProblem::Other(e.to_string())).and_then(|text| {
                        let done = match call {
                            "loading" => self.load(&text),
                            "create" => self.create(&text),
                            "typical" => Ok(self.set_typical(number, &text)),
                            _ => self.destroy(number),
                        };
                        done.map_err(CallProblem::of_error)
                    });
                let text = serde_json::to_string(&answer).unwrap_or_default();
                // Without room the parent finds what it has written, and that makes no sense.
                let _ = lane.write(&text);
            }
            _ => {
                let (told, columns_end) = match self.evaluate(lane, call) {
                    Ok((outcome, columns_end)) => (CallProblem::of(outcome), columns_end),
                    Err(text) => (Some(CallProblem::Other(text)), 0),
                };
                lane.head().text.store(0, Ordering::Relaxed);
                if let Some(told) = told {
                    let text = serde_json::to_string(&told).unwrap_or_default();
                    let _ = lane.write_behind(columns_end, &text);
                }
            }
        }
    }

    fn load(&self, path: &str) -> Result<String, KineticsError> {
        let library = Library::load(Path::new(path))?;
        let descriptor = serde_json::to_string(library.descriptor());
        let _ = self.library.set(library);
        descriptor.map_err(|e| KineticsError::Isolated(e.to_string()))
    }

    fn create(&self, text: &str) -> Result<String, KineticsError> {
        let none = || KineticsError::Isolated("no plugin is loaded".to_owned());
        let library = self.library.get().ok_or_else(none)?;
        let request: CreateRequest = serde_json::from_str(text).map_err(|_| none())?;
        let parameters = request.parameters.into_iter().map(f64::from_bits).collect();
        let mut law = PluginKinetics::new(library, parameters)?;
        law.takes_parameter_columns &= request.takes_parameter_columns;
        let mut laws = self.laws.write().unwrap_or_else(PoisonError::into_inner);
        let free = laws.iter().position(Option::is_none).unwrap_or(laws.len());
        if free == laws.len() {
            laws.push(None);
        }
        laws[free] = Some(Arc::new(law));
        Ok(free.to_string())
    }

    fn set_typical(&self, number: u64, text: &str) -> String {
        let laws = self.laws.read().unwrap_or_else(PoisonError::into_inner);
        let law = usize::try_from(number).ok().and_then(|k| laws.get(k)?.as_ref());
        if let (Some(law), Ok(typical)) = (law, serde_json::from_str::<Vec<f64>>(text)) {
            law.set_typical(&typical);
        }
        String::new()
    }

    fn destroy(&self, number: u64) -> Result<String, KineticsError> {
        let law = {
            let mut laws = self.laws.write().unwrap_or_else(PoisonError::into_inner);
            usize::try_from(number).ok().and_then(|k| laws.get_mut(k)?.take())
        };
        drop(law);
        take_destroy_error().map_or_else(|| Ok(String::new()), Err)
    }

    /// Calls the law at the points of the lane; the outcome, and where the columns end.
    fn evaluate(&self, lane: &mut Lane, call: &'static str) -> Result<(Outcome, usize), String> {
        let invalid_request = || invalid_request(call);
        let Request { law, first, count, location, columns } =
            Request::read(lane.head()).ok_or_else(invalid_request)?;
        let laws = self.laws.read().unwrap_or_else(PoisonError::into_inner);
        let law = laws.get(law).cloned().flatten().ok_or_else(invalid_request)?;
        drop(laws);
        let [species, signals, parameters, values, partials] = columns;
        let inputs = species + signals + parameters;
        let room = |lane: &mut Lane, bytes: usize| lane.room(bytes).map_err(|e| e.to_string());
        room(lane, inputs.saturating_mul(size_of::<u64>()))?;
        let vary: Vec<bool> =
            // SAFETY: there is room, and it is our turn.
            (0..inputs).map(|k| unsafe { lane.data().cast::<u64>().add(k).read() } != 0).collect();
        let columns = ColumnLayout::new(vary.iter().copied(), values + partials, count);
        let columns = columns.ok_or_else(invalid_request)?;
        room(lane, columns.bytes)?;

        let column = |(place, vary): (&(usize, usize), &bool)| {
            // SAFETY: there is room, it is our turn, and inputs are only read.
            let data = unsafe { lane.values(*place) };
            if *vary { data.into() } else { Column::uniform(&data[0]) }
        };
        let all: Vec<Column<'_>> = columns.inputs.iter().zip(&vary).map(column).collect();
        let untouched = f64::from_bits(UNWRITTEN_BITS);
        let mut out: Vec<&mut [f64]> = Vec::with_capacity(values + partials);
        for (k, place) in columns.outputs.iter().enumerate() {
            // SAFETY: there is room, it is our turn, and no two columns overlap.
            let (column, guard) =
                unsafe { (lane.values_mut(*place), lane.values_mut(columns.guard(k))) };
            column.fill(untouched);
            guard.fill(untouched);
            out.push(column);
        }
        let batch = Batch {
            location,
            first,
            count,
            species: &all[..species],
            signals: &all[species..species + signals],
            parameters: &all[species + signals..],
        };
        let quantity = Quantity::of_call(call, partials > 0).ok_or_else(invalid_request)?;
        let (out_values, out_partials) = out.split_at_mut(values);
        let outcome = law.evaluate(quantity, &batch, out_values, out_partials);
        for k in 0..columns.outputs.len() {
            // SAFETY: as above; no other reference to these exists.
            let guard = unsafe { lane.values(columns.guard(k)) };
            if outcome.is_ok() && guard.iter().any(|value| value.to_bits() != UNWRITTEN_BITS) {
                let (output, law) = (k + 1, law.descriptor().title());
                let beyond = KineticsError::WritesBeyond { law, call, output, points: count };
                return Ok((Err(beyond), columns.bytes));
            }
        }
        if let Some(what) = self.grown.check() {
            let plugin = law.descriptor().name.clone();
            return Ok((Err(KineticsError::Misbehaves { plugin, call, what }), columns.bytes));
        }
        Ok((outcome, columns.bytes))
    }
}

fn invalid_request(call: &str) -> String {
    format!("{call} is asked for what makes no sense")
}

/// What a call is asked for.
struct Request {
    /// Number of the law.
    law: usize,
    first: usize,
    count: usize,
    location: Location,
    /// Counts of columns: species, signals, parameters, values, partial derivatives.
    columns: [usize; 5],
}

impl Request {
    /// None if a number is out of range.
    fn read(head: &Head) -> Option<Self> {
        let number = |value: u64| usize::try_from(value).ok();
        let mut columns = [0; 5];
        for (part, place) in columns.iter_mut().zip(&head.columns) {
            *part = number(place.load(Ordering::Relaxed))?;
        }
        Some(Self {
            law: number(head.law.load(Ordering::Relaxed))?,
            first: number(head.first.load(Ordering::Relaxed))?,
            count: number(head.count.load(Ordering::Relaxed))?,
            location: *LOCATIONS.get(head.location.load(Ordering::Relaxed) as usize)?,
            columns,
        })
    }
}
