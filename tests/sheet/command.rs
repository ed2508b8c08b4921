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
    let shape = ["generate", "annulus", "--inner", "2", "--outer", "7"];
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
    let message = mesh(&["generate", "disc", "--radius", "1", "--out", "disc.stl"]).unwrap_err();
    assert!(message.contains("disc.stl") && message.contains(".obj"), "{message}");
    let message = mesh(&["generate", "disc", "--radius", "0"]).unwrap_err();
    assert!(message.contains("radius = 0"), "{message}");
}
