//! Conversion of triangle lists, strips and fans to triangle lists.

/// Primitive topology.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Topology {
    /// Three vertices per triangle.
    List,
    /// One triangle per vertex, with the two vertices before it.
    Strip,
    /// One triangle per vertex, with the vertex before it and the first one.
    Fan,
    /// Points or lines of any kind: no triangles.
    Other,
}

impl Topology {
    /// The topology of the format's code (OpenGL's); `None` for an unknown code.
    pub fn new(mode: u32) -> Option<Self> {
        Some(match mode {
            0..=3 => Self::Other,
            4 => Self::List,
            5 => Self::Strip,
            6 => Self::Fan,
            _ => return None,
        })
    }

    /// The indices as a triangle list with the same winding. Vertices that do not complete a triangle are dropped.
    /// Degenerate triangles of strips and fans, which use a vertex twice, are dropped as well: they only join parts of a strip.
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
            Self::Other => Vec::new(),
        }
    }
}
