//! The first minutes: scenes from templates, the schema for editors, completions, man pages; licences of all that is linked.

mod licences;
mod new;
mod schema;
mod shell;
mod user;
