//! What members are taken to need.

use rumple::study::run::{MemoryEstimates, available};

#[test]
fn needs_go_by_the_nearest_in_size_and_by_the_ended_before_the_running() {
    let mut needs = MemoryEstimates::default();
    assert_eq!(needs.of(1000), None);
    needs.set_running(vec![(1000, 100)]);
    assert_eq!(needs.of(1000), Some(150), "with room for growth");
    assert_eq!(needs.of(3000), Some(450), "in proportion");
    needs.record_peak(1000, 120);
    assert_eq!(needs.of(1000), Some(120));
    assert_eq!(needs.of(2000), Some(240));
    assert_eq!(needs.of(10), Some(120), "a smaller one may need as much");
    needs.record_peak(1000, 140);
    needs.record_peak(2000, 150);
    assert_eq!([needs.of(1000), needs.of(2000), needs.of(4000)], [Some(140), Some(150), Some(300)]);
}

#[test]
fn the_system_says_what_is_free() {
    if !std::path::Path::new("/proc/meminfo").is_file() {
        return;
    }
    let free = available().unwrap();
    assert!(free > 1 << 20 && free < 1 << 50, "{free}");
}
