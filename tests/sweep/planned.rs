//! Sweeps that are planned, and whose members are run by themselves.

use super::{GROWING, folder, rows, rumple, statuses, text};

#[test]
fn a_planned_sweep_is_run_member_by_member() {
    let folder = folder(GROWING);
    let root = folder.path().join("it's 100% o\"ut");
    let sweep = |more: &[&str]| {
        let all = ["sweep", "scene.toml", "--out", root.to_str().unwrap(), "--seeds", "5"];
        let out = rumple(folder.path(), &[&all[..], more].concat());
        assert!(out.status.success(), "{}", text(&out.stderr));
        text(&out.stdout)
    };
    assert!(sweep(&["--plan"]).contains("members 0 to 4: rumple sweep member"));
    assert!(!root.join("members").exists(), "nothing runs");
    let member =
        |number: &str| rumple("/".as_ref(), &["sweep", "member", root.to_str().unwrap(), number]);
    for number in ["1", "3", "3"] {
        let out = member(number);
        assert!(out.status.success(), "{}", text(&out.stderr));
    }
    assert_eq!(member("5").status.code(), Some(2));
    // The rest here.
    sweep(&["--quiet"]);
    assert_eq!(statuses(&rows(&root.join("sweep.csv"))), ["complete"; 5]);
}
