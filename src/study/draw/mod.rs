//! Tables and plots of studies.

pub mod plot;
pub mod table;
