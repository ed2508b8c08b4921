//! Statistics over seeds: known answers, and those of a sweep.

use std::fs;

use rumple::study::gather::{MemberResults, MemberStatus, Statistics};
use rumple::study::sweep::{markdown, statistics_csv};

use super::plots::{complete, plan, without};
use super::{GROWING, folder, number, rows, rumple, statuses, text};

#[test]
fn mean_and_sample_standard_deviation_have_known_values() {
    let all = Statistics::new(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]);
    assert_eq!((all.count, all.mean), (8, Some(5.0)));
    assert!((all.deviation.unwrap() - (32.0f64 / 7.0).sqrt()).abs() < 1e-15);
    // A large offset costs no digits.
    let shifted = Statistics::new(&[1e9 + 1.0, 1e9 + 2.0, 1e9 + 3.0]);
    assert_eq!((shifted.mean, shifted.deviation), (Some(1e9 + 2.0), Some(1.0)));
    // Equal values: without round-off.
    let equal = Statistics::new(&[0.1; 3]);
    assert_eq!((equal.mean, equal.deviation), (Some(0.1), Some(0.0)));
    let one = Statistics::new(&[0.1]);
    assert_eq!((one.count, one.mean, one.deviation), (1, Some(0.1), None));
    let none = Statistics { count: 0, mean: None, deviation: None };
    assert_eq!(Statistics::new(&[]), none);
}

#[test]
fn failed_members_and_missing_measures_are_left_out_of_the_statistics() {
    let plan = plan(&["sheet.imperfection.seed=1..3", "a.h=1,2"]);
    let mut members: Vec<MemberResults> = (0..6).map(|k| complete(&plan, k, 1 + k, 0.0)).collect();
    // h = 1: spots 1, 3, 5, of which the last failed on its way. h = 2: spots 2, 4, 6, a separation of two of them.
    members[4].status = MemberStatus::Failed;
    members[3].measures[0].separation = None;
    members[1].totals = vec![("total c".into(), 7.0)];
    let table = statistics_csv(&plan, &members).unwrap();
    let cells: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(
        cells[0][..6],
        ["a.h", "statistic", "failed", "time", "spots", "separation d [length]"]
    );
    assert_eq!(cells[1][..6], ["1", "mean", "1", "2", "2", "3"]);
    assert_eq!(cells[2][..6], ["1", "standard deviation", "1", "0", "1.4142135623730951", "0"]);
    assert_eq!(cells[3][..6], ["1", "n", "1", "2", "2", "2"]);
    assert_eq!(cells[4][..6], ["2", "mean", "0", "2", "4", "3"]);
    assert_eq!(cells[5][..6], ["2", "standard deviation", "0", "0", "2", "0"]);
    assert_eq!(cells[6][..6], ["2", "n", "0", "3", "3", "2"]);
    let total = cells[0].iter().position(|title| *title == "total c").unwrap();
    let totals: Vec<&str> = cells[1..].iter().map(|row| row[total]).collect();
    assert_eq!(totals, ["", "", "0", "7", "", "1"]);
    // Nothing to take statistics of.
    let one = self::plan(&["sheet.seed=1", "a.h=1,2"]);
    let members = [0, 1].map(|k| without(&one, k, MemberStatus::NotBegun));
    assert!(statistics_csv(&one, &members).is_none());
    assert!(!markdown(&one, &members).contains("standard deviation"));
}

#[test]
fn a_sweep_over_seeds_prints_and_writes_statistics() {
    let scene = GROWING.replace("bump = {", "imperfection = { amplitude = 1e-2 }, bump = {");
    let folder = folder(&scene);
    let over = ["--over", "sheet.imperfection.seed=1..3", "--set", "time.until=0.05"];
    let out =
        rumple(folder.path(), &[&["sweep", "scene.toml", "--out", "out"][..], &over].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let root = folder.path().join("out");
    let (table, statistics) = (rows(&root.join("sweep.csv")), rows(&root.join("statistics.csv")));
    assert_eq!(statuses(&table), ["complete"; 3]);
    let names: Vec<&str> = statistics.iter().map(|row| row["statistic"].as_str()).collect();
    assert_eq!(names, ["mean", "standard deviation", "n"]);
    for column in ["time", "spots", "energy [energy]", "amplitude [length]", "total c"] {
        let values: Vec<f64> = table.iter().map(|row| number(row, column)).collect();
        let mean = values.iter().sum::<f64>() / 3.0;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 2.0).sqrt();
        let [found, spread, count] = [0, 1, 2].map(|k| number(&statistics[k], column));
        assert!((found - mean).abs() <= 1e-12 * mean.abs(), "{column}: {found}, {mean}");
        assert!((spread - deviation).abs() <= 1e-9 * deviation + 1e-15, "{column}: {spread}");
        assert_eq!((count, statistics[2]["failed"].as_str()), (3.0, "0"));
    }
    assert!(number(&statistics[1], "energy [energy]") > 0.0, "seeds make a difference");
    // The total is that of the ledger at the end.
    let ledger = rows(&root.join("members").join(&table[0]["member"]).join("ledger.csv"));
    assert_eq!(number(&table[0], "total c"), number(ledger.last().unwrap(), "total c"));
    let page = fs::read_to_string(root.join("sweep.md")).unwrap();
    assert!(page.contains("| standard deviation | 0 "), "{page}");
    assert!(text(&out.stdout).contains(page.trim_end()), "{page}");
}
