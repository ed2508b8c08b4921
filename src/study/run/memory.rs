//! Memory demand of members.
//!
//! The memory of a member is measured: the peak of members that have ended, scaled with the
//! size of their sheets; before one has ended, that of the ones that run, with some room for growth. So
//! the first runs alone until it has relaxed its start.

use std::fs;
use std::path::Path;

use crate::run::Costs;
use crate::study::gather::{MemberStatus, status};
use crate::study::plan::Plan;

/// Growth that is expected beyond the peak of a member so far, while no other has ended.
const PEAK_GROWTH: f64 = 1.5;
/// Part of the free memory that a sweep uses; the rest is for everything else on the machine.
const USED_SHARE: f64 = 0.9;

/// Bytes that a sweep may use on this machine: most of what is free now, and no more than a control
/// group leaves; none where the system does not say.
#[must_use]
pub fn available() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    let free = left_by_group().map_or(1024 * kibibytes, |group| group.min(1024 * kibibytes));
    Some(share(free, USED_SHARE))
}

/// Memory that the control group of this process has left, where it has a limit.
fn left_by_group() -> Option<u64> {
    let number =
        |path: String| -> Option<u64> { fs::read_to_string(path).ok()?.trim().parse().ok() };
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let left = |line: &str| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (root, limit, used) = match parts.next()? {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            "memory" => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes"),
            _ => return None,
        };
        let root = format!("{root}{}", parts.next()?);
        Some(number(format!("{root}/{limit}"))?.saturating_sub(number(format!("{root}/{used}"))?))
    };
    groups.lines().filter_map(left).min()
}

#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn share(bytes: u64, part: f64) -> u64 {
    // Far below the 2⁵³ that a float counts to.
    (bytes as f64 * part) as u64
}

/// Largest resident memory of the run in `directory`, bytes, where that is known.
pub(super) fn peak(directory: &Path) -> Option<u64> {
    Costs::read(directory).ok()?.peak_resident_bytes
}

/// Measured memory of members.
#[derive(Debug, Default)]
pub struct MemoryEstimates {
    /// Size and peak of members that have ended.
    ended: Vec<(u64, u64)>,
    /// Of those that run and have relaxed their start.
    running: Vec<(u64, u64)>,
}

impl MemoryEstimates {
    /// Memory of the complete members of the study in `root`.
    pub(super) fn measured(plan: &Plan, root: &Path) -> Self {
        let mut needs = Self::default();
        for (number, point) in plan.members.iter().enumerate() {
            let directory = plan.directory(root, number);
            if status(plan, &directory).0 == MemberStatus::Complete
                && let Some(peak) = peak(&directory)
            {
                needs.record_peak(point.size, peak);
            }
        }
        needs
    }

    /// A member of this size has ended with this peak.
    pub fn record_peak(&mut self, size: u64, peak: u64) {
        self.ended.push((size, peak));
    }

    /// Sizes and peaks so far of the members that run and have relaxed their start.
    pub fn set_running(&mut self, running: Vec<(u64, u64)>) {
        self.running = running;
    }

    /// Bytes that a member of this size needs; none while no member is known.
    #[must_use]
    pub fn of(&self, size: u64) -> Option<u64> {
        // In proportion to the size where that is larger than a known one; a smaller one may need as much.
        let scaled = |&(known, peak): &(u64, u64)| match size > known && known > 0 {
            true => peak.saturating_mul(size).div_ceil(known),
            false => peak,
        };
        // The nearest in size is the best to go by.
        let nearest = |list: &[(u64, u64)]| -> Option<u64> {
            let distance = list.iter().map(|(known, _)| known.abs_diff(size)).min()?;
            let near = list.iter().filter(|(known, _)| known.abs_diff(size) == distance);
            near.map(scaled).max()
        };
        let guess = || nearest(&self.running).map(|peak| share(peak, PEAK_GROWTH));
        nearest(&self.ended).or_else(guess)
    }
}
