//! What is measured [VanGelderen2020, §6.1.3, §6.1.4, §6.2].

use lanternfish::settings::{Assignment, ClusterShape, Clustered, Culling, Grouping, Settings, Shadows};
use serde::Serialize;

/// [VanGelderen2020, §6.1.4].
pub const LIGHT_COUNTS: &[u32] = &[1_000, 10_000, 100_000];
/// Those of the promises.
pub const QUICK_LIGHT_COUNTS: &[u32] = &[10_000, 100_000];

/// Tests of a light against a cluster that every light against every visible cluster may come to; with more, that row is
/// left out. Twice as many are made, for lists are counted and then written.
pub const BRUTE_FORCE_TESTS: u64 = 300_000_000;

/// How far from the eye clusters reach in the thesis, in whose units its cubes and displacements are [VanGelderen2020, §6.1.3].
const DEPTH: f32 = 100.0;
/// Rows of the thesis' pictures, in whose pixels its clusters are [VanGelderen2020, §6.1.5].
const ROWS: f32 = 720.0;
/// Width of a cluster at least, pixels.
const LEAST_PIXELS: u32 = 4;

/// One picture, or two, and how two share clusters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Views {
    Mono,
    StereoIndividual,
    StereoEnclosed,
}

impl Views {
    pub fn grouping(self) -> Grouping {
        match self {
            Self::Mono | Self::StereoIndividual => Grouping::Individual,
            Self::StereoEnclosed => Grouping::Enclosed,
        }
    }
}

impl std::fmt::Display for Views {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Mono => "mono",
            Self::StereoIndividual => "stereo, individual",
            Self::StereoEnclosed => "stereo, enclosed",
        })
    }
}

/// The shapes of [VanGelderen2020, §6.2] and those around them, in pixels that fit a picture of so many `rows`, and in metres that
/// fit clusters which reach `depth`, m, from the eye.
pub fn shapes(rows: u32, depth: f32, quick: bool) -> Vec<ClusterShape> {
    let pixels = |pixels: f32| ((pixels * rows as f32 / ROWS).round() as u32).max(LEAST_PIXELS);
    let metres = |metres: f32| two_digits(metres * depth / DEPTH);
    let perspective = |width| ClusterShape::Perspective { pixels: pixels(width) };
    let orthographic = |side| ClusterShape::Orthographic { side: metres(side) };
    let displaced = |width, distance| ClusterShape::Displaced { pixels: pixels(width), distance: metres(distance) };
    if quick {
        return vec![perspective(64.0), orthographic(4.0), displaced(64.0, 32.0)];
    }
    let mut shapes: Vec<_> = [16.0, 32.0, 64.0, 128.0].map(perspective).into();
    shapes.extend([1.0, 2.0, 4.0, 8.0].map(orthographic));
    shapes.extend([displaced(64.0, 8.0), displaced(64.0, 32.0)]);
    // In a small picture two may be one.
    shapes.dedup();
    shapes
}

/// To two decimal digits, so that names are short.
fn two_digits(value: f32) -> f32 {
    format!("{value:.1e}").parse().expect("a number as it was printed")
}

/// No shadows: it is lists that are measured.
pub fn settings(shape: ClusterShape, grouping: Grouping, assignment: Assignment) -> Settings {
    let clustered = Clustered { shape, grouping, assignment, ..Clustered::default() };
    Settings { culling: Culling::Clustered(clustered), shadows: Shadows::None, ..Settings::direct_light() }
}

#[test]
fn shapes_grow_with_picture_and_depth() {
    let side = |depth| shapes(720, depth, false)[4];
    assert_eq!(side(100.0), ClusterShape::Orthographic { side: 1.0 });
    assert_eq!(side(5000.0), ClusterShape::Orthographic { side: 50.0 });
    assert_eq!(side(33.3), ClusterShape::Orthographic { side: 0.33 });
    // Those that the thesis judges best.
    assert_eq!(shapes(720, 100.0, true)[0], ClusterShape::Perspective { pixels: 64 });
    assert_eq!(shapes(720, 100.0, true)[1], ClusterShape::Orthographic { side: 4.0 });
    assert_eq!(shapes(720, 100.0, true)[2], ClusterShape::Displaced { pixels: 64, distance: 32.0 });
    assert_eq!(shapes(180, 100.0, true)[2], ClusterShape::Displaced { pixels: 16, distance: 32.0 });
    assert_eq!(shapes(90, 100.0, false).iter().filter(|s| **s == ClusterShape::Perspective { pixels: 4 }).count(), 1);
}
