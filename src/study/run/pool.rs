//! Members as child processes, several at once.
//!
//! A child holds one end of a pipe. When that closes, because the study was asked to end or was killed
//! itself, the child ends after its step as if it was interrupted, its files complete. A signal that asked
//! the study to end is passed on through the pipe, as a number.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::output::plot::label;
use crate::output::{Interrupt, OutputError};
use crate::run::{Error, Result};
use crate::study::gather::{MemberStatus, last_time, status};
use crate::study::plan::Plan;

/// Child processes that run the members of a study.
pub struct Pool<'a> {
    /// The members.
    pub plan: &'a Plan,
    /// The directory of the study.
    pub root: &'a Path,
    /// Command of a member, to which the directory of the study and the number of the member are appended.
    pub command: &'a [OsString],
    /// Most members at once.
    pub jobs: usize,
    /// Called with a line of text for everything that happens.
    pub happens: &'a dyn Fn(&str),
}

/// A member that runs.
struct Running {
    member: usize,
    child: Child,
    /// Closed to ask it to end.
    leash: Option<ChildStdin>,
    since: Instant,
}

/// Members that run and that have ended.
struct Progress {
    running: Vec<Running>,
    /// Counts of members that have ended and of all.
    ended: [usize; 2],
}

/// Interval between two checks of the children.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Interval between two reports of the times that members have reached.
const REPORT_INTERVAL: Duration = Duration::from_secs(30);

impl Pool<'_> {
    /// Runs `members`.
    ///
    /// # Errors
    /// If a child cannot be started.
    pub fn run(&mut self, members: &[usize], interrupt: Interrupt) -> Result<()> {
        let mut waiting = members.iter().copied().peekable();
        let mut progress = Progress { running: Vec::new(), ended: [0, members.len()] };
        let mut reported = Instant::now();
        loop {
            self.reap(&mut progress);
            if reported.elapsed() > REPORT_INTERVAL {
                reported = Instant::now();
                self.report(&progress);
            }
            if interrupt.requested() {
                for mut leash in progress.running.iter_mut().filter_map(|r| r.leash.take()) {
                    let signal = interrupt.signal().map_or_else(String::new, |s| s.to_string());
                    // One that has ended does not read it.
                    let _ = leash.write_all(signal.as_bytes());
                }
            } else if let Some(&member) = waiting.peek()
                && progress.running.len() < self.jobs
            {
                waiting.next();
                progress.running.push(self.start(member)?);
                self.say(member, &format!("begun, {} at once", progress.running.len()));
                continue;
            }
            let done = waiting.peek().is_none() || interrupt.requested();
            if progress.running.is_empty() && done {
                return Ok(());
            }
            thread::sleep(POLL_INTERVAL);
        }
    }

    fn directory(&self, member: usize) -> PathBuf {
        self.plan.directory(self.root, member)
    }

    fn say(&mut self, member: usize, text: &str) {
        (self.happens)(&format!("{}: {text}", self.plan.name(member)));
    }

    /// Reports the times that members have reached.
    fn report(&mut self, progress: &Progress) {
        let time = |running: &Running| {
            let member = running.member;
            let until =
                self.plan.until(member).map_or(String::new(), |t| format!(" of {}", label(t)));
            let time = last_time(&self.directory(member));
            let time = time.map_or("at its start".into(), |t| format!("t = {}{until}", label(t)));
            format!("{}: {time}", self.plan.name(member))
        };
        let all: Vec<String> = progress.running.iter().map(time).collect();
        let [ended, of] = progress.ended;
        (self.happens)(&format!("[{ended}/{of}] {}", all.join("; ")));
    }

    /// Notes which children have ended.
    fn reap(&mut self, progress: &mut Progress) {
        for mut one in std::mem::take(&mut progress.running) {
            // One that cannot be waited for any more has ended.
            match one.child.try_wait() {
                Ok(None) => progress.running.push(one),
                _ => self.end(one, progress),
            }
        }
    }

    /// Notes how a member has ended.
    fn end(&mut self, mut one: Running, progress: &mut Progress) {
        let directory = self.directory(one.member);
        let (mut status, mut reason) = status(self.plan, &directory);
        if let Ok(Some(code)) = one.child.try_wait()
            && matches!(status, MemberStatus::NotBegun | MemberStatus::Killed)
        {
            status = MemberStatus::Killed;
            let log = fs::read_to_string(self.log(one.member)).unwrap_or_default();
            let last = log.lines().last().map(str::to_owned);
            reason = last.unwrap_or_else(|| format!("ended without a word: {code}"));
        }
        progress.ended[0] += 1;
        let [ended, of] = progress.ended;
        let (name, seconds) = (self.plan.name(one.member), one.since.elapsed().as_secs_f64());
        let first = reason.lines().next().unwrap_or_default();
        (self.happens)(&format!("[{ended}/{of}] {name}: {status} after {seconds:.1} s: {first}"));
    }

    fn start(&self, member: usize) -> Result<Running> {
        let log = self.log(member);
        fs::create_dir_all(self.root.join(Plan::MEMBERS)).map_err(OutputError::write(&log))?;
        let messages = File::create(&log).map_err(OutputError::write(&log))?;
        let (program, arguments) = self
            .command
            .split_first()
            .ok_or_else(|| Error::Refused("the command that runs a member is empty".to_owned()))?;
        let mut child = Command::new(program)
            .args(arguments)
            .arg(self.root)
            .arg(member.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(messages)
            .spawn()
            .map_err(OutputError::read(program.as_ref()))?;
        let leash = child.stdin.take();
        Ok(Running { member, child, leash, since: Instant::now() })
    }

    /// Where the messages of a member go.
    fn log(&self, member: usize) -> PathBuf {
        let mut name = self.directory(member).into_os_string();
        name.push(".log");
        name.into()
    }
}
