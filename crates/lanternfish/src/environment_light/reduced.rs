//! Smaller environment images: the work of filtering one then follows its pixels, once, and not the square of its width.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lanternfish_scene::Environment;
use rayon::prelude::*;

/// Largest width of an image that is filtered as it is, pixels: two for each texel along the equator of the largest cube.
const MOST_WIDTH: usize = 8 * 512;

/// The image with at least [`MOST_WIDTH`] columns and half as many rows, and less than twice as many: each pixel is the mean of those that
/// it replaces, weighted by their solid angles. `None` for an image with fewer columns and rows.
pub(super) fn reduced(image: &Environment) -> Option<Environment> {
    let width = image.width / (image.width / MOST_WIDTH).max(1);
    let height = image.height / (2 * image.height / MOST_WIDTH).max(1);
    if (width, height) == (image.width, image.height) {
        return None;
    }
    let rows = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| row(image, width, y * image.height / height..(y + 1) * image.height / height));
    Some(Environment { width, height, pixels: rows.collect(), rotation: image.rotation })
}

/// The means of `width` blocks of these rows.
fn row(image: &Environment, width: usize, rows: std::ops::Range<usize>) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; width];
    let mut weights = 0.0;
    let first = |x: usize| x * image.width / width;
    for y in rows {
        let solid_angle = (PI * (y as f64 + 0.5) / image.height as f64).sin();
        let pixels = &image.pixels[y * image.width..(y + 1) * image.width];
        for (x, sum) in sums.iter_mut().enumerate() {
            let block = &pixels[first(x)..first(x + 1)];
            *sum += solid_angle / block.len() as f64 * block.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>();
        }
        weights += solid_angle;
    }
    sums.into_iter().map(|sum| (sum / weights).as_vec3()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of radiance times solid angle, up to a factor.
    fn flux(image: &Environment) -> DVec3 {
        let rows = image.pixels.chunks(image.width).enumerate();
        let of_row = |(y, row): (usize, &[Vec3])| {
            let solid_angle = (PI * (y as f64 + 0.5) / image.height as f64).sin() / (image.width * image.height) as f64;
            solid_angle * row.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>()
        };
        rows.map(of_row).sum()
    }

    #[test]
    fn filtered_images_have_bounded_sides_and_the_same_light() {
        for (width, height, expected) in
            [(16_384, 8, (4096, 8)), (8_191, 3, (8_191, 3)), (9_000, 6_001, (4_500, 3_000))]
        {
            // One bright pixel in a gradient: light that points between pixels would miss.
            let mut pixels: Vec<Vec3> = (0..width * height).map(|i| Vec3::new((i % width) as f32, 1.0, 0.0)).collect();
            pixels[width * (height / 2) + 7] = Vec3::splat(1e7);
            let image = Environment { width, height, pixels, rotation: 0.25 };
            let Some(reduced) = reduced(&image) else {
                assert_eq!((width, height), expected);
                continue;
            };
            assert_eq!((reduced.width, reduced.height, reduced.rotation), (expected.0, expected.1, 0.25));
            let (before, after) = (flux(&image), flux(&reduced));
            assert!(((after - before) / before.max(DVec3::splat(1e-9))).abs().max_element() < 1e-3, "{before} {after}");
        }
    }
}
