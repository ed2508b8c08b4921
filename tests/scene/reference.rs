//! The reference has a row for every key and name that a scene accepts, and no row for anything else; it names every
//! command and option.
//!
//! What is accepted is what the error about an unknown key lists, which follows from the types.

use std::collections::BTreeSet;
use std::process::Command;

use super::refused;

use crate::common::shipped;
use crate::run::program;

const UNKNOWN: &str = "impossible";

const SHEET: &str = "sheet = { shape = \"disc\", radius = 10.0, vertices = 300 }";
const TIME: &str = "time = { until = 1.0 }";

/// Page and heading of the reference, and scenes (but for the tables above) with an unknown key or name.
const TABLES: [(&str, &str, &[&str]); 33] = [
    (
        "sheet",
        "`[sheet]`",
        &[
            "sheet = { impossible = 0 }",
            "sheet = { shape = \"impossible\" }",
            "sheet = { shape = \"lattice\", impossible = 0 }",
            "sheet = { shape = \"polygon\", impossible = 0 }",
            "sheet = { shape = \"sphere\", impossible = 0 }",
            "sheet = { shape = \"cylinder\", impossible = 0 }",
            "sheet = { shape = \"cap\", impossible = 0 }",
            "sheet = { shape = \"torus\", impossible = 0 }",
            "sheet = { shape = \"ellipsoid\", impossible = 0 }",
            "sheet = { shape = \"wavy-strip\", impossible = 0 }",
            "sheet = { shape = \"graph\", impossible = 0 }",
            "sheet = { file = \"a.obj\", impossible = 0 }",
            "sheet = { shape = \"disc\", radius = 1.0, vertices = 100, bump = { impossible = 0 } }",
            "sheet = { shape = \"disc\", radius = 1.0, vertices = 100, imperfection = { impossible = 0 } }",
        ],
    ),
    (
        "sheet",
        "`[material]`",
        &[
            "material = { impossible = 0 }",
            "material = { young = 1.0, poisson = 0.3, thickness = 0.5, drag = { impossible = 0 } }",
            "material = { young = 1.0, poisson = 0.3, thickness = 0.5, drag = { per-area = { impossible = 0 } } }",
        ],
    ),
    (
        "sheet",
        "Fields",
        &["material = { young = { impossible = 0 }, poisson = 0.3, thickness = 0.5 }"],
    ),
    ("effects", "Stretching", &["effect = [{ kind = \"stretching\", impossible = 0 }]"]),
    ("effects", "Bending", &["effect = [{ kind = \"bending\", impossible = 0 }]"]),
    ("effects", "Pin", &["effect = [{ kind = \"pin\", impossible = 0 }]"]),
    (
        "effects",
        "Load",
        &[
            "effect = [{ kind = \"load\", impossible = 0 }]",
            "effect = [{ kind = \"load\", where = \"all\", force = { impossible = 0 } }]",
        ],
    ),
    ("effects", "Pressure", &["effect = [{ kind = \"pressure\", impossible = 0 }]"]),
    (
        "effects",
        "Foundation",
        &[
            "effect = [{ kind = \"foundation\", impossible = 0 }]",
            "effect = [{ kind = \"foundation\", where = \"all\", stiffness = 1, to = { impossible = 0 } }]",
            "effect = [{ kind = \"foundation\", where = \"all\", stiffness = 1, to = { plane = { impossible = 0 } } }]",
        ],
    ),
    (
        "effects",
        "Volume",
        &[
            "effect = [{ kind = \"volume\", impossible = 0 }]",
            "effect = [{ kind = \"volume\", stiffness = 1, target = { impossible = 0 } }]",
        ],
    ),
    ("effects", "Contact", &["effect = [{ kind = \"contact\", impossible = 0 }]"]),
    (
        "effects",
        "Obstacle",
        &[
            "effect = [{ kind = \"obstacle\", impossible = 0 }]",
            "effect = [{ kind = \"obstacle\", shape = { impossible = 0 } }]",
            "effect = [{ kind = \"obstacle\", shape = { plane = { impossible = 0 } } }]",
            "effect = [{ kind = \"obstacle\", shape = { sphere = { impossible = 0 } } }]",
            "effect = [{ kind = \"obstacle\", shape = { cylinder = { impossible = 0 } } }]",
        ],
    ),
    (
        "effects",
        "Adhesion",
        &[
            "effect = [{ kind = \"adhesion\", impossible = 0 }]",
            "effect = [{ kind = \"adhesion\", to = { impossible = 0 } }]",
            "effect = [{ kind = \"adhesion\", to = { plane = { impossible = 0 } } }]",
        ],
    ),
    ("effects", "Active-tension", &["effect = [{ kind = \"active-tension\", impossible = 0 }]"]),
    ("effects", "Growth", &["effect = [{ kind = \"growth\", impossible = 0 }]"]),
    ("effects", "Directed-growth", &["effect = [{ kind = \"directed-growth\", impossible = 0 }]"]),
    (
        "effects",
        "Remodelling",
        &[
            "effect = [{ kind = \"remodelling\", impossible = 0 }]",
            "effect = [{ kind = \"bending\", model = \"hinge\", remodelling = { impossible = 0 } }]",
        ],
    ),
    ("effects", "Diffusion", &["effect = [{ kind = \"diffusion\", impossible = 0 }]"]),
    ("effects", "Cross-diffusion", &["effect = [{ kind = \"cross-diffusion\", impossible = 0 }]"]),
    ("effects", "Advection", &["effect = [{ kind = \"advection\", impossible = 0 }]"]),
    ("effects", "Flux", &["effect = [{ kind = \"flux\", impossible = 0 }]"]),
    ("effects", "Exchange", &["effect = [{ kind = \"exchange\", impossible = 0 }]"]),
    ("effects", "Hold", &["effect = [{ kind = \"hold\", impossible = 0 }]"]),
    (
        "effects",
        "Regions",
        &["effect = [{ kind = \"pin\", axes = \"z\", where = { impossible = 0 } }]"],
    ),
    (
        "kinetics",
        "`[kinetics]`",
        &[
            "kinetics = { impossible = 0 }",
            "kinetics = { rates = { c = \"-c\" }, species = { c = { impossible = 0 } } }",
        ],
    ),
    (
        "kinetics",
        "Parameters",
        &[
            "kinetics = { rates = { c = \"-k*c\" }, parameters = { k = { impossible = 0 } } }",
            "kinetics = { rates = { c = \"-k*c\" }, parameters = { k = { file = \"a.vtu\", impossible = 0 } } }",
            "kinetics = { rates = { c = \"-k*c\" }, parameters = { k = { regions = [], impossible = 0 } } }",
        ],
    ),
    (
        "kinetics",
        "Initial values",
        &[
            "kinetics = { rates = { c = \"-c\" }, initial = { c = { impossible = 0 } } }",
            "kinetics = { rates = { c = \"-c\" }, initial = { c = { file = \"a.vtu\", impossible = 0 } } }",
            "kinetics = { rates = { c = \"-c\" }, initial = { c = { regions = [], impossible = 0 } } }",
            "kinetics = { rates = { c = \"-c\" }, initial = { c = { gaussian = { impossible = 0 } } } }",
            "kinetics = { rates = { c = \"-c\" }, initial = { c = { rectangle = { impossible = 0 } } } }",
            "kinetics = { rates = { c = \"-c\" }, initial = { c = { stripe = { impossible = 0 } } } }",
            "kinetics = { rates = { c = \"-c\" }, initial = { c = { random = { impossible = 0 } } } }",
        ],
    ),
    (
        "time",
        "`[time]`",
        &[
            "time = { until = 1.0, impossible = 0 }",
            "time = { until = 1.0, policy = \"impossible\" }",
            "time = { until = 1.0, policy = { kind = \"quasi-static\", impossible = 0 } }",
            "time = { until = 1.0, integrator = \"impossible\" }",
            "time = { until = 1.0, integrator = { kind = \"staggered\", impossible = 0 } }",
            "time = { until = 1.0, integrator = { kind = \"staggered\", method = \"impossible\" } }",
            "time = { until = 1.0, integrator = { kind = \"staggered\", chemistry = \"impossible\" } }",
            "time = { until = 1.0, integrator = { kind = \"staggered\", shape = \"impossible\" } }",
            "time = { until = 1.0, integrator = { kind = \"monolithic\", impossible = 0 } }",
            "time = { until = 1.0, integrator = { kind = \"monolithic\", method = \"impossible\" } }",
            "time = { until = 1.0, integrator = { kind = \"monolithic\", linear = \"impossible\" } }",
            "time = { until = 1.0, integrator = { kind = \"explicit\", impossible = 0 } }",
            "time = { until = 1.0, integrator = { kind = \"explicit\", method = \"impossible\" } }",
        ],
    ),
    (
        "solvers",
        "`[equilibrium]`",
        &[
            "equilibrium = \"impossible\"",
            "equilibrium = { method = \"lbfgs\", impossible = 0 }",
            "equilibrium = { method = \"lbfgs\", preconditioner = \"impossible\" }",
            "equilibrium = { method = \"lbfgs\", precision = \"impossible\" }",
            "equilibrium = { method = \"lbfgs\", collapse = \"impossible\" }",
            "equilibrium = { method = \"newton\", impossible = 0 }",
            "equilibrium = { method = \"descent\", impossible = 0 }",
        ],
    ),
    ("solvers", "`[stability]`", &["stability = { impossible = 0 }"]),
    ("solvers", "`[invariants]`", &["invariants = { impossible = 0 }"]),
    (
        "output",
        "`[output]`",
        &["output = { impossible = 0 }", "output = { compression = \"impossible\" }"],
    ),
    ("output", "`[checkpoint]`", &["checkpoint = { impossible = 0 }"]),
];

/// The keys or names that stand beside the unknown one in the error about `table`.
fn accepted(table: &str) -> BTreeSet<String> {
    let mut text = String::new();
    for other in [SHEET, TIME] {
        if other.split(' ').next() != table.split(' ').next() {
            text.push_str(other);
            text.push('\n');
        }
    }
    text.push_str(table);
    let error = refused(&text, &[]);
    assert!(error.message().contains(UNKNOWN), "{table}: {}", error.message());
    let advice = error.advice().unwrap_or_default();
    let (_, allowed) =
        advice.split_once("allowed: ").unwrap_or_else(|| panic!("{table}: {advice}"));
    allowed.split(", ").map(str::to_owned).collect()
}

/// The tables under a heading of a page of the reference: rows of cells, the first of which is the header.
fn tables(page: &str, heading: &str) -> Vec<Vec<Vec<String>>> {
    let text = shipped(&format!("docs/book/reference/{page}.md"));
    let (mut inside, mut within) = (false, false);
    let mut tables: Vec<Vec<Vec<String>>> = Vec::new();
    for line in text.lines() {
        if line.starts_with('#') {
            inside = line.trim_start_matches('#').trim() == heading;
        }
        let row = inside && line.starts_with('|');
        if row && !within {
            tables.push(Vec::new());
        }
        within = row;
        if row && !line.starts_with("| ---") {
            let cells = line.trim_matches('|').replace("\\|", "/");
            let cells = cells.split('|').map(|cell| cell.trim().to_owned());
            tables.last_mut().unwrap().push(cells.collect());
        }
    }
    assert!(!tables.is_empty(), "no table under {heading} in {page}");
    tables
}

/// Words of the code in a cell: `{ box = { min = …` has box and min.
fn words(cell: &str) -> BTreeSet<String> {
    let code = cell.split('`').skip(1).step_by(2);
    let word = |c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '-');
    code.flat_map(|code| code.split(word)).filter(|w| !w.is_empty()).map(str::to_owned).collect()
}

#[test]
fn every_key_has_its_row_in_the_reference() {
    let mut missing = Vec::new();
    for (page, heading, scenes) in TABLES {
        let known: BTreeSet<String> =
            tables(page, heading).iter().flatten().flatten().flat_map(|cell| words(cell)).collect();
        for scene in scenes {
            // The kind of an effect is the heading.
            let kind = |key: &String| key == "kind" && page == "effects";
            let own = |key: &String| !key.starts_with("test-");
            let keys = accepted(scene).into_iter().filter(own);
            let keys = keys.filter(|key| !kind(key) && !known.contains(key));
            missing.extend(keys.map(|key| format!("{page}.md, {heading}: {key}, of {scene}")));
        }
    }
    assert!(missing.is_empty(), "without a row:\n{}", missing.join("\n"));
}

#[test]
fn every_row_of_the_reference_is_a_key() {
    let mut wrong = Vec::new();
    for (page, heading, scenes) in TABLES {
        let keys: BTreeSet<String> = scenes.iter().flat_map(|scene| accepted(scene)).collect();
        for table in tables(page, heading).iter().filter(|table| table[0][0].starts_with("key")) {
            for cell in table[1..].iter().map(|row| &row[0]) {
                let code = cell.split('`').skip(1).step_by(2);
                let key = |code: &&str| !keys.contains(code.rsplit('.').next().unwrap_or(code));
                wrong.extend(code.filter(key).map(|code| format!("{page}.md, {heading}: {code}")));
            }
        }
    }
    assert!(wrong.is_empty(), "no such keys:\n{}", wrong.join("\n"));
}

#[test]
fn every_effect_and_table_is_in_the_reference() {
    let kinds = tables("effects", "`[[effect]]`");
    let listed: BTreeSet<String> = kinds[0][1..].iter().flat_map(|row| words(&row[0])).collect();
    // Those of other crates, and of these tests, are not the reference's.
    let own = |kind: &&str| !kind.starts_with("test-") && *kind != "indenter";
    let kinds = rumple::effects::kinds().into_iter().filter(own);
    let kinds: BTreeSet<String> = kinds.map(str::to_owned).collect();
    assert_eq!(listed, kinds);
    let checked = |page: &str, heading: &str| {
        TABLES.iter().any(|(of, known, _)| (*of, *known) == (page, heading))
    };
    for kind in kinds {
        let heading = format!("{}{}", kind[..1].to_uppercase(), &kind[1..]);
        assert!(checked("effects", &heading), "{heading} is not checked");
    }
    for table in accepted("impossible = 0").into_iter().filter(|table| table != "effect") {
        let heading = format!("`[{table}]`");
        assert!(TABLES.iter().any(|(_, known, _)| *known == heading), "{heading} is not checked");
    }
}

#[test]
fn every_command_and_option_is_in_the_reference() {
    let page = |name: &str| shipped(&format!("docs/book/{name}.md"));
    let rows = page("reference/command-line");
    // Options of the two commands with pages of their own stand there.
    let pages = [rows.clone(), page("manual/accuracy"), page("manual/sweeps")].concat();
    let mut left = vec![Vec::<String>::new()];
    let mut missing = Vec::new();
    while let Some(path) = left.pop() {
        let help = Command::new(program()).args(&path).arg("--help").output().unwrap();
        let help = String::from_utf8(help.stdout).unwrap();
        let commands = help.split_once("\nCommands:\n").map_or("", |(_, list)| list);
        let names = commands.lines().take_while(|line| !line.is_empty());
        let names = names.filter_map(|line| line.split_whitespace().next());
        let names: Vec<&str> = names.filter(|name| *name != "help").collect();
        left.extend(names.iter().map(|name| [&path[..], &[(*name).to_owned()]].concat()));
        let command = format!("rumple {}", path.join(" "));
        if names.is_empty() && !rows.contains(&command) {
            missing.push(command.clone());
        }
        let options = help.lines().map(str::trim).filter(|line| line.starts_with('-'));
        // Two spaces before what they are for.
        let options = options.filter_map(|line| line.split("  ").next());
        let options = options.flat_map(|line| line.split([' ', ',']));
        let options = options.filter(|word| word.starts_with("--") && word.len() > 2);
        let unknown = options.filter(|word| !["--help", "--version"].contains(word));
        let unknown = unknown.filter(|word| !pages.contains(*word));
        missing.extend(unknown.map(|option| format!("{command} {option}")));
    }
    assert!(missing.is_empty(), "not in the reference:\n{}", missing.join("\n"));
}
