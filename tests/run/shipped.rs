//! Shipped scenes in short runs.

use std::fs;

use rumple::sheet::read;

use super::program::{folder, passes_with};
use crate::common::{path, root};

/// The free leaf under both policies: the margin grows alike, and the shape lags behind its equilibrium under drag.
#[test]
fn the_leaf_is_compared_under_both_policies() {
    let folder = folder("");
    let scene = path("models/plates/leaf.toml");
    let short = ["sheet.vertices=150", "time.until=0.2", "output.every=0.1"];
    let short = short.iter().flat_map(|key| ["--set", key]);
    let policies = ["--policies", "quasi-static,simultaneous", "--out", "out", "--quiet"];
    let args = ["compare", &scene].into_iter().chain(policies).chain(short).collect::<Vec<_>>();
    passes_with(folder.path(), &args);
    let table = fs::read_to_string(folder.path().join("out/compare.csv")).unwrap();
    let mut rows = table.lines().map(|row| row.rsplit_once('"').unwrap_or(("", row)));
    let titles: Vec<&str> = rows.next().unwrap().1.split(',').skip(1).collect();
    let column = |name: &str| titles.iter().position(|title| *title == name).unwrap();
    let rows: Vec<(&str, Vec<f64>)> = rows
        .map(|(name, cells)| {
            let cells = cells.split(',').skip(1);
            (name, cells.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect())
        })
        .collect();
    let last = |policy: &str| {
        let of = rows.iter().rev().find(|(name, _)| name.contains(policy));
        &of.unwrap_or_else(|| panic!("{policy}: {table}")).1
    };
    let (rest, lagging) = (last("quasi-static"), last("simultaneous"));
    assert!(rest[column("time")] == 0.2 && lagging[column("time")] == 0.2, "{table}");
    assert!(lagging[column("species distance")] < 0.02, "{table}");
    let (energy, amplitude) = (column("energy [energy]"), column("amplitude [length]"));
    assert!(lagging[energy] > 1.1 * rest[energy], "{table}");
    assert!(lagging[amplitude] < 0.8 * rest[amplitude], "{table}");
}

/// The petal's groups, combined regions, held values, flux, exchange and one-sided curvatures.
#[test]
fn the_petal_holds_its_foot_and_curls() {
    let folder = folder("");
    let scene = path("models/plates/petal.toml");
    let short = ["--set", "time.until=0.4", "--out", "out", "--quiet"];
    passes_with(folder.path(), &[&["run", &scene], &short[..]].concat());
    let surface = read::surface(folder.path().join("out/frames/frame_000002.vtu")).unwrap();
    let of = |name: &str| &surface.point_array(name).unwrap().values;
    let (u, curvature) = (of("u"), of("mean_curvature"));
    let mesh = root().join("models/plates/petal.msh");
    let (sheet, _) = read::surface(&mesh).and_then(rumple::sheet::Surface::into_sheet).unwrap();
    let at =
        |inside: &dyn Fn(usize) -> bool| (0..u.len()).filter(|v| inside(*v)).collect::<Vec<_>>();
    let foot = at(&|v| sheet.rest()[v].x == 0.0);
    assert_eq!(foot.len(), 11);
    assert!(foot.iter().all(|v| u[*v] == 0.2), "held");
    let mean = |all: &[usize]| all.iter().map(|v| u[*v]).sum::<f64>() / all.len() as f64;
    let inner = |v: usize| !sheet.boundary()[v];
    let tip = at(&|v| sheet.rest()[v].x > 10.0 && inner(v));
    let middle = at(&|v| (3.0..7.0).contains(&sheet.rest()[v].x) && inner(v));
    let margin = at(&|v| (3.0..7.0).contains(&sheet.rest()[v].x) && !inner(v));
    assert!(
        mean(&tip) > mean(&middle) + 0.02,
        "the tip releases it: {} {}",
        mean(&tip),
        mean(&middle)
    );
    assert!(mean(&margin) < mean(&middle) - 0.02, "the margin loses it: {}", mean(&margin));
    assert!(margin.iter().all(|v| curvature[*v] != 0.0), "extrapolated to the boundary");
}
