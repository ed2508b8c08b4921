//! Polygons: what meshes of them promise, and which outlines are refused.

use std::f64::consts::TAU;

use rumple::sheet::{MeshReport, Sheet, SheetShape, generate};

type Ring = Vec<[f64; 2]>;
/// Name, outline, holes, vertices, whether corners are kept, least and mean quality.
type Case<'a> = (&'a str, Ring, &'a [Ring], usize, bool, [f64; 2]);

fn regular(n: usize, radius: f64, [x, y]: [f64; 2]) -> Ring {
    let angle = |k: usize| TAU * k as f64 / n as f64;
    (0..n).map(|k| [x + radius * angle(k).cos(), y + radius * angle(k).sin()]).collect()
}

fn square(half: f64) -> Ring {
    vec![[-half, -half], [half, -half], [half, half], [-half, half]]
}

/// A leaf of two sines with sharp ends, of many points.
fn leaf() -> Ring {
    let side = |sign: f64| {
        (0..100).map(move |k| {
            let x = f64::from(k) / 10.0;
            [sign * x, sign * 2.0 * (x * TAU / 20.0).sin()]
        })
    };
    side(1.0).chain(side(-1.0).map(|[x, y]| [10.0 + x, y])).collect()
}

fn star(tips: usize, inner: f64) -> Ring {
    let angle = |k: usize| TAU * k as f64 / (2 * tips) as f64;
    let radius = |k: usize| if k.is_multiple_of(2) { 10.0 } else { inner };
    (0..2 * tips).map(|k| [radius(k) * angle(k).cos(), radius(k) * angle(k).sin()]).collect()
}

fn shape(points: &Ring, holes: &[Ring]) -> SheetShape {
    SheetShape::Polygon { points: points.clone(), holes: holes.to_vec() }
}

fn area(ring: &Ring) -> f64 {
    let next = |k: usize| ring[(k + 1) % ring.len()];
    let twice = |k: usize| ring[k][0] * next(k)[1] - next(k)[0] * ring[k][1];
    0.5 * (0..ring.len()).map(twice).sum::<f64>().abs()
}

/// Whether a boundary vertex lies at every corner.
fn has_corners(sheet: &Sheet, ring: &Ring) -> bool {
    ring.iter().all(|[x, y]| {
        sheet
            .rest()
            .iter()
            .zip(sheet.boundary())
            .any(|(p, boundary)| *boundary && p.x == *x && p.y == *y)
    })
}

#[test]
fn meshes_of_polygons_are_good() {
    let ell = vec![[0.0, 0.0], [8.0, 0.0], [8.0, 3.0], [3.0, 3.0], [3.0, 8.0], [0.0, 8.0]];
    let backwards: Ring = ell.iter().rev().copied().collect();
    let closed: Ring = square(5.0).into_iter().chain([[-5.0, -5.0]]).collect();
    let holes = [
        regular(6, 2.0, [0.0, 0.0]),
        square(0.8).iter().map(|[x, y]| [x + 3.5, y - 3.5]).collect(),
    ];
    let cases: [Case; 11] = [
        ("square", square(5.0), &[], 500, true, [0.6, 0.97]),
        ("closed square", closed, &[], 500, true, [0.6, 0.97]),
        ("L", ell.clone(), &[], 800, true, [0.6, 0.97]),
        ("L, clockwise", backwards, &[], 800, true, [0.6, 0.97]),
        ("triangle", regular(3, 8.0, [1e3, -1e3]), &[], 400, true, [0.6, 0.97]),
        ("hexagon", regular(6, 8.0, [0.0, 0.0]), &[], 400, true, [0.6, 0.97]),
        ("circle of 300 points", regular(300, 8.0, [0.0, 0.0]), &[], 600, false, [0.6, 0.97]),
        ("leaf", leaf(), &[], 500, false, [0.55, 0.96]),
        ("star", star(5, 4.0), &[], 2000, true, [0.45, 0.96]),
        ("many tips", star(9, 6.0), &[], 3000, true, [0.45, 0.95]),
        ("two holes", square(5.0), &holes, 1500, true, [0.6, 0.97]),
    ];
    for (name, points, holes, vertices, corners, [least, mean]) in cases {
        for seed in 1..4 {
            let sheet = generate(&shape(&points, holes), vertices, seed);
            let sheet = sheet.unwrap_or_else(|e| panic!("{name}: {e}"));
            let report = MeshReport::new(&sheet);
            let exact = area(&points) - holes.iter().map(area).sum::<f64>();
            println!(
                "{name} {seed}: quality {:.3} {:.3}, edges {:.3} to {:.3}, spanning {}, area off by {:.1e}",
                report.quality.min,
                report.quality.mean,
                report.edge_length.min,
                report.edge_length.max,
                report.all_boundary_triangles,
                report.area / exact - 1.0
            );
            assert_eq!(report.vertices, vertices, "{name}");
            assert_eq!(
                report.euler_characteristic,
                1 - i64::try_from(holes.len()).unwrap(),
                "{name}"
            );
            assert!(report.quality.min >= least && report.quality.mean > mean, "{name}");
            assert!(
                (report.area / exact - 1.0).abs() < if corners { 1e-12 } else { 0.01 },
                "{name}"
            );
            assert!(sheet.triangles().iter().all(|t| {
                let [a, b, c] = t.map(|v| sheet.rest()[v as usize]);
                (b - a).cross(&(c - a)).z > 0.0
            }));
            if corners {
                assert!(
                    has_corners(&sheet, &points)
                        && holes.iter().all(|hole| has_corners(&sheet, hole)),
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn wrong_outlines_are_refused_with_the_place() {
    let bow = vec![[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]];
    let spike = vec![[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [20.0, 9.5], [9.0, 10.0], [0.0, 10.0]];
    let fold = vec![[0.0, 0.0], [9.0, 0.0], [4.0, 0.0], [4.0, 5.0]];
    let twice = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [0.0, 4.0]];
    let hole =
        |half: f64, x: f64| -> Ring { square(half).iter().map(|p| [p[0] + x, p[1]]).collect() };
    for (points, holes, message) in [
        (bow, vec![], "the side of points from (0, 0) to (4, 4) meets side 2 of points"),
        (vec![[0.0, 0.0], [1.0, 0.0]], vec![], "points has 2 points; at least 3 are needed"),
        (vec![[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], vec![], "points has 2 points"),
        (twice, vec![], "points has the point (4, 0) twice in a row"),
        (spike, vec![], "the corner at (20, 9.5) is sharper than 15 degrees"),
        (fold, vec![], "the side of points from (0, 0) to (9, 0) meets side 2 of points"),
        (square(5.0), vec![hole(1.0, 9.0)], "holes[0] lies outside the outline, at (8, -1)"),
        (
            square(5.0),
            vec![hole(1.0, 5.0)],
            "the side of points from (5, -5) to (5, 5) meets side 0 of holes[0]",
        ),
        (square(5.0), vec![hole(2.0, 0.0), hole(1.0, 0.0)], "holes[1] lies inside holes[0]"),
        (square(5.0), vec![hole(1.0, 3.9)], "more vertices"),
        (square(1e200), vec![], "points has the point (-1"),
    ] {
        let error = generate(&shape(&points, &holes), 300, 1).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn outlines_are_read_from_drawings_and_lists() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, text: &str, width| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        rumple::sheet::read::outline(&path, width)
    };
    let ring = "x,y\n0,0\n4,0\n4,2\n0,2\n0,0\n\n1,0.5\n2,0.5\n2,1\n";
    let (outline, holes) = read("a.csv", ring, None).unwrap();
    assert_eq!(outline, [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]]);
    assert_eq!(holes, [vec![[1.0, 0.5], [2.0, 0.5], [2.0, 1.0]]]);
    // A circle of radius 10 around (20, 30), with a square hole; y points up.
    let drawing = "<svg><path d=\"M 30 30 A 10 10 0 1 1 10 30 A 10 10 0 1 1 30 30 Z\"/>\
        <polygon points=\"18,26 22,26 22,28 18,28\"/></svg>";
    let (outline, holes) = read("b.svg", drawing, Some(2.0)).unwrap();
    let far = outline.iter().map(|[x, y]| (x.hypot(*y) - 1.0).abs()).fold(0.0, f64::max);
    assert!(outline.len() > 50 && far < 1e-3, "{} {far}", outline.len());
    let expected = [[-0.2, 0.4], [0.2, 0.4], [0.2, 0.2], [-0.2, 0.2]];
    let near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-3;
    assert!(holes[0].iter().zip(&expected).all(near), "{holes:?}");
    for (name, text, message) in [
        ("c.csv", "0,0\n1\n", "line 2: expected two numbers, found `1`"),
        ("d.csv", "# none\n\n", "no closed ring"),
        ("i.csv", "x,y\n\n0,0\n1,1\n", "the ring of line 3 has 2 points; at least 3 are needed"),
        (
            "j.csv",
            "0,0\n4,0\n4,4\n\n1,2\n9,9\n9,8\n",
            "the ring of line 5 lies outside the outline, at (1, 2); an empty line ends a ring",
        ),
        ("k.svg", "<svg>\n<polyline points=\"0,0 1,0 1,1\"/></svg>", "line 2: <polyline>"),
        (
            "l.svg",
            "<svg>\n<path d=\"M 0 0 L 40 40 L 40 0 L 0 40 Z\"/></svg>",
            "the side of the ring of line 2 from (0, 0) to (40, 40) meets side 2",
        ),
        ("e.csv", "0,0\n1,nan\n2,2\n", "line 2"),
        (
            "f.svg",
            "<svg>\n<g transform=\"scale(2)\"><path d=\"M0 0L1 0L1 1Z\"/></g></svg>",
            "line 2: a transform",
        ),
        ("g.svg", "<svg>\n\n<path d=\"M 0 0 L 1 x\"/></svg>", "line 3: path"),
        ("h.svg", "<svg><circle r=\"3\"/></svg>", "<circle>"),
    ] {
        let error = read(name, text, Some(2.0)).unwrap_err().to_string();
        assert!(error.contains(message) && error.contains(name), "{error}");
    }
}

#[test]
fn a_scene_with_a_wrong_outline_is_refused_at_its_key() {
    let scene = "[sheet]\nshape = \"polygon\"\noutline = \"o.csv\"\nwidth = 2.0\nvertices = 300\n\
        [material]\nyoung = 1.0\npoisson = 0.3\nthickness = 0.1\n[[effect]]\nkind = \"stretching\"\nmodel = \"stvk\"\n\
        [time]\nuntil = 1.0\nintegrator = { kind = \"staggered\", step = 0.1 }\n";
    let folder = crate::run::program::folder(scene);
    for (ring, message, help) in [
        ("0,0\n4,4\n4,0\n0,4\n", "from (0, 0) to (4, 4) meets side 2", false),
        ("0,0\n9,0\n9,9\n20,9.5\n9,10\n0,10\n", "is sharper than 15 degrees", true),
    ] {
        std::fs::write(folder.path().join("o.csv"), ring).unwrap();
        let out = crate::run::program::rumple(folder.path(), &["check", "scene.toml"]);
        let said = crate::run::program::text(&out.stderr);
        assert!(said.contains(message) && said.contains("scene.toml:3"), "{said}");
        assert_eq!(said.contains("places are those of the sheet"), help, "{said}");
    }
}
