//! Times and counts of a frame: sums of its passes.

use std::time::Instant;

use lanternfish::{RenderedImage, Report};
use lanternfish_gpu::PassTime;

/// The distinct values, in ascending order.
pub fn distinct<T: Ord>(values: impl Iterator<Item = T>) -> Vec<T> {
    values.collect::<std::collections::BTreeSet<T>>().into_iter().collect()
}

/// Value of the counter `name`; 0 if there is none.
pub fn counter(report: &Report, name: &str) -> u64 {
    report.counters.iter().find(|(counter, _)| counter == name).map_or(0, |(_, count)| *count)
}

/// Device time of the passes whose names begin with `start`, ms.
pub fn ms_of(passes: &[PassTime], start: &str) -> f64 {
    // A fold, because the empty `sum` is -0.0.
    passes.iter().filter(|pass| pass.name.starts_with(start)).fold(0.0, |sum, pass| sum + pass.ms)
}

/// Device time of a frame, ms, without building deep images, which are reused while nothing moves.
pub fn frame_ms(passes: &[PassTime]) -> f64 {
    passes.iter().filter(|pass| !pass.name.starts_with("deep_images/")).fold(0.0, |sum, pass| sum + pass.ms)
}

/// The time of a frame, ms, and the frame: of its passes, or of the host if the adapter has no timestamps.
pub fn frame_time<E>(frame: impl FnOnce() -> Result<RenderedImage, E>) -> Result<(f64, RenderedImage), E> {
    let started = Instant::now();
    let image = frame()?;
    let host_ms = 1e3 * started.elapsed().as_secs_f64();
    let passes = &image.report.passes;
    Ok((if passes.is_empty() { host_ms } else { ms_of(passes, "") }, image))
}

/// Sums the device times of passes by category, ms. `of` returns the category of a pass and is called in execution
/// order. Passes without a category are ignored.
pub fn sorted<const N: usize>(passes: &[PassTime], mut of: impl FnMut(&str) -> Option<usize>) -> [f64; N] {
    let mut sums = [0.0; N];
    for pass in passes {
        if let Some(kind) = of(&pass.name) {
            sums[kind] += pass.ms;
        }
    }
    sums
}

/// Device times of passes by name, ms, in the order of their first appearance. Passes of one name are added up.
pub fn sums<'p>(passes: impl Iterator<Item = &'p PassTime>) -> Vec<(&'p str, f64)> {
    let mut sums: Vec<(&str, f64)> = Vec::new();
    for pass in passes {
        match sums.iter_mut().find(|(name, _)| *name == pass.name) {
            Some((_, ms)) => *ms += pass.ms,
            None => sums.push((&pass.name, pass.ms)),
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deep_images_are_no_part_of_a_frame() {
        let passes = [("deep_images/sort", 4.0), ("prepass", 1.0), ("shading/forward", 2.0)];
        let passes = passes.map(|(name, ms)| PassTime { name: name.to_owned(), ms });
        assert_eq!([frame_ms(&passes), ms_of(&passes, "deep_images/"), ms_of(&passes, "sky")], [3.0, 4.0, 0.0]);
        let report = Report { passes: passes.into(), counters: vec![("rays".to_owned(), 7)], ..Report::default() };
        assert_eq!([counter(&report, "rays"), counter(&report, "lights")], [7, 0]);
    }
}
