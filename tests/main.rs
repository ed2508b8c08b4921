//! Integration tests.

mod output;
