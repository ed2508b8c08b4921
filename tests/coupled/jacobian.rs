//! Derivatives of the coupled residual against central differences.

mod feedback;
mod law;

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    BondStretching, Cotan, DirichletValues, Effect, EffectContext, EffectSpec, EnergyTerm, Fibre,
    Field, GreenGauss, HingeBending, LawGrowthDirectionSpec, Measure, MeyerBending, ParameterField,
    RestShape, StretchingModulus, StretchingWeight, StvkStretching, TransportTerm,
};
use rumple::geometry::{AreaRule, VertexArea, face_areas};
use rumple::kinetics::formula::SpeciesFormula;
use rumple::kinetics::{Kinetics, Location, Signal};
use rumple::model::{
    AtBoundary, Chemistry, Coupled, Drag, MassWeights, Mechanics, Model, ParameterFields, Signals,
    State, Subsystem, TensionReading,
};
use rumple::sheet::Sheet;

use self::law::Everything;
use crate::common::{Noise, irregular};
use crate::mechanics::{MATERIAL, alone, crumpled, variants};

/// A sheet with that kinetics, the transports, and a pinned corner and boundary direction.
fn model(
    sheet: &Arc<Sheet>,
    location: Location,
    stretching: EnergyTerm,
    transport: Vec<TransportTerm>,
    measure: Measure,
) -> Arc<Model> {
    with_areas(AreaRule::FrozenVoronoi, sheet, location, stretching, transport, measure)
}

/// What these tables of effects bring to the species `a` and `b`.
fn brought(sheet: &Sheet, location: Location, measure: Measure, tables: &[&str]) -> Effect {
    let law = Everything::new(location);
    let kinetics = Some((law.descriptor(), location));
    let context = EffectContext {
        sheet,
        material: Some(&MATERIAL),
        kinetics,
        measure,
        varying: None,
        read: None,
    };
    let mut all = Effect::default();
    for table in tables {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 1.0, vertices = 50 }}\ntime = {{ until = 1.0 }}\n\
             kinetics = {{ rates = {{ a = '0', b = '0' }} }}\n[[effect]]\n{table}\n"
        );
        let scene = rumple::scene::Scene::parse(&text, "scene.toml", &[]).unwrap();
        let effect = scene.effects[0].build(&context).unwrap();
        all.energies.extend(effect.energies);
        all.transports.extend(effect.transports);
        all.held.extend(effect.held);
    }
    all
}

#[test]
fn the_jacobian_is_exact_for_fluxes_advection_cross_diffusion_and_held_values() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    for (location, tables) in [
        (
            Location::Vertex,
            &[
                "kind = 'flux'\nspecies = 'a'\nwhere = 'rim'\nvalue = '1 + x'",
                "kind = 'exchange'\nspecies = 'b'\nwhere = 'all'\nrate = '2 + x'\nreference = 0.3",
                "kind = 'advection'\nspecies = 'a'\nvelocity = ['1 + y', 'x', 0.2]",
                "kind = 'cross-diffusion'\nspecies = 'b'\nby = 'a'\ncoefficient = -0.4",
                "kind = 'flux'\nspecies = 'b'\nwhere = 'all'\nvalue = '(1 + x)/(1 + pos(sigma)/5) + 0.1*H'",
                "kind = 'exchange'\nspecies = 'a'\nwhere = 'rim'\nrate = 'J + t'\nreference = '0.1*normal_z + x'",
                "kind = 'hold'\nspecies = 'b'\nwhere = 'rim'\nvalue = 'x + sin(t)'",
            ][..],
        ),
        (
            Location::Face,
            &[
                "kind = 'flux'\nspecies = 'a'\nwhere = 'all'\nvalue = '1 + x'",
                "kind = 'exchange'\nspecies = 'b'\nwhere = 'rim'\nrate = '2 + x'\nreference = 0.3",
                "kind = 'hold'\nspecies = 'b'\nwhere = { half-space = { normal = [1, 0, 0] } }\nvalue = 'x'",
            ][..],
        ),
    ] {
        for measure in [Measure::Concentration, Measure::Amount] {
            let Effect { transports, held, .. } = brought(&sheet, location, measure, tables);
            let (rule, stretching) = (AreaRule::FrozenVoronoi, bond(StretchingWeight::OptimalArea));
            let model = holding(rule, &sheet, location, stretching, (transports, &held), measure);
            let error = deviation(&model, &state(&sheet, location));
            assert!(error < 1e-6, "{location:?}, {measure:?}: {error:e}");
        }
    }
}

/// The same with another area of a vertex, in the forces and in the signals.
fn with_areas(
    rule: AreaRule,
    sheet: &Arc<Sheet>,
    location: Location,
    stretching: EnergyTerm,
    transport: Vec<TransportTerm>,
    measure: Measure,
) -> Arc<Model> {
    holding(rule, sheet, location, stretching, (transport, &[]), measure)
}

/// The same with values that are held.
fn holding(
    rule: AreaRule,
    sheet: &Arc<Sheet>,
    location: Location,
    stretching: EnergyTerm,
    (transport, held): (Vec<TransportTerm>, &[DirichletValues]),
    measure: Measure,
) -> Arc<Model> {
    let weight = rumple::effects::BendingWeight::Area;
    let bending = MeyerBending::new(sheet, &MATERIAL, weight, rule);
    let mut pins: Vec<[bool; 3]> =
        sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    pins[0] = [true; 3];
    let energies: Vec<EnergyTerm> = vec![stretching, EnergyTerm::new(bending)];
    let mechanics = Mechanics::new(Arc::clone(sheet), energies, pins).unwrap();
    let area = VertexArea::new(sheet, rule);
    let rest_area = face_areas(sheet, sheet.rest());
    let kinetics = Arc::new(Everything::new(location));
    let boundary = match measure {
        Measure::Amount => AtBoundary::OneSided,
        Measure::Concentration => AtBoundary::Zero,
    };
    let signals = Signals::new(
        Signal::ALL.to_vec(),
        location,
        area,
        Some(&(&MATERIAL).into()),
        TensionReading::Paper,
        rest_area,
    )
    .with_boundary(boundary, sheet);
    let chemistry = Chemistry::new(
        sheet,
        kinetics,
        ParameterFields::default(),
        location,
        signals,
        transport,
        measure,
    )
    .with_held_values(held);
    let weights = MassWeights { mechanics: 1.0, chemistry: 1.0 };
    Arc::new(Model::new(mechanics, Some(chemistry), weights, Drag::per_vertex(3.0)))
}

fn state(sheet: &Sheet, location: Location) -> State {
    let points = match location {
        Location::Vertex => sheet.vertex_count(),
        _ => sheet.triangle_count(),
    };
    let mut noise = Noise::new(23);
    let species = (0..2).map(|_| (0..points).map(|_| 0.3 * noise.number()).collect()).collect();
    State { time: 0.4, step: 0, x: crumpled(sheet, 0.15).into(), species, ..State::default() }
}

/// Largest |J d - (F(y + h d) - F(y - h d))/2h| over directions, relative to |J d|.
fn deviation(model: &Arc<Model>, state: &State) -> f64 {
    let [mechanics, chemistry] = deviations(model, state);
    mechanics.max(chemistry)
}

/// The same of either row: they have different units, and neither may hide the other.
fn deviations(model: &Arc<Model>, state: &State) -> [f64; 2] {
    let mut coupled = Coupled::new(model, Subsystem::Whole);
    coupled.start(state);
    let n = coupled.layout().unknowns();
    let y = coupled.pack(state);
    // Twice, the second time with places known.
    coupled.jacobian(state.time, &vec![0.0; n]).unwrap();
    let jacobian = coupled.jacobian(state.time, &y).unwrap().clone();
    let mut worst = [0.0f64; 2];
    for seed in 0..4 {
        let mut noise = Noise::new(200 + seed);
        let d: Vec<f64> = (0..n).map(|_| noise.number()).collect();
        let mut exact = vec![0.0; n];
        jacobian.multiply(&d, &mut exact);
        let h = 1e-6;
        let mut at = |sign: f64| {
            let moved: Vec<f64> = y.iter().zip(&d).map(|(y, d)| y + sign * h * d).collect();
            let mut out = vec![0.0; n];
            coupled.residual(state.time, &moved, &mut out).unwrap();
            out
        };
        let (up, down) = (at(1.0), at(-1.0));
        let split = coupled.layout().mechanical();
        for (worst, range) in worst.iter_mut().zip([0..split, split..n]) {
            let (mut error, mut size) = (0.0, 0.0);
            for i in range {
                error += ((up[i] - down[i]) / (2.0 * h) - exact[i]).powi(2);
                size += exact[i].powi(2);
            }
            *worst = worst.max((error / size).sqrt());
        }
    }
    worst
}

fn bond(weight: StretchingWeight) -> EnergyTerm {
    EnergyTerm::new(BondStretching::new(&MATERIAL, weight))
}

#[test]
fn the_jacobian_is_exact_for_species_on_vertices() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    for measure in [Measure::Concentration, Measure::Amount] {
        for rest in [false, true] {
            let cotan =
                |species, d| TransportTerm::new(Cotan::new(&sheet, species, d, measure, rest));
            let mut transport = vec![cotan(0, 0.7), cotan(1, 2.0)];
            if measure == Measure::Concentration {
                let by_species = |text| SpeciesFormula::new(text, &["a", "b"], false).unwrap();
                transport.push(cotan(0, 1.0).with_coefficient(by_species("1 + a^2 + 0.3*sin(b)")));
                let crossed = Cotan::new(&sheet, 1, 0.5, measure, rest).reading(0);
                let crossed = TransportTerm::new(crossed);
                transport.push(crossed.with_coefficient(by_species("x + a*b")));
            }
            let stretching = bond(StretchingWeight::OptimalArea);
            let model = model(&sheet, Location::Vertex, stretching, transport, measure);
            let error = deviation(&model, &state(&sheet, Location::Vertex));
            assert!(error < 1e-6, "{measure:?}, rest {rest}: {error:e}");
        }
    }
}

#[test]
fn the_jacobian_is_exact_for_species_on_faces() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    // The positions' part of the Green-Gauss scheme is left out, as documented: here it is frozen.
    let green: Vec<TransportTerm> = vec![TransportTerm::new(GreenGauss::new(&sheet, 1, 0.5, true))];
    let stretching = bond(StretchingWeight::Paper);
    let measure = Measure::Concentration;
    let model = model(&sheet, Location::Face, stretching, green, measure);
    let error = deviation(&model, &state(&sheet, Location::Face));
    assert!(error < 1e-6, "{error:e}");
}

/// Of the rates through the signals, that is: the second derivatives of recomputed fractions are left
/// out of the bending energy's, as documented.
#[test]
fn the_jacobian_is_exact_for_every_area_of_a_vertex() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    for location in [Location::Vertex, Location::Face] {
        for rule in [AreaRule::FrozenVoronoi, AreaRule::MixedVoronoi, AreaRule::Barycentric] {
            let stretching = bond(StretchingWeight::OptimalArea);
            let measure = Measure::Concentration;
            let model = with_areas(rule, &sheet, location, stretching, Vec::new(), measure);
            let [forces, rates] = deviations(&model, &state(&sheet, location));
            assert!(rates < 1e-6, "{location:?}, {rule:?}: {rates:e}");
            assert!(forces < 1e-6 || rule == AreaRule::MixedVoronoi, "{rule:?}: {forces:e}");
        }
    }
}

#[test]
fn the_jacobian_is_exact_for_stvk_membranes() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    let stretching = EnergyTerm::new(StvkStretching::new(&MATERIAL, Default::default()));
    let measure = Measure::Concentration;
    let model = model(&sheet, Location::Vertex, stretching, Vec::new(), measure);
    let error = deviation(&model, &state(&sheet, Location::Vertex));
    assert!(error < 1e-6, "{error:e}");
}

/// Forces change with optimal lengths as every energy says, also where lengths make no triangle.
#[test]
fn forces_follow_optimal_lengths() {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    let x = crumpled(&sheet, 0.08);
    let edges = sheet.edges().len();
    for (name, energy) in variants(&sheet) {
        let mut potential = alone(&sheet, energy);
        for wild in [0.05, 0.6] {
            let factor: Vec<f64> =
                (0..edges).map(|e| 1.0 + wild * (7.0 * e as f64).sin()).collect();
            potential.set_length_factor(&factor);
            let impossible = potential.metric().impossible_triangles();
            assert_eq!(impossible > 0, wild > 0.1, "{name}: {impossible}");
            let reference = potential.metric().reference_length().to_vec();
            let mut noise = Noise::new(77);
            let d: Vec<f64> = (0..edges).map(|_| noise.number()).collect();
            let mut exact = vec![Vec3::zeros(); x.len()];
            potential.mixed_derivatives(&x, ParameterField::OptimalLength, &mut |i, e, by| {
                exact[i] += d[e] * reference[e] * by
            });
            let h = 1e-7;
            let mut at = |sign: f64| {
                let moved: Vec<f64> =
                    factor.iter().zip(&d).map(|(f, d)| f + sign * h * d).collect();
                potential.set_length_factor(&moved);
                let mut gradient = vec![Vec3::zeros(); x.len()];
                potential.energy_gradient(&x, &mut gradient);
                gradient
            };
            let (up, down) = (at(1.0), at(-1.0));
            let (mut error, mut size) = (0.0, 0.0);
            for i in 0..x.len() {
                error += ((up[i] - down[i]) / (2.0 * h) - exact[i]).norm_squared();
                size += up[i].norm_squared().max(exact[i].norm_squared());
            }
            let error = (error / size).sqrt();
            assert!(error < 1e-5, "{name}, {wild}: {error:e}");
            if name.contains("stretching") || name.contains("hinge") {
                assert!(exact.iter().any(|v| v.norm() > 0.0), "{name}");
            }
        }
    }
}
