//! Runs of sheets that bending leaves at rest where they are curved.

use std::fs;
use std::path::Path;

use rumple::Vec3;
use rumple::sheet::write::MeshFormat;
use rumple::sheet::{Sheet, SheetShape, generate, write};

use super::program::{folder, passes, passes_with, rumple, text};
use super::resumed::{assert_same, checkpoints, stopped};

const SCENE: &str = "
sheet.file = 'cap.obj'
material = { young = 1e3, poisson = 0.3, thickness = 0.3, drag = 10.0 }
effect = [
    { kind = 'stretching', model = 'stvk' },
    { kind = 'bending', rest = { state = 'flatter.obj' }, curvature = '0.02*z' },
]
output.every = 0.1
checkpoint = { every = 0.05, keep = 100 }
[time]
until = 0.3
[kinetics]
rates.c = '0.3 - c'
length_factor = '1 + 0.1*c'
initial.c = 0.1
";

fn written(sheet: &Sheet, to: &Path) {
    write::mesh(sheet, MeshFormat::Obj, &mut fs::File::create(to).unwrap()).unwrap();
}

/// The mesh of the scene, and the same with half of its height.
fn meshes(folder: &Path) {
    let cap = generate(&SheetShape::Cap { radius: 5.0, height: 2.0 }, 150, 1).unwrap();
    written(&cap, &folder.join("cap.obj"));
    let lower = cap.rest().iter().map(|x| Vec3::new(x.x, x.y, 0.5 * x.z)).collect();
    let lower = Sheet::new(lower, cap.triangles().to_vec()).unwrap();
    written(&lower, &folder.join("flatter.obj"));
}

#[test]
fn rest_shapes_go_on_with_the_same_bits_under_every_policy() {
    for keys in [
        &["time.policy=\"quasi-static\""][..],
        &[
            "time.policy=\"quasi-static\"",
            "effect.bending.model=hinge",
            "kinetics.curvature=\"0.1*c^2\"",
        ],
        &["time.policy=\"chemistry-fast\""],
        &["time.policy=\"simultaneous\""],
        &[
            "time.policy=\"simultaneous\"",
            "kinetics.curvature=\"0.1*c^2\"",
            "time.integrator={ kind = \"monolithic\", rtol = 1e-3, atol = 1e-3 }",
        ],
    ] {
        let folder = folder(SCENE);
        meshes(folder.path());
        let mut args = vec!["run", "scene.toml", "--out", "whole", "--quiet"];
        args.extend(keys.iter().flat_map(|key| ["--set", *key]));
        passes_with(folder.path(), &args);
        let (whole, part) = (folder.path().join("whole"), folder.path().join("part"));
        let count = checkpoints(&whole).len();
        assert!(count > 1, "{keys:?}");
        stopped(&whole, &part, (count - 1) / 2);
        passes(folder.path(), "resume part --quiet");
        assert_same(&whole, &part, &format!("{keys:?}"));
    }
}

/// What a checkpoint was made from includes the rest shape.
#[test]
fn a_run_is_not_continued_with_another_rest_shape() {
    let folder = folder(SCENE);
    meshes(folder.path());
    passes(folder.path(), "run scene.toml --out whole --quiet");
    let part = folder.path().join("part");
    stopped(&folder.path().join("whole"), &part, 0);
    fs::copy(folder.path().join("cap.obj"), folder.path().join("flatter.obj")).unwrap();
    let out = rumple(folder.path(), &["resume", "part", "--quiet"]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("flatter.obj"), "{}", text(&out.stderr));
}

/// Nor with another thickness: the files of the material belong to it as well.
#[test]
fn a_run_is_not_continued_with_another_thickness() {
    let folder = folder(
        "sheet.file = 'mesh.vtk'
         material = { young = 1e3, poisson = 0.3, thickness = { file = 'mesh-h.vtk', array = 'h' } }
         effect = [{ kind = 'stretching' }, { kind = 'pin', where = 'rim', axes = 'z' }]
         checkpoint = { every = 0.05, keep = 100 }
         kinetics = { rates.c = '0.3 - c', length_factor = '1 + 0.1*c', initial.c = 0.1 }
         time.until = 0.2",
    );
    let (_, mesh) = crate::scene::fields::written(folder.path());
    let thickness = folder.path().join("mesh-h.vtk");
    fs::copy(&mesh, &thickness).unwrap();
    passes(folder.path(), "run scene.toml --out whole --quiet");
    let part = folder.path().join("part");
    stopped(&folder.path().join("whole"), &part, 0);
    let other = fs::read_to_string(&thickness).unwrap().replace("0.625", "0.75");
    fs::write(&thickness, other).unwrap();
    let out = rumple(folder.path(), &["resume", "part", "--quiet"]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("mesh-h.vtk"), "{}", text(&out.stderr));
}

/// Without loads a shell at rest stays where it is.
#[test]
fn a_shell_at_rest_stays_and_is_told_to_be_free_of_stress() {
    let folder = folder(
        "sheet.file = 'cap.obj'
         material = { young = 1e3, poisson = 0.3, thickness = 0.3 }
         effect = [{ kind = 'stretching' }, { kind = 'bending', rest = 'mesh' }]
         time.until = 1.0",
    );
    meshes(folder.path());
    let out = passes(folder.path(), "check scene.toml");
    assert!(!text(&out.stdout).contains("not free of stress"), "{}", text(&out.stdout));
    let out = rumple(folder.path(), &["check", "scene.toml", "--set", "effect.bending.rest=flat"]);
    assert!(text(&out.stdout).contains("bending.rest = \"mesh\""), "{}", text(&out.stdout));
}
