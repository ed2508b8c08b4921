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

create_exception!(
    rumple,
    Error,
    PyException,
    "Anything that can go wrong. `path`, `line`, `column` and `key` are the place in a scene, `vertex` is one to blame, `time` that of \
     a run that stopped and `folder` its failure report; None where they do not apply."
);
create_exception!(rumple, SceneError, Error, "A scene is wrong: `path`, `line`, `column`, `key`.");
create_exception!(
    rumple,
    LawError,
    Error,
    "A law cannot be loaded, or one of its calls failed: `vertex`."
);
create_exception!(
    rumple,
    SolverError,
    Error,
    "A solver stopped without a result; of a run `time`, `vertex` and `folder`."
);
create_exception!(
    rumple,
    FileError,
    Error,
    "A mesh, a state or a result cannot be read or written."
);

/// Adds the exceptions to the module.
pub(crate) fn add_errors(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let error = py.get_type::<Error>();
    for attribute in ["path", "line", "column", "key", "vertex", "time", "folder"] {
        error.setattr(attribute, py.None())?;
    }
    module.add("Error", error)?;
    module.add("SceneError", py.get_type::<SceneError>())?;
    module.add("LawError", py.get_type::<LawError>())?;
    module.add("SolverError", py.get_type::<SolverError>())?;
    module.add("FileError", py.get_type::<FileError>())
}

/// An exception of the class of `error`, with its place.
fn of_class(py: Python<'_>, error: &rumple::Error, text: String) -> PyResult<PyErr> {
    Ok(match error {
        rumple::Error::Scene(scene) => {
            let raised = SceneError::new_err(text);
            let value = raised.value(py);
            // What is wrong may stand in the overrides.
            if !scene.origin().starts_with("--set") {
                value.setattr("path", scene.origin())?;
            }
            if let Some((line, column)) = scene.position() {
                value.setattr("line", line)?;
                value.setattr("column", column)?;
            }
            value.setattr("key", scene.key())?;
            raised
        }
        rumple::Error::Stopped(failure) => {
            let raised = of_class(py, &failure.error, text)?;
            raised.value(py).setattr("time", failure.time)?;
            raised.value(py).setattr("vertex", failure.vertex)?;
            raised.value(py).setattr("folder", &failure.folder)?;
            raised
        }
        rumple::Error::Kinetics(law) => {
            let raised = LawError::new_err(text);
            let vertex = law.site().filter(|site| site.location == "vertex").map(|site| site.point);
            raised.value(py).setattr("vertex", vertex)?;
            raised
        }
        rumple::Error::Solve(_) | rumple::Error::Broken(_) => SolverError::new_err(text),
        rumple::Error::Sheet(_) | rumple::Error::Output(_) => FileError::new_err(text),
        _ => Error::new_err(text),
    })
}

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

    /// Does `work` in a thread of its own, with so many for its loops (0: all), while this one lets handlers of signals run;
    /// one that raises an exception asks `interrupt` to end the work, whose result is then that exception.
    pub(crate) fn attend<R: Send>(
        &self,
        py: Python<'_>,
        (interrupt, threads): (Interrupt, usize),
        work: impl FnOnce() -> rumple::Result<R> + Send,
    ) -> PyResult<R> {
        self.call(py, &mut false, || {
            thread::scope(|scope| {
                let (end, ended) = mpsc::channel::<()>();
                let worker = move || {
                    let done = with_threads(threads, work);
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

/// Does `work` with so many threads; 0 for those that all calls share.
fn with_threads<R: Send>(
    threads: usize,
    work: impl FnOnce() -> rumple::Result<R> + Send,
) -> rumple::Result<R> {
    if threads == 0 {
        return work();
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES).build();
    let refuse = |error| rumple::Error::Refused(format!("{threads} threads: {error}"));
    pool.map_err(refuse)?.install(work)
}

/// Does `work` outside of any simulation.
pub(crate) fn call<R: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> rumple::Result<R> + Send,
) -> PyResult<R> {
    Pending::default().call(py, &mut false, work)
}

/// Options of the program that errors of the library name, and what they are here.
const PYTHON_NAMES: [(&str, &str); 6] = [
    ("choose another with --out, or give --force", "choose another out, or give force=True"),
    ("choose another, or give --force", "choose another, or give force=True"),
    ("--plugin-path DIR", "plugins=[DIR]"),
    ("--start-time ", "start_time "),
    ("[--set:", "[overrides:"),
    ("[--over", "[over"),
];

/// A text of the library with the options as they are called here.
pub(crate) fn in_python(text: String) -> String {
    PYTHON_NAMES.iter().fold(text, |text, (there, here)| text.replace(there, here))
}

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
    let raised =
        of_class(py, error, in_python(text).trim_end().to_owned()).unwrap_or_else(|error| error);
    raised.set_cause(py, cause);
    raised
}

/// The text of a panic.
fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message")
}
