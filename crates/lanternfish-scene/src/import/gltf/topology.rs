//! Triangle lists from lists, strips and fans.

/// How a primitive's vertices are joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Topology {
    /// Three a triangle.
    List,
    /// Each vertex with the two before it.
    Strip,
    /// Each vertex with the one before it and the first.
    Fan,
    /// Points or lines of any kind: no triangles.
    Other,
}

impl Topology {
    /// The format's code for it (OpenGL's), or `None`.
    pub fn new(mode: u32) -> Option<Self> {
        Some(match mode {
            0..=3 => Self::Other,
            4 => Self::List,
            5 => Self::Strip,
            6 => Self::Fan,
            _ => return None,
        })
    }

    /// The indices as a triangle list of the same winding. Vertices that do not complete a triangle are dropped, and
    /// so are the triangles of strips and fans that use a vertex twice: they only join what lies beside them.
    pub fn triangles(self, mut indices: Vec<u32>) -> Vec<u32> {
        let is_proper = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        match self {
            Self::List => {
                indices.truncate(indices.len() / 3 * 3);
                indices
            }
            Self::Strip => {
                let turned = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] };
                indices.windows(3).enumerate().map(turned).filter(is_proper).flatten().collect()
            }
            Self::Fan => {
                let Some((first, rest)) = indices.split_first() else { return indices };
                rest.windows(2).map(|t| [t[0], t[1], *first]).filter(is_proper).flatten().collect()
            }
            Self::Other => Vec::new(),
        }
    }
}
