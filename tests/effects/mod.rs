//! Effects by the public kit: every registered one has samples here, or a test fails.

mod constraint;
mod contact;
mod contact_pressure;
mod contract;
mod counted;
mod faults;
mod growth;
mod hard_contact;
mod held;
mod internal;
mod mesh_obstacle;
mod planted;
mod prescribed;
mod pressed;
mod problem;
mod proximity;
mod reading;
mod registered;
mod running;
mod separated;
mod signals;
mod timed;
mod touching;
mod unlisted;
