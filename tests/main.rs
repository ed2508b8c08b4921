//! Integration tests, one binary.
//!
//! * `accuracy`: studies of what accuracy costs: errors, reports, advice, references.
//! * `answers`: plates, strips, membranes, growth, cantilevers against theory, over meshes.
//! * `chebyshev`: order, stability, error control and failures of the stabilised integrator.
//! * `diffusion`: decay rates, order, conservation, maximum principle; faults of the paper's scheme.
//! * `effects`: every registered effect by the public kit, and effects in runs.
//! * `examples`: the numbered examples, and the crate with an effect of its own.
//! * `fit`: parameters from data, their errors, what data do not determine, refusals.
//! * `formula`: laws written as text, their derivatives and errors, the shipped models as text.
//! * `fuzz`: hostile inputs for all that reads, its limits; formulas against trees.
//! * `gradient`: derivatives of equilibria and steady states by parameters against differences.
//! * `house`: who may know whom.
//! * `mechanics`: energies, gradients and Hessians against differences, invariants, known answers.
//! * `output`: frames, series, ledger, provenance, result directories, progress.
//! * `planar`: scenes in a plane against their twins in space, and what is refused there.
//! * `plugins`: the C boundary with good and faulty plugins; the shipped models.
//! * `run`: coupled runs, `inspect`, and the program from the outside.
//! * `scene`: what is accepted, what is refused and how that is said.
//! * `sheet`: generated meshes, their quality and topology; readers; checks.
//! * `start`: scenes from templates, the schema of scenes, completions, man pages, licences.
//! * `sweep`: keys and values, members, tables, pictures, plots; killed and gone on.
//! * `view`: the viewer of results: its data against the frames, its size, what is refused.

#![allow(missing_docs, clippy::cast_precision_loss)]

mod accuracy;
mod answers;
mod chebyshev;
mod common;
mod coupled;
mod diffusion;
mod effects;
mod examples;
mod fit;
mod formula;
mod fuzz;
mod gradient;
mod house;
mod mechanics;
mod output;
mod planar;
mod plugins;
mod run;
mod scene;
mod sheet;
mod start;
mod sweep;
mod view;
