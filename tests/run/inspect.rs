//! `inspect` against the same quantities computed here from their definitions.

use rumple::Simulation;
use rumple::run::inspect;
use rumple::sheet::{Array, Surface};
use serde_json::Value;

use super::program::{folder, passes, rumple, text};
use super::{SMALL, prepare};

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn numbers_are_those_of_the_definitions() {
    let (_, mut simulation) =
        prepare(&["[[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 2.0"]);
    simulation.relax().unwrap();
    let result = inspect::inspect(&mut simulation).unwrap();
    let (sheet, state) = (simulation.sheet(), simulation.state());

    // Bonds: lengths, and optimal lengths by the logistic of Model I.
    let c = &state.species[0];
    let modulus = 1e6 * 0.5 / (1.0 - 1.0 / 9.0);
    let (mut stretching, mut checked) = (0.0, 0);
    let length = numbers(&result["bond"]["length"]);
    let optimal = numbers(&result["bond"]["optimal_length"]);
    let heron = |t: u32| {
        let [a, b, c] = sheet.triangle_edges()[t as usize].map(|e| optimal[e as usize]);
        let s = 0.5 * (a + b + c);
        (s * (s - a) * (s - b) * (s - c)).sqrt()
    };
    for (e, edge) in sheet.edges().iter().enumerate() {
        let [a, b] = edge.vertices.map(|v| v as usize);
        let now = (state.x[a] - state.x[b]).norm();
        assert!((now - length[e]).abs() < 1e-14);
        let mean = 0.5 * (c[a] + c[b]);
        let lambda = 0.65 + 0.35 / (1.0 + (20.0 * (mean - 0.1)).exp());
        let rest = (sheet.rest()[a] - sheet.rest()[b]).norm();
        assert!((optimal[e] - rest / lambda).abs() < 1e-12, "{e}");
        let area = heron(edge.triangles[0])
            + if edge.is_boundary() { 0.0 } else { heron(edge.triangles[1]) };
        stretching += 0.5 * modulus * area * (now / optimal[e] - 1.0).powi(2);
        checked += 1;
    }
    assert_eq!(checked, sheet.edges().len());
    let reported = result["energy"]["stretching"].as_f64().unwrap();
    assert!((reported / stretching - 1.0).abs() < 1e-9, "{reported} {stretching}");
    let total = result["energy"]["total"].as_f64().unwrap();
    let bending = result["energy"]["bending"].as_f64().unwrap();
    assert!((total - reported - bending).abs() < 1e-9 * total.abs());

    // Reaction of Model I from the mean curvature; curvature as signal and at vertices agree.
    let h = numbers(&result["mean_curvature"]);
    assert_eq!(numbers(&result["signals"]["mean_curvature"]), h);
    let reaction = numbers(&result["reaction"]["c"]);
    for i in 0..h.len() {
        let up = h[i].max(0.0);
        let expected = 15.0 * up / (1.0 + up / 0.05) - c[i];
        assert!((reaction[i] - expected).abs() < 1e-12);
    }

    // Diffusion neither makes nor loses anything: thirds of the triangle areas.
    let diffusion = numbers(&result["diffusion"]["c"]);
    let mut third = vec![0.0; h.len()];
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| state.x[v as usize]);
        for v in t {
            third[*v as usize] += (b - a).cross(&(c - a)).norm() / 6.0;
        }
    }
    let sum: f64 = diffusion.iter().zip(&third).map(|(d, a)| d * a).sum();
    let size: f64 = diffusion.iter().zip(&third).map(|(d, a)| (d * a).abs()).sum();
    assert!(size > 0.0 && sum.abs() < 1e-12 * size, "{sum:e} of {size:e}");

    // Forces: in equilibrium what is left is fixed by the pins (z on the boundary).
    let force = result["force"]["total"].as_array().unwrap();
    let unit = modulus * simulation.model().mechanics().reference().mean_edge();
    for (i, f) in force.iter().enumerate() {
        let f = numbers(f);
        let free = if simulation.sheet().boundary()[i] { 2 } else { 3 };
        assert!(f[..free].iter().all(|f| f.abs() < 2e-6 * unit), "vertex {i}: {f:?}");
    }
}

/// One area of a vertex in a scene: that of the bending energy, in reports, signals and rates.
#[test]
fn signals_and_rates_go_by_the_areas_of_the_bending_energy() {
    let at = |rule: &str| {
        let (_, mut simulation) = prepare(&[&format!("effect[1].area=\"{rule}\"")]);
        // Off the plane by more than the start, without a relaxation that depends on the rule.
        for x in &mut simulation.state_mut().x {
            x.z = 1e-2 * x.x * x.x + 0.02 * (x.x + 2.0 * x.y).sin();
        }
        let result = inspect::inspect(&mut simulation).unwrap();
        let columns = simulation.evaluate().signals().unwrap().clone();
        assert_eq!(columns[0], numbers(&result["mean_curvature"]), "{rule}");
        (simulation, result)
    };
    let (simulation, thirds) = at("barycentric");
    let (sheet, x) = (simulation.sheet(), &simulation.state().x);
    let mut area = vec![0.0; x.len()];
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| x[v as usize]);
        for v in t {
            area[*v as usize] += (b - a).cross(&(c - a)).norm() / 6.0;
        }
    }
    for (reported, area) in numbers(&thirds["vertex_area"]).iter().zip(&area) {
        assert!((reported / area - 1.0).abs() < 1e-12, "{reported} {area}");
    }
    let (_, frozen) = at("frozen-voronoi");
    let [a, b] = [&thirds, &frozen].map(|r| numbers(&r["reaction"]["c"]));
    let apart = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart > 1e-3, "rates differ by {apart:e} at most");
    // H A is the same vector by any rule.
    let [ha, hb] = [&thirds, &frozen].map(|r| {
        let (h, area) = (numbers(&r["mean_curvature"]), numbers(&r["vertex_area"]));
        h.iter().zip(&area).map(|(h, a)| h * a).collect::<Vec<_>>()
    });
    assert!(ha.iter().zip(&hb).all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn effects_of_the_same_kind_have_names_of_their_own() {
    let load = |z: f64| {
        format!(
            "[[effect]]\nkind = \"load\"\nwhere = \"all\"\nforce = {{ total = [0.0, 0.0, {z}] }}"
        )
    };
    let (_, mut simulation) = prepare(&[&load(1.0), &load(2.0)]);
    let names: Vec<String> = simulation.model().mechanics().names().map(str::to_owned).collect();
    assert_eq!(names, ["stretching", "bending", "load", "load 2"]);
    let result = inspect::inspect(&mut simulation).unwrap();
    let [first, second] = ["load", "load 2"].map(|name| result["energy"][name].as_f64().unwrap());
    assert!(first < 0.0 && (second / first - 2.0).abs() < 1e-12, "{first} {second}");
    let sum: f64 = names.iter().map(|name| result["energy"][name].as_f64().unwrap()).sum();
    assert!((result["energy"]["total"].as_f64().unwrap() / sum - 1.0).abs() < 1e-12);
    assert_eq!(result["force"].as_object().unwrap().len(), names.len() + 1);
}

/// The start of the small scene as a file would give it.
fn surface(simulation: &Simulation) -> Surface {
    let values = simulation.state().species[0].clone();
    Surface {
        points: simulation.state().x.to_vec(),
        triangles: simulation.sheet().triangles().to_vec(),
        point_arrays: vec![Array { name: "c".into(), components: 1, values }],
        ..Surface::default()
    }
}

#[test]
fn a_state_with_other_triangles_is_refused() {
    let (_, mut simulation) = prepare(&[]);
    let right = surface(&simulation);
    inspect::take_state(&mut simulation, &right).unwrap();
    // The same triangles from other corners.
    let mut turned = right.clone();
    turned.triangles.iter_mut().for_each(|t| t.rotate_left(1));
    inspect::take_state(&mut simulation, &turned).unwrap();

    let mut other = right.clone();
    other.triangles.swap(3, 4);
    let error = inspect::take_state(&mut simulation, &other).unwrap_err().to_string();
    assert!(error.contains("triangle 3") && error.contains("another mesh"), "{error}");
    let mut other = right;
    other.triangles.iter_mut().flatten().for_each(|v| *v = 399 - *v);
    let error = inspect::take_state(&mut simulation, &other).unwrap_err().to_string();
    assert!(error.contains("triangle 0"), "{error}");
}

#[test]
fn a_state_that_is_not_finite_is_refused_with_its_vertex() {
    let (_, mut simulation) = prepare(&[]);
    let right = surface(&simulation);
    let before = simulation.state().clone();
    for bad in [f64::NAN, f64::INFINITY] {
        let mut wrong = right.clone();
        wrong.points[7].y = bad;
        let error = inspect::take_state(&mut simulation, &wrong).unwrap_err().to_string();
        assert!(error.contains("vertex 7"), "{error}");
        let mut wrong = right.clone();
        wrong.point_arrays[0].values[11] = bad;
        let error = inspect::take_state(&mut simulation, &wrong).unwrap_err().to_string();
        assert!(error.contains("`c`") && error.contains("vertex 11"), "{error}");
    }
    assert_eq!(simulation.state().x, before.x);
}

/// Finite positions whose energy is not finite are an error, not `null`.
#[test]
fn an_energy_that_is_not_finite_is_an_error() {
    let (_, mut simulation) = prepare(&[]);
    let mut far = surface(&simulation);
    far.points[5].x = 1e300;
    inspect::take_state(&mut simulation, &far).unwrap();
    let error = inspect::inspect(&mut simulation).unwrap_err().to_string();
    assert!(error.contains("not a finite number"), "{error}");
}

#[test]
fn inspect_relax_tells_what_a_run_would_and_how_far_it_came() {
    let load = "[[effect]]\nkind = \"load\"\nwhere = \"all\"\nforce = { total = [0, 0, 1.0] }";
    let folder = folder(&SMALL.replace("# more effects", load));
    let args = ["inspect", "scene.toml", "--relax", "--json", "-"];
    let out = rumple(folder.path(), &args);
    let message = text(&out.stderr);
    assert!(out.status.success(), "{message}");
    assert!(message.contains("equilibrium.tolerance"), "{message}");
    assert!(message.contains("residual") && message.contains("iterations"), "{message}");
    let value: Value = serde_json::from_slice(&out.stdout).unwrap();
    let done = &value["relaxation"];
    assert!(done["residual"].as_f64().unwrap() <= done["tolerance"].as_f64().unwrap(), "{done}");
    assert!(done["iterations"].as_u64().unwrap() > 0, "{done}");
}

/// 266 kB of JSON came on one line.
#[test]
fn inspect_prints_an_overview_and_all_numbers_only_if_asked() {
    let folder = folder(SMALL);
    let out = rumple(folder.path(), &["inspect", "scene.toml"]);
    let said = text(&out.stdout);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(said.len() < 4000 && said.lines().all(|line| line.len() < 100), "{said}");
    let out = rumple(folder.path(), &["inspect", "scene.toml", "--json", "-"]);
    let all: Value = serde_json::from_slice(&out.stdout).unwrap();
    let total = all["energy"]["total"].as_f64().unwrap();
    assert!(said.contains(&format!("{total:.6e}")), "{said}");
    let largest = numbers(&all["mean_curvature"]).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let row = said.lines().find(|line| line.starts_with("mean_curvature ")).unwrap();
    assert!(row.ends_with(&format!("{largest:.6e}")), "{row}");
    for row in [
        "energy stretching",
        "force bending",
        "bond length",
        "species c",
        "reaction c",
        "length_factor",
    ] {
        assert!(said.lines().any(|line| line.starts_with(row)), "{row}: {said}");
    }
}

/// `inspect` took it, and `run --from` failed in its first step, as a solver does.
#[test]
fn a_state_with_a_species_out_of_its_range_is_refused() {
    let directory = folder(SMALL);
    let path = directory.path();
    passes(path, "inspect scene.toml --vtu start.vtu");
    let mut state = rumple::sheet::read::surface(path.join("start.vtu")).unwrap();
    state.point_arrays.iter_mut().find(|a| a.name == "c").unwrap().values[13] = -5.0;
    let (_, mut simulation) = prepare(&[]);
    let error = inspect::take_state(&mut simulation, &state).unwrap_err().to_string();
    assert!(error.contains("species `c` of the state is -5 at vertex 13"), "{error}");
    assert!(error.contains("valid from 0 to"), "{error}");
    let mut text_of = String::from("# vtk DataFile Version 3.0\nstate\nASCII\nDATASET POLYDATA\n");
    text_of += &format!("POINTS {} double\n", state.points.len());
    for x in &state.points {
        text_of += &format!("{} {} {}\n", x.x, x.y, x.z);
    }
    text_of += &format!("POLYGONS {} {}\n", state.triangles.len(), 4 * state.triangles.len());
    for [a, b, c] in &state.triangles {
        text_of += &format!("3 {a} {b} {c}\n");
    }
    text_of +=
        &format!("POINT_DATA {}\nSCALARS c double 1\nLOOKUP_TABLE default\n", state.points.len());
    let c = state.point_arrays.iter().find(|a| a.name == "c").unwrap();
    c.values.iter().for_each(|c| text_of += &format!("{c}\n"));
    std::fs::write(path.join("wrong.vtk"), text_of).unwrap();
    for args in [
        &["inspect", "scene.toml", "--state", "wrong.vtk"][..],
        &["run", "scene.toml", "--from", "wrong.vtk", "--out", "out"],
    ] {
        let out = rumple(path, args);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {}", text(&out.stderr));
        assert!(text(&out.stderr).contains("wrong.vtk: species `c`"), "{}", text(&out.stderr));
    }
    assert!(!path.join("out").exists());
}

/// A ramped load was that of time 0, whatever the time of the frame.
#[test]
fn a_frame_is_inspected_at_its_time() {
    let load = "[[effect]]\nkind = \"load\"\nwhere = \"all\"\nforce = { total = [0, 0, 5.0] }\n\
                ramp = { formula = \"t\" }";
    let folder = folder(&SMALL.replace("# more effects", load));
    let path = folder.path();
    passes(path, "run scene.toml --out out --set time.until=0.02");
    let mut frames: Vec<_> =
        path.join("out/frames").read_dir().unwrap().map(|f| f.unwrap().path()).collect();
    frames.sort();
    let last = frames.last().unwrap();
    let args = ["inspect", "scene.toml", "--json", "-", "--state", last.to_str().unwrap()];
    let out = rumple(path, &args);
    let all: Value = serde_json::from_slice(&out.stdout).unwrap();
    let ledger = std::fs::read_to_string(path.join("out/ledger.csv")).unwrap();
    let mut rows = ledger.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let column = rows.next().unwrap().iter().position(|name| *name == "energy of load [energy]");
    let expected: f64 = rows.next_back().unwrap()[column.unwrap()].parse().unwrap();
    let load = all["energy"]["load"].as_f64().unwrap();
    assert!(expected < -1e-6 && (load / expected - 1.0).abs() < 1e-9, "{load}, {expected}");
}

/// Frames had 0 along pinned axes, where the reactions are.
#[test]
fn the_force_of_a_frame_is_that_of_the_effects_on_pins_too() {
    let load = "[[effect]]\nkind = \"load\"\nwhere = \"all\"\nforce = { total = [0, 0, 5e3] }";
    let keys = ["output.fields=[\"force\"]", "equilibrium.tolerance=1e-8"];
    let (_, mut simulation) = prepare(&[load, keys[0], keys[1]]);
    simulation.relax().unwrap();
    let frame = simulation.frame().unwrap();
    let force = frame.point.iter().find(|f| f.name == "force [force]").unwrap().data.to_vec();
    let all = inspect::inspect(&mut simulation).unwrap();
    let total: Vec<f64> =
        all["force"]["total"].as_array().unwrap().iter().flat_map(numbers).collect();
    let largest = total.iter().fold(0.0, |a: f64, f| a.max(f.abs()));
    assert!(force.iter().zip(&total).all(|(f, t)| (f - t).abs() < 1e-9 * largest));
    // Inner forces cancel: on the pins is all of the load.
    let held: f64 = (0..force.len() / 3)
        .filter(|i| simulation.sheet().boundary()[*i])
        .map(|i| force[3 * i + 2])
        .sum();
    assert!((held / 5e3 - 1.0).abs() < 1e-2, "{held}");
}

/// A constraint is kept by a force too.
#[test]
fn the_force_of_a_frame_has_that_of_constraints() {
    let text = "sheet = { shape = 'sphere', radius = 10.0, vertices = 200 }
        material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.1 }
        effect = [{ kind = 'stretching' }, { kind = 'bending' }, { kind = 'volume', exact = true },
            { kind = 'pin', where = { vertices = [0, 1, 2] }, axes = 'xyz' }]
        time = { until = 1.0 }
        output = { fields = ['force'] }";
    let (_, mut simulation) = crate::common::prepare(text, &[]);
    for x in &mut simulation.state_mut().x {
        *x *= 1.0 + 0.01 * x.z;
    }
    simulation.relax().unwrap();
    let frame = simulation.frame().unwrap();
    let force = frame.point.iter().find(|f| f.name == "force [force]").unwrap().data.to_vec();
    let all = inspect::inspect(&mut simulation).unwrap();
    let kept = all["constraint"].as_object().unwrap().values().next().unwrap();
    let kept: Vec<f64> = kept["force"].as_array().unwrap().iter().flat_map(numbers).collect();
    let total: Vec<f64> =
        all["force"]["total"].as_array().unwrap().iter().flat_map(numbers).collect();
    let largest = |all: &[f64]| all.iter().fold(0.0, |a: f64, f| a.max(f.abs()));
    assert!(largest(&kept) > 0.0);
    let apart: Vec<f64> = force.iter().zip(&total).map(|(f, t)| f - t).collect();
    assert!(largest(&apart) < 1e-9 * largest(&kept), "{apart:?}");
}

/// `--time` gives another.
#[test]
fn the_time_of_a_state_is_that_of_its_frame_or_the_one_asked_for() {
    let load = "[[effect]]\nkind = \"load\"\nwhere = \"all\"\nforce = { total = [0, 0, 5.0] }\n\
                ramp = { formula = \"t\" }";
    let folder = folder(&SMALL.replace("# more effects", load));
    let path = folder.path();
    passes(path, "run scene.toml --out out --set time.until=0.02");
    let inspect = |more: &[&str]| {
        let state = ["inspect", "scene.toml", "--state", "out/frames/frame_000001.vtu"];
        let done = rumple(path, &[&state[..], more].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        text(&done.stdout)
    };
    let said = inspect(&[]);
    assert!(said.starts_with("evaluated at time 0.02, that of the frame\n"), "{said}");
    let said = inspect(&["--time", "3"]);
    assert!(said.starts_with("evaluated at time 3, as --time says\n"), "{said}");
    let energy = |more: &[&str]| {
        let all: Value = serde_json::from_str(&inspect(more)).unwrap();
        (all["time"].as_f64().unwrap(), all["energy"]["load"].as_f64().unwrap())
    };
    let [own, later] = [&["--json", "-"][..], &["--json", "-", "--time", "3"]].map(energy);
    assert_eq!([own.0, later.0], [0.02, 3.0]);
    assert!((later.1 / own.1 - 150.0).abs() < 1e-6, "{own:?} {later:?}");
    let out = rumple(path, &["inspect", "scene.toml", "--time", "nan"]);
    assert_eq!(out.status.code(), Some(2));
    let out = text(&rumple(path, &["inspect", "scene.toml"]).stdout);
    assert!(out.starts_with("evaluated at time 0, that of the start\n"), "{out}");
}
