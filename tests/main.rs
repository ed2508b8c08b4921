//! Integration tests.

mod plugins;
