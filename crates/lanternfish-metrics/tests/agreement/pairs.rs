//! Comparison with the authors' evaluator of FLIP and with scikit-image, on the images of `tests/pairs`.
//!
//! `tests/pairs/make.py` draws the images and writes `expected.csv`; its head names the versions.

use std::path::PathBuf;

use lanternfish_metrics::{
    Exposures, FlipMap, FlipToneMapper, HdrFlip, HdrFlipMap, PIXELS_PER_DEGREE, Pair, read_exr, read_png,
};

/// A line of `expected.csv`.
struct Case {
    line: String,
    pair: Pair,
    /// `None` for display values.
    tone_mapper: Option<FlipToneMapper>,
    pixels_per_degree: f32,
    /// `None` for display values.
    exposures: Option<Exposures>,
    flip_mean: f64,
    /// Errors at (0, 0), (50, 6) and (30, 45).
    flip_at: [f32; 3],
    /// `None` for linear images.
    ssim: Option<f64>,
}

impl Case {
    fn parse(line: &str) -> Self {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |i: usize| fields[i].parse::<f32>().ok();
        let tone_mapper = FlipToneMapper::ALL.into_iter().find(|mapper| mapper.name() == fields[2]);
        let image = |name: &str| {
            let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/pairs")).join(name);
            if name.ends_with(".png") { read_png(&path).unwrap() } else { read_exr(&path).unwrap() }
        };
        let exposures = tone_mapper.map(|_| Exposures {
            start: number(4).unwrap(),
            stop: number(5).unwrap(),
            count: fields[6].parse().unwrap(),
        });
        Self {
            line: line.to_owned(),
            pair: Pair::new(image(fields[1]), image(fields[0])).unwrap(),
            tone_mapper,
            pixels_per_degree: number(3).unwrap(),
            exposures,
            flip_mean: fields[7].parse().unwrap(),
            flip_at: [8, 9, 10].map(|i| number(i).unwrap()),
            ssim: fields[11].parse().ok(),
        }
    }

    fn all() -> Vec<Self> {
        let cases: Vec<_> = include_str!("../pairs/expected.csv").lines().skip(1).map(Self::parse).collect();
        assert_eq!(cases.len(), 26);
        cases
    }

    /// The error map, at the case's own exposures if it has any, otherwise at the reference's.
    fn flip(&self, pixels_per_degree: f32) -> FlipMap {
        match self.tone_mapper {
            None => self.pair.flip_ldr(pixels_per_degree).unwrap(),
            Some(tone_mapper) => {
                let exposures = self.exposures.filter(|_| self.has_own_exposures());
                self.pair.flip_hdr(&HdrFlip { pixels_per_degree, tone_mapper, exposures }).unwrap().map
            }
        }
    }

    fn has_own_exposures(&self) -> bool {
        self.exposures.is_some_and(|exposures| exposures.count == 4)
    }

    /// Error of a map's mean, and largest error of its pixels.
    fn deviation(&self, map: &FlipMap) -> (f64, f32) {
        let at = [(0, 0), (50, 6), (30, 45)].map(|(x, y)| map.errors[y * map.width + x]);
        let pixel = at.iter().zip(self.flip_at).map(|(actual, expected)| (actual - expected).abs()).fold(0.0, f32::max);
        ((self.pair.mean_of(map) - self.flip_mean).abs(), pixel)
    }
}

/// Both sides filter and sum in 32 bits: the measured error is at most 7e-7, and `pow` differs between systems.
const MEAN_TOLERANCE: f64 = 3e-6;
/// The measured error is 8e-6. In pixels with almost no error, the rounding error is raised to the powers 0.5 and 0.7.
const PIXEL_TOLERANCE: f32 = 1e-4;

#[test]
fn flip_matches_the_evaluator() {
    let mut worst = (0.0f64, 0.0f32);
    for case in Case::all() {
        let (mean, pixel) = case.deviation(&case.flip(case.pixels_per_degree));
        worst = (worst.0.max(mean), worst.1.max(pixel));
        assert!(mean < MEAN_TOLERANCE && pixel < PIXEL_TOLERANCE, "{}: off by {mean}, {pixel}", case.line);
    }
    println!("off by {} in the mean, by {} in a pixel at most", worst.0, worst.1);
}

#[test]
fn exposures_match_the_evaluator() {
    for case in Case::all().into_iter().filter(|case| !case.has_own_exposures()) {
        let (Some(tone_mapper), Some(expected)) = (case.tone_mapper, case.exposures) else { continue };
        let actual = Exposures::of(case.pair.reference(), tone_mapper);
        assert_eq!(actual.count, expected.count, "{}", case.line);
        // Rounding errors of the luminance and of the logarithm.
        let close = |a: f32, b: f32| (a - b).abs() < 4e-6;
        assert!(close(actual.start, expected.start) && close(actual.stop, expected.stop), "{}: {actual:?}", case.line);
    }
}

#[test]
fn the_comparison_detects_another_viewing_distance_and_another_tone_mapper() {
    for case in Case::all() {
        let (mean, _) = case.deviation(&case.flip(1.05 * case.pixels_per_degree));
        assert!(mean > MEAN_TOLERANCE, "{}: blind; off by {mean}", case.line);
        // Lit lamps against unlit ones have the largest error on every curve.
        if let Some(right) = case.tone_mapper.filter(|_| !case.line.starts_with("dim-unlit")) {
            let tone_mapper = FlipToneMapper::ALL.into_iter().find(|mapper| *mapper != right).unwrap();
            let looks = HdrFlip { tone_mapper, pixels_per_degree: case.pixels_per_degree, exposures: case.exposures };
            let (mean, _) = case.deviation(&case.pair.flip_hdr(&looks).unwrap().map);
            assert!(mean > MEAN_TOLERANCE, "{}: blind; off by {mean}", case.line);
        }
    }
}

#[test]
fn ssim_matches_scikit_image() {
    let cases: Vec<_> = Case::all().into_iter().filter(|case| case.ssim.is_some()).collect();
    assert_eq!(cases.len(), 5);
    for case in cases {
        // Luma is f32 here and f64 there.
        let (actual, expected) = (case.pair.ssim().unwrap(), case.ssim.unwrap());
        assert!((actual - expected).abs() < 1e-6, "{}: {actual}", case.line);
    }
}

#[test]
fn fewer_exposures_change_hdr_flip() {
    let case = &Case::all()[5];
    let HdrFlipMap { map, exposures } = case.pair.flip_hdr(&HdrFlip::default()).unwrap();
    let fewer = Exposures { count: 1, ..exposures };
    let looks = HdrFlip { exposures: Some(fewer), ..HdrFlip::default() };
    let first = case.pair.flip_hdr(&looks).unwrap().map;
    assert!(first.errors.iter().zip(&map.errors).all(|(first, all)| first <= all));
    assert!(case.pair.mean_of(&first) < 0.5 * case.pair.mean_of(&map));
}

#[test]
fn an_image_does_not_differ_from_itself_and_a_black_reference_is_allowed() {
    let case = &Case::all()[5];
    let reference = case.pair.reference();
    let same = Pair::new(reference.clone(), reference.clone()).unwrap();
    assert!(same.flip_hdr(&HdrFlip::default()).unwrap().map.errors.iter().all(|e| *e == 0.0));
    let black = lanternfish_metrics::RgbImage { pixels: vec![[0.0; 3]; reference.pixels.len()], ..*reference };
    let unlit = Pair::new(black.clone(), black.clone()).unwrap();
    assert_eq!(unlit.mean_of(&unlit.flip_hdr(&HdrFlip::default()).unwrap().map), 0.0);
    // Any light against black has the largest error.
    let lit = Pair::new(reference.clone(), black).unwrap();
    let mean = lit.mean_of(&lit.flip_hdr(&HdrFlip::default()).unwrap().map);
    assert!((mean - 0.967_388).abs() < 1e-4, "{mean}");
}

#[test]
fn exposures_out_of_range_are_refused() {
    let case = &Case::all()[5];
    for (start, stop, count) in
        [(1.0, 0.0, 3), (0.0, 1.0, 0), (0.0, 1.0, 1000), (f32::NAN, 1.0, 2), (0.0, f32::INFINITY, 2), (-500.0, 0.0, 2)]
    {
        let looks = HdrFlip { exposures: Some(Exposures { start, stop, count }), ..HdrFlip::default() };
        assert!(case.pair.flip_hdr(&looks).is_err(), "{start} {stop} {count}");
    }
    let looks = HdrFlip { pixels_per_degree: PIXELS_PER_DEGREE * 100.0, ..HdrFlip::default() };
    assert!(case.pair.flip_hdr(&looks).is_err());
}
