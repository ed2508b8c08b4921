//! Sub-steps that are rejected however short they are: the branch ends there.
//!
//! The distance between a sub-step and its prediction falls with its length along a branch, at a fold at the end of one
//! with the square root. Where it does not, the shape jumps, and shorter sub-steps would only look for the instant.

use super::{SAFETY, STEP_REDUCTION, factor};

/// A sub-step jumps if it has at most this share of the length of one that was rejected before it, or this where it has no
/// result, which may be the solver's fault,
const STALLED_LENGTH: (f64, f64) = (0.25, 0.02);
/// and at least so large a share of its error.
const STALLED_ERROR: f64 = 0.75;

/// The first of the rejected sub-steps whose error does not fall.
#[derive(Default, Clone, Copy)]
pub(super) struct Stall(Option<Rejected>);

#[derive(Clone, Copy)]
struct Rejected {
    until: f64,
    length: f64,
    error: f64,
}

impl Stall {
    /// Takes up the rejection of a sub-step for its `error`, infinite where it has no result. Whether it jumps.
    pub(super) fn reject(&mut self, (t, until): (f64, f64), error: f64) -> bool {
        let length = until - t;
        let shorter = if error.is_finite() { STALLED_LENGTH.0 } else { STALLED_LENGTH.1 };
        match self.0 {
            Some(first) if error >= STALLED_ERROR * first.error => length <= shorter * first.length,
            _ => {
                self.0 = Some(Rejected { until, length, error });
                false
            }
        }
    }

    /// Share of its `length` at which a rejected sub-step is repeated.
    pub(super) fn shrink(&self, length: f64, error: f64) -> f64 {
        let again = self.0.is_some_and(|first| length < first.length);
        if again { STEP_REDUCTION } else { factor(error, SAFETY) }
    }

    /// A sub-step to `until` is accepted.
    pub(super) fn pass(&mut self, until: f64) {
        self.0 = self.0.filter(|first| until < first.until);
    }
}

#[cfg(test)]
mod tests {
    use super::Stall;

    /// Repeats sub-steps from 0 whose error is a function of their length: how many are rejected, and whether the last of
    /// these jumps.
    fn repeated(error: impl Fn(f64) -> f64) -> (usize, bool) {
        let (mut stall, mut length) = (Stall::default(), 1.0);
        for tries in 0..100 {
            let error = error(length);
            if error <= 1.0 {
                return (tries, false);
            }
            if stall.reject((0.0, length), error) {
                return (tries + 1, true);
            }
            length *= stall.shrink(length, error);
        }
        panic!("neither a branch nor a jump");
    }

    #[test]
    fn errors_that_fall_with_the_length_are_no_jump() {
        assert!(!repeated(|length| 50.0 * length * length).1);
        assert!(!repeated(|length| 50.0 * length).1);
    }

    #[test]
    fn a_fold_is_no_jump() {
        assert!(!repeated(|length| 5.0 * length.sqrt()).1);
    }

    #[test]
    fn errors_that_stay_are_a_jump() {
        let (tries, jumps) = repeated(|length| 1.7 + 0.1 * length);
        assert!(jumps && tries <= 4, "{tries}");
        let (tries, jumps) = repeated(|_| f64::INFINITY);
        assert!(jumps && tries <= 4, "{tries}");
    }

    /// What lies beyond an accepted sub-step is not compared with what was rejected before it.
    #[test]
    fn an_accepted_sub_step_ends_the_comparison() {
        let mut stall = Stall::default();
        assert!(!stall.reject((0.0, 1.0), 2.0));
        stall.pass(0.5);
        assert!(stall.0.is_some());
        stall.pass(1.5);
        assert!(stall.0.is_none());
        assert!(!stall.reject((1.5, 1.6), 2.0));
    }
}
