//! What one half of the system sees of the other while it is integrated alone.

/// Columns of values that go along a straight line in time: signals while the chemistry moves
/// alone, species while the shape does.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearInTime {
    start: f64,
    end: f64,
    from: Vec<Vec<f64>>,
    /// None where nothing changes.
    to: Option<Vec<Vec<f64>>>,
}

impl LinearInTime {
    /// Values that do not change.
    #[must_use]
    pub fn still(values: Vec<Vec<f64>>) -> Self {
        Self { start: 0.0, end: 0.0, from: values, to: None }
    }

    /// From values at one time to values at a later one; columns of equal lengths.
    #[must_use]
    pub fn new(from: (f64, Vec<Vec<f64>>), to: (f64, Vec<Vec<f64>>)) -> Self {
        Self { start: from.0, end: to.0, from: from.1, to: Some(to.1) }
    }

    /// Whether nothing changes.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.to.is_none()
    }

    /// The values at `time`, which may lie outside the two times.
    pub fn interpolate(&self, time: f64, out: &mut Vec<Vec<f64>>) {
        out.clone_from(&self.from);
        let Some(to) = &self.to else { return };
        let share = (time - self.start) / (self.end - self.start);
        for (out, to) in out.iter_mut().zip(to) {
            for (out, to) in out.iter_mut().zip(to) {
                *out += share * (to - *out);
            }
        }
    }
}
