//! Limits for untrusted files: a [`memory`] budget that is checked before allocation, and third-party decoders whose
//! [panics](caught) become errors.

mod caught;
mod machine;
pub mod memory;

pub use caught::caught;
