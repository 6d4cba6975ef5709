//! What can be chosen of clusters.

use lanternfish_gpu::Feature;
use lanternfish_scene::named_enum;

use super::{CULLING_CLUSTERED, ClusteredCulling, DECLARED, grid::ClusterShape};
use crate::{
    error::RenderError,
    light_culling::{CullingTechnique, LightCullingPasses},
    settings::Samples,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};

/// Lists per cluster [VanGelderen2020, ch. 3].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clustered {
    /// Which clusters there are. Smaller: fewer lights a pixel, more lists.
    pub shape: ClusterShape,
    /// True if several views share one grid [VanGelderen2020, §4.1].
    pub grouping: Grouping,
    /// How the lights of a cluster are found. The lists are the same.
    pub assignment: Assignment,
    /// How close to a cluster a light must come. The image is the same.
    pub test: ClusterTest,
    /// How far from the eye clusters reach at least, m, whatever there is to see: 100 in the thesis [VanGelderen2020, §6.1.3]. Without it
    /// they end with the scene; so they do where that is farther. More: more clusters, of which none is visible; displaced ones are others.
    pub depth: u32,
}

impl Default for Clustered {
    fn default() -> Self {
        Self {
            shape: ClusterShape::Perspective { pixels: 32 },
            grouping: Grouping::Enclosed,
            assignment: Assignment::Hierarchy,
            test: ClusterTest::PlanesAndBox,
            depth: 0,
        }
    }
}

named_enum! {
    /// True if several views share one grid of clusters.
    Grouping {
        /// A grid, lists and all for each view.
        Individual = "individual": "A grid for each view",
        /// One grid around the frusta of all views.
        Enclosed = "enclosed": "One grid around all views: lights are assigned once",
    }
}

named_enum! {
    /// How the lights of a cluster are found.
    Assignment {
        /// Every light is tested: the thesis'.
        BruteForce = "brute_force": "Every light is tested against every cluster",
        /// A tree over the lights is walked.
        Hierarchy = "hierarchy": "A tree over the lights is walked: for thousands of lights",
    }
}

named_enum! {
    /// How close to a cluster a light must come.
    ClusterTest {
        /// Behind none of its planes [VanGelderen2020, §3.3]. Orthographic clusters are boxes and always tested as such.
        Planes = "planes": "Behind none of the cluster's planes: some lights too many",
        /// And within reach of the box around it: fewer lights that do not reach it.
        PlanesAndBox = "planes-and-box": "And within reach of the box around it",
    }
}

impl Technique for Clustered {
    const NAME: &'static str = "clustered";
    const SUMMARY: &'static str = "A list of lights for every cluster of what is visible";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "clusters",
            "SHAPE",
            Range::Text,
            "Shape of the clusters, with `culling clustered`: persp:P (P pixels wide, as deep as wide), ortho:S (cubes of S m) or \
             displ:P:D (as persp, from D m behind the camera). The image is the same",
            |clustered: &mut Self| &mut clustered.shape,
        )
        .with_default(),
        Parameter::new(
            "cluster-views",
            "NAME",
            Range::Names,
            "Cluster grids of several views. The image does not depend on it",
            |clustered: &mut Self| &mut clustered.grouping,
        )
        .with_default(),
        Parameter::new(
            "light-assignment",
            "NAME",
            Range::Names,
            "Assignment of lights to clusters. The image does not depend on it",
            |clustered: &mut Self| &mut clustered.assignment,
        )
        .with_default(),
        Parameter::new(
            "cluster-test",
            "NAME",
            Range::Names,
            "Test of a light against a cluster. The image does not depend on it",
            |clustered: &mut Self| &mut clustered.test,
        )
        .with_default(),
        Parameter::new(
            "cluster-depth",
            "METRES",
            Range::Count(0, 1_000_000),
            "Least depth of the cluster grid, m. The image does not depend on it",
            |clustered: &mut Self| &mut clustered.depth,
        )
        .with_default(),
    ];
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

    fn build(&self, device: &wgpu::Device, samples: Samples) -> Result<Box<dyn LightCullingPasses>, RenderError> {
        Ok(Box::new(ClusteredCulling::new(device, *self, samples)?))
    }
}
