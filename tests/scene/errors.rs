//! Every class of mistake: message, exact place, help. Words that are not known: `unknown`.

use super::{SCENE, position, refused};

/// Cases of [`wrong`]: `from | to | needle`, then, indented, the message and the help, if there is any.
pub(super) fn all_wrong(cases: &str) {
    for case in cases.trim().replace("\n    ", "\t").lines() {
        let case = case.replace("\\n", "\n");
        let mut parts = case.split('\t');
        let change: Vec<&str> = parts.next().unwrap().split(" | ").collect();
        let [from, to, needle] = change[..] else { panic!("{case}") };
        wrong(from, to, needle, parts.next().unwrap(), parts.next());
    }
}

/// Replaces `from` by `to` in the scene; the error must point to the first `needle` and read
/// `message`, with `help`.
fn wrong(from: &str, to: &str, needle: &str, message: &str, help: Option<&str>) {
    let text = SCENE.replacen(from, to, 1);
    assert_ne!(text, SCENE, "{from}");
    let error = refused(&text, &[]);
    assert_eq!(error.message(), message);
    assert_eq!(error.position(), Some(position(&text, needle)), "{message}");
    assert_eq!(error.advice(), help, "{message}");
    assert_eq!(error.others().count(), 0, "{message}");
    let (line, column) = position(&text, needle);
    assert_eq!(error.to_string(), format!("s.toml:{line}:{column}: {message}"));
    let rendered = error.rendered(false);
    assert!(rendered.contains(&format!("[s.toml:{line}:{column}]")), "{rendered}");
}

#[test]
fn values_out_of_range_or_of_the_wrong_type() {
    all_wrong(
        r#"
radius = 100.0 | radius = -7 | -7
    sheet.radius must be a number above 0, not -7.0
thickness = 0.5 | thickness = 0 | 0\n\n[[
    material.thickness must be a number above 0, not 0.0
poisson = 0.3333333333333333 | poisson = 0.51 | 0.51
    material.poisson must be a number above -1 and up to 0.5, not 0.51
poisson = 0.3333333333333333 | poisson = -1 | -1\n
    material.poisson must be a number above -1 and up to 0.5, not -1.0
young = 1e6 | young = nan | nan
    material.young must be a number above 0, not NaN
young = 1e6 | young = inf | inf
    material.young must be a number above 0, not inf
young = 1e6 | young = true | true
    material.young must be a number above 0, a formula of x, y and z, or a table by regions or of a file, not true
young = 1e6 | young = 1979-05-27 | 1979
    material.young must be a number above 0, a formula of x, y and z, or a table by regions or of a file, not a date
vertices = 20000 | vertices = 3 | 3\nimp
    sheet.vertices must be an integer from 4, not 3
seed = 7 | seed = -7 | -7
    sheet.imperfection.seed must be an integer from 0, not -7
amplitude = 1e-3 | amplitude = -1e-3 | -1e-3
    sheet.imperfection.amplitude must be a number from 0, not -0.001
centre = [1, 2, 0] | centre = [1, 2] | [1, 2]
    sheet.bump.centre must be a list of 3 values, not a list of 2
centre = [1, 2, 0] | centre = [1, 2, 0, 4] | [1, 2, 0, 4]
    sheet.bump.centre must be a list of 3 values, not a list of 4
[1.5, -2, 3] | [1.5, -2, nan] | nan
    effect[0].anchors[1][2] must be a finite number, not NaN
width = 5.0 | width = "x" | "x"
    kinetics.initial.c.gaussian.width must be a number, not the string "x"
c_star = 0.1 | c_star = -inf | -inf
    kinetics.parameters.c_star must be a finite number, not -inf
"c",  | 3,  | 3, "mean
    output.fields[0] must be a string in quotes, not 3
stiffness = 2 | stiffness = [] | []
    effect[0].stiffness must be a number, not a list
shape = "disc"\nradius = 100.0 | shape = "annulus"\ninner = 3\nouter = 2 | 3\nouter
    sheet.inner must be a number below outer = 2.0, not 3.0
rtol = 1e-3 | rtol = 0.0 | 0.0 }
    time.integrator.rtol must be a number above 0, not 0.0
integrator = { kind = "monolithic", rtol = 1e-3 } | integrator = 5 | 5\nuntil
    time.integrator must be a table with a kind, not 5
"#,
    );
}

#[test]
fn numbers_that_no_float_holds() {
    all_wrong(
        r#"
until = 500.0 | until = 1e999 | 1e999
    this number is too large
    the largest number is 1.797e308
until = 500.0 | until = 99999999999999999999 | 99999999999999999999
    this integer needs more than 64 bits
    write a large real number with a point or exponent, as in 1e20
"#,
    );
}

#[test]
fn missing_keys_name_table_and_key() {
    all_wrong(
        r#"
radius = 100.0\n |  | [sheet]
    missing key radius in [sheet]
young = 1e6\n |  | [material]
    missing key young in [material]
until = 500.0\n |  | [time]
    missing key until in [time]
stiffness = 2\n |  | [[effect]]
    missing key stiffness in effect[0]
width = 5.0,  |  | { amplitude = 0.5 }
    missing key width in [kinetics.initial.c.gaussian]
shape = "disc"\n |  | [sheet]
    missing key shape in [sheet]
    shape is one of: disc, rectangle, lattice, annulus, polygon, sphere, cylinder, cap, torus, ellipsoid, wavy-strip, graph, point; or give file = "…"
"#,
    );
    let text = SCENE.replacen("kind = \"test-spring\"\n", "", 1);
    let error = refused(&text, &[]);
    assert!(error.message().starts_with("missing key kind in"), "{}", error.message());
    assert!(error.advice().unwrap().starts_with("the effect is one of: "));
}

#[test]
fn tables_of_the_wrong_shape() {
    all_wrong(
        r#"
[[effect]]\nkind = "test-spring"\nstiffness = 2\nweight = "paper"\nanchors = [[0, 0, 0], [1.5, -2, 3]]\n\n[[effect]] | [effect] | [effect]
    effect must be a list of tables, not a table
    write [[effect]] before every effect
shape = "disc" | shape = "disc"\nfile = "a.obj" | file
    sheet: shape and file exclude each other
    give shape = "…" for a generated sheet, or file = "…" for one from a file
initial.m = 0.25 | initial.m = "high" | "high"
    kinetics.initial.m must be a number or a table such as { gaussian = { … } }, not the string "high"
    allowed: gaussian, rectangle, stripe, spots, random, formula, file, regions
initial.m = 0.25 | initial.m = { stripe = { width = 1, value = 1, normal = [0, 0, 0] } } | { stripe
    kinetics.initial.m.stripe.normal must be a nonzero vector, not 0
"#,
    );
}

#[test]
fn a_missing_table_is_named() {
    let error = refused("[time]\nuntil = 1.0\n", &[]);
    assert_eq!(error.to_string(), "s.toml: missing table [sheet]");
    assert_eq!(error.position(), None);
}

#[test]
fn what_is_not_toml_is_shown_with_its_line() {
    for (from, to, needle) in [
        ("until = 500.0", "until = ", "\nstop_when"),
        ("until = 500.0", "until 500.0", "500.0"),
        ("radius = 100.0", "radius = 100.0\nradius = 2", "radius = 2"),
        ("[material]", "[material", "\nyoung"),
    ] {
        let text = SCENE.replacen(from, to, 1);
        let error = refused(&text, &[]);
        assert!(error.message().starts_with("not valid TOML: "), "{error}");
        assert_eq!(error.position(), Some(position(&text, needle)), "{error}");
    }
}

#[test]
fn several_mistakes_are_reported_together() {
    let text = SCENE.replacen("young = 1e6", "young = -1", 1).replacen("\"none\"", "\"lz\"", 1);
    let text = text.replacen("stiffness = 2", "stiffness = 0", 1);
    let error = refused(&text, &[]);
    let mut all = vec![error.message().to_owned()];
    all.extend(error.others().map(|other| other.message().to_owned()));
    assert_eq!(
        all,
        [
            "material.young must be a number above 0, not -1.0",
            "effect[0].stiffness must be a number above 0, not 0.0",
            "output.compression: unknown name \"lz\"",
        ]
    );
    let rendered = error.rendered(false);
    assert!(all.iter().all(|message| rendered.contains(message)), "{rendered}");
}

#[test]
fn columns_count_characters() {
    let text = SCENE.replacen("c_star = 0.1", "\"γ\" = 1, c_star = nan", 1);
    let error = refused(&text, &[]);
    assert_eq!(error.position(), Some(position(&text, "nan")));
}

#[test]
fn an_integer_with_a_point_is_told_how_to_write_it() {
    all_wrong(
        r#"
vertices = 20000 | vertices = 2e4 | 2e4
    sheet.vertices must be an integer, not 20000.0
    write 20000, without a point or exponent
seed = 7 | seed = 7e0 | 7e0
    sheet.imperfection.seed must be an integer from 0, not 7.0
    write 7, without a point or exponent
vertices = 20000 | vertices = 20000.5 | 20000.5
    sheet.vertices must be an integer, not 20000.5
"#,
    );
}

/// A frame at every representable time fills the disc.
#[test]
fn frames_beyond_number_are_refused_with_their_number() {
    all_wrong(
        r#"
every = 5.0 | every = 1e-90 | 1e-90
    output: every = 1e-90 to time.until = 500 asks for 5.0e92 frames; at most 1e6 are allowed
    every = 0.0005 or longer
every = 5.0 | every = 4e-4 | 4e-4
    output: every = 0.0004 to time.until = 500 asks for 1.2e6 frames; at most 1e6 are allowed
    every = 0.0005 or longer
"#,
    );
    let steps = |every: &str, most: &str| {
        let text = SCENE.replacen("every = 5.0", &format!("every = {every}"), 1);
        let keys = [format!("time.max_steps={most}")];
        rumple::scene::Scene::parse(&text, "s.toml", &keys).map(|_| ()).map_err(|e| e.to_string())
    };
    // A bound on the steps is one on the frames, unless times are then the same.
    assert_eq!(steps("1e-4", "1000"), Ok(()));
    assert_eq!(steps("5e-4", "1000000000"), Ok(()));
    assert!(steps("1e-4", "2000000").unwrap_err().contains("asks for 2.0e6 frames"));
    assert!(steps("1e-20", "10").unwrap_err().contains("too short for times up to"));
    // Checkpoints are not counted, but looked for at their times.
    let saved = |every: &str| {
        let keys = [format!("checkpoint.every={every}")];
        rumple::scene::Scene::parse(SCENE, "s.toml", &keys).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(saved("1e-9"), Ok(()));
    assert!(saved("1e-17").unwrap_err().contains("checkpoint: every = 1e-17 is too short"));
}
