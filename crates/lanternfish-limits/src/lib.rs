//! Limits for untrusted files: a [`memory`] budget that is checked before allocation, third-party decoders whose panics become
//! errors, and names that are printable.

mod caught;
mod machine;
pub mod memory;
mod printable;
mod text;

#[doc(hidden)]
pub use caught::caught;
#[doc(hidden)]
pub use printable::{printable, printable_name};
#[doc(hidden)]
pub use text::read_text;
