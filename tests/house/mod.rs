//! Who may know whom: the paths that the sources really use, resolved, against the plan of the house.

mod circles;
mod paths;
mod words;

use std::collections::{BTreeMap, BTreeSet};

use paths::{Use, uses};

/// Every room with those that it may know. No room knows one further up.
const PLAN: [(&str, &[&str]); 19] = [
    ("cli", &["view", "study", "run", "ranks", "scene", "output", "solve", "kinetics", "sheet"]),
    ("view", &["study", "run", "output", "sheet"]),
    ("study", &["run", "scene", "output", "solve", "model", "kinetics", "geometry", "sheet"]),
    (
        "run",
        &[
            "problem", "stepper", "scene", "output", "solve", "model", "effects", "kinetics",
            "geometry", "sheet",
        ],
    ),
    ("ranks", &["solve", "registry"]),
    (
        "scene",
        &["document", "registry", "output", "solve", "model", "effects", "kinetics", "sheet"],
    ),
    ("problem", &["stepper", "solve", "model", "effects", "kinetics", "geometry", "sheet"]),
    ("stepper", &["solve", "model", "effects", "kinetics", "geometry", "sheet"]),
    ("kit", &["model", "effects", "kinetics", "geometry", "sheet"]),
    ("solve", &["model", "effects", "registry", "geometry", "sheet"]),
    ("model", &["effects", "kinetics", "geometry", "sheet"]),
    ("effects", &["registry", "kinetics", "geometry", "sheet"]),
    ("registry", &["document"]),
    ("document", &[]),
    ("output", &[]),
    ("kinetics", &[]),
    ("geometry", &["sheet"]),
    ("sheet", &[]),
    ("numerics", &[]),
];

/// What every room may use: the algebra, and names of the crate itself.
const EVERYWHERE: [&str; 1] = ["numerics"];

fn listed(uses: &[&Use]) -> String {
    uses.iter().map(|u| format!("\n  {}: {}", u.file, u.path)).collect()
}

#[test]
fn every_room_knows_only_those_of_the_plan() {
    let all = uses();
    let plan: BTreeMap<&str, &[&str]> = PLAN.into_iter().collect();
    let wrong: Vec<&Use> = all
        .iter()
        .filter(|u| u.to != u.from && !EVERYWHERE.contains(&u.to.as_str()))
        .filter(|u| !plan.get(u.from.as_str()).is_some_and(|may| may.contains(&u.to.as_str())))
        .filter(|u| !u.external)
        .collect();
    assert!(wrong.is_empty(), "not in the plan:{}", listed(&wrong));
    // Nor does the plan allow an unused dependency.
    for (from, rooms) in PLAN {
        for to in rooms {
            assert!(
                all.iter().any(|u| u.from == from && u.to == *to),
                "{from} → {to} is not found"
            );
        }
    }
}

#[test]
fn the_plan_has_no_cycle() {
    let place = |room: &str| PLAN.iter().position(|(name, _)| *name == room);
    // Beneath one another in some order: rooms without any that is left are taken away.
    let mut left: Vec<usize> = (0..PLAN.len()).collect();
    while !left.is_empty() {
        let free = |k: &usize| {
            PLAN[*k].1.iter().all(|room| !place(room).is_some_and(|other| left.contains(&other)))
        };
        let next = left.iter().copied().find(free);
        let Some(next) = next else { panic!("a cycle among {left:?}") };
        left.retain(|k| *k != next);
    }
}

#[test]
fn the_book_shows_the_plan() {
    let page = crate::common::shipped("docs/book/developers/house.md");
    for (room, may) in PLAN.iter().filter(|(_, may)| !may.is_empty()) {
        let may: Vec<String> = may.iter().map(|room| format!("`{room}`")).collect();
        let row = format!("| `{room}` | {} |", may.join(", "));
        assert!(page.contains(&row), "developers/house.md lacks {row}");
    }
}

#[test]
fn an_effect_knows_no_other_effect() {
    let all = uses();
    // Whatever is registered in a file or folder of its own.
    let effects: BTreeSet<&str> = all
        .iter()
        .filter(|u| u.from == "effects" && u.path.ends_with("register_kind"))
        .filter_map(|u| u.module.get(1).map(String::as_str))
        .collect();
    assert!(effects.len() > 8, "{effects:?}");
    let of = |path: &str| -> Option<String> {
        let rest = path.strip_prefix("effects::")?;
        let name = rest.split("::").next()?;
        effects.contains(&name).then(|| name.to_owned())
    };
    let wrong: Vec<&Use> = all
        .iter()
        .filter(|u| {
            let own = of(&u.module.join("::"));
            own.is_some() && of(&u.path).is_some_and(|other| own != Some(other))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", listed(&wrong));
}

/// What concerns one effect is in its file: notes, advice, diagnosis.
#[test]
fn runs_and_commands_know_no_effect_by_name() {
    // A term of rates and of laws, and a measure of shapes.
    let others = ["diffusion", "volume"];
    let kinds = rumple::effects::kinds();
    let kinds: Vec<_> = kinds.into_iter().filter(|kind| !others.contains(kind)).collect();
    for (file, text) in paths::texts() {
        if !["run/", "cli/"].iter().any(|room| file.starts_with(room)) {
            continue;
        }
        for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
            let named = |kind: &&&str| {
                [format!("\"{kind}\""), format!("`{kind}`")].iter().any(|k| line.contains(k))
            };
            assert_eq!(kinds.iter().find(named), None, "{file}: {line}");
        }
    }
}

/// Libraries that one place alone knows.
#[test]
fn libraries_stay_in_their_rooms() {
    let places: [(&str, &[&str]); 7] = [
        ("diffsol", &["numerics/ode"]),
        ("diffsol_la", &["numerics/ode"]),
        ("faer", &["numerics"]),
        ("libloading", &["kinetics/library"]),
        ("mpi", &["ranks"]),
        ("vtkio", &["sheet/read", "sheet/write", "output/vtk"]),
        ("clap", &["cli"]),
    ];
    let all = uses();
    for (library, rooms) in places {
        let wrong: Vec<&Use> = all
            .iter()
            .filter(|u| u.external && u.to == library)
            .filter(|u| !rooms.iter().any(|room| u.file.starts_with(room)))
            .collect();
        assert!(wrong.is_empty(), "{library}:{}", listed(&wrong));
        assert!(all.iter().any(|u| u.external && u.to == library), "no room uses {library}");
    }
}

#[test]
fn one_place_holds_what_is_unsafe() {
    // The program's handler of fatal signals is outside the library crates, and MPI and PETSc are libraries in C.
    let places = ["kinetics/library", "ranks/"];
    let allowed = |file: &str| places.iter().any(|place| file.starts_with(place));
    let wrong: Vec<String> =
        paths::unsafe_blocks().into_iter().filter(|file| !allowed(file)).collect();
    assert_eq!(wrong, Vec::<String>::new());
}

#[test]
fn observers_change_nothing() {
    let all = uses();
    let wrong: Vec<&Use> =
        all.iter().filter(|u| u.from == "output" && ["model", "solve"].contains(&&*u.to)).collect();
    assert!(wrong.is_empty(), "{}", listed(&wrong));
}

/// What solvers and the model sum or compare over a whole sheet passes its reduction. This one hands it what it has summed
/// over what it owns.
#[test]
fn no_solver_sums_by_itself() {
    let by_itself = ["parallel::sum(", "parallel::max(", "parallel::reduce(", "vectors::dots"];
    let files: BTreeSet<String> = paths::texts()
        .filter(|(file, _)| file.starts_with("core/solve") || file.starts_with("core/model"))
        .filter(|(_, text)| by_itself.iter().any(|name| text.contains(name)))
        .map(|(file, _)| file)
        .collect();
    let expected = ["core/solve/chemistry/chebyshev.rs"];
    assert_eq!(files, expected.map(str::to_owned).into());
}
