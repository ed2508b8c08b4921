//! Tables of problems whose answers are known, which `docs/book/verification/` sums up:
//!
//! `cargo run --release --example 03_known_answers`
//!
//! takes some minutes. With a name (`plates`, `strips`, `membranes`, `growth`, `cantilevers`, `shells`, `contact`,
//! `chemistry`, `branches`, `remodelling`, `steady`, `active`) only these.

mod known_answers;

use known_answers::chemistry::{CARRIED, FINE};
use known_answers::plates::Boundary;
use known_answers::strips::Ends;
use known_answers::{
    BOND_HINGE, BOND_MEYER, Outcome, STVK_HINGE, STVK_MEYER, Sample, active, annulus, bilayer,
    branches, caps, chemistry, contact, growth, membranes, plates, remodelling, shells, squeezed,
    steady, strips, sze,
};

/// Prints the tables.
///
/// # Errors
/// None is expected.
fn main() -> Outcome<()> {
    let only = std::env::args().nth(1);
    let wanted = |name: &str| only.as_deref().is_none_or(|o| o == name);
    if wanted("plates") {
        plate_tables()?;
    }
    if wanted("strips") {
        strip_tables()?;
    }
    if wanted("membranes") {
        membrane_tables()?;
    }
    if wanted("growth") {
        growth_tables()?;
    }
    if wanted("cantilevers") {
        cantilever_tables()?;
    }
    if wanted("shells") {
        shell_tables()?;
    }
    if wanted("contact") {
        contact_tables()?;
    }
    if wanted("chemistry") {
        chemistry_tables()?;
    }
    if wanted("branches") {
        branch_tables()?;
    }
    if wanted("remodelling") {
        remodelling_tables()?;
    }
    if wanted("steady") {
        steady_tables()?;
    }
    if wanted("active") {
        active_tables()?;
    }
    Ok(())
}

/// One problem over several meshes.
fn table(title: &str, samples: &[Sample]) {
    println!("\n**{title}**\n");
    println!("| vertices | edge | computed | exact | error | order |");
    println!("| ---: | ---: | ---: | ---: | ---: | ---: |");
    for (k, s) in samples.iter().enumerate() {
        let order = match k {
            0 => String::new(),
            _ => format!("{:.1}", s.order(&samples[k - 1])),
        };
        println!(
            "| {} | {:.4} | {:.5e} | {:.5e} | {:+.2} % | {order} |",
            s.vertices,
            s.edge,
            s.computed,
            s.exact,
            100.0 * s.error()
        );
    }
}

fn over(sizes: &[usize], solve: impl Fn(usize) -> Outcome<Sample>) -> Outcome<Vec<Sample>> {
    sizes.iter().map(|&n| solve(n)).collect()
}

fn remodelling_tables() -> Outcome<()> {
    println!("\n## V1 to V4: strips that flow");
    for models in [BOND_HINGE, STVK_HINGE] {
        for strain in [1e-4, 1e-2, 1e-1] {
            let by = ("quasi-static", remodelling::FINE);
            let samples =
                over(&[150, 600], |n| remodelling::relaxed(n, models.stretching, strain, by))?;
            table(&format!("V1 tension left after τ, ε = {strain}, {}", models.name), &samples);
        }
        let samples = over(&[150, 600, 2400], |n| remodelling::creep(n, models.stretching, 1e-4))?;
        table(&format!("V2 speed of creep, {}", models.name), &samples);
    }
    for (what, threshold) in [("no yield curvature", None), ("yield curvature 0.4 κ", Some(0.04))]
    {
        let samples = over(&[3, 6, 12], |n| remodelling::bent(n, threshold))?;
        table(&format!("V3 curvature left, {what}"), &samples);
    }
    let samples = over(&[150, 600], |n| remodelling::below_yield(n, STVK_HINGE.stretching, 1.5))?;
    table("V4 tension left below the yield strain", &samples);
    Ok(())
}

fn active_tables() -> Outcome<()> {
    println!("\n## A1, A2: a ring that pulls itself together");
    let samples = over(&[400, 1600, 6400], |n| active::ring(n, ("quasi-static", active::FINE)))?;
    table("A1 displacement of the outer boundary", &samples);
    table("A2 displacement of the outer boundary", &over(&[400, 1600], active::followed)?);
    Ok(())
}

fn plate_tables() -> Outcome<()> {
    println!("\n## B1, B5: circular plates");
    let sizes = [200, 800, 3200];
    for models in [BOND_MEYER, STVK_MEYER, STVK_HINGE] {
        for boundary in [Boundary::Supported, Boundary::Clamped] {
            let title = |what: &str| {
                format!("{what}, {boundary:?} boundary, {}", models.name).to_lowercase()
            };
            let samples = over(&sizes, |n| plates::buckling(n, boundary, &models))?;
            table(&title("B1 critical expansion"), &samples);
            let samples = over(&sizes, |n| plates::deflection(n, boundary, &models))?;
            table(&title("B5 deflection"), &samples);
        }
    }
    Ok(())
}

fn strip_tables() -> Outcome<()> {
    println!("\n## B3: Euler's strip");
    for models in [BOND_MEYER, STVK_MEYER, STVK_HINGE] {
        for (ends, rows) in [(Ends::Pinned, [4, 6, 8, 12]), (Ends::Clamped, [5, 7, 9, 13])] {
            let samples = over(&rows, |n| strips::buckling(n, ends, &models))?;
            let title = format!("critical expansion, {ends:?} ends, {}", models.name);
            table(&title.to_lowercase(), &samples);
        }
        for load in [2.0, 4.0] {
            let samples = over(&[4, 6, 8, 12], |n| strips::height(n, load, &models))?;
            table(&format!("height at {load} ε_cr, pinned ends, {}", models.name), &samples);
        }
    }
    for models in [BOND_MEYER, STVK_MEYER, STVK_HINGE] {
        let samples = over(&[4, 6, 8, 12], |n| strips::step(n, &models))?;
        table(&format!("deflection with a step in thickness, {}", models.name), &samples);
    }
    Ok(())
}

fn membrane_tables() -> Outcome<()> {
    println!("\n## B7: Hencky's membrane");
    let sizes = [200, 800, 3200];
    for case in membranes::HENCKY {
        let samples = over(&sizes, |n| membranes::hencky(n, case, &STVK_MEYER))?;
        table(&format!("height, stvk, ν = {:.4}", case.0), &samples);
    }
    let samples = over(&sizes, |n| membranes::hencky(n, membranes::HENCKY[2], &BOND_MEYER))?;
    table("height, bond, ν = 1/3", &samples);
    Ok(())
}

fn growth_tables() -> Outcome<()> {
    println!("\n## F2: growth to a spherical cap");
    for models in [BOND_MEYER, STVK_HINGE] {
        println!("\n**height, {}**\n", models.name);
        println!("| h | vertices | computed | thin limit | error | with free edge | error |");
        println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
        for thickness in [0.2, 0.1, 0.05] {
            for vertices in [400, 1600] {
                let cap = growth::cap(vertices, thickness, &models)?;
                println!(
                    "| {thickness} | {vertices} | {:.4} | {:.4} | {:+.2} % | {:.4} | {:+.2} % |",
                    cap.thin.computed,
                    cap.thin.exact,
                    100.0 * cap.thin.error(),
                    cap.edge.exact,
                    100.0 * cap.edge.error()
                );
            }
        }
    }
    println!("\n## F3: growth along the radius to a cone");
    for models in [BOND_MEYER, STVK_HINGE] {
        println!("\n**slope at λ = 1.1, {}**\n", models.name);
        println!("| h | vertices | computed | √(λ² - 1) | error |");
        println!("| ---: | ---: | ---: | ---: | ---: |");
        for thickness in [0.2, 0.1, 0.05] {
            for vertices in [400, 1600] {
                let Sample { computed, exact, .. } =
                    growth::cone(vertices, thickness, 1.1, &models)?;
                let error = 100.0 * (computed / exact - 1.0);
                println!(
                    "| {thickness} | {vertices} | {computed:.4} | {exact:.4} | {error:+.2} % |"
                );
            }
        }
    }
    println!("\n## F5: disclinations");
    for models in [BOND_HINGE, BOND_MEYER] {
        println!("\n**critical Y R²/B, {}**\n", models.name);
        println!("| fold | 5 edges | 10 edges | 20 edges | order | limit | Seung & Nelson |");
        println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
        for fold in [5, 7] {
            let found = over(&[5, 10, 20], |n| growth::disclination_buckling(fold, n, &models))?;
            let [a, b, c] = [0, 1, 2].map(|k| found[k].computed);
            let ratio = (b - a) / (c - b);
            let limit = c + (c - b) / (ratio - 1.0);
            let (order, printed) = (ratio.log2(), found[2].exact);
            println!("| {fold} | {a:.1} | {b:.1} | {c:.1} | {order:.1} | {limit:.1} | {printed} |");
        }
    }
    Ok(())
}

fn cantilever_tables() -> Outcome<()> {
    println!("\n## S1: cantilever under end shear");
    let runs: Outcome<Vec<_>> = [4, 8, 16].iter().map(|&n| sze::shear(n, &STVK_MEYER)).collect();
    let runs = runs?;
    for (which, name) in ["-U", "W"].iter().enumerate() {
        beside(name, &STVK_MEYER, sze::SHEAR.map(|row| row.0).as_slice(), &runs, which);
    }
    println!("\n## S2: cantilever under end moment");
    let runs: Outcome<Vec<_>> =
        [4, 8, 12].iter().map(|&n| sze::moment(n, 20, &STVK_MEYER)).collect();
    let runs = runs?;
    let loads: Vec<f64> = runs[0].iter().map(|row| row.0).collect();
    let runs: Vec<Vec<[Sample; 2]>> =
        runs.iter().map(|run| run.iter().map(|row| row.1).collect()).collect();
    for (which, name) in ["-U", "W"].iter().enumerate() {
        beside(name, &STVK_MEYER, &loads, &runs, which);
    }
    Ok(())
}

fn shell_tables() -> Outcome<()> {
    let both = [shells::SHELL_MEYER, shells::SHELL_HINGE];
    rolled_tables(&both)?;
    println!("\n## R2: hemisphere with a hole");
    for models in both {
        let samples = over(&[32, 64, 128], |around| shells::hemisphere(around, &models))?;
        table(&format!("displacement under forces of 2, linear, {}", models.name), &samples);
    }
    hemisphere_table(&shells::SHELL_MEYER)?;
    println!("\n## R3: pinched cylinder");
    for models in both {
        let samples = over(&[64, 128, 192], |around| shells::pinched(around, &models))?;
        table(&format!("w E h/P, {}", models.name), &samples);
    }
    println!("\n## R4: Zoelly's pressure");
    for models in both {
        for (irregular, mesh) in [(false, "icosphere"), (true, "irregular")] {
            let samples = over(&[1000, 2500, 6000], |n| shells::zoelly(n, irregular, &models))?;
            table(&format!("critical pressure, {}, {mesh}", models.name), &samples);
        }
    }
    println!("\n## R5: point load on a cap");
    for models in both {
        let samples = over(&[500, 2000, 8000], |n| shells::point(n, &models))?;
        table(&format!("stiffness, {}", models.name), &samples);
    }
    Ok(())
}

fn rolled_tables(both: &[known_answers::Models]) -> Outcome<()> {
    println!("\n## R1: a strip rolled by spontaneous curvature");
    let widths: [(f64, &[usize]); 3] = [(0.5, &[4, 8]), (1.5, &[6, 12, 24]), (4.0, &[8, 16, 24])];
    for models in both {
        for (width, rows) in widths {
            let samples = over(rows, |rows| shells::rolled(width, rows, models))?;
            table(&format!("curvature at a width of {width}, {}", models.name), &samples);
        }
    }
    Ok(())
}

/// The hemisphere under large loads.
fn hemisphere_table(models: &known_answers::Models) -> Outcome<()> {
    let runs: Outcome<Vec<_>> =
        [32, 64, 128].iter().map(|n| shells::hemisphere_path(*n, models)).collect();
    let runs = runs?;
    let forces: Vec<f64> = shells::HEMISPHERE_PATH.iter().map(|(force, _)| *force).collect();
    for (which, name) in
        ["displacement of A outwards", "displacement of B inwards"].iter().enumerate()
    {
        beside(name, models, &forces, &runs, which);
    }
    Ok(())
}

/// A displacement at several loads, one column a mesh.
fn beside(
    name: &str,
    models: &known_answers::Models,
    loads: &[f64],
    runs: &[Vec<[Sample; 2]>],
    which: usize,
) {
    let columns = |f: &dyn Fn(&Vec<[Sample; 2]>) -> String| -> String {
        runs.iter().map(|run| format!(" {} |", f(run))).collect()
    };
    println!("\n**{name}, {}**\n", models.name);
    println!(
        "| load | exact |{} order |",
        columns(&|run| format!("{} vertices", run[0][0].vertices))
    );
    println!("| ---: | ---: |{} ---: |", columns(&|_| "---:".into()));
    for (k, load) in loads.iter().enumerate() {
        let last = runs.len() - 1;
        let [coarse, fine] = [last - 1, last].map(|r| {
            let s = runs[r][k][which];
            ((s.computed - s.exact).abs(), s.edge)
        });
        let order = (coarse.0 / fine.0).ln() / (coarse.1 / fine.1).ln();
        println!(
            "| {load:.2} | {:.4} |{} {order:.1} |",
            runs[0][k][which].exact,
            columns(&|run| format!("{:.4}", run[k][which].computed))
        );
    }
}

fn contact_tables() -> Outcome<()> {
    println!("\n## Contact");
    for pressure in [0.01, 0.1, 1.0] {
        let samples = over(&[2, 4, 8, 16], |n| contact::plates(n, pressure))?;
        table(&format!("distance of plates under {pressure} of the stiffness"), &samples);
    }
    for work in [0.01, 0.1] {
        let samples = over(&[2, 4, 8], |n| contact::stuck(n, work))?;
        table(&format!("distance of plates that stick with the work {work}"), &samples);
    }
    let sizes = [20, 40, 80, 160];
    for reach in [0.2, 0.05, 0.0125] {
        let samples = over(&sizes, |n| contact::lift_off(n, reach))?;
        table(&format!("lift-off of a heavy strip, reach {reach}"), &samples);
    }
    for range in [0.1, 0.025, 0.00625] {
        let samples = over(&[40, 80, 160, 320], |n| contact::peeled(n, range))?;
        table(
            &format!("length of a strip off a plane to which it sticks, range {range}"),
            &samples,
        );
    }
    for reach in [0.2, 0.05, 0.0125] {
        let samples = over(&sizes, |n| contact::bent_round(n, reach))?;
        table(&format!("force on a strip bent round between planes, reach {reach}"), &samples);
    }
    let sizes = [48, 96, 192, 384];
    table("pressure at which a ring touches itself", &over(&sizes, contact::first_contact)?);
    for (pressure, thickness) in [(6.0, 0.02), (8.0, 0.08), (8.0, 0.04), (8.0, 0.02)] {
        let samples = over(&sizes, |n| contact::neck(n, pressure, thickness))?;
        table(
            &format!("force between the walls of a ring, pressure {pressure}, reach {thickness}"),
            &samples,
        );
    }
    for (reach, ball) in [(0.2, None), (0.05, None), (0.0125, None), (0.0125, Some(4.0))] {
        let samples = over(&[1000, 4000, 16000], |n| contact::pressed(n, 0.05, reach, ball))?;
        let by = ball.map_or("plate".to_owned(), |radius| format!("ball of radius {radius}"));
        table(&format!("stiffness of a shell under a {by}, reach {reach} h"), &samples);
    }
    let sizes = [2562, 10242];
    let all = sizes.iter().map(|n| squeezed::squeezed(*n, 0.05)).collect::<Outcome<Vec<_>>>()?;
    for (k, (depth, _)) in squeezed::EXACT.iter().enumerate() {
        let samples: Vec<Sample> = all.iter().map(|samples| samples[k]).collect();
        table(&format!("force on a shell between plates that approach by {depth} h"), &samples);
    }
    Ok(())
}

fn chemistry_tables() -> Outcome<()> {
    println!("\n## C1 to C4: transport of species");
    let sizes = [200, 800, 3200];
    table("C1 decay rate, c = 0 held", &over(&sizes, |n| chemistry::decay(n, None, FINE))?);
    for rate in [1.0, 10.0] {
        let samples = over(&sizes, |n| chemistry::decay(n, Some(rate), FINE))?;
        table(&format!("C1 decay rate, exchange k R/D = {rate}"), &samples);
    }
    let implicit = "{ kind = \"monolithic\", method = \"bdf\", rtol = 1e-7, atol = 1e-9 }";
    let samples = over(&[300, 1200, 4800], |n| chemistry::ring(n, implicit))?;
    table("C2 concentration at the inner boundary", &samples);
    for scheme in ["central", "upwind"] {
        let samples = over(&[600, 2400, 9600], |n| chemistry::rotated(n, scheme, CARRIED))?;
        table(&format!("C3 1 + distance, {scheme}"), &samples);
    }
    table("C4 growth rate", &over(&[300, 1200, 4800], |n| chemistry::cross(n, FINE))?);
    Ok(())
}

fn steady_tables() -> Outcome<()> {
    println!("\n## Y1: a bistable law on a sheet that it makes grow");
    let sizes = [100, 400];
    let all: Outcome<Vec<_>> = sizes.iter().map(|&n| steady::bistable(n)).collect();
    let all = all?;
    let unstable: Vec<_> = all.iter().map(|found| found.unstable).collect();
    println!("growing disturbances before, between, beyond: {unstable:?}");
    for (which, name) in ["going up", "going back"].iter().enumerate() {
        let folds: Vec<Sample> = all.iter().map(|found| found.folds[which]).collect();
        table(&format!("parameter at the fold, {name}"), &folds);
    }
    println!("\n## Y2: Turing's threshold on a disc");
    let sizes = [300, 1200];
    let all: Outcome<Vec<_>> = sizes.iter().map(|&n| steady::turing(n)).collect();
    let all = all?;
    let unstable: Vec<_> = all.iter().map(|found| found.unstable).collect();
    println!("growing disturbances at the end: {unstable:?}");
    for which in 0..2 {
        let thresholds: Vec<Sample> = all.iter().map(|found| found.thresholds[which]).collect();
        table(&format!("threshold of m = {}", which + 1), &thresholds);
    }
    Ok(())
}

fn branch_tables() -> Outcome<()> {
    println!("\n## Q1: a column beyond Euler's load");
    let sizes = [4, 6, 8];
    let columns: Outcome<Vec<_>> = sizes.iter().map(|&rows| branches::column(rows)).collect();
    let columns = columns?;
    let negative: Vec<_> = columns.iter().map(|column| column.negative).collect();
    println!("negative eigenvalues below, above, bent: {negative:?}");
    let critical: Vec<Sample> = columns.iter().map(|column| column.critical).collect();
    table("critical load over Euler's", &critical);
    let beyond: Vec<Sample> = columns.iter().map(|column| column.beyond).collect();
    table("P/P_c - 1 at an amplitude of L/5", &beyond);
    println!("\n## Q2: limit loads of a shallow arch");
    let arches: Outcome<Vec<_>> = sizes.iter().map(|&rows| branches::arch(rows)).collect();
    let arches = arches?;
    let negative: Vec<_> = arches.iter().map(|arch| arch.negative).collect();
    println!("negative eigenvalues before, between, beyond: {negative:?}");
    for (which, name) in ["snap down", "snap back"].iter().enumerate() {
        let limits: Vec<Sample> = arches.iter().map(|arch| arch.limits[which]).collect();
        table(&format!("load of the {name}"), &limits);
    }
    println!("\n## Q3: snap of a shallow cap");
    let sizes = [300, 1200, 4800];
    let caps: Outcome<Vec<_>> = sizes.iter().map(|&n| caps::cap(n)).collect();
    let caps = caps?;
    let negative: Vec<_> = caps.iter().map(|cap| cap.negative).collect();
    println!("negative eigenvalues before, between, beyond: {negative:?}");
    for (which, name) in ["snap down", "snap back"].iter().enumerate() {
        let limits: Vec<Sample> = caps.iter().map(|cap| cap.limits[which]).collect();
        table(&format!("load of the {name}"), &limits);
    }
    println!("\n## Q4: wrinkling of a growing annulus");
    let sizes = [800, 3200];
    let all: Outcome<Vec<_>> = sizes.iter().map(|&n| annulus::wrinkled(n)).collect();
    let all = all?;
    println!(
        "waves found, expected: {:?}",
        all.iter().map(|found| found.waves).collect::<Vec<_>>()
    );
    let strains: Vec<Sample> = all.iter().map(|found| found.strain).collect();
    table("strain of the first bifurcation", &strains);
    bilayer_tables()
}

fn bilayer_tables() -> Outcome<()> {
    println!("\n## Q5: a disc that bends itself, from a cap to a trough");
    let all: Outcome<Vec<_>> = [300, 1200, 4800].iter().map(|&n| bilayer::bilayer(n)).collect();
    let all = all?;
    let critical: Vec<Sample> = all.iter().map(|found| found.critical).collect();
    table("critical spontaneous curvature over that of theory", &critical);
    let slope: Vec<Sample> = all.iter().map(|found| found.slope).collect();
    table("slope of (κ_x - κ_y)² over C₀²", &slope);
    Ok(())
}
