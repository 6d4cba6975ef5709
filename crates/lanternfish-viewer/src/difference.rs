//! How different the two sides look: ꟻLIP of what a display shows of them, computed in a thread of its own.

use std::{
    sync::mpsc::{Receiver, TryRecvError, channel},
    thread,
};

use glam::UVec2;
use lanternfish_metrics::{PIXELS_PER_DEGREE, RgbImage, flip_ldr};

/// What came out.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The mean over all pixels, 0 (none is to be told from the other) to 1.
    pub mean: f32,
    /// The map as an image: RGBA, black 0 to pale yellow 1, rows from the top.
    pub map: Vec<u8>,
    /// Pixels across and down.
    pub size: UVec2,
}

/// One comparison at a time.
#[derive(Debug, Default)]
pub struct Difference {
    on_its_way: Option<Receiver<Result<Compared, String>>>,
}

impl Difference {
    /// Begins to compare two images: bytes of a display, RGBA, of `size` pixels each. Another that is on its way is not heard of any more.
    pub fn compare(&mut self, a: Vec<[u8; 4]>, b: Vec<[u8; 4]>, size: UVec2) {
        let (says, told) = channel();
        self.on_its_way = Some(told);
        thread::spawn(move || {
            // Who does not listen any more has other images.
            let _ = says.send(compared(&a, &b, size));
        });
    }

    /// True if one is on its way.
    pub fn is_working(&self) -> bool {
        self.on_its_way.is_some()
    }

    /// What came out, if it is there. It never waits.
    pub fn poll(&mut self) -> Option<Result<Compared, String>> {
        let told = self.on_its_way.as_ref()?.try_recv();
        if told == Err(TryRecvError::Empty) {
            return None;
        }
        self.on_its_way = None;
        Some(told.unwrap_or_else(|_| Err("the comparison has failed".to_owned())))
    }

    /// Leaves it.
    pub fn stop(&mut self) {
        self.on_its_way = None;
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
    fn what_differs_is_on_the_map() {
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
