//! Keys and their values as they are written.

use rumple::study::plan::Axis;

fn values(text: &str) -> Vec<String> {
    Axis::parse(text).unwrap_or_else(|e| panic!("{e}")).values
}

#[test]
fn lists_and_ranges_give_their_values() {
    let cases: [(&str, &[&str]); 12] = [
        ("a.h=0.5,1,1.5", &["0.5", "1", "1.5"]),
        ("h=1..4", &["1", "2", "3", "4"]),
        ("h=-1..1", &["-1", "0", "1"]),
        ("h=0.1..0.3:3", &["0.1", "0.2", "0.3"]),
        ("h=2..0:3", &["2", "1", "0"]),
        ("h=1..9:5", &["1", "3", "5", "7", "9"]),
        ("h=0.01..10:4:log", &["0.01", "0.1", "1.0", "10.0"]),
        ("h=0,3..5,10", &["0", "3", "4", "5", "10"]),
        ("p=quasi-static, simultaneous", &["quasi-static", "simultaneous"]),
        (
            "i={ kind = \"a\", step = 1 },{ kind = \"b\" }",
            &["{ kind = \"a\", step = 1 }", "{ kind = \"b\" }"],
        ),
        ("f=\"a,b\",'c..d'", &["\"a,b\"", "'c..d'"]),
        ("f=../one.obj,../two.obj", &["../one.obj", "../two.obj"]),
    ];
    for (text, expected) in cases {
        assert_eq!(values(text), expected, "{text}");
    }
}

#[test]
fn logarithmic_ranges_have_equal_ratios() {
    let axis = Axis::parse("k=0.5..200:7:log").unwrap();
    assert!(axis.logarithmic);
    let numbers = axis.numbers().unwrap();
    assert_eq!((numbers.len(), numbers[0], numbers[6]), (7, 0.5, 200.0));
    let ratio = 400f64.powf(1.0 / 6.0);
    for pair in numbers.windows(2) {
        assert!((pair[1] / pair[0] / ratio - 1.0).abs() < 1e-10, "{numbers:?}");
    }
}

#[test]
fn what_is_no_list_is_refused_with_what_is_wrong() {
    let cases = [
        ("h", "KEY=VALUES"),
        ("=1,2", "key is missing"),
        ("h=", "no values"),
        ("h= ", "no values"),
        ("h=1,,2", "value 2"),
        ("h=1,2,", "value 3"),
        ("h=1,2,1.0", "1 and 1.0"),
        ("h=a,b,a", "a is given twice"),
        ("h=1..3,2", "2 is given twice"),
        ("h=1..x", "\"x\" is not a number"),
        ("h=0.5..1.5", "how many"),
        ("h=5..1", "before it begins"),
        ("h=1..2:1", "from 2"),
        ("h=1..2:1.5", "from 2"),
        ("h=1..2:3:lin", "\"lin\""),
        ("h=1..2:3:log:4", "\"4\""),
        ("h=0..2:3:log", "above 0"),
        ("h=1..1:3", "given twice"),
        ("h=1..100000", "more than"),
    ];
    for (text, expected) in cases {
        let error = Axis::parse(text).expect_err(text);
        assert!(error.contains(expected) && error.contains(text), "{text}: {error}");
    }
}
