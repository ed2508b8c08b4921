//! Lists of pairs and lengths of steps beside those found pair by pair.

use super::*;
use rumple_numerics::num::index;

use crate::Crossings;

/// Numbers from -1 to 1, the same each time.
struct Noise(u64);

impl Noise {
    fn vector(&mut self) -> Vec3 {
        Vec3::from_fn(|_, _| {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            #[allow(clippy::cast_precision_loss)]
            let unit = (self.0 >> 11) as f64 / (1u64 << 53) as f64;
            2.0 * unit - 1.0
        })
    }
}

/// A square of n × n vertices a unit apart, in two halves one above the other, `gap` apart and a little rough.
fn folded(n: u32, gap: f64, roughness: f64) -> (Sheet, Vec<Vec3>) {
    let place = |k: u32| Vec3::new(f64::from(k % n), f64::from(k / n), 0.0);
    let rest: Vec<Vec3> = (0..n * n).map(place).collect();
    let two = |k: u32| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]];
    let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
    let sheet = Sheet::new(rest, cells.flat_map(two).collect()).unwrap();
    let half = 0.5 * f64::from(n - 1);
    let mut noise = Noise(5);
    let fold = |x: &Vec3| {
        let s = x.x - half;
        let r = 0.5 * gap;
        let curve = if s.abs() > std::f64::consts::FRAC_PI_2 * r {
            Vec3::new(std::f64::consts::FRAC_PI_2 * r - s.abs(), 0.0, s.signum() * r)
        } else {
            Vec3::new(r * (s / r).cos(), 0.0, r * (s / r).sin())
        };
        curve + Vec3::new(0.0, x.y, 0.0)
    };
    let x = sheet.rest().iter().map(|x| fold(x) + roughness * noise.vector()).collect();
    (sheet, x)
}

/// All pairs within their reach, one by one.
fn slowly(sheet: &Sheet, x: &[Vec3], range: &Reach) -> Vec<Pair> {
    let mut all = every(sheet, range);
    all.retain(|pair| pair.kind.distance(&corner_positions(x, &pair.corners)) < pair.reach);
    all
}

/// All pairs there are.
fn every(sheet: &Sheet, range: &Reach) -> Vec<Pair> {
    let mut all = Vec::new();
    let mut offer = |kind: PairKind, features: [u32; 2], corners: [u32; 4]| {
        all.push(Pair { kind, features, corners, reach: reach(kind, sheet, &corners, range) });
    };
    for v in 0..index(sheet.vertex_count()) {
        for (t, &[a, b, c]) in sheet.triangles().iter().enumerate() {
            if ![a, b, c].contains(&v) {
                offer(PairKind::PointTriangle, [v, index(t)], [v, a, b, c]);
            }
        }
    }
    for (e, one) in sheet.edges().iter().enumerate() {
        for (f, other) in sheet.edges().iter().enumerate().skip(e + 1) {
            let ([a, b], [c, d]) = (one.vertices, other.vertices);
            if ![c, d].contains(&a) && ![c, d].contains(&b) {
                offer(PairKind::EdgeEdge, [index(e), index(f)], [a, b, c, d]);
            }
        }
    }
    all
}

/// The largest share of a step, pair by pair.
fn slow_step(sheet: &Sheet, x: &[Vec3], direction: &[Vec3]) -> f64 {
    let free = |pair: &Pair| {
        let from = corner_positions(x, &pair.corners);
        let least = MIN_DISTANCE_SHARE * pair.reach.min(pair.kind.distance(&from));
        pair.kind.free_share(&from, &corner_positions(direction, &pair.corners), least)
    };
    every(sheet, &RANGE).iter().map(free).fold(1.0, f64::min)
}

const RANGE: Reach = Reach { points: 0.6, edges: 0.3, shrinkage: 1.0 };

fn within(proximity: &mut Proximity, sheet: &Sheet, x: &[Vec3]) -> Vec<Pair> {
    let (points, edges) = proximity.near(sheet, x, &RANGE);
    let all = points.iter().chain(edges);
    all.filter(|pair| pair.kind.distance(&corner_positions(x, &pair.corners)) < pair.reach)
        .copied()
        .collect()
}

#[test]
fn all_pairs_within_reach_are_listed_also_when_the_shape_has_moved() {
    for (gap, roughness) in [(0.55, 0.02), (0.35, 0.1), (0.25, 0.0)] {
        let (sheet, mut x) = folded(12, gap, roughness);
        let mut proximity = Proximity::new(&sheet, 1.0, 0.6);
        let mut noise = Noise(3);
        for round in 0..12 {
            let (found, wanted) = (within(&mut proximity, &sheet, &x), slowly(&sheet, &x, &RANGE));
            assert!(wanted.len() > 50, "{gap}: {}", wanted.len());
            assert_eq!(found, wanted, "gap {gap}, round {round}");
            x.iter_mut().for_each(|x| *x += 0.03 * noise.vector());
        }
    }
}

/// The square of n × n vertices without a notch at one side, over which `rest` lies.
fn notched(n: u32, rest: &dyn Fn(f64, f64) -> Vec3) -> Sheet {
    let place = |k: u32| rest(f64::from(k % n), f64::from(k / n));
    let two = |k: u32| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]];
    let notch = |i: u32, j: u32| i < n / 3 && (j == n / 2 || j == n / 2 + 1);
    let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| (i, j)));
    let cells = cells.filter(|(i, j)| !notch(*i, *j)).map(|(i, j)| j * n + i);
    Sheet::new((0..n * n).map(place).collect(), cells.flat_map(two).collect()).unwrap()
}

#[test]
fn bent_sheets_have_all_their_pairs_whatever_their_patches_keep_apart() {
    const N: u32 = 20;
    let flat = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let cap = |x: f64, y: f64| Vec3::new(x, y, 0.02 * ((x - 9.5).powi(2) + (y - 9.0).powi(2)));
    let roll = |r: f64| {
        move |x: &Vec3| {
            let (sin, cos) = (x.x / r).sin_cos();
            Vec3::new((r - x.z) * sin, x.y, r - (r - x.z) * cos)
        }
    };
    let wave = |a: f64| move |x: &Vec3| Vec3::new(0.5 * x.x, x.y, x.z + a * (0.9 * x.x).sin());
    let press = |by: f64| move |x: &Vec3| Vec3::new(x.x, by * x.y, by * x.z);
    let (gentle, tight, waves, pressed) = (roll(9.0), roll(2.6), wave(2.5), press(0.3));
    let turns: [&dyn Fn(&Vec3) -> Vec3; 4] = [&gentle, &tight, &waves, &pressed];
    let (mut apart, mut near, mut shortened) = (0, 0, 0);
    for rest in [&flat as &dyn Fn(f64, f64) -> Vec3, &cap] {
        let sheet = notched(N, rest);
        for turn in turns {
            let mut proximity = Proximity::new(&sheet, 1.0, RANGE.points);
            let mut noise = Noise(7);
            for round in 0..=5 {
                let share = f64::from(round) / 5.0;
                let bent = |x: &Vec3| x + share * (turn(x) - x) + 0.03 * noise.vector();
                let x: Vec<Vec3> = sheet.rest().iter().map(bent).collect();
                let wanted = slowly(&sheet, &x, &RANGE);
                assert_eq!(within(&mut proximity, &sheet, &x), wanted, "{round}");
                let bounds = &proximity.list.as_ref().unwrap().bounds;
                apart += bounds.iter().filter(|b| b.is_some_and(|b| b.holds)).count();
                near += wanted.len();
                if round % 3 == 0 {
                    let step = |x: &Vec3| 0.4 * (turn(x) - x) + 0.1 * noise.vector();
                    let step: Vec<Vec3> = sheet.rest().iter().map(step).collect();
                    let found = proximity.largest_step(&sheet, (&x, &step), &RANGE);
                    assert_eq!(found, slow_step(&sheet, &x, &step), "{round}");
                    shortened += usize::from(found < 1.0);
                }
            }
        }
    }
    assert!(
        apart > 200 && near > 1000 && shortened > 1,
        "{apart} patches keep their points apart; {near} pairs; {shortened} steps"
    );
}

#[test]
fn a_flat_sheet_has_no_pairs_and_its_list_is_empty() {
    let (sheet, _) = folded(12, 0.5, 0.0);
    let mut proximity = Proximity::new(&sheet, 1.0, 0.6);
    let (points, edges) = proximity.near(&sheet, sheet.rest(), &RANGE);
    assert_eq!((points.len(), edges.len()), (0, 0));
}

#[test]
fn nothing_is_near_on_a_sheet_that_bends_gently_and_something_where_it_touches_or_crosses() {
    let (sheet, folded) = folded(16, 0.5, 0.0);
    let roll = |r: f64| {
        let at = |x: &Vec3| Vec3::new(r * (x.x / r).sin(), x.y, r * (1.0 - (x.x / r).cos()));
        sheet.rest().iter().map(at).collect::<Vec<Vec3>>()
    };
    // Rolled tightly it goes round more than once.
    let shapes = [(roll(40.0), false), (roll(12.0), false), (folded, true), (roll(1.9), true)];
    for (k, (x, touches)) in shapes.iter().enumerate() {
        let pairs = slowly(&sheet, x, &RANGE).len() + Crossings::new(&sheet).find(&sheet, x).pairs;
        assert_eq!(pairs > 0, *touches, "{k}");
        let mut proximity = Proximity::new(&sheet, 1.0, RANGE.points);
        assert_eq!(proximity.any_near(&sheet, x, &RANGE), *touches, "{k}");
    }
}

#[test]
fn no_step_crosses_and_its_share_does_not_depend_on_the_list() {
    let mut shortened = 0;
    for seed in 0..40 {
        let (sheet, x) = folded(8, 0.4, 0.1);
        let mut noise = Noise(seed);
        // Short steps, for which a list serves, and long ones.
        let size = if seed % 2 == 0 { 0.08 } else { 1.5 };
        let direction: Vec<Vec3> = x.iter().map(|_| size * noise.vector()).collect();
        let mut fresh = Proximity::new(&sheet, 1.0, 0.6);
        let share = fresh.largest_step(&sheet, (&x, &direction), &RANGE);
        let mut listed = Proximity::new(&sheet, 1.0, 0.6);
        let before: Vec<Vec3> = x.iter().map(|x| x + 0.02 * noise.vector()).collect();
        let _ = listed.near(&sheet, &before, &RANGE);
        assert_eq!(share, listed.largest_step(&sheet, (&x, &direction), &RANGE), "{seed}");
        assert_eq!(share, slow_step(&sheet, &x, &direction), "{seed}");
        assert!(share > 0.0, "{seed}");
        shortened += usize::from(share < 1.0);
        let mut crossings = Crossings::new(&sheet);
        assert_eq!(crossings.find(&sheet, &x).pairs, 0, "the start crosses itself");
        for part in [0.25, 0.5, 0.75, 1.0] {
            let next: Vec<Vec3> =
                x.iter().zip(&direction).map(|(x, d)| x + part * share * d).collect();
            assert_eq!(crossings.find(&sheet, &next).pairs, 0, "{seed}: {share}, {part}");
        }
    }
    assert!(shortened >= 20, "{shortened}");
}

#[test]
fn a_list_that_serves_at_both_ends_of_a_step_serves_on_the_way_and_nowhere_beside_it() {
    let (mut passed, mut near) = (0, 0);
    for seed in 0..20 {
        let (sheet, x) = folded(8, 0.4, 0.05);
        let mut noise = Noise(seed);
        let step: Vec<Vec3> = x.iter().map(|_| 0.02 * noise.vector()).collect();
        let mut proximity = Proximity::new(&sheet, 1.0, 0.6);
        let share = proximity.largest_step(&sheet, (&x, &step), &RANGE);
        // Nothing but the way from x tells it about these shapes.
        for part in [1.0, 0.5, 0.25, 0.125] {
            let on: Vec<Vec3> = x.iter().zip(&step).map(|(x, d)| x + part * share * d).collect();
            let wanted = slowly(&sheet, &on, &RANGE);
            passed += usize::from(proximity.list.as_ref().unwrap().is_on_last_step(&on));
            near += wanted.len();
            assert_eq!(within(&mut proximity, &sheet, &on), wanted, "{seed}: {part}");
        }
        let mut beside = x;
        beside[3] += 0.01 * noise.vector();
        assert!(!proximity.list.as_ref().unwrap().is_on_last_step(&beside), "{seed}");
    }
    assert!(passed > 20 && near > 100, "{passed} shapes on the way, {near} pairs");
}

#[test]
fn long_steps_apart_are_not_shortened() {
    let (sheet, x) = folded(8, 0.4, 0.02);
    let mut proximity = Proximity::new(&sheet, 1.0, 0.6);
    let away: Vec<Vec3> = x.iter().map(|x| Vec3::new(0.0, 0.0, 20.0 * x.z)).collect();
    assert_eq!(proximity.largest_step(&sheet, (&x, &away), &RANGE), 1.0);
    let along = vec![Vec3::new(100.0, 3.0, -7.0); x.len()];
    assert_eq!(proximity.largest_step(&sheet, (&x, &along), &RANGE), 1.0);
}
