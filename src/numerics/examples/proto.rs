//! proto
#![allow(missing_docs, unused, dead_code, clippy::all)]
use rumple_numerics::Vec3;
use rumple_numerics::linear::*;
use std::sync::Arc;
use std::time::Instant;
fn cpu() -> f64 {
    std::fs::read_dir("/proc/self/task")
        .unwrap()
        .map(|t| {
            std::fs::read_to_string(t.unwrap().path().join("schedstat"))
                .unwrap()
                .split(' ')
                .next()
                .unwrap()
                .parse::<f64>()
                .unwrap()
                * 1e-9
        })
        .sum()
}
fn med(mut f: impl FnMut(), n: usize) -> (f64, f64) {
    let mut w = vec![];
    let mut c = vec![];
    for _ in 0..n {
        let t = Instant::now();
        let a = cpu();
        f();
        c.push(cpu() - a);
        w.push(t.elapsed().as_secs_f64());
    }
    w.sort_by(f64::total_cmp);
    c.sort_by(f64::total_cmp);
    (w[0] * 1e3, c[n / 4] * 1e3)
}
fn hash(v: &[Vec3]) -> u64 {
    let mut h = 0u64;
    for x in v {
        for k in 0..3 {
            h = h.rotate_left(5) ^ x[k].to_bits();
            h = h.wrapping_mul(0x9E3779B97F4A7C15);
        }
    }
    h
}
fn run<T: Precision>(name: &str, m: &BlockMatrix, rhs: &[Vec3], old: bool, reps: usize) {
    let t = Instant::now();
    let mut new = BlockCholesky::<T>::new(Arc::clone(m.pattern())).unwrap();
    let s = t.elapsed().as_secs_f64();
    new.factorise(m).unwrap();
    let f = med(
        || {
            new.factorise(m).unwrap();
        },
        reps,
    );
    let mut x = rhs.to_vec();
    let so = med(
        || {
            x.copy_from_slice(rhs);
            new.solve(&mut x);
        },
        reps * 3,
    );
    println!(
        "new {name}: symbolic {:.0} ms, {:.2}M values, factor wall {:.1},  {:.1} cpu ms, solve wall {:.2} cpu {:.2} ms  hash {:x}",
        s * 1e3,
        new.factor_size() as f64 * 1e-6,
        f.0,
        f.1,
        so.0,
        so.1,
        hash(&x)
    );
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let m: usize = a[1].parse().unwrap();
    let threads: usize = a[2].parse().unwrap();
    let old = a.get(3).is_some_and(|s| s == "old");
    let planar = a.iter().any(|s| s == "planar");
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().unwrap();
    // triangular lattice m x m, scrambled
    let n = m * m;
    let mut perm: Vec<usize> = (0..n).collect();
    let mut s = 12345u64;
    let mut rnd = move || {
        s ^= s << 13;
        s ^= s >> 7;
        s ^= s << 17;
        s
    };
    for i in (1..n).rev() {
        let j = (rnd() % (i as u64 + 1)) as usize;
        perm.swap(i, j);
    }
    let mut inv = vec![0; n];
    for (i, &p) in perm.iter().enumerate() {
        inv[p] = i;
    }
    let nb = |v: usize| -> Vec<usize> {
        let p = inv[v];
        let (i, j) = ((p % m) as i64, (p / m) as i64);
        [(1, 0), (-1, 0), (0, 1), (0, -1), (1, -1), (-1, 1)]
            .iter()
            .map(|d| (i + d.0, j + d.1))
            .filter(|q| q.0 >= 0 && q.1 >= 0 && q.0 < m as i64 && q.1 < m as i64)
            .map(|q| perm[(q.0 + q.1 * m as i64) as usize])
            .collect()
    };
    let mut pat = BlockPattern::of_rings(
        n,
        2,
        &|v, f| {
            for j in nb(v) {
                f(j as u32);
            }
        },
        &[],
    );
    if planar {
        pat = pat.in_plane();
    }
    let pat = Arc::new(pat);
    let mut mat = BlockMatrix::zeros(Arc::clone(&pat));
    mat.update_rows(|i, row| {
        let mut d = 0.0;
        for &j in pat.row(i) {
            let j = j as usize;
            if j != i {
                let b = Block::from_fn(|r, c| {
                    -1.0 * ((r == c) as i32 as f64)
                        + 0.05 * (((i * 7 + j * 13 + r * 3 + c * 5) % 17) as f64 / 17.0 - 0.5)
                });
                row.add(j, &b);
            }
        }
        row.add(i, &Block::from_diagonal_element(18.5));
    });
    let rhs: Vec<Vec3> = (0..n)
        .map(|i| {
            Vec3::new(
                (i as f64).sin(),
                (i as f64 * 1.3).cos(),
                if planar { 0.0 } else { (i as f64 * 0.7).sin() },
            )
        })
        .collect();
    let reps: usize = if n > 50000 { 3 } else { 9 };
    run::<f32>("f32", &mat, &rhs, old, reps);
    run::<f64>("f64", &mat, &rhs, old, reps);
}
