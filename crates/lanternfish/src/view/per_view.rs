//! What the frames of a view leave for its later frames.

use std::collections::HashMap;

use lanternfish_gpu::{AcrossFrames, Frame};

/// The identity of a view across frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ViewKey {
    /// The key of a [`crate::ViewRequest`].
    Key(u64),
    /// The index among the views of a frame that is rendered to images.
    Slot(usize),
}

/// Number of frames that the value of a view is stored while no frame contains the view.
const STORED_FRAMES: u64 = 64;

/// A value of each view: its last frame left it, this one takes it and leaves the next. It is gone where
/// [`AcrossFrames`] are, and if that frame was long ago.
#[derive(Debug)]
pub(crate) struct PerView<T> {
    /// Each with the index of its frame.
    views: AcrossFrames<HashMap<ViewKey, (T, u64)>>,
}

impl<T> Default for PerView<T> {
    fn default() -> Self {
        Self { views: AcrossFrames::default() }
    }
}

impl<T> PerView<T> {
    /// The value that the view's last frame left, which now has none.
    pub fn take(&mut self, frame: &Frame<'_>, key: ViewKey) -> Option<T> {
        self.views.get(frame).remove(&key).map(|(value, _)| value)
    }

    /// The value that the view's last frame left.
    pub fn get(&mut self, frame: &Frame<'_>, key: ViewKey) -> Option<&T> {
        self.views.get(frame).get(&key).map(|(value, _)| value)
    }

    /// Leaves a value for the view's next frame.
    pub fn leave(&mut self, frame: &Frame<'_>, key: ViewKey, value: T) {
        let views = self.views.get(frame);
        views.retain(|_, (_, last)| *last + STORED_FRAMES >= frame.index());
        views.insert(key, (value, frame.index()));
    }

    /// Drops the values of all views.
    pub fn clear(&mut self) {
        self.views = AcrossFrames::default();
    }
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::{Growth, Pool, Profiler, testing};

    use super::*;

    #[gpu_test]
    fn gpu_a_value_lasts_until_its_view_is_not_shown_for_long_or_the_pool_is_emptied(gpu: &Gpu) {
        let (mut profiler, mut pool) = (Profiler::new(&gpu.device, &gpu.queue), Pool::new(&gpu.device));
        let mut values = PerView::default();
        let mut of_frame = |pool: &mut Pool, key, next: Option<u32>| {
            let frame = Frame::pooled(&gpu.device, &gpu.queue, &mut profiler, pool);
            let last = values.take(&frame, key);
            next.into_iter().for_each(|next| values.leave(&frame, key, next));
            last
        };
        let [shown, hidden] = [ViewKey::Slot(0), ViewKey::Key(0)];
        assert_eq!(of_frame(&mut pool, hidden, Some(7)), None);
        let last = (0..STORED_FRAMES as u32).map(|i| of_frame(&mut pool, shown, Some(i))).collect::<Vec<_>>();
        assert_eq!((last[0], last[5]), (None, Some(4)));
        assert_eq!(of_frame(&mut pool, hidden, Some(8)), Some(7));
        (0..=STORED_FRAMES as u32).for_each(|i| _ = of_frame(&mut pool, shown, Some(i)));
        assert_eq!(of_frame(&mut pool, hidden, None), None);
        pool.empty(&gpu.device);
        assert_eq!(of_frame(&mut pool, shown, Some(1)), None);
        pool.set_growth(&gpu.device, Growth::Deferred).unwrap();
        assert_eq!(of_frame(&mut pool, shown, None), None);
    }
}
