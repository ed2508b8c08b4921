//! Calls of the engine: without the interpreter's lock, with errors and panics as exceptions, and to be interrupted.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use rumple::output::Interrupt;
use rumple::solve::Control;

create_exception!(rumple, Error, PyException, "Anything that can go wrong in the engine.");

/// Signals are asked for no more often: every time takes the interpreter's lock.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Bytes of stack of a thread that runs a scene: what the main one has elsewhere.
const STACK_BYTES: usize = 8 << 20;

/// An exception that engine code has met and cannot return itself.
#[derive(Debug, Default, Clone)]
pub(crate) struct Slot(Arc<Mutex<Option<PyErr>>>);

impl Slot {
    /// Keeps the first exception.
    pub(crate) fn keep(&self, error: PyErr) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    /// Removes the exception.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn is_empty(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_none()
    }
}

/// The exceptions that end a call of the engine.
#[derive(Debug, Default, Clone)]
pub(crate) struct Pending {
    /// Raised by a handler of signals, as KeyboardInterrupt is.
    pub(crate) signal: Slot,
    /// Raised by a law written in Python.
    pub(crate) law: Slot,
}

impl Pending {
    /// The control that lets handlers of signals run, and gives up once one has raised an exception.
    pub(crate) fn control(&self) -> Control {
        let (signal, asked) = (self.signal.clone(), Mutex::new(Instant::now()));
        let interrupted = move || {
            if !signal.is_empty() {
                return true;
            }
            {
                let mut asked = asked.lock().unwrap_or_else(PoisonError::into_inner);
                if asked.elapsed() < SIGNAL_INTERVAL {
                    return false;
                }
                *asked = Instant::now();
            }
            let handled = Python::attach(|py| py.check_signals());
            handled.map_err(|error| signal.keep(error)).is_err()
        };
        Control::new(interrupted, |_| ())
    }

    /// Does `work` in a thread of its own, while this one lets handlers of signals run; one that raises an exception
    /// asks `interrupt` to end the work, whose result is then that exception.
    pub(crate) fn attend<R: Send>(
        &self,
        py: Python<'_>,
        interrupt: Interrupt,
        work: impl FnOnce() -> rumple::Result<R> + Send,
    ) -> PyResult<R> {
        self.call(py, &mut false, || {
            thread::scope(|scope| {
                let (end, ended) = mpsc::channel::<()>();
                let worker = move || {
                    let done = work();
                    drop(end);
                    done
                };
                let worker =
                    thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, worker);
                let worker = worker.map_err(|error| {
                    rumple::Error::Refused(format!("no thread can be started: {error}"))
                })?;
                while ended.recv_timeout(SIGNAL_INTERVAL) == Err(mpsc::RecvTimeoutError::Timeout) {
                    if let Err(error) = Python::attach(|py| py.check_signals()) {
                        self.signal.keep(error);
                        interrupt.request();
                    }
                }
                worker.join().unwrap_or_else(|panic| resume_unwind(panic))
            })
        })
    }

    /// Does `work` without the interpreter's lock. A panic is an exception too; `broken` says that there was one.
    pub(crate) fn call<R: Send>(
        &self,
        py: Python<'_>,
        broken: &mut bool,
        work: impl FnOnce() -> rumple::Result<R> + Send,
    ) -> PyResult<R> {
        if *broken {
            return Err(Error::new_err("an internal error has ended this simulation before"));
        }
        drop((self.signal.take(), self.law.take()));
        let done = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
        if let Some(signal) = self.signal.take() {
            *broken |= done.is_err();
            return Err(signal);
        }
        let cause = self.law.take();
        match done {
            Ok(Ok(result)) => Ok(result),
            Ok(Err(error)) => Err(raised(py, &error, cause)),
            Err(panic) => {
                *broken = true;
                Err(Error::new_err(format!("internal error: {}", message(&*panic))))
            }
        }
    }
}

/// Does `work` outside of any simulation.
pub(crate) fn call<R: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> rumple::Result<R> + Send,
) -> PyResult<R> {
    Pending::default().call(py, &mut false, work)
}

/// Options of the program that errors of the library name, and what they are here.
const PYTHON_NAMES: [(&str, &str); 5] = [
    ("choose another with --out, or give --force", "choose another out, or give force=True"),
    ("choose another, or give --force", "choose another, or give force=True"),
    ("--plugin-path DIR", "plugins=[DIR]"),
    ("[--set:", "[overrides:"),
    ("[--over", "[over"),
];

/// The exception of an error, as the program prints it but for colours and options.
fn raised(py: Python<'_>, error: &rumple::Error, cause: Option<PyErr>) -> PyErr {
    if let Some(cause) = &cause
        && !cause.is_instance_of::<PyException>(py)
    {
        // KeyboardInterrupt and SystemExit are no errors of a law.
        return cause.clone_ref(py);
    }
    let text = match error {
        rumple::Error::Scene(scene) => scene.reworded(&PYTHON_NAMES).rendered(false),
        other => other.to_string(),
    };
    let text = PYTHON_NAMES.iter().fold(text, |text, (there, here)| text.replace(there, here));
    let raised = Error::new_err(text.trim_end().to_owned());
    raised.set_cause(py, cause);
    raised
}

/// The text of a panic.
fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message")
}
