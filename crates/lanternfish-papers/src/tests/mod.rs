//! What the renderer does, under settings that choose techniques of this crate.

mod frames;
mod later;
