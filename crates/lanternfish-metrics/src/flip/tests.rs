//! Compares with the authors' evaluator on generated images: `flip-evaluator` 1.7 of PyPI,
//! `evaluate(reference, test, "LDR", applyMagma=False, parameters={"ppd": …})`.

use super::*;

const WIDTH: usize = 61;
const HEIGHT: usize = 47;

/// A byte as a function of x, y and channel.
type Pattern = fn(usize, usize, usize) -> usize;

fn rendering(pattern: Pattern) -> RgbImage {
    let pixel = |i: usize| [0, 1, 2].map(|channel| pattern(i % WIDTH, i / WIDTH, channel) as f32 / 255.0);
    RgbImage::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(pixel).collect()).unwrap()
}

fn uniform(color: [f32; 3]) -> RgbImage {
    RgbImage::new(20, 20, vec![color; 400]).unwrap()
}

/// Pseudo-random, 0..256.
fn hash(x: usize, y: usize, channel: usize, seed: u32) -> usize {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1)
        ^ (y as u32).wrapping_mul(0x85EB_CA77)
        ^ (channel as u32).wrapping_mul(0xC2B2_AE3D)
        ^ seed.wrapping_mul(0x27D4_EB2F);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    ((h ^ (h >> 15)) >> 24) as usize
}

fn noise(x: usize, y: usize, channel: usize) -> usize {
    hash(x, y, channel, 0)
}

fn other_noise(x: usize, y: usize, channel: usize) -> usize {
    hash(x, y, channel, 1)
}

fn gradient(x: usize, y: usize, channel: usize) -> usize {
    [x * 255 / 60, y * 255 / 46, (x + y) * 255 / 106][channel]
}

fn grainy_gradient(x: usize, y: usize, channel: usize) -> usize {
    (gradient(x, y, channel) + hash(x, y, channel, 2) % 41).saturating_sub(20).min(255)
}

fn dim_gradient(x: usize, y: usize, channel: usize) -> usize {
    gradient(x, y, channel) * 9 / 10
}

/// Squares of 5 × 5 pixels.
fn squares(x: usize, y: usize, channel: usize) -> usize {
    hash(x / 5, y / 5, channel, 3)
}

fn shifted_squares(x: usize, y: usize, channel: usize) -> usize {
    squares(x + 2, y + 1, channel)
}

fn blurred_squares(x: usize, y: usize, channel: usize) -> usize {
    let column = |i: usize| (x + i).saturating_sub(1).min(WIDTH - 1);
    let row = |i: usize| (y + i).saturating_sub(1).min(HEIGHT - 1);
    (0..9).map(|i| squares(column(i % 3), row(i / 3), channel)).sum::<usize>() / 9
}

/// Two images, pixels per degree, and the evaluator's results: the mean, and the errors at (0, 0), (30, 20) and (60, 46).
type Case = (Pattern, Pattern, f32, f32, [f32; 3]);

const CASES: [Case; 7] = [
    (noise, other_noise, PIXELS_PER_DEGREE, 0.442_987, [0.84758, 0.27826, 0.66250]),
    (noise, other_noise, 20.0, 0.850_590, [0.90856, 0.95430, 0.83099]),
    (gradient, grainy_gradient, PIXELS_PER_DEGREE, 0.109_067, [0.12777, 0.06337, 0.14160]),
    (gradient, dim_gradient, PIXELS_PER_DEGREE, 0.315_104, [0.01324, 0.23242, 0.32286]),
    (squares, blurred_squares, PIXELS_PER_DEGREE, 0.227_742, [0.01010, 0.30778, 0.43503]),
    (squares, shifted_squares, PIXELS_PER_DEGREE, 0.543_811, [0.07734, 0.79156, 0.31677]),
    (squares, shifted_squares, 150.0, 0.343_572, [0.21906, 0.58361, 0.25424]),
];

/// Difference from the evaluator's mean, and largest difference from its pixels.
fn deviation(map: &FlipMap, (_, _, _, mean, pixels): &Case) -> (f32, f32) {
    let at = [(0, 0), (30, 20), (60, 46)].map(|(x, y)| map.errors[y * WIDTH + x]);
    let pixel = at.iter().zip(pixels).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    ((map.mean() - mean).abs(), pixel)
}

/// The evaluator and its filters sum millions of numbers in 32 bits: the error is 8e-6 on images of half a million pixels.
const MEAN_TOLERANCE: f32 = 2e-5;
/// In pixels with almost no error, the rounding error is raised to the powers 0.5 and 0.7: 4e-4 on images with flat areas.
const PIXEL_TOLERANCE: f32 = 5e-4;

#[test]
fn errors_match_the_evaluator() {
    for case in &CASES {
        let (reference, test, pixels_per_degree, ..) = *case;
        let map = flip_ldr(&rendering(reference), &rendering(test), pixels_per_degree).unwrap();
        let (mean, pixel) = deviation(&map, case);
        assert!(mean < MEAN_TOLERANCE && pixel < PIXEL_TOLERANCE, "{case:?}: mean off by {mean}, a pixel by {pixel}");
        assert!(map.errors.iter().all(|e| (0.0..=1.0).contains(e)));
    }
}

#[test]
fn the_comparison_detects_a_viewing_distance_that_is_5_per_cent_off() {
    for case in &CASES {
        let (reference, test, pixels_per_degree, ..) = *case;
        let map = flip_ldr(&rendering(reference), &rendering(test), 1.05 * pixels_per_degree).unwrap();
        let (mean, pixel) = deviation(&map, case);
        assert!(
            mean > MEAN_TOLERANCE && pixel > PIXEL_TOLERANCE,
            "{case:?}: blind; mean off by {mean}, a pixel by {pixel}"
        );
    }
}

/// A uniform image has no features. Greys are neutral up to rounding, which the power 0.7 raises to 1e-5.
#[test]
fn uniform_images_match_the_evaluator() {
    let (black, white) = ([0.0; 3], [1.0; 3]);
    for (reference, test, expected) in [
        (black, white, 0.967_388),
        (white, black, 0.967_388),
        ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.986_665),
        ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 1.0),
        ([0.5; 3], [0.6; 3], 0.285_038),
        // Clamped.
        ([-3.0; 3], [f32::INFINITY; 3], 0.967_388),
    ] {
        let map = flip_ldr(&uniform(reference), &uniform(test), PIXELS_PER_DEGREE).unwrap();
        for error in map.errors {
            assert!((error - expected).abs() < 2e-5, "{reference:?}, {test:?}: {error}, not {expected}");
        }
    }
}

#[test]
fn an_image_does_not_differ_from_itself() {
    for pattern in [noise, gradient, squares] {
        let map = flip_ldr(&rendering(pattern), &rendering(pattern), PIXELS_PER_DEGREE).unwrap();
        assert_eq!((map.width, map.height, map.errors.len()), (WIDTH, HEIGHT, WIDTH * HEIGHT));
        assert!(map.errors.iter().all(|e| *e == 0.0));
        assert_eq!(map.mean(), 0.0);
    }
}

#[test]
fn the_measure_is_symmetric() {
    for (a, b, pixels_per_degree, ..) in CASES {
        let (a, b) = (rendering(a), rendering(b));
        assert_eq!(flip_ldr(&a, &b, pixels_per_degree).unwrap(), flip_ldr(&b, &a, pixels_per_degree).unwrap());
    }
}

#[test]
fn one_wrong_pixel_is_located() {
    let reference = uniform([0.5; 3]);
    let mut test = reference.clone();
    test.pixels[20 * 4 + 15] = [1.0; 3];
    let map = flip_ldr(&reference, &test, PIXELS_PER_DEGREE).unwrap();
    let largest = map.errors.iter().copied().fold(0.0, f32::max);
    assert!(largest > 0.3, "only {largest}");
    assert_eq!(map.errors[20 * 4 + 15], largest);
    // The widest filter reaches 10 pixels.
    assert!(map.errors.iter().enumerate().all(|(i, e)| (i % 20).abs_diff(15) <= 10 || *e == 0.0));
}

#[test]
fn images_may_be_smaller_than_the_filters_or_empty() {
    for (width, height) in [(0, 0), (0, 3), (3, 0), (1, 1), (2, 3), (61, 1)] {
        let [black, white] = [0.0, 1.0].map(|v| RgbImage::new(width, height, vec![[v; 3]; width * height]).unwrap());
        for pixels_per_degree in [2.0, PIXELS_PER_DEGREE, 1000.0] {
            let map = flip_ldr(&black, &white, pixels_per_degree).unwrap();
            assert_eq!((map.width, map.height, map.errors.len()), (width, height, width * height));
            let expected = if map.errors.is_empty() { 0.0 } else { 0.967_388 };
            assert!((map.mean() - expected).abs() < 2e-5, "{width}×{height}, {pixels_per_degree}: {}", map.mean());
        }
    }
}

#[test]
fn bad_input_is_refused() {
    let image = uniform([0.5; 3]);
    let wide = RgbImage::new(40, 10, image.pixels.clone()).unwrap();
    assert!(matches!(
        flip_ldr(&image, &wide, PIXELS_PER_DEGREE),
        Err(MetricsError::SizeMismatch { image: (40, 10), reference: (20, 20) })
    ));
    for pixels_per_degree in [0.0, -67.0, 1.9, 1e9, f32::INFINITY, f32::NAN] {
        let result = flip_ldr(&image, &image, pixels_per_degree);
        assert!(matches!(result, Err(MetricsError::PixelsPerDegree { .. })), "{pixels_per_degree}");
    }
    let mut broken = image.clone();
    broken.pixels[20 * 3 + 7][1] = f32::NAN;
    for (reference, test) in [(&image, &broken), (&broken, &image)] {
        let result = flip_ldr(reference, test, PIXELS_PER_DEGREE);
        assert!(matches!(result, Err(MetricsError::NotANumber { x: 7, y: 3 })));
    }
}

#[test]
fn the_image_of_errors_goes_from_black_to_pale_yellow() {
    let errors = vec![0.0, 0.5, 1.0, -1.0, 2.0, f32::NAN];
    let map = FlipMap { width: 6, height: 1, errors };
    let (black, yellow) = ([0, 0, 4], [252, 253, 191]);
    assert_eq!(map.magma(), [black, [183, 55, 121], yellow, black, yellow, black].concat());

    // Lightness is monotonic.
    let lightness: Vec<f32> = (0..=255)
        .map(|i| magma::srgb(i as f32 / 255.0).map(|v| f32::from(v) / 255.0))
        .map(|[red, green, blue]| 0.2126 * red.powf(2.2) + 0.7152 * green.powf(2.2) + 0.0722 * blue.powf(2.2))
        .collect();
    // With 8 bits, neighbours may differ only in the last bit of a channel.
    assert!(lightness.windows(4).all(|w| w[0] < w[3]));
}
