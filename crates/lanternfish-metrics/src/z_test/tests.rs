use super::*;

const WIDTH: usize = 96;
const HEIGHT: usize = 64;

/// A generator of 64 random bits per call (SplitMix64).
struct Random(u64);

impl Random {
    /// A uniform number in 0..1, both ends exclusive.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (((z ^ (z >> 31)) >> 12) as f64 + 0.5) / (1u64 << 52) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// The noise-free image, 0.2 to 2.
fn expected(i: usize) -> [f64; 3] {
    let (x, y) = ((i % WIDTH) as f64 / WIDTH as f64, (i / WIDTH) as f64 / HEIGHT as f64);
    [0.2 + 1.8 * x, 0.2 + y, 1.0 - 0.5 * x * y]
}

fn image_of(pixel: impl FnMut(usize) -> [f64; 3]) -> RgbImage {
    RgbImage::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(pixel).map(|p| p.map(|v| v as f32)).collect()).unwrap()
}

/// An image with normal noise of a tenth of each value, and its variance. `change` modifies the expected value.
fn noisy(seed: u64, change: impl Fn(usize, f64) -> f64) -> (RgbImage, RgbImage) {
    let mut random = Random(seed);
    let image = image_of(|i| expected(i).map(|v| change(i, v) + 0.1 * v * random.normal()));
    (image, image_of(|i| expected(i).map(|v| (0.1 * v).powi(2))))
}

fn unchanged(_: usize, value: f64) -> f64 {
    value
}

fn test_of((a, va): &(RgbImage, RgbImage), (b, vb): &(RgbImage, RgbImage)) -> ZTest {
    Pair::new(a.clone(), b.clone()).unwrap().z_test(Some(va), Some(vb)).unwrap()
}

#[test]
fn equal_noise_is_noise() {
    for seed in 0..20 {
        let test = test_of(&noisy(seed, unchanged), &noisy(1000 + seed, unchanged));
        assert_eq!((test.value_count, test.verdict()), (3 * WIDTH * HEIGHT, ZVerdict::Noise), "{seed}: {test:?}");
        // Four standard deviations of means over 18432 normal values.
        assert!(test.mean_z.abs() < 0.03 && (test.mean_z_squared - 1.0).abs() < 0.042, "{test:?}");
        assert!(
            (test.share_beyond_2 - 0.0455).abs() < 0.0062 && (test.share_beyond_3 - 0.0027).abs() < 0.0016,
            "{test:?}"
        );
    }
}

/// Under noise alone, p values are uniform in 0..1: after the factor six, at most a tenth of them are below 0.1.
#[test]
fn noise_is_rarely_improbable() {
    let p = |seed| test_of(&noisy(seed, unchanged), &noisy(1000 + seed, unchanged)).p_value();
    let low = (0..100).filter(|seed| p(*seed) < 0.1).count();
    // The mean is at most 10; 20 is 3.3 standard deviations more. Without the factor six it would be 47.
    assert!(low <= 20, "{low}");
}

#[test]
fn a_change_of_1_per_cent_is_detected() {
    for (seed, factor) in [(1, 1.01), (2, 0.99)] {
        let test = test_of(&noisy(seed, |_, v| factor * v), &noisy(1000 + seed, unchanged));
        assert_eq!(test.verdict(), ZVerdict::Offset, "{test:?}");
        assert!(test.p_value() < 1e-6 && (test.mean_z > 0.0) == (factor > 1.0), "{} {test:?}", test.p_value());
    }
    // A change of one channel.
    let reference = noisy(3, unchanged);
    let mut image = noisy(4, unchanged);
    image.0.pixels.iter_mut().for_each(|pixel| pixel[2] *= 1.01);
    let test = test_of(&image, &reference);
    assert_eq!(test.verdict(), ZVerdict::Offset, "{test:?}");
    assert!(test.offset[2] > 4.0 && test.offset[0].abs() < 4.0, "{test:?}");
}

#[test]
fn changes_that_cancel_out_are_detected() {
    // The left half is 0.03 brighter and the right half 0.03 darker, so that the sum is unchanged.
    let test = test_of(&noisy(5, |i, v| v + if i % WIDTH < WIDTH / 2 { 0.03 } else { -0.03 }), &noisy(6, unchanged));
    assert_eq!(test.verdict(), ZVerdict::Spread, "{test:?}");
    assert!(test.offset.iter().all(|d| d.abs() < 4.0), "{test:?}");
}

#[test]
fn wrong_variances_are_detected() {
    let scaled = |(image, variance): (RgbImage, RgbImage), factor: f32| {
        let pixels = variance.pixels.iter().map(|p| p.map(|v| factor * v)).collect();
        (image, RgbImage { pixels, ..variance })
    };
    let small = test_of(&scaled(noisy(7, unchanged), 0.25), &scaled(noisy(8, unchanged), 0.25));
    assert!((small.mean_z_squared - 4.0).abs() < 0.2, "{small:?}");
    assert_eq!(small.verdict(), ZVerdict::Spread);
    let large = test_of(&scaled(noisy(7, unchanged), 9.0), &scaled(noisy(8, unchanged), 9.0));
    assert_eq!(large.verdict(), ZVerdict::TooAlike, "{large:?}");
    let same = noisy(9, unchanged);
    assert_eq!(test_of(&same, &same).verdict(), ZVerdict::TooAlike);
}

/// Path-traced images: few samples, most of them dark, and variances estimated from the same samples. A pixel that is too
/// dark therefore has too small a variance.
#[test]
fn few_skewed_samples_of_two_counts_are_no_difference() {
    let traced = |seed: u64, count: usize, factor: f64| {
        let mut random = Random(seed);
        let mut variances = Vec::new();
        let image = image_of(|i| {
            let estimates = expected(i).map(|v| {
                // One sample in five is lit, with an exponential distribution: a skewness of 4.6.
                let samples: Vec<f64> = (0..count)
                    .map(|_| if random.uniform() < 0.2 { -5.0 * factor * v * random.uniform().ln() } else { 0.0 })
                    .collect();
                let mean = samples.iter().sum::<f64>() / count as f64;
                let square = samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (count - 1) as f64;
                (mean, square / count as f64)
            });
            variances.push(estimates.map(|(_, variance)| variance as f32));
            estimates.map(|(mean, _)| mean)
        });
        (image, RgbImage::new(WIDTH, HEIGHT, variances).unwrap())
    };
    let reference = traced(11, 256, 1.0);
    for seed in 20..30 {
        let test = test_of(&traced(seed, 16, 1.0), &reference);
        assert_eq!(test.verdict(), ZVerdict::Noise, "{seed}: {} {test:?}", test.p_value());
        // Here, the plain mean of z would be off by 25 standard deviations.
        assert!(test.mean_z < -0.1, "{test:?}");
    }
    // Noise of 75 % per value: a change of 5 % is still detected.
    assert_eq!(test_of(&traced(40, 16, 1.05), &reference).verdict(), ZVerdict::Offset);
}

#[test]
fn values_without_variance_are_counted_and_not_tested() {
    let (mut a, b) = (noisy(1, unchanged), noisy(2, unchanged));
    let mut b = (b.0, RgbImage { pixels: vec![[0.0; 3]; WIDTH * HEIGHT], ..b.1 });
    a.1.pixels[0] = [0.0, 0.0, 1.0];
    a.0.pixels[0] = [1.0, 2.0, 3.0];
    b.0.pixels[0] = [1.0, 2.5, 3.0];
    a.1.pixels[1] = [f32::NAN, 1.0, 1.0];
    b.1.pixels[2] = [1.0, 1.0, -1.0];
    let test = test_of(&a, &b);
    assert_eq!((test.certain_equal, test.certain_different, test.invalid_variance), (1, 1, 2));
    assert_eq!(test.value_count, 3 * (WIDTH * HEIGHT - 3) + 1);
    assert!(test.mean_z.is_finite() && test.mean_z_squared.is_finite());
}

#[test]
fn one_variance_is_enough_and_none_is_an_error() {
    let (image, variance) = noisy(1, unchanged);
    let pair = Pair::new(image, image_of(expected)).unwrap();
    assert_eq!(pair.z_test(Some(&variance), None).unwrap().verdict(), ZVerdict::Noise);
    assert!(matches!(pair.z_test(None, None), Err(MetricsError::NoVariance)));
    let small = RgbImage::new(1, 1, vec![[1.0; 3]]).unwrap();
    assert!(matches!(pair.z_test(None, Some(&small)), Err(MetricsError::SizeMismatch { .. })));
    let nothing = RgbImage { pixels: vec![[0.0; 3]; WIDTH * HEIGHT], ..variance };
    let test = pair.z_test(Some(&nothing), None).unwrap();
    assert_eq!((test.verdict(), test.value_count, test.certain_different), (ZVerdict::Untested, 0, 3 * WIDTH * HEIGHT));
    assert!(test.p_value().is_nan());
}
