//! Limits for untrusted files: a [`memory`] budget that is checked before allocation, third-party decoders whose [panics](caught) become
//! errors, and names that are [printable].

#![cfg_attr(
    not(feature = "unstable"),
    allow(dead_code, private_interfaces, unused_imports, reason = "the feature makes the rest public")
)]

mod caught;
mod machine;
pub mod memory;
mod printable;

#[cfg_attr(feature = "unstable", visibility::make(pub))]
use caught::caught;
#[cfg_attr(feature = "unstable", visibility::make(pub))]
use printable::{printable, printable_name};
