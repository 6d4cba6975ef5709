//! Ambient occlusion and obscurance by the directions of deep images [Aalund2015, §3.3], and the light that arrives
//! along them.

mod cells;

use std::any::Any;

use glam::{Quat, UVec2, Vec3};
use lanternfish::{
    RenderError, ViewContext,
    environment_light::{ENVIRONMENT, irradiance_target},
    gpu_scene::Parts,
    occlusion::{AmbientVisibility, OcclusionPasses, OcclusionTechnique, TILE, ambient_visibility_target},
    parameters,
    prepass::Surface,
    rays::Structure,
    settings::{History, Settings},
    shaders::{Root, Shaders},
    technique::{Parameter, Range, Technique},
};
use lanternfish_gpu::{ComputeKernel, Feature, Frame, Growth, SharedStruct, gpu_struct};

use self::cells::CellRadiances;
use super::DISTANCE;
use crate::{
    VirtualLights,
    deep_images::{
        DeepCounts, DeepImages, KeptDeepImages, LINEAR_STEPS, LINKED_LIST, PAYLOAD, PaperImages, SLOPES,
        SORTED_LINKED_LIST, directions::Directions, settings::DeepImageSettings,
    },
    indirect::light_views::{bounced, radius_of},
};

gpu_struct! {
    /// The directions that one pass accumulates.
    pub struct DirectionRun {
        /// First image of the run, counted from the chunk's first.
        first: u32,
        /// Number of images.
        count: u32,
        /// Maximum distance of occluders, m; 0: unlimited.
        max_distance: f32,
        /// 1: first run of the frame, the sums start at 0.
        is_first: u32,
        /// Radiance of the environment of a scene without a sky, nits.
        ambient: Vec3,
        /// Factor of what surfaces mirror of the environment: 0 if rays find it.
        mirrored: f32,
        /// Perceptual roughness of the narrowest lobe about the mirror direction.
        least_roughness: f32,
        /// Frame number, the seed of the choice of texels.
        frame: u32,
        /// Unused.
        _pad: UVec2,
    }
}

/// One texel, its first fragment, weights of 2 / N [Aalund2015, §3.3, eq. 1 to 3].
const PLAIN_OCCLUSION: Feature = Feature::new("plain_occlusion");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::of(
    &crate::shaders::SHADERS,
    &[Root::of(
        "occlusion/deep/accumulate",
        &[
            &[&[PAYLOAD], &[PLAIN_OCCLUSION]],
            &[&[], &[LINKED_LIST], &[SORTED_LINKED_LIST], &[LINEAR_STEPS], &[SLOPES], &[LINEAR_STEPS, SLOPES]],
            &[&[], &[ENVIRONMENT]],
        ],
    )],
    &[SharedStruct::of::<DirectionRun>()],
);

parameters! {
    /// Ambient visibility by rays along every direction of deep images [Aalund2015, §3.3].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Deep {
        /// Largest distance of occluders, m, > 0: obscurance. Higher: darker; none: ambient occlusion, in which every
        /// surface occludes at any distance.
        max_distance: Option<f32> = None => DISTANCE;
        /// Ambient occlusion as the paper has it, without tests of triangles [Aalund2015, §3.3, eq. 1 to 3]. Off: far
        /// texels are drawn at random, and an open plane is exactly 1.
        plain: bool = false, "occlusion-plain" "on|off" Range::Switch(
            "As in the paper: one texel, its first fragment, weights of 2 / N",
            "Near triangles are tested",
        ), with_default;
        /// Constant ambient light of scenes without a sky, over the light of a closed room as large as the scene whose
        /// surfaces reflect all light once. Larger: brighter; 0: none. It comes from within `occlusion-distance`; without
        /// one, from within the scene's radius.
        ambient: f32 = 0.0, "occlusion-ambient" "FACTOR" Range::Number(0.0, 100.0), with_default;
        /// Deep images for ambient visibility.
        images: PaperImages = PaperImages::Shared, "occlusion-images" "NAME" Range::Names, with_default;
    }
}

impl Technique for Deep {
    const NAME: &'static str = "deep";
    const SUMMARY: &'static str = "Deep images: the whole scene";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl OcclusionTechnique for Deep {
    fn max_distance(&self) -> Option<f32> {
        self.max_distance
    }

    fn update_frames(&self, settings: &Settings) -> u32 {
        self.images.settings(settings).slices.max(1)
    }

    /// Texels are chosen at random.
    fn is_noisy(&self) -> bool {
        !self.plain
    }

    fn parts(&self) -> Parts {
        Parts::BVH
    }

    fn build(&self, device: &wgpu::Device, settings: &Settings) -> Result<Box<dyn OcclusionPasses>, RenderError> {
        Ok(Box::new(DeepOcclusion::new(device, settings, self)?))
    }
}

/// Images per pass. One image per pass would spend its time reading pixels; all images in one pass would keep a slow
/// device busy for longer than a driver may allow.
const IMAGES_A_PASS: u32 = 32;

/// Bytes of a pixel's `AmbientVisibilitySums`.
const IRRADIANCE_BYTES: u64 = 16;
/// Bytes of a pixel's `AmbientVisibilitySums` with radiance.
const RADIANCE_BYTES: u64 = 48;

/// The passes.
#[derive(Debug)]
struct DeepOcclusion {
    /// The set without rotation.
    directions: Directions,
    /// The structure whose images are the same; none: it has its own.
    shared: Option<Structure>,
    images: Option<KeptDeepImages>,
    ambient: f32,
    /// Rays of indirect light find what surfaces mirror.
    leaves_mirrored: bool,
    constant: Kernels,
    /// Kernels for an environment image.
    environment: Kernels,
    cells: CellRadiances,
    max_distance: f32,
    history: History,
}

#[derive(Debug)]
struct Kernels {
    accumulate: ComputeKernel,
    resolve: ComputeKernel,
}

impl Kernels {
    fn new(device: &wgpu::Device, features: &[Feature]) -> Result<Self, RenderError> {
        let shader = DECLARED.link("occlusion/deep/accumulate", features)?;
        Ok(Self {
            accumulate: ComputeKernel::new(device, &shader, "accumulate", "occlusion/deep/accumulate"),
            resolve: ComputeKernel::new(device, &shader, "resolve", "occlusion/deep/resolve"),
        })
    }
}

/// The rotation of the set, extended so that its nearest axis points along `direction` (unit, world space).
fn rotated_towards(directions: &Directions, direction: Vec3) -> Quat {
    let (image, reversed) = directions.nearest(direction);
    let axis = directions.axes()[image as usize];
    let nearest = if reversed { -axis } else { axis };
    (Quat::from_rotation_arc(nearest, direction) * directions.rotation()).normalize()
}

impl DeepOcclusion {
    /// Compiles the passes.
    fn new(device: &wgpu::Device, settings: &Settings, deep: &Deep) -> Result<Self, RenderError> {
        let history = settings.history;
        let built = settings.indirect.technique().map(|indirect| indirect.structures(settings)).unwrap_or_default();
        let shared = built.into_iter().find(|built| *built == Structure::from(deep.images.settings(settings)));
        let leaves_mirrored = settings.indirect.get::<VirtualLights>().is_some_and(|lights| lights.glossy_rays > 0);
        // The triangles of near fragments are tested.
        let settings = DeepImageSettings { payload: !deep.plain, ..deep.images.settings(settings) };
        let mut features = settings.fragment_features();
        if deep.plain {
            features.push(PLAIN_OCCLUSION);
        }
        let with_image: Vec<Feature> = features.iter().copied().chain([ENVIRONMENT]).collect();
        Ok(Self {
            directions: Directions::new(settings.directions)
                .map_err(|error| RenderError::Directions { what: error.to_string() })?,
            images: shared.is_none().then(|| KeptDeepImages::new(device, settings)).transpose()?,
            shared,
            ambient: deep.ambient,
            leaves_mirrored,
            constant: Kernels::new(device, &features)?,
            environment: Kernels::new(device, &with_image)?,
            cells: CellRadiances::default(),
            max_distance: deep.max_distance.unwrap_or(0.0),
            history,
        })
    }
}

impl OcclusionPasses for DeepOcclusion {
    fn check_growth(&self, growth: Growth) -> Result<(), RenderError> {
        self.images.as_ref().map_or(Ok(()), |images| images.check_growth(growth))
    }

    /// Uses images of the current scene with the frame's rotation of the direction set. If there is a sun, a set of its
    /// own is rotated a little more, so that one direction points towards it.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, view, buffer, rotation, structures, .. }: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<AmbientVisibility, RenderError> {
        let rotation = match scene.environment_light().sun {
            Some(sun) => rotated_towards(&self.directions.rotated(*rotation), sun),
            None => *rotation,
        };
        let built = structures.iter().find(|(structure, _)| Some(structure) == self.shared.as_ref());
        let built: Option<&dyn Any> = built.map(|(_, built)| &**built as _);
        let images = match (built.and_then(|built| built.downcast_ref::<DeepImages>()), &mut self.images) {
            (Some(images), _) => images,
            (None, Some(own)) => own.get(frame, scene, rotation)?,
            (None, None) => unreachable!("the frame builds the structures of its rays"),
        };
        let ambient = if scene.has_sky() { Vec3::ZERO } else { self.ambient * bounced(scene) };
        let cells = match &scene.environment_light().samples {
            Some(samples) => Some(self.cells.get(frame, samples, &images.directions)?),
            None => None,
        };
        let kernels = if cells.is_some() { &self.environment } else { &self.constant };
        let UVec2 { x, y } = surface.size;
        let pixels = u64::from(x) * u64::from(y);
        let irradiance_bytes = if cells.is_some() { RADIANCE_BYTES } else { IRRADIANCE_BYTES };
        let irradiance = frame.scratch("occlusion/irradiance", irradiance_bytes * pixels)?;
        let target = ambient_visibility_target(frame, surface.size);
        let environment_irradiance = irradiance_target(frame, surface.size);
        let groups = [x.div_ceil(TILE), y.div_ceil(TILE), 1];
        let view_bindings = buffer.bindings();
        let shared = view_bindings.with(&surface.bindings()).with(&scene.bindings());
        let mut shared = shared.buffer("ambient_visibility_sums", &irradiance);
        if let Some(cells) = cells {
            shared = shared.buffer("cell_radiances", cells);
        }
        // Half vectors deviate half as much as directions. They are as wide as a direction's cell, whose radius is (2 /
        // count)^½.
        let least_roughness = (2.0 / images.directions.len() as f32).sqrt().sqrt().min(1.0);
        let drawn = match self.history {
            History::Off => view.frame_index,
            History::On => view.forgetful_index,
        };
        let max_distance = match self.max_distance {
            0.0 if ambient != Vec3::ZERO => radius_of(scene.bounds()),
            distance => distance,
        };
        let mirrored = f32::from(!self.leaves_mirrored);
        let run = DirectionRun { max_distance, least_roughness, frame: drawn, ambient, mirrored, ..Default::default() };
        let mut is_first = 1;
        for chunk in &images.chunks {
            let of_chunk = shared.clone().with(&chunk.bindings(&images.frames));
            for first in (0..chunk.grid.image_count).step_by(IMAGES_A_PASS as usize) {
                let count = IMAGES_A_PASS.min(chunk.grid.image_count - first);
                let run = DirectionRun { first, count, is_first, ..run };
                let run = frame.uniform(&run);
                frame.dispatch(&kernels.accumulate, &of_chunk.clone().part("direction_run", &run), groups);
                is_first = 0;
            }
        }
        let run = frame.uniform(&run);
        let resolving = shared
            .part("direction_run", &run)
            .texture("ambient_visibility_target", &target)
            .texture("environment_irradiance_target", &environment_irradiance);
        frame.dispatch(&kernels.resolve, &resolving, groups);
        let DeepCounts { kept, bytes, .. } = images.counts;
        let counters = vec![("deep_images/fragments", kept), ("deep_images/bytes", bytes)];
        Ok(AmbientVisibility { texture: target, environment_irradiance, counters })
    }
}
