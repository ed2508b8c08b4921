//! Many runs, and what they say together.

pub mod compare;
