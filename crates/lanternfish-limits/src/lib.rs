//! What files from outside may cost: [`memory`], which is requested before it is taken, and [panics](caught) of the
//! decoders of others, which become errors.

mod caught;
mod machine;
pub mod memory;

pub use caught::caught;
