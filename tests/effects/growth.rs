//! Growth by a formula.

use std::borrow::Cow;

use rumple::Vec3;
use rumple::effects::{
    ActiveTension, BondStretching, EffectContext, EffectError, EffectSpec, EnergyTerm, Fibre,
    Field, Growth, LengthFactor, Measure, Region, StretchingModulus, StretchingWeight,
    StvkStretching,
};
use rumple::model::{Drag, MassWeights, Mechanics, Model, Potential};
use rumple::sheet::{Array, Sheet, Surface};

use crate::common::{irregular, lattice};
use crate::mechanics::MATERIAL;

fn built(sheet: &Sheet, spec: &Growth) -> Result<LengthFactor, EffectError> {
    let context = EffectContext {
        sheet,
        material: None,
        varying: None,
        kinetics: None,
        measure: Measure::Concentration,
        read: None,
    };
    Ok(spec.build(&context)?.growth.remove(0))
}

fn factor(sheet: &Sheet, formula: &str) -> LengthFactor {
    built(sheet, &Growth::isotropic(formula, Region::All)).unwrap()
}

fn fibre(components: [&str; 3]) -> Fibre {
    Fibre::Components(components.map(|text| Field::Formula(text.into())))
}

fn directed(along: Option<&str>, across: Option<&str>, components: [&str; 3]) -> Growth {
    Growth {
        along: along.map(|text| Field::Formula(text.into())),
        across: across.map(|text| Field::Formula(text.into())),
        shear: None,
        fibre: Some(fibre(components)),
        factor: None,
        region: Region::All,
    }
}

/// What does not change with time is not evaluated again by any caller; its product with what does is
/// that of the formulas.
#[test]
fn a_formula_without_the_time_is_evaluated_once() {
    let sheet = std::sync::Arc::new(lattice(4, 3));
    let middle = |e: usize| {
        let [a, b] = sheet.edges()[e].vertices.map(|v| sheet.rest()[v as usize].x);
        0.5 * (a + b)
    };
    let (fixed, ramped) = (factor(&sheet, "1 + 0.1*x"), factor(&sheet, "1 + 0.2*t*step(x + 1)"));
    assert!(matches!(ramped.at_edges(&sheet, 2.0), Cow::Owned(_)));
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mechanics = Mechanics::new(sheet.clone(), Vec::new(), pins).unwrap();
    let weights = MassWeights { mechanics: 0.0, chemistry: 1.0 };
    let model = |growth| {
        Model::new(mechanics.clone(), None, weights, Drag::per_vertex(1.0)).with_growth(growth)
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

/// Arrays and regions give what the formulas of the same values give; of an array, the sign of a direction has no meaning.
#[test]
fn growth_and_fibres_may_be_arrays() {
    let sheet = irregular(6, 5, 0.15);
    let rest = sheet.rest();
    let array = |name: &str, components: usize, values: Vec<f64>| Array {
        name: name.into(),
        components,
        values,
    };
    let sign = |v: usize| if v.is_multiple_of(3) { -2.0 } else { 1.0 };
    let vectors: Vec<f64> = (0..rest.len())
        .flat_map(|v| [0.8, 0.6, 0.3].map(|component| sign(v) * component))
        .collect();
    let surface = || Surface {
        points: rest.to_vec(),
        triangles: sheet.triangles().to_vec(),
        point_arrays: vec![
            array("g", 1, rest.iter().map(|x| 1.0 + 0.1 * x.x).collect()),
            array("a", 3, vectors.clone()),
        ],
        cell_arrays: vec![array(
            "c",
            3,
            (0..sheet.triangle_count()).flat_map(|_| [0.8, 0.6, 0.3]).collect(),
        )],
        ..Surface::default()
    };
    let read = |_: &std::path::Path| Ok(surface());
    let built = |growth: &Growth| {
        let context = EffectContext {
            sheet: &sheet,
            material: None,
            varying: None,
            kinetics: None,
            measure: Measure::Concentration,
            read: Some(&read),
        };
        growth
            .build(&context)
            .map(|mut effect| effect.growth.remove(0).at_edges(&sheet, 0.0).into_owned())
    };
    let of = |name: &str| Field::Array { file: "mesh.vtu".into(), array: name.into() };
    let along = |name: &str| Growth {
        along: Some(of("g")),
        fibre: Some(Fibre::Array { file: "mesh.vtu".into(), array: name.into() }),
        ..directed(None, None, ["0", "0", "0"])
    };
    let expected = built(&directed(Some("1 + 0.1*x"), None, ["0.8", "0.6", "0.3"])).unwrap();
    for name in ["a", "c"] {
        for (a, b) in built(&along(name)).unwrap().iter().zip(&expected) {
            assert!((a - b).abs() < 1e-14, "{name}: {a} {b}");
        }
    }
    let isotropic = Growth { factor: Some(of("g")), ..Growth::isotropic("1", Region::All) };
    let expected = built(&Growth::isotropic("1 + 0.1*x", Region::All)).unwrap();
    assert_eq!(built(&isotropic).unwrap(), expected);
    let error = built(&along("b")).unwrap_err();
    assert_eq!((error.key, error.help.as_deref()), ("fibre", Some("its arrays: g, a, c")));
    let error = built(&along("g")).unwrap_err();
    assert!(error.message.ends_with("array `g` has 1 component, and a fibre needs 3"), "{error}");
}

/// What grows by 1.3 along a fibre and by 0.8 across it is free of stress where it is stretched like that.
#[test]
fn growth_along_a_fibre_has_the_lengths_of_its_metric() {
    let sheet = std::sync::Arc::new(irregular(6, 5, 0.15));
    let (sin, cos) = 0.4f64.sin_cos();
    let growth =
        built(&sheet, &directed(Some("1.3"), Some("0.8"), ["cos(0.4)", "sin(0.4)", "0.7"]));
    let factor = growth.unwrap().at_edges(&sheet, 0.0).into_owned();
    let stretched = |x: &Vec3| {
        let (a, b) = (cos * x.x + sin * x.y, cos * x.y - sin * x.x);
        Vec3::new(1.3 * cos * a - 0.8 * sin * b, 1.3 * sin * a + 0.8 * cos * b, 0.0)
    };
    let x: Vec<Vec3> = sheet.rest().iter().map(stretched).collect();
    without_stress(&sheet, &factor, &x);
}

/// The metric FᵀF of any deformation F, by its three numbers: free of stress in the shape that F gives.
#[test]
fn growth_with_shear_has_the_lengths_of_its_metric() {
    let sheet = std::sync::Arc::new(irregular(6, 5, 0.15));
    let f = |x: &Vec3| Vec3::new(1.2 * x.x + 0.25 * x.y, -0.1 * x.x + 0.9 * x.y, 0.0);
    let (sin, cos) = 0.4f64.sin_cos();
    let (a, b) = (f(&Vec3::new(cos, sin, 0.0)), f(&Vec3::new(-sin, cos, 0.0)));
    let number = |value: f64| Field::Formula(format!("{value:?}"));
    let growth = Growth {
        along: Some(number(a.norm())),
        across: Some(number(b.norm())),
        shear: Some(number(a.dot(&b))),
        // Neither the sign nor the length of the fibre has a meaning.
        ..directed(None, None, ["-2*cos(0.4)", "-2*sin(0.4)", "0"])
    };
    assert!(a.dot(&b).abs() > 0.05);
    let factor = built(&sheet, &growth).unwrap().at_edges(&sheet, 0.0).into_owned();
    let x: Vec<Vec3> = sheet.rest().iter().map(f).collect();
    without_stress(&sheet, &factor, &x);
    let error = built(&sheet, &Growth { shear: Some(number(1.2)), ..growth }).unwrap_err();
    assert_eq!(error.key, "shear");
    assert!(error.message.contains("the shear is 1.2 between vertices"), "{error}");
}

#[test]
fn a_metric_without_lengths_gives_no_positive_factor() {
    let sheet = irregular(6, 5, 0.2);
    let at = |along: &str, across: &str, shear: &str, time: f64| {
        let spec = Growth {
            shear: Some(Field::Formula(shear.into())),
            ..directed(Some(along), Some(across), ["1", "0", "0"])
        };
        built(&sheet, &spec).unwrap().at_edges(&sheet, time).into_owned()
    };
    assert!(at("1 - 2*t", "1", "0", 1.0).iter().all(|f| *f == -1.0));
    assert!(at("1", "2 - 2*t", "0", 1.0).iter().all(|f| *f == 0.0));
    // Eigenvalues 1 ± 1.5; just inside all lengths are positive.
    assert!(at("1", "1", "1.5*t", 1.0).iter().all(|f| *f == -(0.5f64.sqrt())));
    assert!(at("1", "1", "0.999*t", 1.0).iter().all(|f| *f > 0.0));
}

/// That neither triangles nor bonds have an energy or a force at `x` under these length factors.
fn without_stress(sheet: &std::sync::Arc<Sheet>, factor: &[f64], x: &[Vec3]) {
    let stretching = [
        EnergyTerm::new(StvkStretching::new(&MATERIAL, StretchingModulus::Paper)),
        EnergyTerm::new(BondStretching::new(&MATERIAL, StretchingWeight::OptimalArea)),
    ];
    for term in stretching {
        let name = term.name().to_owned();
        let pins = vec![[false; 3]; sheet.vertex_count()];
        let mechanics = Mechanics::new(sheet.clone(), vec![term], pins).unwrap();
        let mut potential = Potential::new(&mechanics);
        potential.set_length_factor(factor);
        let mut gradient = vec![Vec3::zeros(); x.len()];
        let energy = potential.energy_gradient(x, &mut gradient);
        let largest = gradient.iter().map(|g| g.norm()).fold(0.0, f64::max);
        let scale = potential.force_scale();
        assert!(energy < 1e-20 * scale && largest < 1e-11 * scale, "{name} {energy} {largest}");
    }
}

#[test]
fn growth_that_is_not_whole_is_refused_at_its_key() {
    let sheet = lattice(4, 3);
    let refused = |spec: &Growth| built(&sheet, spec).unwrap_err();
    let along = |fibre| directed(Some("1.1"), None, fibre);
    for (spec, key, message) in [
        (Growth { fibre: None, ..along(["1", "0", "0"]) }, "along", "needs the fibre"),
        (directed(None, None, ["1", "0", "0"]), "fibre", "along or across"),
        (
            Growth { factor: Some(Field::Formula("2".into())), ..along(["1", "0", "0"]) },
            "factor",
            "every direction",
        ),
        (Growth { fibre: None, along: None, ..along(["1", "0", "0"]) }, "factor", "needs a length"),
        (along(["0", "0", "1"]), "fibre", "no direction in the sheet near"),
        (along(["1", "0*r", "0"]), "fibre", "`r`"),
        (directed(Some("1"), Some("x - 100"), ["1", "0", "0"]), "across", "at time 0"),
    ] {
        let error = refused(&spec);
        assert_eq!(error.key, key, "{error}");
        assert!(error.message.contains(message), "{error}");
    }
}

/// A number stays one: branches are followed along numbers alone.
#[test]
fn a_length_factor_is_a_field() {
    let read = |text: &str| toml::from_str::<Growth>(text);
    let number = |text: &str| read(text).unwrap().factor.and_then(|factor| factor.number());
    assert_eq!(number("factor = 1.25"), Some(1.25));
    assert_eq!(number("factor = 2"), Some(2.0));
    let formula = read("factor = \"1 + t\"").unwrap().factor;
    assert_eq!(formula, Some(Field::Formula("1 + t".into())));
    let directed = read("fibre = [1, 0, 0]\nalong = 1.1").unwrap();
    assert_eq!((directed.along.and_then(|f| f.number()), directed.across), (Some(1.1), None));
    for wrong in ["factor = nan", "factor = true", "factor = [1.0]"] {
        let error = read(wrong).unwrap_err().to_string();
        assert!(error.contains("number"), "{wrong}: {error}");
    }
}

/// The growth of a user-defined effect is evaluated at every time, and refused where it does not fit.
#[test]
fn growth_can_be_a_function() {
    let sheet = std::sync::Arc::new(lattice(4, 3));
    let model = |growth: LengthFactor| {
        let pins = vec![[false; 3]; sheet.vertex_count()];
        let mechanics = Mechanics::new(sheet.clone(), Vec::new(), pins).unwrap();
        let weights = MassWeights { mechanics: 0.0, chemistry: 1.0 };
        Model::new(mechanics, None, weights, Drag::per_vertex(1.0)).with_growth(vec![growth])
    };
    let linear = LengthFactor::function(|sheet, t| vec![1.0 + t; sheet.edges().len()]);
    assert_eq!(model(linear).growth(0.5).unwrap().unwrap()[3], 1.5);
    for wrong in [
        LengthFactor::function(|_, _| vec![1.0]),
        LengthFactor::constant(vec![1.0; 3]),
        LengthFactor::function(|sheet, t| vec![1.0 - t; sheet.edges().len()]),
    ] {
        assert!(model(wrong).growth(1.0).is_err());
    }
}

/// A free sheet contracts until its elastic stress balances the tension: along a fibre `λ Y₂ (λ² - 1)/2 = -τ` with
/// the lateral strain of ν, in all directions `(λ² - 1)/2 = -γ (1-ν)/Y₂`.
#[test]
fn active_tension_is_balanced_by_the_stress_of_theory() {
    let sheet = std::sync::Arc::new(irregular(6, 5, 0.15));
    let (stiff, nu) = (MATERIAL.stretching_modulus(), MATERIAL.poisson);
    let context = EffectContext {
        sheet: &sheet,
        material: None,
        varying: None,
        kinetics: None,
        measure: Measure::Concentration,
        read: None,
    };
    // λ = 0.9 along x.
    let along = 0.9f64;
    let strain = 0.5 * (along * along - 1.0);
    let lateral = (1.0 - 2.0 * nu * strain).sqrt();
    let tau = -along * stiff * strain;
    let uniform = 0.95f64;
    let gamma = -0.5 * (uniform * uniform - 1.0) * stiff / (1.0 - nu);
    for (value, fibre, stretch) in
        [(tau, Some(fibre(["1", "0", "0"])), [along, lateral]), (gamma, None, [uniform, uniform])]
    {
        let value = Field::Formula(format!("{value:.17e}"));
        let tension = ActiveTension { value, fibre, ramp: None }.build(&context).unwrap();
        let mut terms = tension.energies;
        terms.push(EnergyTerm::new(StvkStretching::new(&MATERIAL, StretchingModulus::Paper)));
        let pins = vec![[false; 3]; sheet.vertex_count()];
        let mechanics = Mechanics::new(sheet.clone(), terms, pins).unwrap();
        let mut potential = Potential::new(&mechanics);
        let scaled = |x: &Vec3| Vec3::new(stretch[0] * x.x, stretch[1] * x.y, 0.0);
        let x: Vec<Vec3> = sheet.rest().iter().map(scaled).collect();
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(&x, &mut gradient);
        let largest = gradient.iter().map(|g| g.norm()).fold(0.0, f64::max);
        assert!(largest < 1e-12 * potential.force_scale(), "{stretch:?} {largest}");
    }
}
