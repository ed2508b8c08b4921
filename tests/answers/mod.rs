//! Problems of plate, membrane and shell theory with known answers, on meshes small enough for
//! seconds; `docs/book/verification/` has the tables of larger ones.

#[path = "../../examples/known_answers/mod.rs"]
mod known_answers;

mod active;
mod branches;
mod cantilevers;
mod caps;
mod chemistry;
mod contact;
mod growth;
mod membranes;
mod periodic;
mod periodic_boundary;
mod plates;
mod remodelling;
mod shells;
mod steady;
mod strips;

use known_answers::{Outcome, Sample};

/// The answers of several meshes, coarse to fine.
fn over(sizes: &[usize], solve: impl Fn(usize) -> Outcome<Sample>) -> Vec<Sample> {
    sizes.iter().map(|&n| solve(n).unwrap_or_else(|e| panic!("{n}: {e}"))).collect()
}

/// The finest answer is within `tolerance`, and from the coarsest to it the error falls at least
/// with the power `order` of the edge length.
fn converges(what: &str, samples: &[Sample], tolerance: f64, order: f64) {
    let finest = samples.last().unwrap();
    assert!(finest.vertices > samples[0].vertices);
    assert!(finest.error().abs() < tolerance, "{what}: {:?}", errors(samples));
    let observed = finest.order(&samples[0]);
    assert!(observed > order, "{what}: order {observed:.2}: {:?}", errors(samples));
}

fn errors(samples: &[Sample]) -> Vec<f64> {
    samples.iter().map(Sample::error).collect()
}
