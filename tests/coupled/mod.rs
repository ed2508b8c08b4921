//! The coupled system: its residual, its Jacobian, and the ways to integrate it.

mod jacobian;
