//! Growth by a formula.

use std::borrow::Cow;

use rumple::effects::{EffectContext, EffectSpec, Growth, LengthFactor, Measure, Region};
use rumple::model::{Drag, Mechanics, Model, Storage};
use rumple::sheet::Sheet;

use crate::common::lattice;

fn factor(sheet: &Sheet, formula: &str) -> LengthFactor {
    let spec = Growth { factor: formula.into(), region: Region::All };
    let context = EffectContext {
        sheet,
        material: None,
        varying: None,
        kinetics: None,
        measure: Measure::Concentration,
        read: None,
    };
    spec.build(&context).unwrap().growth.remove(0)
}

/// What does not change with time is not evaluated again, whoever asks; its product with what does is
/// that of the formulas.
#[test]
fn a_formula_without_the_time_is_evaluated_once() {
    let sheet = std::sync::Arc::new(lattice(4, 3));
    let middle = |e: usize| {
        let [a, b] = sheet.edges()[e].vertices.map(|v| sheet.rest()[v as usize].x);
        0.5 * (a + b)
    };
    let (fixed, ramped) = (factor(&sheet, "1 + 0.1*x"), factor(&sheet, "1 + 0.2*t*step(x + 1)"));
    assert!(matches!(ramped.at(&sheet, 2.0), Cow::Owned(_)));
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mechanics = Mechanics::new(sheet.clone(), Vec::new(), pins).unwrap();
    let storage = Storage { mechanics: 0.0, chemistry: 1.0 };
    let model = |growth| {
        Model::new(mechanics.clone(), None, storage, Drag::per_vertex(1.0)).growing(growth)
    };
    let alone = model(vec![fixed.clone()]);
    let first = alone.growth(0.0).unwrap().unwrap();
    assert!(matches!(first, Cow::Borrowed(_)));
    assert_eq!(first.as_ptr(), alone.growth(2.0).unwrap().unwrap().as_ptr());
    let both = model(vec![fixed, ramped]);
    for (e, product) in both.growth(2.0).unwrap().unwrap().iter().enumerate() {
        assert!((first[e] - 1.0 - 0.1 * middle(e)).abs() < 1e-14);
        assert!((product - 1.4 * first[e]).abs() < 1e-14, "{product}");
    }
    assert_eq!(both.growth(0.0).unwrap().unwrap(), first);
}
