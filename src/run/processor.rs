//! The processor time of steps, without what happens between them.
//!
//! The system takes as long to say what processor time a process has used as a small model takes for a step. So
//! it is asked at the ends of pieces that are long, and else now and then: of what is short the wall time
//! stands for it, as nothing short has waited or works on several threads.

use std::time::{Duration, Instant};

/// A piece of work or a pause this long, s, does not go by without asking the system.
const LONG_INTERVAL: f64 = 5e-5;
/// Nor does so much time with any number of short ones.
const MAX_UNMEASURED_TIME: f64 = 5e-4;

/// Tells the processor time of pieces of work apart from that of what is between them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Processor {
    /// When the system was last asked, and what it said; none before the first piece.
    asked: Option<(Instant, f64)>,
    /// Wall time since that pieces and pauses took, s.
    pieces: f64,
    pauses: f64,
    /// When the last piece ended.
    ended: Option<Instant>,
}

impl Processor {
    /// A piece begins: the processor time of earlier ones that was not told yet, s.
    pub(crate) fn begin(&mut self) -> f64 {
        let now = Instant::now();
        let pause = self.ended.map_or(f64::INFINITY, |ended| (now - ended).as_secs_f64());
        self.ended = Some(now);
        self.pauses += pause;
        if pause <= LONG_INTERVAL {
            return 0.0;
        }
        let told = self.pieces;
        self.restart(now, processor_time().unwrap_or(f64::NAN));
        told
    }

    /// The piece ends: its wall time, and the processor time of it and of earlier ones that was not told yet,
    /// s; 0 where that is reported later.
    pub(crate) fn end(&mut self) -> (f64, f64) {
        let now = Instant::now();
        let piece = self.ended.map_or(f64::INFINITY, |began| (now - began).as_secs_f64());
        self.ended = Some(now);
        self.pieces += piece;
        let Some((asked, before)) = self.asked else { return (piece, 0.0) };
        if piece <= LONG_INTERVAL && (now - asked).as_secs_f64() <= MAX_UNMEASURED_TIME {
            return (piece, 0.0);
        }
        let used = processor_time().unwrap_or(f64::NAN);
        let told = used - before - self.pauses;
        self.restart(now, used);
        // NaN stays.
        (piece, if told < 0.0 { 0.0 } else { told })
    }

    /// What was not told yet, s.
    pub(crate) fn unreported(&self) -> f64 {
        self.pieces
    }

    fn restart(&mut self, now: Instant, used: f64) {
        self.asked = Some((now, used));
        (self.pieces, self.pauses) = (0.0, 0.0);
    }
}

/// Processor time of all threads of this process, s.
#[cfg(unix)]
pub(crate) fn processor_time() -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ProcessCPUTime);
    let [seconds, nanoseconds] = [time.tv_sec, time.tv_nsec].map(u64::try_from);
    Some(Duration::new(seconds.ok()?, u32::try_from(nanoseconds.ok()?).ok()?).as_secs_f64())
}

#[cfg(not(unix))]
pub(crate) fn processor_time() -> Option<f64> {
    None
}
