//! Motion under drag by steps that move the sheet by far less than the tolerance of a step.

use crate::common::prepare;

/// Height of a pinned disc under a slowly rising load, by steps up to this long.
fn height(longest: f64) -> f64 {
    let text = format!(
        "sheet = {{ shape = 'disc', radius = 4.0, vertices = 120 }}
         material = {{ young = 1e3, poisson = 0.3, thickness = 0.1, drag = {{ per-area = 2.0 }} }}
         time = {{ until = 0.5, policy = 'simultaneous', integrator = {{ kind = 'staggered', longest_step = {longest:?} }} }}
         equilibrium = {{ tolerance = 1e-9 }}
         effect = [
             {{ kind = 'stretching', model = 'stvk' }},
             {{ kind = 'bending' }},
             {{ kind = 'pin', where = 'rim', axes = 'xyz' }},
             {{ kind = 'load', where = 'all', force = {{ along-normal = '0.0003*t' }} }},
         ]"
    );
    let (_, mut simulation) = prepare(&text, &[]);
    simulation.prepare().unwrap();
    while simulation.state().time < 0.5 {
        simulation.step(0.5).unwrap();
    }
    simulation.state().x.iter().map(|x| x.z).fold(0.0, f64::max)
}

/// With steps of 0.0005 nothing moved, without a word.
#[test]
fn however_short_steps_are_the_sheet_moves() {
    let [long, short] = [0.05, 0.0005].map(height);
    println!("{long:e} {short:e}");
    assert!((short / long - 1.0).abs() < 0.02, "{long:e} {short:e}");
}
