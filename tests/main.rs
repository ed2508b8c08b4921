//! Integration tests.

mod sheet;
