//! The committed C header is what the source says.
//!
//! To regenerate it: `RUMPLE_WRITE_HEADER=1 cargo test -p rumple-plugin-abi --test header`.

use std::path::Path;

#[test]
fn the_committed_header_is_generated_from_the_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let bindings =
        cbindgen::Builder::new().with_config(config).with_crate(root).generate().unwrap();
    let mut fresh = Vec::new();
    bindings.write(&mut fresh);
    let fresh = String::from_utf8(fresh).unwrap();
    let path = root.join("include/rumple_plugin.h");
    if std::env::var_os("RUMPLE_WRITE_HEADER").is_some() {
        std::fs::write(&path, &fresh).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    let differs = committed.lines().zip(fresh.lines()).position(|(a, b)| a != b);
    assert!(
        committed == fresh,
        "include/rumple_plugin.h differs from the source from line {} on: regenerate it by \
         RUMPLE_WRITE_HEADER=1 cargo test -p rumple-plugin-abi --test header",
        differs.map_or_else(|| committed.lines().count(), |line| line + 1)
    );
}
