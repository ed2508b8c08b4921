//! Progress of a run: a line that is rewritten on a terminal, a line now and then elsewhere, or nothing.
//!
//! ```text
//! 00:01:12  [#####...............]  25 %  time 12.500000 of 50  step 100  dt 5.000e-1
//! ```
//!
//! The bar is the share of the scene's end time, not of the wall time: step sizes and the cost of a step change
//! within a run. The wall time is that of this process.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{FormattedDuration, ProgressBar, ProgressStyle};

use rumple_numerics::num::{Short, whole};

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// A line that is rewritten, on standard error.
    Bar,
    /// Plain lines on standard error.
    Lines,
    /// Nothing.
    Silent,
}

impl Mode {
    /// A line that is rewritten if standard error is a terminal, lines if not.
    #[must_use]
    pub fn detect() -> Self {
        if std::io::stderr().is_terminal() { Self::Bar } else { Self::Lines }
    }
}

/// Least time between two plain lines: often enough to see that a run is alive, seldom enough
/// that the log of a long one stays readable.
pub const INTERVAL: Duration = Duration::from_secs(5);

/// The same of a bar's text.
const REDRAW_INTERVAL: Duration = Duration::from_millis(500);

/// Characters of the bar.
const WIDTH: usize = 20;

/// State of the run after a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ProgressLine {
    /// Simulated time.
    pub time: f64,
    /// Accepted steps.
    pub step: u64,
    /// Size of the last step.
    pub dt: f64,
}

enum Sink {
    Bar(ProgressBar),
    Lines { writer: Box<dyn Write + Send>, every: Duration, shown: Option<Instant> },
    Silent,
}

/// Where lines go, and the progress that each of them begins with.
struct Shown {
    sink: Sink,
    began: Instant,
    /// The end time, if there is one.
    end: Option<f64>,
    time: f64,
}

impl Shown {
    /// `[#####...............]  25 %  time 12.5 of 50  `: the share of the end time that is done.
    fn reached(&self) -> Option<String> {
        let end = self.end?;
        let share = self.time / end;
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        let percent = whole((100.0 * share).floor());
        let done = percent * WIDTH / 100;
        let bar = "#".repeat(done);
        Some(format!("[{bar:.<WIDTH$}] {percent:>3} %  {}  ", reached(self.time, end)))
    }

    /// Shows the elapsed wall time, the bar and the simulated time if they have an end, and `text`.
    fn show(&mut self, text: &str) {
        let text = format!("{}{text}", self.reached().unwrap_or_default());
        match &mut self.sink {
            Sink::Silent => {}
            Sink::Bar(line) => line.set_message(text),
            Sink::Lines { writer, shown, .. } => {
                say(writer, &format!("{}  {text}", FormattedDuration(self.began.elapsed())));
                *shown = Some(Instant::now());
            }
        }
    }
}

/// Shows the progress of a run to its end time.
pub struct Progress {
    shown: Arc<Mutex<Shown>>,
    /// The last step, if it was not shown.
    hidden: Option<String>,
}

impl Progress {
    /// Progress to time `end`.
    #[must_use]
    pub fn new(mode: Mode, end: f64) -> Self {
        Self::with_sink(Self::sink(mode), Some(end))
    }

    /// Progress of work that has no end in simulated time.
    #[must_use]
    pub fn without_end(mode: Mode) -> Self {
        Self::with_sink(Self::sink(mode), None)
    }

    fn sink(mode: Mode) -> Sink {
        match mode {
            Mode::Silent => Sink::Silent,
            Mode::Lines => {
                Sink::Lines { writer: Box::new(std::io::stderr()), every: INTERVAL, shown: None }
            }
            Mode::Bar => {
                let line = ProgressBar::new_spinner();
                if let Ok(style) = ProgressStyle::with_template("{elapsed_precise}  {wide_msg}") {
                    line.set_style(style);
                }
                line.enable_steady_tick(REDRAW_INTERVAL);
                Sink::Bar(line)
            }
        }
    }

    /// Plain lines to `writer`, at most one `every` so often, besides the first and the last.
    #[must_use]
    pub fn lines_to(writer: Box<dyn Write + Send>, every: Duration, end: f64) -> Self {
        Self::with_sink(Sink::Lines { writer, every, shown: None }, Some(end))
    }

    fn with_sink(sink: Sink, end: Option<f64>) -> Self {
        let shown = Shown { sink, began: Instant::now(), end, time: 0.0 };
        Self { shown: Arc::new(Mutex::new(shown)), hidden: None }
    }

    /// Reports the progress after a step.
    pub fn update(&mut self, line: &ProgressLine) {
        let ProgressLine { time, step, dt } = line;
        let text = format!("step {step}  dt {dt:.3e}");
        let mut shown = lock(&self.shown);
        shown.time = *time;
        let due = match &shown.sink {
            Sink::Lines { every, shown, .. } => shown.is_none_or(|at| at.elapsed() >= *every),
            _ => true,
        };
        if due {
            shown.show(&text);
        }
        self.hidden = (!due).then_some(text);
    }

    /// Reports work within a step while it is under way.
    #[must_use]
    pub fn aside(&self) -> Aside {
        Aside { shown: Arc::clone(&self.shown), reported: Mutex::new(Instant::now()) }
    }

    /// Shows `text` once, above the bar if there is one.
    pub fn message(&mut self, text: &str) {
        match &mut lock(&self.shown).sink {
            Sink::Silent => {}
            Sink::Bar(line) => line.println(text),
            Sink::Lines { writer, .. } => say(writer, text),
        }
    }

    /// Shows the last step if it was not shown, and leaves the terminal as it was; without an end the bar goes.
    pub fn finish(self) {
        let mut shown = lock(&self.shown);
        if let Some(text) = &self.hidden {
            shown.show(text);
        }
        if let Sink::Bar(line) = &shown.sink {
            match shown.end {
                Some(_) => line.abandon(),
                None => line.finish_and_clear(),
            }
        }
    }
}

/// How far a run to `end` is, in words.
fn reached(time: f64, end: f64) -> String {
    let time = if end.abs() < 1e-3 { format!("{time:.6e}") } else { format!("{time:.6}") };
    format!("time {time} of {}", Short(end))
}

/// Tells of work within a step: on the bar, or as a line where none was shown for long.
pub struct Aside {
    shown: Arc<Mutex<Shown>>,
    reported: Mutex<Instant>,
}

impl Aside {
    /// Shows what is done if it is time to, after the progress up to the last step; cheap enough to be asked
    /// again and again.
    pub fn report(&self, what: &dyn Fn() -> String) {
        let mut reported = lock(&self.reported);
        let mut shown = lock(&self.shown);
        let due = match &shown.sink {
            Sink::Silent => false,
            Sink::Bar(_) => reported.elapsed() >= REDRAW_INTERVAL,
            Sink::Lines { every, shown, .. } => shown.unwrap_or(*reported).elapsed() >= *every,
        };
        if due {
            *reported = Instant::now();
            shown.show(&what());
        }
    }
}

fn lock<T>(what: &Mutex<T>) -> MutexGuard<'_, T> {
    what.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Progress is a courtesy: a closed pipe must not end a run.
fn say(writer: &mut dyn Write, text: &str) {
    let _ = writeln!(writer, "{text}").and_then(|()| writer.flush());
}
