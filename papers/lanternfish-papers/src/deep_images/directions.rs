//! Direction sets of deep images, and the lookup of the nearest direction.
//!
//! One image serves a direction and its opposite: for the opposite, the texels' lists are read from the other end.

mod cells;
mod sets;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{Mat3, Quat, Vec3};

/// The directions of deep images. The pole of a set is +y without a rotation ([`Directions::rotated`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DirectionSet {
    /// Spherical coordinates over the upper hemisphere [Archer2019, §3.1]: `stacks` equal steps of colatitude from the pole to the equator,
    /// each of `slices` equal steps of longitude; an axis goes through the middle of each cell. So no axis is the pole, which all slices
    /// would share, and none lies on the equator, where the opposite of one could be another. Axes are dense at the pole. Archer has 13 ×
    /// 13 = 169.
    StacksSlices {
        /// More: finer in colatitude.
        stacks: u32,
        /// More: finer in longitude. All slices of the first stack are candidates around the pole, so the longest candidate list of
        /// [`Directions::nearest`] has at least this length. At most [`Directions::MAX_SLICES`].
        slices: u32,
    },
    /// The centres of k × k squares on each face of a cube [Niessner2010, §3.1]: 6 k² directions, 3 k² images. Axes are dense at the cube's
    /// corners.
    Cube {
        /// Squares along an edge.
        k: u32,
    },
    /// The centres of a recursive zonal equal-area partition of the sphere [Leopardi2006, §3] into 2 `count` regions, in pairs
    /// of opposites [Aalund2015, §3.2]. The most uniform of the three, for any number of images.
    ZonalEqualArea {
        /// Images.
        count: u32,
    },
}

impl DirectionSet {
    /// Number of images.
    pub fn count(self) -> u64 {
        match self {
            Self::StacksSlices { stacks, slices } => u64::from(stacks) * u64::from(slices),
            Self::Cube { k } => (3 * u64::from(k)).saturating_mul(u64::from(k)),
            Self::ZonalEqualArea { count } => count.into(),
        }
    }
}

/// An invalid set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DirectionError {
    /// No images, or too many.
    #[error("{set:?} has {} directions: the number must be from 1 to {}", .set.count(), Directions::MAX_COUNT)]
    Count {
        /// The requested set.
        set: DirectionSet,
    },
    /// Too many axes around one pole.
    #[error("{set:?}: at most {} slices may share the pole; use more stacks", Directions::MAX_SLICES)]
    Slices {
        /// The requested set.
        set: DirectionSet,
    },
}

/// The axes of deep images, world space, and a table that finds the nearest axis.
///
/// On the GPU the table is in the set's own space, without rotation, so [`Self::cells`] is uploaded once; a shader (`nearest_image.wesl`)
/// rotates its directions into that space ([`Self::rotation`]).
#[derive(Clone, Debug)]
pub struct Directions {
    set: DirectionSet,
    /// World from set.
    rotation: Quat,
    /// World space.
    axes: Vec<Vec3>,
    /// The set's own space.
    axes_in_set: Arc<[Vec3]>,
    cells: Arc<[u32]>,
}

impl Directions {
    /// Maximum number of images of a set.
    pub const MAX_COUNT: u32 = 4096;

    /// Maximum number of slices per stack, which is the number of candidates at the pole.
    pub const MAX_SLICES: u32 = 256;

    /// Lays out the axes and builds the table, whose cost grows with the square of the number of images.
    pub fn new(set: DirectionSet) -> Result<Self, DirectionError> {
        if !(1..=u64::from(Self::MAX_COUNT)).contains(&set.count()) {
            return Err(DirectionError::Count { set });
        }
        if let DirectionSet::StacksSlices { slices, .. } = set
            && slices > Self::MAX_SLICES
        {
            return Err(DirectionError::Slices { set });
        }
        let axes = match set {
            DirectionSet::StacksSlices { stacks, slices } => sets::stacks_slices(stacks, slices),
            DirectionSet::Cube { k } => sets::cube(k),
            DirectionSet::ZonalEqualArea { count } => {
                sets::zonal_regions(count).iter().map(sets::Region::center).collect()
            }
        };
        let axes: Vec<Vec3> = axes.into_iter().map(|axis| axis.as_vec3()).collect();
        let cells = cells::build(&axes).into();
        Ok(Self { set, rotation: Quat::IDENTITY, axes_in_set: axes.clone().into(), axes, cells })
    }

    /// The set as it was requested.
    pub fn set(&self) -> DirectionSet {
        self.set
    }

    /// Number of images, at least 1.
    #[allow(clippy::len_without_is_empty, reason = "no set is empty")]
    pub fn len(&self) -> usize {
        self.axes.len()
    }

    /// Axis of each image, unit, world space; one of each pair of opposites.
    pub fn axes(&self) -> &[Vec3] {
        &self.axes
    }

    /// The image whose axis is nearest to ±`direction`, and true if −axis is the nearer end, so that the image is read backwards.
    ///
    /// World space; any length whose square is a normal number. Exact up to the rounding of a scalar product in single precision. Tests one
    /// cell's candidates ([`Self::cells`]), independent of the number of images.
    pub fn nearest(&self, direction: Vec3) -> (u32, bool) {
        cells::nearest(&self.axes_in_set, &self.cells, self.rotation.inverse() * direction)
    }

    /// World space from an image's own: orthonormal and right-handed, z is the axis. It rotates with the set.
    pub fn frame(&self, image: u32) -> Mat3 {
        let z = self.axes_in_set[image as usize];
        let (x, y) = z.any_orthonormal_pair();
        Mat3::from_quat(self.rotation) * Mat3::from_cols(x, y, z)
    }

    /// The set with a further rotation. Images keep their indices, and [`Self::cells`] do not change. `rotation` is unit.
    pub fn rotated(&self, rotation: Quat) -> Self {
        let rotation = (rotation * self.rotation).normalize();
        let axes = self.axes_in_set.iter().map(|axis| (rotation * *axis).normalize()).collect();
        Self { rotation, axes, ..self.clone() }
    }

    /// World space from the set's own.
    pub fn rotation(&self) -> Quat {
        self.rotation
    }

    /// `direction_cells` of `nearest_image.wesl`, in the set's own space: cells along an edge of a cube's face, the start of each cell's
    /// candidates, and the candidates.
    pub fn cells(&self) -> &[u32] {
        &self.cells
    }
}
