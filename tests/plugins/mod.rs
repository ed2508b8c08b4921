//! Plugins through the real boundary: the shipped models, one in C, and broken ones.

pub mod build;
mod correct;
#[cfg(target_os = "linux")]
mod embedding;
mod faults;
mod feedback;
mod fields;
mod joint;
mod made;
mod models;
mod parameters;
mod planted;
mod readme;
mod reported;
mod search;
