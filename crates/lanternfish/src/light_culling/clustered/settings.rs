//! Settings of clustered light culling.

use lanternfish_gpu::Feature;
use lanternfish_scene::named_enum;

use super::{CULLING_CLUSTERED, ClusteredCulling, DECLARED, grid::ClusterShape};
use crate::{
    error::RenderError,
    light_culling::{CullingTechnique, LightCullingPasses},
    parameters,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};

parameters! {
    /// Lists per cluster [VanGelderen2020, ch. 3].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Clustered {
        /// Shape of the clusters, with `culling clustered`: persp:P (P pixels wide, as deep as wide), ortho:S (cubes of
        /// S m) or displ:P:D (as persp, from D m behind the camera). The image is the same.
        shape: ClusterShape = ClusterShape::Perspective { pixels: 32 }, "clusters" "SHAPE" Range::Text, with_default;
        /// Cluster grids of several views. The image does not depend on it [VanGelderen2020, §4.1].
        grouping: Grouping = Grouping::Enclosed, "cluster-views" "NAME" Range::Names, with_default;
        /// Assignment of lights to clusters. The image does not depend on it.
        assignment: Assignment = Assignment::Hierarchy, "light-assignment" "NAME" Range::Names, with_default;
        /// Least depth of the cluster grid, m. The image does not depend on it.
        ///
        /// 100 in the thesis [VanGelderen2020, §6.1.3]. At 0, clusters end with the scene; so they do if the scene ends
        /// farther away. More: more clusters, of which none is visible; displaced clusters change.
        depth: u32 = 0, "cluster-depth" "METRES" Range::Count(0, 1_000_000), with_default;
    }
}

named_enum! {
    /// Grouping of several views into grids of clusters.
    Grouping {
        /// A grid, lists and all for each view.
        Individual = "individual": "A grid for each view",
        /// One grid around the frusta of all views.
        Enclosed = "enclosed": "One grid around all views: lights are assigned once",
    }
}

named_enum! {
    /// How lights are assigned to clusters.
    Assignment {
        /// Tests every light, as the thesis does.
        BruteForce = "brute_force": "Tests every light against every cluster",
        /// Traverses a tree over the lights.
        Hierarchy = "hierarchy": "Traverses a tree over the lights: for thousands of lights",
    }
}

impl Technique for Clustered {
    const NAME: &'static str = "clustered";
    const SUMMARY: &'static str = "A list of lights for every cluster of what is visible";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl CullingTechnique for Clustered {
    fn has_clusters(&self) -> bool {
        true
    }

    fn feature(&self) -> Feature {
        CULLING_CLUSTERED
    }

    fn tests_every_light(&self) -> bool {
        self.assignment == Assignment::BruteForce
    }

    fn build(&self, device: &wgpu::Device, samples: u32) -> Result<Box<dyn LightCullingPasses>, RenderError> {
        Ok(Box::new(ClusteredCulling::new(device, *self, samples)?))
    }
}
