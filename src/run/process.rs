//! What the system says of this process: memory and processor time.

/// Largest resident memory of this process so far, bytes; where the system says it.
#[must_use]
pub fn peak_resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024 * kibibytes)
}

/// Processor time of all threads of this process, s.
#[cfg(unix)]
pub(crate) fn processor_time() -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ProcessCPUTime);
    let [seconds, nanoseconds] = [time.tv_sec, time.tv_nsec].map(u32::try_from);
    Some(f64::from(seconds.ok()?) + 1e-9 * f64::from(nanoseconds.ok()?))
}

#[cfg(not(unix))]
pub(crate) fn processor_time() -> Option<f64> {
    None
}
