//! tension-feedback
