//! The measured configurations [VanGelderen2020, §6.1.3, §6.1.4, §6.2].

use lanternfish::{
    settings::{Settings, Shadows},
    techniques::{Assignment, ClusterShape, Clustered, Grouping},
};
use serde::{Deserialize, Serialize};

/// Numbers of lights [VanGelderen2020, §6.1.4].
pub const LIGHT_COUNTS: &[u32] = &[1_000, 10_000, 100_000];
/// Numbers of lights of a quick run: those that the expected ratios need.
pub const QUICK_LIGHT_COUNTS: &[u32] = &[10_000, 100_000];

/// Most light-cluster tests of a brute-force row; rows with more are left out. Each test runs twice: lists are first counted, then
/// written.
pub const BRUTE_FORCE_TESTS: u64 = 300_000_000;

/// Depth range of the clusters in the thesis, m. Its units are taken as metres [VanGelderen2020, §6.1.3].
pub const DEPTH: u32 = 100;
/// Image height of the thesis, pixels. Its cluster sizes are in pixels of such images [VanGelderen2020, §6.1.5].
const ROWS: f32 = 720.0;
/// Least width of a cluster, pixels.
const LEAST_PIXELS: u32 = 4;

/// One image, or two, and how two share clusters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Views {
    Mono,
    StereoIndividual,
    StereoEnclosed,
    /// A view and one that looks back at it [VanGelderen2020, fig. 4.7].
    UnalignedIndividual,
    UnalignedEnclosed,
}

/// The configurations of every shape.
pub const CONFIGURATIONS: [(Views, Assignment); 4] = [
    (Views::Mono, Assignment::Hierarchy),
    (Views::StereoIndividual, Assignment::Hierarchy),
    (Views::StereoEnclosed, Assignment::Hierarchy),
    (Views::Mono, Assignment::BruteForce),
];
/// Those of one shape of each kind: what one grid saves without a tree, and for views in opposite directions.
pub const OTHERS: [(Views, Assignment); 4] = [
    (Views::StereoIndividual, Assignment::BruteForce),
    (Views::StereoEnclosed, Assignment::BruteForce),
    (Views::UnalignedIndividual, Assignment::Hierarchy),
    (Views::UnalignedEnclosed, Assignment::Hierarchy),
];

impl Views {
    pub fn grouping(self) -> Grouping {
        match self {
            Self::Mono | Self::StereoIndividual | Self::UnalignedIndividual => Grouping::Individual,
            Self::StereoEnclosed | Self::UnalignedEnclosed => Grouping::Enclosed,
        }
    }

    /// The same views with a grid each, if they share one.
    pub fn individual(self) -> Option<Self> {
        match self {
            Self::StereoEnclosed => Some(Self::StereoIndividual),
            Self::UnalignedEnclosed => Some(Self::UnalignedIndividual),
            _ => None,
        }
    }
}

impl std::fmt::Display for Views {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Mono => "mono",
            Self::StereoIndividual => "stereo, individual",
            Self::StereoEnclosed => "stereo, enclosed",
            Self::UnalignedIndividual => "unaligned, individual",
            Self::UnalignedEnclosed => "unaligned, enclosed",
        })
    }
}

/// The cluster shapes of [VanGelderen2020, §6.2] and neighbouring sizes. Sizes in pixels are scaled to an image height of `rows` pixels;
/// sizes in metres are not scaled.
pub fn shapes(rows: u32, quick: bool) -> Vec<ClusterShape> {
    let pixels = |pixels: f32| ((pixels * rows as f32 / ROWS).round() as u32).max(LEAST_PIXELS);
    let perspective = |width| ClusterShape::Perspective { pixels: pixels(width) };
    let orthographic = |side| ClusterShape::Orthographic { side };
    let displaced = |width, distance| ClusterShape::Displaced { pixels: pixels(width), distance };
    if quick {
        return vec![perspective(64.0), orthographic(4.0), displaced(64.0, 32.0)];
    }
    let mut shapes: Vec<_> = [16.0, 32.0, 64.0, 128.0].map(perspective).into();
    shapes.extend([1.0, 2.0, 4.0, 8.0].map(orthographic));
    shapes.extend([displaced(64.0, 8.0), displaced(64.0, 32.0)]);
    // In a small image two sizes may coincide.
    shapes.dedup();
    shapes
}

/// Settings of a configuration, with clusters to `depth` m. Shadows are off, because light culling is measured.
pub fn settings(shape: ClusterShape, grouping: Grouping, assignment: Assignment, depth: u32) -> Settings {
    let clustered = Clustered { shape, grouping, assignment, depth };
    Settings::direct_light().with_culling(clustered).with_shadows(Shadows::None)
}

#[test]
fn shapes_are_those_of_the_thesis_and_grow_with_the_image() {
    // The best shapes of the thesis.
    assert_eq!(shapes(720, true)[0], ClusterShape::Perspective { pixels: 64 });
    assert_eq!(shapes(720, true)[1], ClusterShape::Orthographic { side: 4.0 });
    assert_eq!(shapes(720, true)[2], ClusterShape::Displaced { pixels: 64, distance: 32.0 });
    assert_eq!(shapes(180, true)[2], ClusterShape::Displaced { pixels: 16, distance: 32.0 });
    assert!(shapes(720, true).iter().all(|shape| shapes(720, false).contains(shape)));
    assert_eq!(shapes(90, false).iter().filter(|s| **s == ClusterShape::Perspective { pixels: 4 }).count(), 1);
}
