//! Licences of everything that is built: each crate can be used under one that is allowed.

use std::process::Command;

use serde_json::Value;

use crate::common::root;

/// Licences that ask for no more than their text and the names of the authors, or, the last, for the source of
/// changes to files of that crate.
const ALLOWED: [&str; 10] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "ISC",
    "MIT",
    "Unicode-3.0",
    "Zlib",
    "MPL-2.0",
];

/// Whether an SPDX expression can be met by allowed licences; `/` is the older form of OR.
fn allowed(expression: &str) -> bool {
    let expression = expression.replace(['(', ')'], "").replace('/', " OR ");
    let one = |part: &str| part.split(" OR ").any(|licence| ALLOWED.contains(&licence.trim()));
    expression.split(" AND ").all(one)
}

#[test]
fn every_crate_has_an_allowed_licence() {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let out = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let metadata: Value = serde_json::from_slice(&out.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    assert!(packages.len() > 100);
    // Those of this repository are not published under another one.
    let foreign = packages.iter().filter(|package| !package["source"].is_null());
    let wrong: Vec<String> = foreign
        .filter(|package| !package["license"].as_str().is_some_and(allowed))
        .map(|package| format!("{}: {}", package["name"], package["license"]))
        .collect();
    assert!(wrong.is_empty(), "without an allowed licence:\n{}", wrong.join("\n"));
}

#[test]
fn an_expression_is_met_by_every_part_of_it() {
    for good in
        ["MIT", "MIT/Apache-2.0", "Apache-2.0 OR GPL-2.0-only", "(MIT OR GPL-3.0) AND Unicode-3.0"]
    {
        assert!(allowed(good), "{good}");
    }
    for bad in ["GPL-3.0", "MIT AND GPL-3.0", "GPL-2.0 OR AGPL-3.0", ""] {
        assert!(!allowed(bad), "{bad}");
    }
}
