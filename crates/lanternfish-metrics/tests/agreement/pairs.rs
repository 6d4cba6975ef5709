//! Against the authors' evaluator of FLIP and scikit-image, on the images of `tests/pairs`.
//!
//! `tests/pairs/make.py` draws the images and writes `expected.csv`; its head says with which versions.

use std::path::PathBuf;

use lanternfish_metrics::{
    Exposures, FlipMap, FlipToneMapper, HdrFlip, HdrFlipMap, PIXELS_PER_DEGREE, Pair, read_exr, read_png,
};

/// A line of `expected.csv`.
struct Case {
    line: String,
    pair: Pair,
    /// `None` of display values.
    tone_mapper: Option<FlipToneMapper>,
    pixels_per_degree: f32,
    /// `None` of display values.
    exposures: Option<Exposures>,
    flip_mean: f64,
    /// At (0, 0), (50, 6) and (30, 45).
    flip_at: [f32; 3],
    /// `None` of linear images.
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

    /// At the exposures that are expected where they are not those of the reference.
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

    /// By how much a map's mean and its pixels are off at most.
    fn deviation(&self, map: &FlipMap) -> (f64, f32) {
        let at = [(0, 0), (50, 6), (30, 45)].map(|(x, y)| map.errors[y * map.width + x]);
        let pixel = at.iter().zip(self.flip_at).map(|(got, expected)| (got - expected).abs()).fold(0.0, f32::max);
        ((self.pair.mean_of(map) - self.flip_mean).abs(), pixel)
    }
}

/// Both sides filter and add up in 32 bits: 7e-7 at most is found, and libraries for powers differ between systems.
const MEAN_TOLERANCE: f64 = 3e-6;
/// 8e-6 is found. In pixels with almost no error, rounding is raised to the powers 0.5 and 0.7.
const PIXEL_TOLERANCE: f32 = 1e-4;

#[test]
fn flip_is_that_of_the_authors() {
    let mut worst = (0.0f64, 0.0f32);
    for case in Case::all() {
        let (mean, pixel) = case.deviation(&case.flip(case.pixels_per_degree));
        worst = (worst.0.max(mean), worst.1.max(pixel));
        assert!(mean < MEAN_TOLERANCE && pixel < PIXEL_TOLERANCE, "{}: off by {mean}, {pixel}", case.line);
    }
    println!("off by {} in the mean, by {} in a pixel at most", worst.0, worst.1);
}

#[test]
fn the_exposures_are_those_of_the_authors() {
    for case in Case::all().into_iter().filter(|case| !case.has_own_exposures()) {
        let (Some(tone_mapper), Some(expected)) = (case.tone_mapper, case.exposures) else { continue };
        let got = Exposures::of(case.pair.reference(), tone_mapper);
        assert_eq!(got.count, expected.count, "{}", case.line);
        // Roundings of the luminance and of the logarithm.
        let close = |a: f32, b: f32| (a - b).abs() < 4e-6;
        assert!(close(got.start, expected.start) && close(got.stop, expected.stop), "{}: {got:?}", case.line);
    }
}

#[test]
fn the_comparison_sees_an_observer_who_is_5_per_cent_off_and_another_tone_mapper() {
    for case in Case::all() {
        let (mean, _) = case.deviation(&case.flip(1.05 * case.pixels_per_degree));
        assert!(mean > MEAN_TOLERANCE, "{}: blind; off by {mean}", case.line);
        // Lamps that are there against lamps that are not are as different as can be on every curve.
        if let Some(right) = case.tone_mapper.filter(|_| !case.line.starts_with("dim-unlit")) {
            let tone_mapper = FlipToneMapper::ALL.into_iter().find(|mapper| *mapper != right).unwrap();
            let looks = HdrFlip { tone_mapper, pixels_per_degree: case.pixels_per_degree, exposures: case.exposures };
            let (mean, _) = case.deviation(&case.pair.flip_hdr(&looks).unwrap().map);
            assert!(mean > MEAN_TOLERANCE, "{}: blind; off by {mean}", case.line);
        }
    }
}

#[test]
fn ssim_is_that_of_scikit_image() {
    let cases: Vec<_> = Case::all().into_iter().filter(|case| case.ssim.is_some()).collect();
    assert_eq!(cases.len(), 5);
    for case in cases {
        // Luma of f32 here, of doubles there.
        let (got, expected) = (case.pair.ssim().unwrap(), case.ssim.unwrap());
        assert!((got - expected).abs() < 1e-6, "{}: {got}", case.line);
    }
}

#[test]
fn an_exposure_that_is_left_out_changes_hdr_flip() {
    let case = &Case::all()[5];
    let HdrFlipMap { map, exposures } = case.pair.flip_hdr(&HdrFlip::default()).unwrap();
    let fewer = Exposures { count: 1, ..exposures };
    let looks = HdrFlip { exposures: Some(fewer), ..HdrFlip::default() };
    let first = case.pair.flip_hdr(&looks).unwrap().map;
    assert!(first.errors.iter().zip(&map.errors).all(|(first, all)| first <= all));
    assert!(case.pair.mean_of(&first) < 0.5 * case.pair.mean_of(&map));
}

#[test]
fn a_image_does_not_differ_from_itself_and_black_may_be_a_reference() {
    let case = &Case::all()[5];
    let reference = case.pair.reference();
    let same = Pair::new(reference.clone(), reference.clone()).unwrap();
    assert!(same.flip_hdr(&HdrFlip::default()).unwrap().map.errors.iter().all(|e| *e == 0.0));
    let black = lanternfish_metrics::RgbImage { pixels: vec![[0.0; 3]; reference.pixels.len()], ..*reference };
    let unlit = Pair::new(black.clone(), black.clone()).unwrap();
    assert_eq!(unlit.mean_of(&unlit.flip_hdr(&HdrFlip::default()).unwrap().map), 0.0);
    // Any light at all is seen as far as can be.
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
