//! Every numbered example runs (03 prints tables of what `answers` tests).

#[path = "../../examples/01_grown_spot.rs"]
mod grown_spot;
#[path = "../../examples/02_scene_from_code.rs"]
mod scene_from_code;

#[test]
fn grown_spot_buckles() {
    grown_spot::main().unwrap();
}

#[test]
fn scene_from_code_is_checked() {
    scene_from_code::main().unwrap();
}
