//! Limits for untrusted files: a [`memory`] budget that is checked before allocation, third-party decoders whose [panics](caught) become
//! errors, and names that are [printable].

mod caught;
mod machine;
pub mod memory;
mod printable;

pub use caught::caught;
pub use printable::{printable, printable_name};
