//! Inputs are read in a process of their own (`trial`), which another one watches (`watch`).

pub mod trial;
pub mod watch;
