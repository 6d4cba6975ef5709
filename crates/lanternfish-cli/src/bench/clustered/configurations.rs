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

/// Diagonal of a scene, m, whose cubes and displacements are those of the thesis.
const DIAGONAL: f32 = 40.0;
/// Rows of a picture whose clusters are as many pixels wide as those of the thesis.
const ROWS: f32 = 1080.0;
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

/// The shapes of [VanGelderen2020, §6.2] and those around them, in pixels that fit a picture of so many `rows` and metres that
/// fit a scene with this `diagonal`, m.
pub fn shapes(rows: u32, diagonal: f32, quick: bool) -> Vec<ClusterShape> {
    let pixels = |pixels: f32| ((pixels * rows as f32 / ROWS).round() as u32).max(LEAST_PIXELS);
    let metres = |metres: f32| two_digits(metres * diagonal / DIAGONAL);
    let perspective = |width| ClusterShape::Perspective { pixels: pixels(width) };
    let orthographic = |side| ClusterShape::Orthographic { side: metres(side) };
    let displaced = |width, distance| ClusterShape::Displaced { pixels: pixels(width), distance: metres(distance) };
    if quick {
        return vec![perspective(32.0), orthographic(1.0), displaced(64.0, 32.0)];
    }
    let mut shapes: Vec<_> = [16.0, 32.0, 64.0, 128.0].map(perspective).into();
    shapes.extend([0.5, 1.0, 2.0, 4.0].map(orthographic));
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
fn shapes_grow_with_picture_and_scene() {
    let side = |diagonal| shapes(1080, diagonal, false)[4];
    assert_eq!(side(40.0), ClusterShape::Orthographic { side: 0.5 });
    assert_eq!(side(4000.0), ClusterShape::Orthographic { side: 50.0 });
    assert_eq!(side(33.3), ClusterShape::Orthographic { side: 0.42 });
    assert_eq!(shapes(1080, 40.0, true)[2], ClusterShape::Displaced { pixels: 64, distance: 32.0 });
    assert_eq!(shapes(270, 40.0, true)[2], ClusterShape::Displaced { pixels: 16, distance: 32.0 });
    assert_eq!(shapes(90, 40.0, false).iter().filter(|s| **s == ClusterShape::Perspective { pixels: 4 }).count(), 1);
}
