//! Optional scene data for techniques: each states its own, and a scene is uploaded for all of them.

use std::ops::BitOr;

/// Optional parts of a scene on the device. They can be combined: `BVH | HITS`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts {
    /// The BVH and its triangles.
    pub bvh: bool,
    /// The same in two levels, in place of the BVH: a tree of each mesh that is placed more than once.
    pub instances: bool,
    /// The adapter's own acceleration structure.
    pub ray_query: bool,
    /// Shading data of ray hits.
    pub hits: bool,
    /// Trees over lights; with `hits`, over emissive triangles too.
    pub light_trees: bool,
    /// Unoccluded light of the environment at surfaces.
    pub environment_visibility: bool,
}

impl Parts {
    /// No part.
    pub const NONE: Self = Self {
        bvh: false,
        instances: false,
        ray_query: false,
        hits: false,
        light_trees: false,
        environment_visibility: false,
    };
    /// The BVH.
    pub const BVH: Self = Self { bvh: true, ..Self::NONE };
    /// The BVH in two levels.
    pub const INSTANCES: Self = Self { instances: true, ..Self::NONE };
    /// The adapter's own acceleration structure.
    pub const RAY_QUERY: Self = Self { ray_query: true, ..Self::NONE };
    /// Shading data of hits; hits are triangles of the BVH, in one level or two, and light trees choose their lights.
    pub const HITS: Self = Self { hits: true, light_trees: true, ..Self::NONE };
    /// Trees over lights.
    pub const LIGHT_TREES: Self = Self { light_trees: true, ..Self::NONE };
    /// Light of the environment.
    pub const ENVIRONMENT_VISIBILITY: Self = Self { environment_visibility: true, ..Self::NONE };

    /// True if rays are traced.
    pub fn rays(self) -> bool {
        self.bvh || self.instances || self.ray_query
    }

    /// The first part of `needed` that a scene with these parts lacks, in words.
    pub fn lacks(self, needed: Self) -> Option<&'static str> {
        let faults = [
            (needed.bvh && !self.bvh, "it has no BVH"),
            (needed.instances && !self.instances, "it has no BVH in two levels"),
            (needed.ray_query && !self.ray_query, "it has no acceleration structure of the adapter's own"),
            (needed.hits && !self.hits, "it has no data to shade hits of indirect rays"),
            (needed.light_trees && !self.light_trees, "it has no trees over lights"),
            (needed.environment_visibility && !self.environment_visibility, "it has no light of the environment"),
        ];
        faults.iter().find(|(is_missing, _)| *is_missing).map(|(_, what)| *what)
    }
}

impl BitOr for Parts {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self {
            bvh: self.bvh || other.bvh,
            instances: self.instances || other.instances,
            ray_query: self.ray_query || other.ray_query,
            hits: self.hits || other.hits,
            light_trees: self.light_trees || other.light_trees,
            environment_visibility: self.environment_visibility || other.environment_visibility,
        }
    }
}
