//! Perceived difference of the two sides: LDR-ꟻLIP of their display values, computed in a separate thread.

use std::{
    sync::mpsc::{Receiver, TryRecvError, channel},
    thread,
};

use glam::UVec2;
use lanternfish_metrics::{PIXELS_PER_DEGREE, RgbImage, flip_ldr};

/// The result of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Mean ꟻLIP error over all pixels, 0 (no visible difference) to 1.
    pub mean: f32,
    /// Error map: RGBA, black 0 to pale yellow 1, rows from the top.
    pub map: Vec<u8>,
    /// Width and height, pixels.
    pub size: UVec2,
}

/// Compares images, one pair at a time.
#[derive(Debug, Default)]
pub struct Difference {
    pending: Option<Receiver<Result<Compared, String>>>,
}

impl Difference {
    /// Starts to compare two images of `size` pixels: display-encoded RGBA. Cancels a comparison in progress.
    pub fn compare(&mut self, a: Vec<[u8; 4]>, b: Vec<[u8; 4]>, size: UVec2) {
        let (sender, receiver) = channel();
        self.pending = Some(receiver);
        thread::spawn(move || {
            // Sending fails if the comparison was cancelled.
            let _ = sender.send(compared(&a, &b, size));
        });
    }

    /// True if a comparison is in progress.
    pub fn is_working(&self) -> bool {
        self.pending.is_some()
    }

    /// The result, if it is ready. Does not block.
    pub fn poll(&mut self) -> Option<Result<Compared, String>> {
        let result = self.pending.as_ref()?.try_recv();
        if result == Err(TryRecvError::Empty) {
            return None;
        }
        self.pending = None;
        Some(result.unwrap_or_else(|_| Err("the comparison failed".to_owned())))
    }

    /// Cancels the comparison.
    pub fn stop(&mut self) {
        self.pending = None;
    }
}

fn compared(a: &[[u8; 4]], b: &[[u8; 4]], size: UVec2) -> Result<Compared, String> {
    let image = |texels: &[[u8; 4]]| {
        let pixels = texels.iter().map(|[r, g, b, _]| [*r, *g, *b].map(|byte| f32::from(byte) / 255.0)).collect();
        RgbImage::new(size.x as usize, size.y as usize, pixels).map_err(|error| error.to_string())
    };
    let flip = flip_ldr(&image(b)?, &image(a)?, PIXELS_PER_DEGREE).map_err(|error| error.to_string())?;
    let map = flip.magma().as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    Ok(Compared { mean: flip.mean(), map, size })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait(difference: &mut Difference) -> Result<Compared, String> {
        loop {
            if let Some(compared) = difference.poll() {
                return compared;
            }
            thread::yield_now();
        }
    }

    #[test]
    fn differences_are_on_the_map() {
        let size = UVec2::new(40, 20);
        let grey = vec![[90, 90, 90, 255]; 800];
        let mut difference = Difference::default();
        assert!(difference.poll().is_none());
        difference.compare(grey.clone(), grey.clone(), size);
        let same = wait(&mut difference).unwrap();
        assert_eq!((same.mean, same.size, same.map.len()), (0.0, size, 3200));
        assert!(!difference.is_working());
        // The right half is white.
        let half = (0..800).map(|i| if i % 40 < 20 { [90, 90, 90, 255] } else { [255; 4] }).collect();
        difference.compare(half, grey.clone(), size);
        let other = wait(&mut difference).unwrap();
        assert!(other.mean > 0.1, "{}", other.mean);
        let at = |x: usize| u32::from(other.map[4 * (10 * 40 + x)]);
        assert!(at(35) > at(5) + 50 && other.map[3] == 255);
        difference.compare(grey, Vec::new(), size);
        assert!(wait(&mut difference).is_err(), "sizes differ");
    }
}
