//! Plugins through the real boundary: the shipped models, one in C, and broken ones.

pub mod build;
mod faults;
mod models;
mod parameters;
mod search;
