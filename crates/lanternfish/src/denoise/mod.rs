//! From noisy values per pixel to layers of light: firefly clamp, filter, and history.
//!
//! Whoever samples light with few rays uses it: indirect light, sampled direct light, shadows of area lights, ambient visibility.

pub(crate) mod counters;
pub mod history;
pub(crate) mod layers;
pub mod smoothing;

pub use self::{
    counters::Counters,
    smoothing::{IndirectClamp, IndirectResolution},
};
