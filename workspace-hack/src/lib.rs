//! Unifies the features of dependencies in tests of one crate with those of the workspace.
