//! Tests of one crate use what the workspace's tests have compiled: its dependencies have the same features alone.

use std::collections::BTreeSet;

use crate::{
    command::{cargo, packages},
    files::read,
};

/// What is linked into programs and tests, and with it what runs while they are compiled: features of the two differ.
const EDGES: [&str; 2] = ["normal,dev,no-proc-macro", "normal,build,dev"];

/// Every package in the dependencies of the selected packages and their tests, with its features.
fn packages_with_features(edges: &str, selected: &[&str]) -> BTreeSet<String> {
    let mut command = cargo(["tree", "--offline", "--edges", edges, "--prefix", "none"]);
    let output = command.args(["--format", "{p} [{f}]"]).args(selected).output().expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("cargo writes UTF-8");
    text.lines().map(|line| line.replace(" (*)", "").replace(" (proc-macro)", "")).collect()
}

/// What the packages of a crate alone have and those of the workspace lack.
fn differences(alone: &BTreeSet<String>, workspace: &BTreeSet<String>) -> Vec<String> {
    alone.difference(workspace).cloned().collect()
}

#[test]
fn a_crate_alone_has_the_workspaces_features() {
    let workspace = EDGES.map(|edges| packages_with_features(edges, &["--workspace"]));
    for folder in packages() {
        let manifest = read(&folder.join("Cargo.toml")).unwrap();
        let name = manifest.lines().find_map(|line| line.strip_prefix("name = ")).expect("a name").trim_matches('"');
        let missing =
            [0, 1].map(|i| differences(&packages_with_features(EDGES[i], &["--package", name]), &workspace[i]));
        let missing = missing.concat();
        assert!(
            missing.is_empty(),
            "cargo test -p {name} compiles other features than the workspace's tests. Add the workspace's to \
             workspace-hack/Cargo.toml, or for a crate of the project to the dev-dependencies:\n{}",
            missing.join("\n")
        );
    }
}

#[test]
fn another_feature_is_a_difference() {
    let set = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect::<BTreeSet<_>>();
    let workspace = set(&["image v1 [gif,png]", "half v2 []"]);
    assert_eq!(differences(&set(&["image v1 [png]", "half v2 []"]), &workspace), ["image v1 [png]"]);
    assert!(differences(&set(&["half v2 []"]), &workspace).is_empty());
}
