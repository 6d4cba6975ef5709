//! State that frames leave for later ones.

use crate::Frame;

/// A value that frames leave for later ones. It is the default at first, and again as soon as what earlier frames left
/// is not valid: after an error ([`crate::Pool::empty`]) and after another growth of lists
/// ([`crate::Pool::set_growth`]). So no pass discards anything itself.
#[derive(Debug, Default)]
pub struct AcrossFrames<T> {
    value: T,
    /// The pool's, which counts how often state was discarded.
    epoch: u64,
}

impl<T: Default> AcrossFrames<T> {
    /// The value that earlier frames left, for this frame to read and change.
    pub fn get(&mut self, frame: &Frame<'_>) -> &mut T {
        let epoch = frame.pool.epoch;
        if self.epoch != epoch {
            *self = Self { value: T::default(), epoch };
        }
        &mut self.value
    }

    /// The value that the last frame left, valid or not.
    pub fn last(&self) -> &T {
        &self.value
    }
}
