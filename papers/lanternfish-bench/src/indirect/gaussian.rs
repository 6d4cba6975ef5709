//! Nießner's filter: "a separable Gaussian", 11 x 11, that does not stop at edges [Niessner2010, §5, §7].

/// Pixels to each side of the filter of [Niessner2010, §7].
pub const RADIUS: u32 = 5;

/// An image of a size, row by row, after a pass across and one down. Weights are those of a Gaussian whose standard deviation is half the
/// radius (he gives none), over their sum within the image.
pub fn filtered(image: &[[f32; 3]], width: usize, radius: usize) -> Vec<[f32; 3]> {
    let height = image.len() / width.max(1);
    let deviation = 0.5 * radius.max(1) as f32;
    let weight = |apart: usize| (-0.5 * (apart as f32 / deviation).powi(2)).exp();
    let weights: Vec<f32> = (0..=radius).map(weight).collect();
    // The mean around place `at` of `length` ones, of which `pixel` gives the values.
    let mean = |at: usize, length: usize, pixel: &dyn Fn(usize) -> [f32; 3]| {
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for place in at.saturating_sub(radius)..=(at + radius).min(length - 1) {
            let weight = weights[place.abs_diff(at)];
            let value = pixel(place);
            total += weight;
            sum = std::array::from_fn(|channel| sum[channel] + weight * value[channel]);
        }
        sum.map(|channel: f32| channel / total)
    };
    let places = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let across: Vec<_> = places().map(|(x, y)| mean(x, width, &|x| image[y * width + x])).collect();
    places().map(|(x, y)| mean(y, height, &|y| across[y * width + x])).collect()
}

/// An image with shadows whose visibility is filtered: `shadowed` over `unshadowed`, filtered, times `unshadowed`. Where nothing arrives
/// without shadows either, nothing is shadowed.
pub fn filtered_shadows(shadowed: &[[f32; 3]], unshadowed: &[[f32; 3]], width: usize, radius: usize) -> Vec<[f32; 3]> {
    let ratio = |with: f32, without: f32| if without > 0.0 { with / without } else { 1.0 };
    let channels = |a: &[f32; 3], b: &[f32; 3], of: &dyn Fn(f32, f32) -> f32| std::array::from_fn(|i| of(a[i], b[i]));
    let ratios: Vec<[f32; 3]> = shadowed.iter().zip(unshadowed).map(|(a, b)| channels(a, b, &ratio)).collect();
    let filtered = filtered(&ratios, width, radius);
    filtered.iter().zip(unshadowed).map(|(a, b)| channels(a, b, &|a, b| a * b)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 31;
    const HEIGHT: usize = 23;

    fn grey(value: impl Fn(usize, usize) -> f32) -> Vec<[f32; 3]> {
        (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y))).map(|(x, y)| [value(x, y); 3]).collect()
    }

    #[test]
    fn a_point_becomes_a_gaussian_of_11_by_11() {
        let filtered = filtered(&grey(|x, y| f32::from(u8::from((x, y) == (15, 11)))), WIDTH, RADIUS as usize);
        let at = |x: usize, y: usize| filtered[y * WIDTH + x][0];
        let one = |apart: f32| (-0.5 * (apart / 2.5).powi(2)).exp();
        let sum: f32 = (-5..=5).map(|apart| one(apart as f32)).sum();
        for (x, y) in [(15, 11), (16, 11), (10, 6), (20, 16), (12, 13)] {
            let expected = one(x as f32 - 15.0) * one(y as f32 - 11.0) / (sum * sum);
            assert!((at(x, y) / expected - 1.0).abs() < 1e-5, "{x} {y}: {} {expected}", at(x, y));
        }
        // No farther than 5 pixels, and all of it.
        assert_eq!([at(9, 11), at(21, 11), at(15, 5), at(15, 17)], [0.0; 4]);
        assert_eq!(filtered.iter().filter(|pixel| pixel[0] > 0.0).count(), 121);
        assert!((filtered.iter().map(|pixel| pixel[0]).sum::<f32>() - 1.0).abs() < 1e-5);
    }

    #[test]
    fn an_even_image_stays_and_an_edge_does_not_stop_the_filter() {
        assert!(filtered(&grey(|_, _| 0.75), WIDTH, 5).iter().flatten().all(|value| (value - 0.75).abs() < 1e-6));
        let image = grey(|x, _| f32::from(u8::from(x >= 15)));
        assert_eq!(filtered(&image, WIDTH, 0), image);
        let edge = filtered(&image, WIDTH, 5);
        // Two pixels at an edge are as far from their own value.
        let [dark, bright] = [14, 15].map(|x| edge[11 * WIDTH + x][0]);
        assert!(dark > 0.3 && (dark + bright - 1.0).abs() < 1e-6, "{dark} {bright}");
    }

    #[test]
    fn visibility_is_filtered_and_what_is_lit_is_not() {
        // A texture in even light, half of it in shadow.
        let texture = grey(|x, y| if (x + y) % 2 == 0 { 2.0 } else { 0.5 });
        let even: Vec<_> = texture.iter().map(|pixel| pixel.map(|value| 0.25 * value)).collect();
        let shadows = filtered_shadows(&even, &texture, WIDTH, 5);
        assert!(shadows.iter().flatten().zip(even.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6));
        // Black surfaces stay black and shadow nothing beside them.
        let lit = grey(|x, _| f32::from(u8::from(x >= 15)));
        assert_eq!(filtered_shadows(&lit, &lit, WIDTH, 5), lit);
    }
}
