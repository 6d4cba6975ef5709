//! Properties of FLIP. `tests/agreement` compares it with the authors' evaluator; here are uniform images: `flip-evaluator` 1.7 of PyPI,
//! `evaluate(reference, test, "LDR", applyMagma=False, parameters={"ppd": …})`.

use super::*;

const WIDTH: usize = 61;
const HEIGHT: usize = 47;

/// Bytes as a function of x, y and channel.
fn rendering(pattern: fn(usize, usize, usize) -> usize) -> RgbImage {
    let pixel = |i: usize| [0, 1, 2].map(|channel| pattern(i % WIDTH, i / WIDTH, channel) as f32 / 255.0);
    RgbImage::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(pixel).collect()).unwrap()
}

fn gradient(x: usize, y: usize, channel: usize) -> usize {
    [x * 255 / 60, y * 255 / 46, (x + y) * 255 / 106][channel]
}

/// Squares of 5 × 5 pixels, pseudo-random.
fn squares(x: usize, y: usize, channel: usize) -> usize {
    (31 * (x / 5) + 17 * (y / 5) + 89 * channel) * 57 % 256
}

fn uniform(color: [f32; 3]) -> RgbImage {
    RgbImage::new(20, 20, vec![color; 400]).unwrap()
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
    for pattern in [gradient, squares] {
        let map = flip_ldr(&rendering(pattern), &rendering(pattern), PIXELS_PER_DEGREE).unwrap();
        assert_eq!((map.width, map.height, map.errors.len()), (WIDTH, HEIGHT, WIDTH * HEIGHT));
        assert!(map.errors.iter().all(|e| *e == 0.0));
        assert_eq!(map.mean(), 0.0);
    }
}

#[test]
fn the_measure_is_symmetric() {
    let (a, b) = (rendering(gradient), rendering(squares));
    assert_eq!(flip_ldr(&a, &b, PIXELS_PER_DEGREE).unwrap(), flip_ldr(&b, &a, PIXELS_PER_DEGREE).unwrap());
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
