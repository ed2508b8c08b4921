//! Timescale policies: which of the two time derivatives is kept.
