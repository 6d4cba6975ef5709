use super::*;
use crate::PIXELS_PER_DEGREE;

fn grey(width: usize, height: usize) -> RgbImage {
    let value = |i: usize| [0.1 + (i * 7 % 50) as f32 / 60.0; 3];
    RgbImage::new(width, height, (0..width * height).map(value).collect()).unwrap()
}

fn pair(image: &RgbImage, reference: &RgbImage) -> Pair {
    Pair::new(image.clone(), reference.clone()).unwrap()
}

#[test]
fn invalid_pixels_are_counted_by_kind_and_left_out() {
    let reference = grey(32, 20);
    let mut broken = reference.clone();
    broken.pixels[5] = [f32::NAN, f32::INFINITY, 1.0];
    broken.pixels[6] = [f32::NEG_INFINITY, -1.0, 1.0];
    broken.pixels[7] = [0.0, f32::NAN, f32::NAN];
    let faults = PixelFaults { nan: 2, positive_infinity: 1, negative_infinity: 1, negative: 1, not_finite: 3 };
    for (a, b, expected) in [
        (&broken, &reference, [faults, PixelFaults::default()]),
        (&reference, &broken, [PixelFaults::default(), faults]),
        (&broken, &broken, [faults, faults]),
    ] {
        let pair = pair(a, b);
        assert_eq!(pair.faults(), expected);
        assert_eq!((pair.compared_count(), pair.is_compared()[4], pair.is_compared()[5]), (637, true, false));
        let errors = pair.errors();
        assert_eq!((errors.mse, errors.relative.max, errors.energy_ratio), (0.0, 0.0, 1.0));
        let shown = pair.shown(0.0);
        assert_eq!(shown.psnr(), f64::INFINITY);
        assert_eq!(shown.ssim().unwrap(), 1.0);
        assert_eq!(pair.mean_of(&shown.flip_ldr(PIXELS_PER_DEGREE).unwrap()), 0.0);
        assert_eq!(pair.mean_of(&pair.flip_hdr(&HdrFlip::default()).unwrap().map), 0.0);
        let variance = RgbImage { pixels: vec![[0.01; 3]; 640], ..reference };
        assert_eq!(pair.z_test(Some(&variance), None).unwrap().value_count, 3 * 637);
    }
    assert_eq!(faults.to_string(), "2 NaN, 1 +inf, 1 -inf, 1 negative");
    assert_eq!(PixelFaults::default().to_string(), "none");
}

#[test]
fn left_out_pixels_do_not_bias_the_means() {
    let reference = grey(32, 20);
    let mut image = RgbImage { pixels: reference.pixels.iter().map(|p| p.map(|v| v + 0.25)).collect(), ..reference };
    let all = pair(&image, &reference).errors();
    // Half of the image.
    image.pixels[..320].fill([f32::NAN; 3]);
    let half = pair(&image, &reference);
    assert!((half.errors().mse - 0.0625).abs() < 1e-6 && (all.mse - 0.0625).abs() < 1e-6);
    assert_eq!(half.compared_count(), 320);
    // For a uniform difference, the lower half is unchanged, except for rows whose filters reach the border.
    let uniform = |v: f32| RgbImage { pixels: vec![[v; 3]; 640], ..reference };
    let all = pair(&uniform(0.5), &uniform(0.6));
    let mut image = uniform(0.5);
    image.pixels[..320].fill([f32::NAN; 3]);
    let half = pair(&image, &uniform(0.6));
    let mean = |pair: &Pair| pair.mean_of(&pair.flip_ldr(20.0).unwrap());
    let map = half.flip_ldr(20.0).unwrap();
    let spread = half.spread_of(&map);
    assert_eq!(spread.mean, half.mean_of(&map));
    assert!(spread.percentile_95 > 0.5 * spread.max && map.errors[..320].iter().all(|e| *e == 0.0), "{spread:?}");
    assert!((mean(&all) / mean(&half) - 1.0).abs() < 0.2, "{} and {}", mean(&all), mean(&half));
}

#[test]
fn nothing_to_compare_is_an_error() {
    let image = grey(4, 4);
    let nan = RgbImage { pixels: vec![[f32::NAN; 3]; 16], ..image };
    assert!(matches!(Pair::new(image.clone(), nan), Err(MetricsError::NothingFinite)));
    let empty = RgbImage::new(0, 4, Vec::new()).unwrap();
    assert!(matches!(Pair::new(empty.clone(), empty), Err(MetricsError::NothingFinite)));
    assert!(matches!(Pair::new(image, grey(2, 8)), Err(MetricsError::SizeMismatch { .. })));
}

#[test]
fn psnr_is_20_db_for_an_error_of_a_tenth() {
    let [a, b] = [0.5, 0.6].map(|v| RgbImage::new(3, 3, vec![[v; 3]; 9]).unwrap());
    assert!((pair(&a, &b).psnr() - 20.0).abs() < 1e-5);
    assert_eq!(pair(&a, &a).psnr(), f64::INFINITY);
}

#[test]
fn one_stop_doubles_the_display_radiance() {
    let image = |v: f32| RgbImage::new(1, 1, vec![[v, 8.0, -1.0]]).unwrap();
    let shown = pair(&image(0.107_02), &image(0.214_04)).shown(1.0);
    // 0.21404 is encoded as 0.5 in sRGB.
    assert!((shown.image().pixels[0][0] - 0.5).abs() < 1e-4);
    let [_, white, black] = shown.image().pixels[0];
    assert!((white - 1.0).abs() < 1e-6 && black == 0.0);
    assert!((srgb_from_linear(0.002) - 0.02584).abs() < 1e-6);
}
