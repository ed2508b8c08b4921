//! What a scene calls for, by its places, in `check`; what a run cost, in shares that add up, in `explain`.

use std::fs;

use rumple::Vec3;
use rumple::effects::{
    BlockMatrix, Contact, Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy,
    HessianPart, Interaction, Reads,
};
use rumple::geometry::Shape;
use rumple::run::{Costs, explain};

use super::program::{folder, passes, rumple, text};
use super::{SMALL, prepare};

/// What `rumple check` prints of a scene.
fn checked(scene: &str, arguments: &str) -> String {
    let folder = folder(scene);
    text(&passes(folder.path(), &format!("check scene.toml {arguments}")).stdout)
}

/// The line of effects of this name.
fn effect<'a>(checked: &'a str, name: &str) -> &'a str {
    let line = checked.lines().find(|line| line.starts_with("effect") && line.contains(name));
    line.unwrap_or_else(|| panic!("no {name} in {checked}"))
}

#[test]
fn each_effect_is_explained_with_its_place() {
    let all = checked(SMALL, "");
    let line = |what: &str| SMALL.lines().position(|l| l.contains(what)).unwrap() + 1;
    for kind in ["stretching", "bending", "pin"] {
        // The table begins with its first key, after its head.
        let place = format!("(line {})", line(&format!("kind = \"{kind}\"")) - 1);
        assert!(effect(&all, kind).contains(&place), "{place}: {all}");
    }
    let flowing = "sheet = { shape = 'disc', radius = 5.0, vertices = 100 }
        time = { until = 1.0 }
        material = { young = 1.0, poisson = 0.3, thickness = 0.1 }
        effect = [{ kind = 'stretching' }, { kind = 'remodelling', time = 2.0 }]";
    let all = checked(flowing, "");
    assert!(effect(&all, "stretching (line 4)").contains("couples neighbours"), "{all}");
    assert!(effect(&all, "remodelling").contains("internal variables"), "{all}");
    assert!(all.contains("values of length_remodelling"), "{all}");
    let tension = SMALL.to_owned() + "[[effect]]\nkind = \"active-tension\"\nvalue = \"c\"\n";
    assert!(effect(&checked(&tension, ""), "active-tension").contains("reads c"));
}

/// An effect that declares every coupling there is.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Everything {}

#[typetag::serialize(name = "test-everything")]
impl EffectSpec for Everything {
    fn name(&self) -> String {
        "everything".into()
    }

    fn build(&self, _: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::contact(All))
    }
}

rumple::register_kind!(dyn EffectSpec, "test-everything", Everything);

struct All;

impl Energy for All {
    type Work = ();

    fn name(&self) -> &'static str {
        "everything"
    }

    fn coupling(&self) -> Coupling {
        Coupling { rings: 3, low_rank: true }
    }

    fn reads(&self) -> Reads<'_> {
        Reads::time(true)
    }

    fn evaluate(&self, _: &Shape<'_>, (): &mut (), _: Option<&mut [Vec3]>) -> f64 {
        0.0
    }

    fn add_hessian(&self, _: &Shape<'_>, (): &mut (), _: HessianPart, _: &mut BlockMatrix) {}
}

impl Contact for All {
    fn interaction(&self) -> Interaction {
        Interaction { pairs: true, limits_steps: true, touches: false }
    }
}

/// What an effect of anybody's calls for is asked from what it declares.
#[test]
fn an_effect_from_outside_explains_itself() {
    let (_, simulation) = prepare(&["[[effect]]\nkind = \"test-everything\""]);
    let all = explain::contributions(&simulation).concat();
    let everything = all.iter().find(|what| what.contains("everything")).unwrap();
    for words in ["3 edges", "pairs that depend on the shape", "depends on time"] {
        assert!(everything.contains(words), "{words}: {all:?}");
    }
}

#[test]
fn a_run_leaves_what_it_cost_in_shares_that_add_up() {
    let folder = folder(SMALL);
    passes(folder.path(), "run scene.toml --out result --quiet");
    let costs = Costs::read(&folder.path().join("result")).unwrap();
    let parts = || costs.parts.iter();
    let shares: f64 = parts().map(|part| part.share).sum();
    assert!((shares - 1.0).abs() < 1e-6, "{shares}");
    let effects: Vec<&str> =
        costs.parts.iter().filter(|p| p.group == "effect").map(|p| p.name.as_str()).collect();
    // A pin costs nothing.
    assert_eq!(effects, ["stretching", "bending"]);
    let part =
        |name: &str| parts().find(|part| part.name == name).unwrap_or_else(|| panic!("{name}"));
    assert!(part("bending").seconds > 0.0, "{costs}");
    assert_eq!(part("frames").counts, [("frames".to_owned(), 3)]);
    assert!(part("mean_curvature").seconds >= 0.0);
    assert!(parts().all(|part| part.name != "volume" && part.name != "gaussian_curvature"));
    // The scene is long since explained; this is the run.
    let shown = passes(folder.path(), "explain result");
    assert!(text(&shown.stdout).contains("stretching"), "{}", text(&shown.stdout));
    let json = rumple(folder.path(), &["explain", "result", "--json"]);
    let json: Costs = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json, costs);
    // A second run in its place replaces it.
    let again = ["run", "scene.toml", "--out", "result", "--quiet", "--force"];
    assert!(rumple(folder.path(), &again).status.success());
}

#[test]
fn a_run_that_fails_leaves_what_it_cost() {
    let failing = format!("{SMALL}\n[equilibrium]\nmax_iterations = 1\ntolerance = 1e-18\n");
    let folder = folder(&failing);
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result", "--quiet"]);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    let costs = Costs::read(&folder.path().join("result")).unwrap();
    assert!(costs.parts.iter().any(|part| part.name == "bending" && part.seconds > 0.0));
}

#[test]
fn what_is_not_a_run_is_refused_with_its_name() {
    let folder = folder(SMALL);
    fs::create_dir(folder.path().join("empty")).unwrap();
    let out = rumple(folder.path(), &["explain", "empty"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("costs.json"), "{}", text(&out.stderr));
    fs::write(folder.path().join("empty/costs.json"), "{}").unwrap();
    let out = rumple(folder.path(), &["explain", "empty"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("costs.json"), "{}", text(&out.stderr));
    let out = rumple(folder.path(), &["explain", "scene.toml"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("rumple check scene.toml"), "{}", text(&out.stderr));
}
