//! The renderer with techniques of this crate.

mod frames;
mod later;
