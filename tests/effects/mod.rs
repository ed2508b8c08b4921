//! Effects by the public kit: every registered one has samples here, or a test fails.

mod contract;
mod counted;
mod registered;
mod running;
