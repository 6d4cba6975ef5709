//! Rays through deep images, and beside them the same rays through the BVH and the adapter's own acceleration structure.

use glam::Vec3;
use lanternfish_gpu::{ComputeKernel, Feature, Frame, gpu_struct, storage_buffer, storage_buffer_of};

use super::{TRACER_RAY_QUERY, Tracer, dispatch, has_ray_query};
use crate::{
    deep_images::{DeepImages, workgroups},
    error::RenderError,
    gpu_scene::GpuScene,
    settings::{DeepDepth, DeepImageSettings, DeepStore},
    shaders::SHADERS,
};

gpu_struct! {
    /// A ray.
    pub struct TracedRay {
        /// Where it starts, world space, m.
        origin: Vec3,
        /// Image of the nearest direction, times two, plus one where it is read backwards.
        image_and_side: u32,
        /// Unit.
        direction: Vec3,
        /// Surfaces nearer than this are the ray's own, m.
        offset: f32,
    }
}

impl TracedRay {
    /// A ray along `direction` (unit), which the images' nearest direction stands for.
    pub fn new(images: &DeepImages, origin: Vec3, direction: Vec3, offset: f32) -> Self {
        let (image, reversed) = images.directions.nearest(direction);
        Self { origin, image_and_side: 2 * image + u32::from(reversed), direction, offset }
    }
}

/// What rays are traced through.
#[derive(Clone, Copy, Debug)]
pub enum Structure<'i> {
    /// The texel of the nearest direction's image that the ray starts in [Archer2019, §3.2].
    WithinTexel(&'i DeepImages),
    /// Every texel of that image that the ray crosses [Niessner2010, §3.2].
    AcrossTexels(&'i DeepImages),
    /// The BVH, for the closest hit: exact.
    Bvh,
    /// The adapter's own acceleration structure, for the closest hit, which scenes are uploaded for where shadows or indirect light
    /// go through it ([`Shadows::RayQuery`](crate::settings::Shadows::RayQuery),
    /// [`IndirectTracer::RayQuery`](crate::settings::IndirectTracer::RayQuery)).
    RayQuery,
}

/// Traces lists of rays.
#[derive(Debug)]
pub struct RayTracer {
    /// For images of each store and depth.
    deep: Vec<DeepTracers>,
    bvh: ComputeKernel,
    /// Where the device has ray queries.
    ray_query: Option<ComputeKernel>,
}

#[derive(Debug)]
struct DeepTracers {
    store: DeepStore,
    depth: DeepDepth,
    within_texel: ComputeKernel,
    across_texels: ComputeKernel,
}

impl RayTracer {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let kernel = |features: &[Feature], label: &str| {
            let shader = SHADERS.link("rays/list", features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, "trace", label))
        };
        let mut deep = Vec::new();
        for store in DeepStore::ALL.iter().copied() {
            for depth in DeepDepth::ALL.iter().copied().filter(|depth| store.holds(*depth)) {
                // Distances need no payload.
                let settings = DeepImageSettings { store, depth, payload: false, ..Default::default() };
                let [within, across] =
                    [Tracer::WithinTexel, Tracer::AcrossTexels].map(|tracer| tracer.features(&settings));
                deep.push(DeepTracers {
                    store,
                    depth,
                    within_texel: kernel(&within, "deep_images/within_texel")?,
                    across_texels: kernel(&across, "deep_images/across_texels")?,
                });
            }
        }
        let ray_query = has_ray_query(device).then(|| kernel(&[TRACER_RAY_QUERY], "ray_query/closest_hit"));
        Ok(Self { deep, bvh: kernel(&[], "bvh/closest_hit")?, ray_query: ray_query.transpose()? })
    }

    /// Those that read such images.
    fn tracers(&self, images: &DeepImages) -> &DeepTracers {
        let DeepImageSettings { store, depth, .. } = images.settings;
        let found = self.deep.iter().find(|tracers| (tracers.store, tracers.depth) == (store, depth));
        found.expect("images are built only where the store holds the depth")
    }

    /// Puts a list of rays on the device.
    pub fn upload(&self, device: &wgpu::Device, rays: &[TracedRay]) -> Result<wgpu::Buffer, RenderError> {
        Ok(storage_buffer_of(device, "deep_images/rays", rays, wgpu::BufferUsages::empty())?)
    }

    /// Distance that each of `count` rays goes, m; −1 where it meets nothing. An error where the device lacks the structure, or
    /// the scene was not uploaded for it.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        structure: Structure<'_>,
        rays: &wgpu::Buffer,
        count: u32,
    ) -> Result<wgpu::Buffer, RenderError> {
        let distances = storage_buffer(frame.device, "deep_images/distances", 4 * u64::from(count))?;
        let groups = workgroups(count);
        let scene_bindings = scene.bindings();
        let bindings = scene_bindings.buffer("traced_rays", rays).buffer("traced_distances", &distances);
        let (kernel, images) = match structure {
            Structure::Bvh => {
                scene.check_bvh(frame.device)?;
                frame.dispatch(&self.bvh, &bindings, groups);
                return Ok(distances);
            }
            Structure::RayQuery => {
                let kernel = self.ray_query.as_ref().ok_or(RenderError::MissingFeature {
                    setting: "tracing through the adapter's own structure",
                    feature: "ray queries",
                    instead: "the BVH",
                })?;
                scene.check_ray_query(frame.device)?;
                frame.dispatch(kernel, &bindings, groups);
                return Ok(distances);
            }
            Structure::WithinTexel(images) => (&self.tracers(images).within_texel, images),
            Structure::AcrossTexels(images) => (&self.tracers(images).across_texels, images),
        };
        dispatch(frame, kernel, &bindings, groups, Some(images));
        Ok(distances)
    }
}
