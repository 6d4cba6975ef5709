//! Primitive topologies: conversion of triangle strips and fans to triangle lists, and of lines to segments.

use super::thin;

/// Primitive topology.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Topology {
    /// Three vertices per triangle.
    List,
    /// One triangle per vertex, with the two vertices before it.
    Strip,
    /// One triangle per vertex, with the vertex before it and the first one.
    Fan,
    /// One point per vertex.
    Points,
    /// Two vertices per segment.
    Lines,
    /// One segment per vertex, to the next one or, from the last one, to the first.
    LineLoop,
    /// One segment per vertex, to the next one.
    LineStrip,
}

impl Topology {
    /// The topology of the format's code (OpenGL's); `None` for an unknown code.
    pub fn new(mode: u32) -> Option<Self> {
        Some(match mode {
            0 => Self::Points,
            1 => Self::Lines,
            2 => Self::LineLoop,
            3 => Self::LineStrip,
            4 => Self::List,
            5 => Self::Strip,
            6 => Self::Fan,
            _ => return None,
        })
    }

    /// True for points and lines.
    pub fn is_thin(self) -> bool {
        matches!(self, Self::Points | Self::Lines | Self::LineLoop | Self::LineStrip)
    }

    /// Upper bound of the number of triangle corners that `index_count` indices give, with points and lines as
    /// triangles.
    pub fn most_corners(self, index_count: u64) -> u64 {
        let shapes = if self == Self::Lines { index_count / 2 } else { index_count };
        let corners = match self {
            Self::List => 1,
            Self::Strip | Self::Fan => 3,
            Self::Points | Self::Lines | Self::LineLoop | Self::LineStrip => thin::CORNERS as u64,
        };
        shapes.saturating_mul(corners)
    }

    /// The ends of the segments of lines; none of other topologies.
    pub fn segments(self, indices: &[u32]) -> impl Iterator<Item = [u32; 2]> {
        let (ends, step) = match self {
            Self::Lines => (indices, 2),
            Self::LineLoop | Self::LineStrip => (indices, 1),
            _ => (&[][..], 1),
        };
        let closing = match ends {
            [first, _, .., last] if self == Self::LineLoop => Some([*last, *first]),
            _ => None,
        };
        ends.windows(2).step_by(step).map(|ends| [ends[0], ends[1]]).chain(closing)
    }

    /// The indices as a triangle list with the same winding. Vertices that do not complete a triangle are dropped.
    /// Degenerate triangles of strips and fans, which use a vertex twice, are dropped as well: they only join parts of a strip.
    /// Points and lines have no triangles.
    pub fn triangles(self, mut indices: Vec<u32>) -> Vec<u32> {
        let is_proper = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        match self {
            Self::List => {
                indices.truncate(indices.len() / 3 * 3);
                indices
            }
            Self::Strip => {
                let oriented =
                    |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] };
                indices.windows(3).enumerate().map(oriented).filter(is_proper).flatten().collect()
            }
            Self::Fan => {
                let Some((first, rest)) = indices.split_first() else { return indices };
                rest.windows(2).map(|t| [t[0], t[1], *first]).filter(is_proper).flatten().collect()
            }
            Self::Points | Self::Lines | Self::LineLoop | Self::LineStrip => Vec::new(),
        }
    }
}
