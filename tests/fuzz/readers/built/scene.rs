//! Scenes that are right by themselves: the tables, with what they list chosen.

use super::{Choices, Table};

/// A kind of effect with its keys.
type Kind = &'static [(&'static str, &'static str)];

/// What bends and stretches.
const ELASTIC: [Kind; 8] = [
    &[("kind", "\"stretching\"")],
    &[("kind", "\"stretching\""), ("weight", "\"paper\"")],
    &[("kind", "\"stretching\""), ("model", "\"stvk\""), ("modulus", "\"plate\"")],
    &[("kind", "\"stretching\""), ("model", "\"stvk\"")],
    &[("kind", "\"bending\"")],
    &[("kind", "\"bending\""), ("weight", "\"paper\""), ("area", "\"mixed-voronoi\"")],
    &[("kind", "\"bending\""), ("model", "\"meyer\""), ("area", "\"barycentric\"")],
    &[("kind", "\"bending\""), ("model", "\"hinge\"")],
];

/// What else acts on a sheet.
const OTHERS: [Kind; 17] = [
    &[("kind", "\"pin\""), ("where", "\"all\""), ("axes", "\"z\"")],
    &[("kind", "\"pin\""), ("where", "{ vertices = [0, 1] }"), ("axes", "\"xyz\"")],
    &[
        ("kind", "\"pin\""),
        ("where", "{ half-space = { point = [1.0, 0, 0], normal = [1, 0, 0] } }"),
        ("axes", "\"xy\""),
        ("displacement", "[0.1, 0, 0]"),
        ("ramp", "{ formula = \"min(t/2, 1)\" }"),
    ],
    &[("kind", "\"load\""), ("where", "\"all\""), ("force.per-area", "[0.0, 0.0, 0.1]")],
    &[
        ("kind", "\"load\""),
        ("where", "{ ball = { centre = [0, 0, 0], radius = 9.0 } }"),
        ("force.total", "[0.0, 0.1, 0.1]"),
        ("ramp", "{ points = [[0, 0], [2, 1]] }"),
    ],
    &[("kind", "\"load\""), ("where", "\"all\""), ("force.along-normal", "0.1")],
    &[("kind", "\"load\""), ("where", "\"all\""), ("force.per-vertex", "[0.0, 0.0, 0.01]")],
    &[("kind", "\"pressure\""), ("value", "0.1"), ("ramp", "{ formula = \"1 + t\" }")],
    &[("kind", "\"foundation\""), ("where", "\"all\""), ("stiffness", "2.0")],
    &[
        ("kind", "\"foundation\""),
        ("where", "{ box = { min = [-9, -9, -9], max = [9, 9, 9] } }"),
        ("stiffness", "0.5"),
        ("to", "{ plane = { normal = [0, 0, 1] } }"),
    ],
    &[("kind", "\"contact\""), ("distance", "0.1"), ("stiffness", "2.0")],
    &[
        ("kind", "\"obstacle\""),
        ("shape", "{ plane = { point = [0, 0, -9], normal = [0, 0, 1] } }"),
        ("displacement", "[0, 0, 0.1]"),
        ("ramp", "{ formula = \"t\" }"),
    ],
    &[
        ("kind", "\"obstacle\""),
        ("shape", "{ sphere = { radius = 99.0, sheet = \"inside\" } }"),
        ("distance", "0.1"),
        ("stiffness", "2.0"),
    ],
    &[("kind", "\"growth\""), ("factor", "\"1 + 0.1*t*exp(-(x^2 + y^2)/20)\"")],
    &[
        ("kind", "\"growth\""),
        ("factor", "\"1.2\""),
        ("where", "{ ring = { inner = 0.0, outer = 9.0 } }"),
    ],
    &[("kind", "\"volume\""), ("stiffness", "5.0"), ("target.share", "1.1")],
    &[("kind", "\"volume\""), ("exact", "true"), ("target.share", "0.99")],
];

const SPHERE: &str = "\"sphere\"";

/// The law has a species `c`, and with `second` also `d`.
const RATES: [&str; 6] = [
    "\"1 - c\"",
    "\"0.1*H - c\"",
    "\"k*tanh(sigma) - c^2/(1 + c)\"",
    "\"k*hill(pos(strain), 0.1, 2) - c*exp(-t)\"",
    "\"K*x + y - z*c + J\"",
    "\"sqrt(abs(c))*log(1 + c*c) - step(c - 1)*c\"",
];

const INITIAL: [&str; 7] = [
    "0.5",
    "{ gaussian = { width = 2.0, amplitude = 0.5 } }",
    "{ spots = [{ centre = [1, 0, 0], width = 1.0, amplitude = 1.0 }] }",
    "{ rectangle = { size = [4.0, 2.0], value = 1.0, background = 0.1 } }",
    "{ stripe = { normal = [0, 1, 0], width = 3.0, value = 1.0 } }",
    "{ random = { mean = 1.0, amplitude = 0.01, seed = 2 } }",
    "{ formula = \"0.3*exp(-(x^2 + y^2)/10)\" }",
];

/// The tables of a scene.
pub fn tables(choices: &mut Choices) -> Vec<Table> {
    let mut all = vec![sheet(choices)];
    let drag = choices.pick(&["100.0", "{ per-area = 10.0 }", "{ per-vertex = 1.0 }"]);
    let (young, poisson) = (choices.pick(&["1e3", "1.0"]), choices.pick(&["0.3", "0.5", "0.0"]));
    let material = [("young", young), ("poisson", poisson), ("thickness", "0.3"), ("drag", drag)];
    all.push(Table::new("[material]").with(&material));
    let kinetics = kinetics(choices);
    let (chemical, two) = (!kinetics.is_empty(), kinetics.len() > 1);
    effects(choices, &mut all, chemical);
    all.extend(kinetics);
    all.push(time(choices, chemical));
    all.push(equilibrium(choices));
    if choices.seldom() {
        let perturb = choices.pick(&["0.01", "1e-3"]);
        all.push(Table::new("[stability]").with(&[
            ("watch", "true"),
            ("modes", "2"),
            ("perturb", perturb),
        ]));
    }
    if choices.seldom() {
        let energy = choices.pick(&["true", "1e-1"]);
        let mut laws = Table::new("[invariants]").with(&[("energy", energy), ("crossings", "0")]);
        if choices.seldom() {
            laws.set("force", "1e-9");
        }
        if chemical && choices.seldom() {
            laws.set("totals", if two { "{ \"c + 2 e\" = true }" } else { "{ c = true }" });
        }
        all.push(laws);
    }
    let fields = choices.pick(&[
        "[\"force\", \"quality\"]",
        "[\"mean_curvature\", \"normal\", \"length_factor\"]",
        "[\"tension\", \"area_ratio\", \"vertex_area\"]",
    ]);
    all.push(Table::new("[output]").with(&[("every", "0.01"), ("fields", fields)]));
    if choices.seldom() {
        all.push(Table::new("[checkpoint]").with(&[("every", "0.01"), ("keep", "2")]));
    }
    all
}

fn sheet(choices: &mut Choices) -> Table {
    let shapes: [&[(&str, &str)]; 7] = [
        &[("shape", "\"disc\""), ("radius", "3.0"), ("vertices", "30")],
        &[("shape", "\"disc\""), ("radius", "3.0"), ("vertices", "42")],
        &[("shape", "\"rectangle\""), ("width", "4.0"), ("height", "3.0"), ("vertices", "50")],
        &[("shape", "\"annulus\""), ("inner", "1.0"), ("outer", "4.0"), ("vertices", "120")],
        &[("shape", SPHERE), ("radius", "2.0"), ("irregular", "true"), ("vertices", "30")],
        &[("shape", SPHERE), ("radius", "2.0"), ("vertices", "42")],
        &[("shape", "\"cylinder\""), ("radius", "1.5"), ("height", "4.0"), ("vertices", "80")],
    ];
    let mut table = Table::new("[sheet]").with(shapes[choices.below(shapes.len())]);
    table.set("seed", choices.pick(&["1", "7"]));
    if choices.below(16) == 15 {
        table.set("planar", "true");
        return table;
    }
    if choices.seldom() {
        table.set("imperfection", "{ amplitude = 1e-3, direction = \"normal\" }");
    }
    if choices.seldom() {
        table.set("bump", "{ amplitude = 0.2, width = 2.0 }");
    }
    table
}

fn effects(choices: &mut Choices, all: &mut Vec<Table>, chemical: bool) {
    let stretching = choices.below(4);
    all.push(Table::new("[[effect]]").with(ELASTIC[stretching]));
    if !choices.seldom() {
        all.push(Table::new("[[effect]]").with(ELASTIC[4 + choices.below(4)]));
    }
    // What encloses nothing has no volume.
    let closed = all[0].rows.iter().any(|(_, value)| value == SPHERE);
    let others = if closed { &OTHERS[..] } else { &OTHERS[..OTHERS.len() - 2] };
    for _ in 0..choices.below(4) {
        all.push(Table::new("[[effect]]").with(others[choices.below(others.len())]));
    }
    if chemical && choices.below(2) == 1 {
        let rows = [("kind", "\"diffusion\""), ("species", "\"c\""), ("coefficient", "0.5")];
        let mut table = Table::new("[[effect]]").with(&rows);
        table.set("metric", choices.pick(&["\"current\"", "\"rest\""]));
        all.push(table);
    }
}

/// None, one or two laws.
fn kinetics(choices: &mut Choices) -> Vec<Table> {
    let count = choices.below(4).min(2);
    let mut all = Vec::new();
    if count > 0 {
        let mut first = Table::new("[[kinetics]]");
        first.set("rates.c", choices.pick(&RATES));
        first.set("rates.d", choices.pick(&["\"-d\"", "\"c - d\"", "\"c*d - d^3\""]));
        first.set(
            "parameters",
            choices.pick(&["{ k = 1.0 }", "{ k = { formula = \"1 + x/10\" } }"]),
        );
        first.set("initial.c", choices.pick(&INITIAL));
        first.set("initial.d", choices.pick(&INITIAL));
        first.set("location", choices.pick(&["\"vertex\"", "\"face\""]));
        first.set("measure", choices.pick(&["\"concentration\"", "\"amount\""]));
        first.set("tension", choices.pick(&["\"trace\"", "\"mean\"", "\"paper\""]));
        if choices.below(2) == 1 {
            first.set(
                "length_factor",
                choices.pick(&["\"1 + 0.1*c\"", "\"1 + 0.5*hill(c, 0.1, 4)\""]),
            );
        }
        if choices.seldom() {
            first.set("let.half", "\"c/2\"");
            first.set("observables.made", "\"half*k\"");
            first.set("species.c", "{ typical = 0.1, lower = -10.0, upper = 100.0 }");
        }
        all.push(first);
    }
    if count > 1 {
        let second =
            [("rates.e", "\"c - e/5\""), ("rates.c", "\"-0.5*e*c\""), ("shared", "[\"c\"]")];
        all.push(Table::new("[[kinetics]]").with(&second));
    }
    all
}

fn time(choices: &mut Choices, chemical: bool) -> Table {
    let mut table = Table::new("[time]");
    table.set("until", choices.pick(&["0.1", "1.0", "1e-3"]));
    let policy = choices.below(if chemical { 4 } else { 3 });
    table.set(
        "policy",
        ["\"quasi-static\"", "\"quasi-static\"", "\"simultaneous\"", "\"chemistry-fast\""][policy],
    );
    let kind = match policy {
        3 => 1 + choices.below(2),
        2 => choices.below(4),
        _ => choices.below(3),
    };
    match kind {
        0 => {
            table.set("integrator.kind", "\"staggered\"");
            table.set("integrator.step", choices.pick(&["0.01", "1e-3"]));
            let chemistry = [
                "\"chebyshev\"",
                "\"tsit45\"",
                "\"bdf\"",
                "\"tr-bdf2\"",
                "\"esdirk34\"",
                "\"euler\"",
            ];
            table.set("integrator.chemistry", choices.pick(&chemistry));
            if policy == 2 {
                table.set("integrator.shape", choices.pick(&["\"sdirk2\"", "\"euler\""]));
            }
            if choices.seldom() {
                table.set("integrator.method", "\"euler\"");
            } else {
                table.set("integrator.rtol", "0.05");
                table.set("integrator.atol", "0.05");
                table.set("integrator.longest_step", "0.5");
            }
        }
        1 => {
            table.set("integrator.kind", "\"monolithic\"");
            table.set(
                "integrator.method",
                choices.pick(&["\"bdf\"", "\"tr-bdf2\"", "\"esdirk34\""]),
            );
            table.set("integrator.rtol", "1e-2");
            table.set("integrator.atol", "1e-3");
            table.set("integrator.linear", choices.pick(&["\"auto\"", "\"lu\"", "\"blocks\""]));
        }
        2 => table.set("integrator", choices.pick(&["\"monolithic\"", "\"staggered\""])),
        _ => {
            table.set("integrator.kind", "\"explicit\"");
            table.set("integrator.method", choices.pick(&["\"euler\"", "\"tsit45\""]));
            table.set("integrator.step", "1e-5");
        }
    }
    if choices.seldom() {
        table.set("stop_when_steady", "1e-4");
        table.set("max_steps", "3");
    }
    table
}

fn equilibrium(choices: &mut Choices) -> Table {
    let rows: &[(&str, &str)] = match choices.below(7) {
        0 | 1 => &[("method", "\"lbfgs\"")],
        2 => &[("method", "\"lbfgs\""), ("preconditioner", "\"multigrid\""), ("memory", "5")],
        3 => &[("method", "\"lbfgs\""), ("preconditioner", "\"blocks\""), ("refresh", "5")],
        4 => &[("method", "\"lbfgs\""), ("precision", "\"single\""), ("collapse", "\"hold\"")],
        5 => &[("method", "\"newton\""), ("path_error", "0.1")],
        _ => &[("method", "\"descent\""), ("steps", "20"), ("largest_move", "0.1")],
    };
    let tolerance = choices.pick(&["1e-4", "1e-6"]);
    let common = [("tolerance", tolerance), ("max_iterations", "200"), ("area_share", "0.4")];
    Table::new("[equilibrium]").with(rows).with(&common)
}
