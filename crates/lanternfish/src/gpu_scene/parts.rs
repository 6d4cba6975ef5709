//! Optional scene data for techniques: each states its own, and a scene is uploaded for all of them.

use std::ops::BitOr;

/// Parts of a scene on the device that not every technique reads. They add up: `BVH | HITS`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts {
    /// The BVH and its triangles.
    pub bvh: bool,
    /// The adapter's own acceleration structure.
    pub ray_query: bool,
    /// What the hit points are shaded with.
    pub hits: bool,
    /// What arrives from the environment where nothing occludes them.
    pub environment_visibility: bool,
}

impl Parts {
    /// None.
    pub const NONE: Self = Self { bvh: false, ray_query: false, hits: false, environment_visibility: false };
    /// The BVH.
    pub const BVH: Self = Self { bvh: true, ..Self::NONE };
    /// The adapter's own acceleration structure.
    pub const RAY_QUERY: Self = Self { ray_query: true, ..Self::NONE };
    /// What hits are shaded with. They are found by the triangles of the BVH.
    pub const HITS: Self = Self { bvh: true, hits: true, ..Self::NONE };
    /// Light of the environment.
    pub const ENVIRONMENT_VISIBILITY: Self = Self { environment_visibility: true, ..Self::NONE };

    /// True if something is traced.
    pub fn rays(self) -> bool {
        self.bvh || self.ray_query
    }

    /// What a scene that has these parts lacks of those needed: the first that is missing, in words.
    pub fn lacks(self, needed: Self) -> Option<&'static str> {
        let faults = [
            (needed.bvh && !self.bvh, "it has no BVH"),
            (needed.ray_query && !self.ray_query, "it has no acceleration structure of the adapter's own"),
            (needed.hits && !self.hits, "it has nothing to shade the ends of indirect rays with"),
            (
                needed.environment_visibility && !self.environment_visibility,
                "it has no environment to light by occlusion",
            ),
        ];
        faults.iter().find(|(is_missing, _)| *is_missing).map(|(_, what)| *what)
    }
}

impl BitOr for Parts {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self {
            bvh: self.bvh || other.bvh,
            ray_query: self.ray_query || other.ray_query,
            hits: self.hits || other.hits,
            environment_visibility: self.environment_visibility || other.environment_visibility,
        }
    }
}
