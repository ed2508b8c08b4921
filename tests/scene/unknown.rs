//! Keys, names and kinds that are not known.

use super::errors::all_wrong;
use super::{SCENE, position, refused};

/// `"vtu"` is what resolved scenes of earlier versions say.
#[test]
fn the_format_of_frames_is_gone() {
    let with =
        |name: &str| SCENE.replacen("[output]", &format!("[output]\nformat = \"{name}\""), 1);
    assert!(rumple::scene::Scene::parse(&with("vtu"), "s.toml", &[]).is_ok());
    for name in ["vtk", "vtkhdf", "png"] {
        let error = refused(&with(name), &[]);
        assert!(error.to_string().contains("frames are `.vtu`"), "{error}");
    }
}

#[test]
fn unknown_keys_show_the_allowed_ones_and_the_nearest() {
    all_wrong(
        r#"
young = 1e6 | yung = 1e6 | yung
    unknown key yung in [material]
    did you mean young? allowed: young, poisson, thickness, drag
weight = "paper" | wight = "paper" | wight
    unknown key wight in effect[0]
    did you mean weight? allowed: kind, stiffness, weight, share, anchors
vertices = 20000 | vertices = 20000\nheight = 3 | height
    unknown key height in [sheet]
    allowed: shape, file, planar, imperfection, bump, radius, vertices, seed
amplitude = 0.5 | height = 0.5 | height
    unknown key height in [kinetics.initial.c.gaussian]
    allowed: centre, width, amplitude, background
rtol = 1e-3 | rtl = 1e-3 | rtl
    unknown key rtl in [time.integrator]
    did you mean rtol? allowed: kind, method, rtol, atol, step, linear
kind = "test-weightless" | kind = "test-weightless"\nstrength = 1 | strength
    unknown key strength in effect[1]
    allowed: kind
[output] | [outputs] | outputs
    unknown key outputs
    did you mean output? allowed: sheet, material, effect, kinetics, time, equilibrium, stability, invariants, output, checkpoint
shape = "disc" | shap = "disc" | shap
    unknown key shap in [sheet]
    did you mean shape? allowed: shape, file, planar, imperfection, bump, vertices, seed, radius, width, height, inner, outer, irregular, caps, major, minor, semi_axes, amplitude, wavelength, z, points, holes, outline, periodic
shape = "disc" | file = "disc.obj" | radius
    unknown key radius in [sheet]
    allowed: file, planar, imperfection, bump
"#,
    );
}

#[test]
fn a_key_of_another_kind_says_whose_it_is() {
    all_wrong(
        r#"
method = "descent" | method = "newton"\npreconditioner = "blocks" | preconditioner
    unknown key preconditioner in [equilibrium]
    preconditioner belongs to method = "lbfgs"; allowed: method, tolerance, max_iterations, path_error, area_share, linear_solver
rtol = 1e-3 | shape = "euler" | shape = "euler"
    unknown key shape in [time.integrator]
    shape belongs to kind = "staggered"; allowed: kind, method, rtol, atol, step, linear
"#,
    );
}

#[test]
fn unknown_names_show_the_allowed_ones_and_the_nearest() {
    all_wrong(
        r#"
"disc" | "disk" | "disk"
    sheet: unknown shape "disk"
    did you mean disc? allowed: disc, rectangle, lattice, annulus, polygon, sphere, cylinder, cap, torus, ellipsoid, wavy-strip, graph, point
"none" | "zlip" | "zlip"
    output.compression: unknown name "zlip"
    did you mean zlib? allowed: zlib, none
"paper" | "papr" | "papr"
    effect[0].weight: unknown name "papr"
    did you mean paper? allowed: optimal-area, paper
gaussian | gausian | gausian
    kinetics.initial.c: unknown name "gausian"
    did you mean gaussian? allowed: file, regions, gaussian, rectangle, stripe, spots, random, formula
"#,
    );
}

#[test]
fn removed_names_say_what_to_write_instead() {
    let staggered = "{ kind = \"staggered\", chemistry = \"exponential\" }";
    for (from, to, instead) in [
        ("\"descent\"", "\"fire\"", "fire is removed: write \"lbfgs\""),
        (
            "{ kind = \"monolithic\", rtol = 1e-3 }",
            staggered,
            "exponential is removed: write \"bdf\"",
        ),
    ] {
        let error = refused(&SCENE.replacen(from, to, 1), &[]);
        assert!(error.message().contains("unknown"), "{error}");
        let help = error.advice().unwrap();
        assert!(help.starts_with(instead) && help.contains("allowed"), "{help}");
    }
    // No effect was called so.
    let error = refused(&SCENE.replacen("\"test-spring\"", "\"fire\"", 1), &[]);
    assert!(!error.advice().unwrap().contains("removed"), "{error}");
}

/// The registries grow with the engine, so only the beginning and the nearest word are fixed.
#[test]
fn unknown_kinds_of_a_registry() {
    for (from, to, message, meant) in [
        (
            "\"simultaneous\"",
            "\"simultaneos\"",
            "time.policy: unknown timescale policy \"simultaneos\"",
            "simultaneous",
        ),
        (
            "\"monolithic\"",
            "\"monolitic\"",
            "time.integrator: unknown integrator \"monolitic\"",
            "monolithic",
        ),
        (
            "\"descent\"",
            "\"decent\"",
            "equilibrium: unknown equilibrium method \"decent\"",
            "descent",
        ),
        (
            "\"test-spring\"",
            "\"test-sprig\"",
            "effect[0]: unknown effect \"test-sprig\"",
            "test-spring",
        ),
    ] {
        let text = SCENE.replacen(from, to, 1);
        let error = refused(&text, &[]);
        assert_eq!(error.message(), message);
        assert_eq!(error.position(), Some(position(&text, to)));
        let help = error.advice().unwrap();
        assert!(help.starts_with(&format!("did you mean {meant}? allowed: ")), "{help}");
    }
}

#[test]
fn a_misspelt_key_of_a_region_is_not_passed_over() {
    let pin = "kind = \"pin\"\naxes = \"z\"\nwhere = { ring = { inner = 1.0, outer = 2.0, axs = [1, 0, 0] } }";
    let error = refused(&SCENE.replace("kind = \"test-weightless\"", pin), &[]);
    let message = error.message();
    assert!(message.starts_with("unknown key axs in "), "{message}");
    let advice = error.advice().unwrap_or_default();
    assert!(advice.contains("did you mean axis?"), "{advice}");
}
