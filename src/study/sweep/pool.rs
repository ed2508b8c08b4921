//! Members as child processes, as many at once as cores and memory allow.
//!
//! A child holds one end of a pipe. When that closes, because the sweep was asked to end or was killed
//! itself, the child ends after its step as if it was interrupted, its files whole. A signal that asked the
//! sweep to end is passed on through the pipe, as a number.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::member::{MemberStatus, reached, status};
use super::memory::Needs;
use super::plan::Plan;
use crate::output::{Interrupt, OutputError, ResultDirectory};
use crate::run::{Costs, Result, peak_resident};

/// How members are run.
pub struct Pool<'a> {
    /// What is run.
    pub plan: &'a Plan,
    /// The directory of the sweep.
    pub root: &'a Path,
    /// This program.
    pub program: PathBuf,
    /// Most members at once.
    pub jobs: usize,
    /// Bytes that all of them together may take, if that matters.
    pub memory: Option<u64>,
}

/// What happens while members run.
pub enum Event {
    /// A member has begun, as one of so many.
    Begun {
        /// Its number.
        member: usize,
        /// How many run now.
        running: usize,
    },
    /// A member has ended.
    Ended {
        /// Its number.
        member: usize,
        /// How.
        status: MemberStatus,
        /// Why.
        reason: String,
        /// Wall time that it took, s.
        seconds: f64,
    },
    /// The next member waits for memory that others have.
    Waits {
        /// Its number.
        member: usize,
        /// Bytes that it needs.
        needs: u64,
        /// Bytes that are left.
        left: u64,
    },
    /// How far those are that run, now and then: their numbers and the times of their last output.
    Going {
        /// The members.
        running: Vec<(usize, Option<f64>)>,
    },
    /// A member needs more than there is, and is run alone.
    Large {
        /// Its number.
        member: usize,
        /// Bytes that it needs.
        needs: u64,
    },
}

/// A member that runs.
struct Running {
    member: usize,
    child: Child,
    /// Closed to ask it to end.
    leash: Option<ChildStdin>,
    since: Instant,
    /// Largest resident memory so far.
    peak: u64,
    /// Whether it has relaxed its start.
    relaxed: bool,
}

/// Interval between two checks of the children.
const PAUSE: Duration = Duration::from_millis(20);
/// Between two reports of how far members are.
const REPORT: Duration = Duration::from_secs(30);
/// A member that has relaxed its start has made most of its tables after so long.
const SETTLED: Duration = Duration::from_millis(500);

impl Pool<'_> {
    /// Runs `members`; `happens` is called for everything that happens.
    ///
    /// # Errors
    /// If a child cannot be started.
    pub fn run(
        &self,
        members: &[usize],
        interrupt: Interrupt,
        happens: &mut dyn FnMut(&Event),
    ) -> Result<()> {
        let mut needs = self.known_needs();
        let mut waiting = members.iter().copied().peekable();
        let mut running: Vec<Running> = Vec::new();
        let (mut said, mut reported) = (None, Instant::now());
        loop {
            self.reap(&mut running, &mut needs, happens);
            if reported.elapsed() > REPORT {
                reported = Instant::now();
                let time = |r: &Running| (r.member, reached(&self.directory(r.member)));
                happens(&Event::Going { running: running.iter().map(time).collect() });
            }
            if interrupt.requested() {
                for mut leash in running.iter_mut().filter_map(|r| r.leash.take()) {
                    let signal = interrupt.signal().map_or_else(String::new, |s| s.to_string());
                    // One that has ended does not read it.
                    let _ = leash.write_all(signal.as_bytes());
                }
            } else if let Some(&member) = waiting.peek()
                && running.len() < self.jobs
                && self.fits(member, &running, &needs, &mut said, happens)
            {
                waiting.next();
                running.push(self.start(member)?);
                happens(&Event::Begun { member, running: running.len() });
                continue;
            }
            let done = waiting.peek().is_none() || interrupt.requested();
            if running.is_empty() && done {
                return Ok(());
            }
            thread::sleep(PAUSE);
        }
    }

    fn directory(&self, member: usize) -> PathBuf {
        self.plan.directory(self.root, member)
    }

    /// What members that have run before took.
    fn known_needs(&self) -> Needs {
        let mut needs = Needs::default();
        for (number, point) in self.plan.members.iter().enumerate() {
            let directory = self.directory(number);
            let complete = status(self.plan, &directory).0 == MemberStatus::Complete;
            let costs = Costs::read(&directory).ok().filter(|_| complete);
            if let Some(peak) = costs.and_then(|costs| costs.peak_resident_bytes) {
                needs.ended(point.size, peak);
            }
        }
        needs
    }

    /// Notes which children have ended, and the memory of the others.
    fn reap(&self, running: &mut Vec<Running>, needs: &mut Needs, happens: &mut dyn FnMut(&Event)) {
        let mut left = Vec::new();
        for mut one in running.drain(..) {
            // One that cannot be waited for any more has ended.
            let Ok(None) = one.child.try_wait() else {
                let directory = self.directory(one.member);
                let (mut status, mut reason) = status(self.plan, &directory);
                if let Ok(Some(code)) = one.child.try_wait()
                    && matches!(status, MemberStatus::NotBegun | MemberStatus::Killed)
                {
                    status = MemberStatus::Killed;
                    let log = std::fs::read_to_string(log(self.plan, self.root, one.member));
                    let said = log.ok().and_then(|log| Some(log.lines().last()?.to_owned()));
                    reason = said.unwrap_or_else(|| format!("ended without a word: {code}"));
                }
                let costs = Costs::read(&directory).ok();
                let peak = costs.and_then(|costs| costs.peak_resident_bytes);
                needs.ended(self.plan.members[one.member].size, peak.unwrap_or(0).max(one.peak));
                let seconds = one.since.elapsed().as_secs_f64();
                happens(&Event::Ended { member: one.member, status, reason, seconds });
                continue;
            };
            let peak = peak_resident(Some(one.child.id())).unwrap_or(0);
            one.peak = one.peak.max(peak);
            one.relaxed |= one.since.elapsed() > SETTLED && self.has_rows(one.member);
            left.push(one);
        }
        let relaxed = left.iter().filter(|r| r.relaxed);
        let known = relaxed.map(|r| (self.plan.members[r.member].size, r.peak)).collect();
        needs.running(known);
        *running = left;
    }

    /// Whether a member has relaxed its start: there is a row of measures.
    fn has_rows(&self, member: usize) -> bool {
        let path = self.directory(member).join(ResultDirectory::MEASURES);
        std::fs::read(path).is_ok_and(|bytes| bytes.iter().filter(|b| **b == b'\n').count() > 1)
    }

    /// Whether there is memory for `member` beside those that run.
    fn fits(
        &self,
        member: usize,
        running: &[Running],
        needs: &Needs,
        said: &mut Option<usize>,
        happens: &mut dyn FnMut(&Event),
    ) -> bool {
        let Some(memory) = self.memory else { return true };
        let size = |member: usize| self.plan.members[member].size;
        let wanted = needs.of(size(member));
        if running.is_empty() {
            if let Some(needs) = wanted.filter(|wanted| *wanted > memory) {
                happens(&Event::Large { member, needs });
            }
            return true;
        }
        // Nothing is known yet: the first tells.
        let Some(wanted) = wanted else { return false };
        let taken = |r: &Running| needs.of(size(r.member)).unwrap_or(0).max(r.peak);
        let left = memory.saturating_sub(running.iter().map(taken).sum());
        let fits = wanted <= left;
        if !fits && said.replace(member) != Some(member) {
            happens(&Event::Waits { member, needs: wanted, left });
        }
        fits
    }

    fn start(&self, member: usize) -> Result<Running> {
        let log = log(self.plan, self.root, member);
        let unwritable = |source| OutputError::Write { path: log.clone(), source };
        std::fs::create_dir_all(self.root.join(Plan::MEMBERS)).map_err(unwritable)?;
        let messages = File::create(&log).map_err(unwritable)?;
        let refused = |source| OutputError::Read { path: self.program.clone(), source };
        let mut child = Command::new(&self.program)
            .args(["sweep", "member", "--leash"])
            .arg(self.root)
            .arg(member.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(messages)
            .spawn()
            .map_err(refused)?;
        let leash = child.stdin.take();
        Ok(Running { member, child, leash, since: Instant::now(), peak: 0, relaxed: false })
    }
}

/// Where the messages of a member go that is run here.
fn log(plan: &Plan, root: &Path, member: usize) -> PathBuf {
    let mut name = plan.directory(root, member).into_os_string();
    name.push(".log");
    PathBuf::from(name)
}
