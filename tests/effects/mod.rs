//! Effects by the public kit: every registered one has samples here, or a test fails.

mod registered;
mod running;
