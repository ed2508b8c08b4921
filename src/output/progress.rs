//! How far a run is: a bar on a terminal, a line now and then elsewhere, or nothing.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use rumple_numerics::num::Short;

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// A bar that redraws itself, on standard error.
    Bar,
    /// Plain lines on standard error.
    Lines,
    /// Nothing.
    Silent,
}

impl Mode {
    /// A bar if standard error is a terminal, lines if not.
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

/// Ticks of the bar from start to end.
const TICKS: u16 = 1000;

/// What is known after a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ProgressLine {
    /// Time reached.
    pub time: f64,
    /// Steps taken.
    pub step: u64,
    /// Size of the last step.
    pub dt: f64,
    /// Force residual, or whatever norm the solver stops by.
    pub residual: f64,
    /// The time that is left, in words, if that is known.
    pub left: String,
    /// Anything else worth a few words.
    pub note: String,
}

enum Sink {
    Bar(ProgressBar),
    Lines { writer: Box<dyn Write + Send>, every: Duration, shown: Option<Instant> },
    Silent,
}

/// Where lines go, and how far the run is that they tell of.
struct Shown {
    sink: Sink,
    /// The time reached, in words.
    reached: String,
    /// The time that is left, in words, if that is known.
    left: String,
}

/// Shows how far a run is between two times.
pub struct Progress {
    shown: Arc<Mutex<Shown>>,
    start: f64,
    end: f64,
    last: Option<ProgressLine>,
    last_shown: bool,
}

impl Progress {
    /// Progress from time `start` to time `end`.
    #[must_use]
    pub fn new(mode: Mode, start: f64, end: f64) -> Self {
        let sink = match mode {
            Mode::Silent => Sink::Silent,
            Mode::Lines => {
                Sink::Lines { writer: Box::new(std::io::stderr()), every: INTERVAL, shown: None }
            }
            Mode::Bar => {
                let bar = ProgressBar::new(TICKS.into());
                if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}") {
                    bar.set_style(style);
                }
                bar.enable_steady_tick(Duration::from_millis(500));
                Sink::Bar(bar)
            }
        };
        Self::with_sink(sink, start, end)
    }

    /// Plain lines to `writer`, at most one `every` so often, besides the first and the last.
    #[must_use]
    pub fn lines_to(writer: Box<dyn Write + Send>, every: Duration, start: f64, end: f64) -> Self {
        Self::with_sink(Sink::Lines { writer, every, shown: None }, start, end)
    }

    fn with_sink(sink: Sink, start: f64, end: f64) -> Self {
        let shown = Shown { sink, reached: reached(start, end), left: String::new() };
        let shown = Arc::new(Mutex::new(shown));
        Self { shown, start, end, last: None, last_shown: false }
    }

    /// Reports the progress after a step.
    pub fn update(&mut self, line: &ProgressLine) {
        let text = self.describe(line);
        let share = self.share(line.time);
        let mut shown = lock(&self.shown);
        shown.reached = reached(line.time, self.end);
        shown.left.clone_from(&line.left);
        self.last_shown = match &mut shown.sink {
            Sink::Silent => true,
            Sink::Bar(bar) => {
                let ticks = rumple_numerics::num::whole(share * f64::from(TICKS)) as u64;
                bar.set_position(ticks);
                bar.set_message(text);
                true
            }
            Sink::Lines { writer, every, shown } => {
                let due = shown.is_none_or(|at| at.elapsed() >= *every);
                if due {
                    say(writer, &text);
                    *shown = Some(Instant::now());
                }
                due
            }
        };
        drop(shown);
        self.last = Some(line.clone());
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
            Sink::Bar(bar) => bar.println(text),
            Sink::Lines { writer, .. } => say(writer, text),
        }
    }

    /// Shows the last step if it was not shown, and leaves the terminal as it was.
    pub fn finish(self) {
        let text = self.last.as_ref().map(|line| self.describe(line));
        match (&mut lock(&self.shown).sink, text) {
            (Sink::Bar(bar), _) => bar.abandon(),
            (Sink::Lines { writer, .. }, Some(text)) if !self.last_shown => say(writer, &text),
            _ => {}
        }
    }

    /// The part of the way from start to end that is done, from 0 to 1.
    fn share(&self, time: f64) -> f64 {
        let share = (time - self.start) / (self.end - self.start);
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }

    fn describe(&self, line: &ProgressLine) -> String {
        let ProgressLine { time, step, dt, residual, left, note } = line;
        let mut text = format!(
            "{}  step {step}  dt {dt:.3e}  residual {residual:.2e}",
            reached(*time, self.end)
        );
        if !left.is_empty() {
            text += &format!("  {left}");
        }
        if !note.is_empty() {
            text += &format!("  {note}");
        }
        text
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
    /// Shows what is done if it is time to, with the time that the last step reached and what is left, as every
    /// line of progress; cheap enough to be asked again and again.
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
            let mut text = format!("{}: {}", shown.reached, what());
            if !shown.left.is_empty() {
                text += &format!("  {}", shown.left);
            }
            match &mut shown.sink {
                Sink::Silent => {}
                Sink::Bar(bar) => bar.set_message(text),
                Sink::Lines { writer, shown, .. } => {
                    say(writer, &text);
                    *shown = Some(*reported);
                }
            }
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
