//! Tables of problems with known answers: `cargo run --release --example 03_known_answers`

mod known_answers;

use known_answers::*;

/// Runs.
///
/// # Errors
/// None.
pub fn main() -> Outcome<()> {
    let what: Vec<String> = std::env::args().skip(1).collect();
    let m = match what[1].as_str() {
        "bm" => BOND_MEYER,
        "sm" => STVK_MEYER,
        "bh" => BOND_HINGE,
        _ => STVK_HINGE,
    };
    let sizes = what[2..].iter().map(|s| s.parse::<usize>().unwrap());
    for n in sizes {
        let t = std::time::Instant::now();
        match what[0].as_str() {
            "plates" => {
                use plates::*;
                for rim in [Rim::Supported, Rim::Clamped] {
                    let s = buckling(n, rim, &m)?;
                    let d = deflection(n, rim, &m)?;
                    println!("{rim:?} {n} {:.4} {:.4} {:.4}", s.edge, s.error(), d.error());
                }
            }
            "strips" | "height" => {
                use strips::*;
                for ends in [Ends::Pinned, Ends::Clamped] {
                    let s = buckling(n, ends, &m)?;
                    println!("{ends:?} {n} {} {:.4} {:.4}", s.vertices, s.edge, s.error());
                }
                if what[0] == "strips" {continue;}
                for f in [2.0, 4.0] {
                    let s = height(n, f, &m)?;
                    println!("{n} {} {:.4} {:.4}", s.vertices, s.edge, s.error());
                }
            }
            "hencky" => {
                for c in membranes::HENCKY {
                    let s = membranes::hencky(n, c, &m)?;
                    println!("{c:?} {n} {} {:.4} {:.4}", s.vertices, s.edge, s.error());
                }
            }
            "cap" => {
                for h in [0.2, 0.1, 0.05] {
                    let s = growth::cap(n, h, &m)?;
                    println!("{h} {n} {:.4} {:.4}", s.thin.error(), s.edge.error());
                }
            }
            "fold" => {
                for f in [5, 7] {
                    let s = growth::disclination_buckling(f, n, &m)?;
                    println!("{f} {n} {} {:.4} {:.4}", s.vertices, s.computed, s.error());
                }
            }
            "s1" => {
                for s in sze::shear(n, &m)? {
                    println!("{n} {} {:.4} {:.4} {:.4}", s[0].vertices, s[1].computed, s[0].error(), s[1].error());
                }
            }
            _ => {
                for (l, s) in sze::moment(n, 20, &m)? {
                    println!("{n} {} {l} {:.5} {:.5}", s[0].vertices, s[0].computed - s[0].exact, s[1].computed-s[1].exact);
                }
            }
        }
        println!("{:.1?}", t.elapsed());
    }
    Ok(())
}
