//! The command `mesh`.

use clap::Parser;
use rumple::cli::mesh::{MeshArgs, run};
use rumple::sheet::read;

#[derive(Parser)]
struct App {
    #[command(flatten)]
    mesh: MeshArgs,
}

fn mesh(arguments: &[&str]) -> Result<(), String> {
    let all = std::iter::once("mesh").chain(arguments.iter().copied());
    let app = App::try_parse_from(all).map_err(|e| e.to_string())?;
    run(&app.mesh).map_err(|e| e.to_string())
}

#[test]
fn a_mesh_is_generated_checked_and_described() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ring.obj");
    let name = file.to_str().unwrap();
    let shape = ["generate", "annulus", "inner=2", "outer=7"];
    mesh(&[&shape[..], &["--vertices", "700", "--seed", "3", "--out", name]].concat()).unwrap();
    assert_eq!(read::surface(&file).unwrap().points.len(), 700);
    for command in ["check", "info"] {
        mesh(&[command, name]).unwrap();
        mesh(&["--json", command, name]).unwrap();
    }
}

#[test]
fn unusable_meshes_and_wishes_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("loose.obj");
    std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n").unwrap();
    let name = file.to_str().unwrap();
    let message = mesh(&["check", name]).unwrap_err();
    assert!(message.contains("loose.obj: the mesh is unusable; the kind of fault"), "{message}");
    let message = mesh(&["info", name]).unwrap_err();
    assert!(message.contains("vertex 3 (line 4)"), "{message}");
    let message = mesh(&["generate", "disc", "radius=1", "--out", "disc.stl"]).unwrap_err();
    assert!(message.contains("disc.stl") && message.contains(".obj"), "{message}");
    let message = mesh(&["generate", "disc", "radius=0"]).unwrap_err();
    assert!(message.contains("sheet.radius=0"), "{message}");
}

#[test]
fn a_graph_is_generated_from_its_formula() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("saddle.obj");
    let shape = ["generate", "graph", "width=4", "height=4", "--vertices", "500"];
    let name = file.to_str().unwrap();
    mesh(&[&shape[..], &["z=-0.2*x*y", "--out", name]].concat()).unwrap();
    let surface = read::surface(&file).unwrap();
    assert!(surface.points.iter().all(|p| (p.z + 0.2 * p.x * p.y).abs() < 1e-15));
    let message = mesh(&[&shape[..], &["z=0.2*w"]].concat()).unwrap_err();
    assert!(message.contains("0.2*w") && message.contains("unknown name"), "{message}");
    let ellipsoid = ["generate", "ellipsoid", "--vertices", "500"];
    mesh(&[&ellipsoid[..], &["semi_axes=[1.5,1.2,1]"]].concat()).unwrap();
    let message = mesh(&[&ellipsoid[..], &["semi_axes=[1.5,1.2]"]].concat()).unwrap_err();
    assert!(message.contains("semi_axes"), "{message}");
}
