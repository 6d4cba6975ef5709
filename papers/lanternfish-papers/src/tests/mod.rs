//! The renderer with techniques of this crate.

mod five;
mod frames;
mod later;
