//! Pictures and plots: what is drawn where.

use rumple::Vec3;
use rumple::output::picture::{Picture, View, sheet};
use rumple::output::plot::{Curve, Figure, Panel};

fn pixel(picture: &mut Picture, column: usize, row: usize) -> [u8; 3] {
    let (width, _) = picture.size();
    let at = 3 * (row * width + column);
    picture.rgb_mut()[at..at + 3].try_into().unwrap()
}

#[test]
fn a_nearer_sheet_hides_a_farther_one() {
    let square = |z: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z))
    };
    let x = [square(0.0), square(0.5)].concat();
    let low = [[0, 1, 2], [0, 2, 3]];
    let high = [[4, 5, 6], [4, 6, 7]];
    let colour = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
    let view = View::of([x.as_slice()].into_iter());
    let draw = |triangles: &[[u32; 3]]| sheet(&x, triangles, &colour, &view, 100);
    // The order of the triangles does not matter, and the upper one is seen: light, not dark.
    let (mut a, mut b) = (draw(&[low, high].concat()), draw(&[high, low].concat()));
    assert_eq!(a, b);
    let [red, green, blue] = pixel(&mut a, 50, 40);
    assert!(red > 120 && green > 120 && blue < 100, "{red} {green} {blue}");
    assert_eq!(pixel(&mut b, 0, 0), [255; 3]);
    let [_, _, blue_below] = pixel(&mut draw(&low), 50, 55);
    assert!(blue_below > 30);
}

#[test]
fn a_picture_is_a_png_of_its_size() {
    let mut whole = Picture::blank(40, 30);
    let mut tile = Picture::blank(10, 10);
    tile.rgb_mut().fill(7);
    whole.place(&tile, 35, 25);
    let bytes = whole.png().unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    assert_eq!((reader.info().width, reader.info().height), (40, 30));
    assert_eq!(pixels.iter().filter(|b| **b == 7).count(), 3 * 5 * 5);
}

#[test]
fn points_that_cannot_be_shown_are_left_out() {
    let points = vec![(0.0, f64::NAN), (1.0, 0.0), (2.0, 1e-3), (3.0, f64::INFINITY), (4.0, 10.0)];
    let panel = |logarithmic, points: &[(f64, f64)]| Panel {
        title: "what".into(),
        across: "time".into(),
        logarithmic,
        curves: vec![Curve { name: 0, points: points.to_vec() }],
        failed: Vec::new(),
        zeros: Vec::new(),
    };
    let figure = Figure {
        guides: 0,
        marks: Vec::new(),
        names: vec!["one & only".into()],
        panels: vec![
            panel((false, true), &points),
            panel((true, true), &[]),
            panel((false, false), &[(1.0, 1.0)]),
        ],
        columns: 2,
    };
    let text = figure.svg().unwrap();
    assert!(text.starts_with("<svg") && text.contains("one &amp; only"), "{text}");
    // Two of the five points of the first panel, one of the last.
    assert_eq!(text.matches("<circle").count(), 3, "{text}");
    assert!(text.contains("nothing to show"));
    let mut picture = figure.picture().unwrap();
    assert!(picture.rgb_mut().iter().any(|b| *b != 255));
}

#[test]
fn lines_to_compare_with_are_grey_and_dashed() {
    let curve = |name, up| Curve { name, points: vec![(1.0, up), (2.0, up)] };
    let figure = |guides| Figure {
        guides,
        marks: Vec::new(),
        names: vec!["measured".into(), "wanted".into()],
        panels: vec![Panel {
            title: "what".into(),
            across: "time".into(),
            logarithmic: (false, false),
            curves: vec![curve(0, 1.0), curve(1, 2.0)],
            failed: Vec::new(),
            zeros: Vec::new(),
        }],
        columns: 1,
    };
    let (both, one) = (figure(0).svg().unwrap(), figure(1).svg().unwrap());
    // A guide has no marks, and many dashes.
    assert_eq!((both.matches("<circle").count(), one.matches("<circle").count()), (4, 2));
    let grey = |text: &str| text.matches("stroke=\"#3C3C3C\"").count();
    assert_eq!(grey(&both), 0);
    assert!(grey(&one) > 10, "{one}");
}

#[test]
fn zeros_lie_at_the_lower_edge_and_only_what_is_drawn_is_in_the_legend() {
    let figure = Figure {
        guides: 1,
        marks: Vec::new(),
        names: vec!["measured".into(), "nowhere".into()],
        panels: vec![Panel {
            title: "error".into(),
            across: "time".into(),
            logarithmic: (true, true),
            curves: vec![Curve { name: 0, points: vec![(1.0, 1e-3), (2.0, 1e-2)] }],
            failed: Vec::new(),
            zeros: vec![(0, 1.0), (0, 3.0)],
        }],
        columns: 1,
    };
    let text = figure.svg().unwrap();
    assert_eq!(text.matches("<polygon").count(), 2, "{text}");
    assert!(text.contains("measured") && !text.contains("nowhere"), "{text}");
    // Their tips are where the axis ends, below every other mark.
    let numbers = |part: &str| -> Vec<f64> {
        part.split([' ', ',']).filter_map(|n| n.parse().ok()).collect()
    };
    let mark = text.split("<polygon").nth(1).unwrap().split("points=\"").nth(1).unwrap();
    let tip = numbers(mark.split('"').next().unwrap()).chunks(2).map(|p| p[1]).fold(0.0, f64::max);
    let circles =
        text.split("cy=\"").skip(1).map(|part| numbers(part.split('"').next().unwrap())[0]);
    assert!(circles.fold(0.0, f64::max) < tip - 5.0, "{text}");
}
