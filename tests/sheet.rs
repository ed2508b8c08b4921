//! Sheets: generators, checks, readers.

mod generate;
