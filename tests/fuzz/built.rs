//! Scenes built from random choices, right but for a key or two.

use proptest::prelude::*;

use super::readers::built;

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// The reader says what else must hold: errors that name a key, states that are finite.
    #[test]
    fn scenes_that_are_built_run_or_are_refused_by_name(
        choices in prop::collection::vec(any::<u8>(), 0..150)
    ) {
        (built::BUILT.read)(&choices);
    }
}

#[test]
fn most_scenes_that_are_built_with_nothing_wrong_run() {
    let right = (built::BUILT.seeds)().into_iter().map(|mut choices| {
        // No key is spoilt.
        choices[0] = 0;
        choices
    });
    let (ran, refused): (Vec<_>, Vec<_>) = right.partition(|choices| (built::BUILT.read)(choices));
    let first = refused.first().map(|choices| built::text(choices));
    assert!(ran.len() > refused.len(), "{} of 64; not {}", ran.len(), first.unwrap_or_default());
}
