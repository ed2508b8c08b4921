//! Regions by the arrays of a mesh file, and combinations of regions.

use rumple::effects::Region;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;
use rumple::sheet::{Sheet, Subdomain, read};
use rumple::{Simulation, Vec3};
use serde_json::{Value, json};

use super::fields::written;
use crate::coupled::ranks::ThreadRank;
use crate::sheet::read::data;

fn region(value: Value) -> Region {
    serde_json::from_value(value).unwrap()
}

fn sheet(name: &str) -> Sheet {
    read::surface(data(name)).unwrap().into_sheet().unwrap().0
}

/// For every vertex and for every triangle whether it is in the region.
fn masks(region: &Region, sheet: &Sheet) -> [Vec<bool>; 2] {
    let spec = rumple::effects::Field::Regions {
        default: rumple::num::checked::Finite::ZERO,
        regions: vec![rumple::effects::RegionValue {
            region: region.clone(),
            value: rumple::num::checked::Finite::ONE,
        }],
    };
    let at = |place| {
        let values = spec.on(place, sheet, None, "value");
        let values = values.unwrap_or_else(|e| panic!("{}", e.message));
        let count = match place {
            rumple::kinetics::Location::Vertex => sheet.vertex_count(),
            _ => sheet.triangle_count(),
        };
        (0..count).map(|i| values.at(i) == 1.0).collect::<Vec<_>>()
    };
    let vertices = at(rumple::kinetics::Location::Vertex);
    assert_eq!(vertices, region.mask(sheet));
    [vertices, at(rumple::kinetics::Location::Face)]
}

fn centroids(sheet: &Sheet) -> Vec<Vec3> {
    let of = |t: &[u32; 3]| t.iter().map(|v| sheet.rest()[*v as usize]).sum::<Vec3>() / 3.0;
    sheet.triangles().iter().map(of).collect()
}

/// Halves of a rectangle, by a name with a space and by a number, in every version of the format.
#[test]
fn physical_groups_are_regions() {
    let files = ["22-ascii", "22-binary", "40-ascii", "41-ascii", "41-binary"];
    for name in files.map(|name| format!("groups-{name}.msh")) {
        let sheet = sheet(&name);
        let x = |all: &[Vec3], least: f64, most: f64| -> Vec<bool> {
            all.iter().map(|p| (least..=most).contains(&p.x)).collect()
        };
        for (group, least, most) in [("left half", -2.0, 0.0), ("7", 0.0, 2.0)] {
            let expected = [x(sheet.rest(), least, most), x(&centroids(&sheet), least, most)];
            assert_eq!(masks(&region(json!({ "group": group })), &sheet), expected, "{name}");
        }
        if name.contains("41") {
            let all = masks(&region(json!({ "group": "both" })), &sheet);
            assert!(all.iter().flatten().all(|inside| *inside), "{name}");
        }
    }
}

/// The lower side of the left half, as Gmsh writes a named curve in version 4.1, text and binary, and in version 2.2.
#[test]
fn physical_groups_of_curves_are_regions() {
    let folder = tempfile::tempdir().unwrap();
    let old = folder.path().join("old.msh");
    let text = std::fs::read_to_string(data("groups-22-ascii.msh")).unwrap();
    let lines = "55\n53 1 2 1 1 1 7\n54 1 2 1 1 7 8\n55 1 2 1 1 8 2\n";
    let text = text.replace("$PhysicalNames\n1\n", "$PhysicalNames\n2\n1 1 \"lower side\"\n");
    std::fs::write(&old, text.replace("$Elements\n52\n", &format!("$Elements\n{lines}"))).unwrap();
    for file in [data("groups-41-ascii.msh"), data("groups-41-binary.msh"), old] {
        let surface = read::surface(&file).unwrap();
        assert!(!surface.notes.iter().any(|note| note.contains("ignored")), "{:?}", surface.notes);
        let sheet = surface.into_sheet().unwrap().0;
        let low: Vec<bool> = sheet.rest().iter().map(|x| x.y == -1.0 && x.x <= 0.0).collect();
        assert_eq!(low.iter().filter(|low| **low).count(), 4);
        let corner = |t: &[u32; 3]| t.iter().any(|v| low[*v as usize]);
        let touching = sheet.triangles().iter().map(corner).collect();
        let by_group = masks(&region(json!({ "group": "lower side" })), &sheet);
        assert_eq!(by_group, [low, touching], "{file:?}");
        let array = json!({ "array": { "name": "lower side", "equals": 1 } });
        assert_eq!(masks(&region(array), &sheet), by_group, "{file:?}");
    }
}

#[test]
fn a_name_of_curves_and_surfaces_is_that_of_the_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("same.msh");
    let text = std::fs::read_to_string(data("groups-41-ascii.msh")).unwrap();
    std::fs::write(&file, text.replace("\"lower side\"", "\"both\"")).unwrap();
    let surface = read::surface(&file).unwrap();
    let note = "the physical group `both` of curves is left out: surfaces have that name";
    assert!(surface.notes.iter().any(|known| known == note), "{:?}", surface.notes);
    let sheet = surface.into_sheet().unwrap().0;
    let all = masks(&region(json!({ "group": "both" })), &sheet);
    assert!(all.iter().flatten().all(|inside| *inside));
}

#[test]
fn arrays_on_points_and_cells_are_regions() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = written(folder.path());
    let sheet = read::surface(&file).unwrap().into_sheet().unwrap().0;
    // On triangles e = 1 + t/4, on points h = 1/2 + i/8 and k = 1 + i.
    let corner_of = |inside: &dyn Fn(usize) -> bool| -> Vec<bool> {
        let any = |corners: &[u32; 3]| corners.iter().any(|v| inside(*v as usize));
        sheet.triangles().iter().map(any).collect()
    };
    let [vertices, triangles] =
        masks(&region(json!({ "array": { "name": "e", "between": [1.25, 2] } })), &sheet);
    for (t, inside) in triangles.iter().enumerate() {
        assert_eq!(*inside, (1..=4).contains(&t));
    }
    for (v, inside) in vertices.iter().enumerate() {
        let expected = sheet.vertex_triangles().entries(v).iter().any(|(t, _)| (1..=4).contains(t));
        assert_eq!(*inside, expected);
    }
    for (array, of) in [
        (json!({ "name": "h", "equals": 0.75 }), &(|i: usize| i == 2) as &dyn Fn(usize) -> bool),
        // With its unit left out.
        (json!({ "name": "k", "between": [0, 3] }), &|i| i < 3),
    ] {
        let [vertices, triangles] = masks(&region(json!({ "array": array })), &sheet);
        assert_eq!(vertices, (0..sheet.vertex_count()).map(of).collect::<Vec<_>>());
        assert_eq!(triangles, corner_of(of));
    }
}

#[test]
fn regions_are_combined() {
    let sheet = sheet("groups-41-ascii.msh");
    let ball = json!({ "ball": { "centre": [0, 0, 0], "radius": 1 } });
    let left = json!({ "group": "left half" });
    let nested = json!({ "any-of": [
        { "all-of": [left, { "not": ball }] },
        { "not": { "any-of": [left, { "not": ball }] } },
    ] });
    let place = |all: &[Vec3], left: &[bool]| -> Vec<bool> {
        all.iter().zip(left).map(|(p, left)| *left != (p.norm() <= 1.0)).collect()
    };
    let [v, t] = masks(&region(left), &sheet);
    let expected = [place(sheet.rest(), &v), place(&centroids(&sheet), &t)];
    assert_eq!(masks(&region(nested), &sheet), expected);
    // On the vertices two groups have their interface in common.
    let both = region(
        json!({ "all-of": [{ "group": "left half" }, { "not": { "array": { "name": "left half", "equals": 0 } } }] }),
    );
    let strictly = both.mask(&sheet);
    assert!(sheet.rest().iter().zip(strictly).all(|(p, inside)| inside == (p.x < 0.0)));
}

/// A part of a sheet has the members of the whole, at ghosts without all of their triangles too.
#[test]
fn parts_have_the_members_of_the_whole() {
    let whole = sheet("groups-41-ascii.msh");
    let region = region(json!({ "any-of": [{ "group": "7" }, { "vertices": [0, 3] }] }));
    let of_whole = region.mask(&whole);
    for communicator in ThreadRank::all(4) {
        let part = Subdomain::cut(&whole, communicator).unwrap();
        let expected: Vec<bool> = part.vertices.iter().map(|v| of_whole[*v as usize]).collect();
        assert_eq!(region.mask(&part.sheet), expected);
    }
}

#[test]
fn wrong_arrays_are_refused_with_the_names_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let (_, vtk) = written(folder.path());
    let msh = data("groups-41-ascii.msh");
    let msh = msh.to_str().unwrap();
    let groups = "it has: lower side, left half, 7, both";
    let arrays = "it has: h, k [1/length], e";
    for (file, region, message, help) in [
        (msh, "{ group = \"margin\" }", "the mesh has no physical group `margin`", groups),
        (
            msh,
            "{ not = { group = \"upper side\" } }",
            "the mesh has no physical group `upper side`",
            groups,
        ),
        (
            vtk.as_str(),
            "{ any-of = [\"rim\", { array = { name = \"v\", equals = 1 } }] }",
            "the mesh has no array of one component `v`",
            arrays,
        ),
        (
            &vtk,
            "{ array = { name = \"e\" } }",
            "the array `e` has one of `equals` and `between`",
            "as in { array = { name = \"e\", equals = 1 } }",
        ),
        (
            &vtk,
            "{ array = { name = \"e\", between = [99, 100] } }",
            "no vertex is chosen by this pin",
            "it is where the array `e` is from 99 to 100; the sheet at rest has x from 0 to 2",
        ),
    ] {
        let text = format!(
            "[sheet]\nfile = \"{file}\"\n[material]\nyoung = 1\npoisson = 0\nthickness = 1\n[[effect]]\n\
             kind = \"stretching\"\n[[effect]]\nkind = \"pin\"\naxes = \"z\"\nwhere = {region}\n[time]\nuntil = 1\n"
        );
        let scene = Scene::parse(&text, "s.toml", &[]).unwrap();
        let again = Scene::parse(&scene.resolved().unwrap(), "r.toml", &[]).unwrap();
        assert_eq!(format!("{:?}", again.effects), format!("{:?}", scene.effects));
        let search = PluginSearch::in_directories(Vec::new());
        let Err(rumple::Error::Scene(error)) = Simulation::new(&scene, &search) else {
            panic!("{region}")
        };
        assert_eq!(error.message(), format!("effect[1].where: {message}"));
        assert!(error.advice().unwrap().starts_with(help), "{:?}", error.advice());
    }
}
