//! Derivatives of what laws give back to the shape, and of energies that read species.

use std::sync::Arc;

use rumple::num::checked::Finite;

use super::law::Everything;
use super::*;

/// The same, its length factor along a fibre.
fn with_fibres(sheet: &Arc<Sheet>, across: Option<f64>) -> Arc<Model> {
    let kinetics = match across {
        Some(_) => Everything::new(Location::Vertex),
        None => Everything::with_feedback(Location::Vertex),
    };
    let context = EffectContext {
        sheet,
        material: Some(&MATERIAL),
        varying: None,
        kinetics: Some((kinetics.descriptor(), Location::Vertex)),
        measure: Measure::Amount,
        read: None,
    };
    let fibre = Fibre::Components(["0.8", "0.5", "0.1"].map(|text| Field::Formula(text.into())));
    let direction = LawGrowthDirectionSpec { fibre, across: across.and_then(Finite::new) }
        .build(&context)
        .unwrap()
        .direction;
    let stvk = EnergyTerm::new(StvkStretching::new(&MATERIAL, StretchingModulus::Paper));
    let signals = Signals::new(
        Signal::ALL.to_vec(),
        Location::Vertex,
        VertexArea::new(sheet, AreaRule::FrozenVoronoi),
        Some(&(&MATERIAL).into()),
        TensionReading::Paper,
        vec![1.0; sheet.triangle_count()],
    );
    let chemistry = Chemistry::new(
        sheet,
        Arc::new(kinetics),
        ParameterFields::default(),
        Location::Vertex,
        signals,
        Vec::new(),
        Measure::Amount,
    );
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mechanics = Mechanics::new(Arc::clone(sheet), vec![stvk], pins).unwrap();
    let weights = MassWeights { mechanics: 1.0, chemistry: 1.0 };
    let chemistry = chemistry.with_direction(direction);
    Arc::new(Model::new(mechanics, Some(chemistry), weights, Drag::per_vertex(3.0)))
}

#[test]
fn the_length_factor_of_a_law_has_its_derivatives_along_fibres_too() {
    let sheet = Arc::new(irregular(5, 4, 0.15));
    // The last by a factor of its own across them.
    for across in [Some(0.0), Some(-1.0), Some(0.5), Some(1.0), None] {
        let found = deviation(&with_fibres(&sheet, across), &state(&sheet, Location::Vertex));
        assert!(found < 1e-7, "{across:?}: {found}");
    }
}

/// A law that gives spontaneous curvature to one of the models of bending.
fn bent(sheet: &Arc<Sheet>, location: Location, bending: EnergyTerm) -> Arc<Model> {
    reading(sheet, location, vec![bending])
}

/// A law with all feedback, and energies that feel it beside stretching.
fn reading(sheet: &Arc<Sheet>, location: Location, energies: Vec<EnergyTerm>) -> Arc<Model> {
    let stretching = bond(StretchingWeight::OptimalArea);
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let energies = std::iter::once(stretching).chain(energies).collect();
    let mechanics = Mechanics::new(Arc::clone(sheet), energies, pins).unwrap();
    let signals = Signals::new(
        Signal::ALL.to_vec(),
        location,
        VertexArea::new(sheet, AreaRule::FrozenVoronoi),
        Some(&(&MATERIAL).into()),
        TensionReading::Paper,
        vec![1.0; sheet.triangle_count()],
    );
    let chemistry = Chemistry::new(
        sheet,
        Arc::new(Everything::with_feedback(location)),
        ParameterFields::default(),
        location,
        signals,
        Vec::new(),
        Measure::Concentration,
    );
    let weights = MassWeights { mechanics: 1.0, chemistry: 1.0 };
    Arc::new(Model::new(mechanics, Some(chemistry), weights, Drag::per_vertex(3.0)))
}

#[test]
fn the_jacobian_is_exact_for_spontaneous_curvatures_of_a_law() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    let shapes = [RestShape::default(), RestShape::from_positions(&crumpled(&sheet, 0.1))]
        .map(RestShape::with_law_curvature);
    for location in [Location::Vertex, Location::Face] {
        for (k, rest) in shapes.iter().enumerate() {
            let rule = AreaRule::FrozenVoronoi;
            let meyer = EnergyTerm::new(MeyerBending::with_rest(&sheet, &MATERIAL, rule, rest));
            let hinge = EnergyTerm::new(HingeBending::with_rest(&sheet, &MATERIAL, rest));
            for (name, bending) in [("meyer", meyer), ("hinge", hinge)] {
                let model = bent(&sheet, location, bending);
                let [forces, rates] = deviations(&model, &state(&sheet, location));
                assert!(rates < 1e-6, "{name}, {location:?}, {k}: {rates:e}");
                assert!(forces < 1e-6, "{name}, {location:?}, {k}: {forces:e}");
            }
        }
    }
}

#[test]
fn the_jacobian_is_exact_for_energies_that_read_species() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    let tables = [
        "kind = 'active-tension'\nvalue = '0.3 + a*b + 0.1*x'\nramp = { formula = '1 + t' }",
        "kind = 'active-tension'\nvalue = 'sin(b)'\nfibre = [1, 'y', 0.2]",
    ];
    for location in [Location::Vertex, Location::Face] {
        for (k, read) in [&tables[..1], &tables[1..], &tables[..]].into_iter().enumerate() {
            let Effect { energies, .. } = brought(&sheet, location, Measure::Concentration, read);
            let model = reading(&sheet, location, energies);
            let [forces, rates] = deviations(&model, &state(&sheet, location));
            assert!(forces < 1e-6, "{location:?}, {k}: {forces:e}");
            assert!(rates < 1e-6, "{location:?}, {k}: {rates:e}");
        }
    }
}
