//! The scene in the adapter's own acceleration structure, traversed by `rays/ray_query/query.wesl`.
//!
//! One bottom level of world-space triangles in BVH leaf order (some drivers split in input order), under one instance. Opaque and masked
//! triangles are two geometries: hits of the first are committed without the shader, the shader tests those of the second.

use glam::Vec3;
use lanternfish_gpu::storage_buffer_of;

use super::{
    super::upload::geometry::buffer,
    triangles::{Source, TracedTriangle},
};
use crate::error::RenderError;

/// An acceleration structure on the device.
#[derive(Debug)]
pub struct Tlas {
    /// Bound as `scene_tlas`.
    pub tlas: wgpu::Tlas,
    /// Indices of the triangles in the BVH's leaf order. Bound as `tlas_triangles`.
    pub triangles: wgpu::Buffer,
    /// Corners of all triangles, world space, m: nine numbers each.
    pub vertices: wgpu::Buffer,
    /// None: there are no triangles.
    blas: Option<wgpu::Blas>,
    geometries: Vec<Geometry>,
}

/// The indices of a geometry, and its size.
type Geometry = (wgpu::Buffer, wgpu::BlasTriangleGeometrySizeDescriptor);

impl Tlas {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, triangles: &[TracedTriangle]) -> Result<Self, RenderError> {
        let mut tlas = device.create_tlas(&wgpu::CreateTlasDescriptor {
            label: Some("scene/tlas"),
            max_instances: 1,
            flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
            update_mode: wgpu::AccelerationStructureUpdateMode::Build,
        });
        let limit = u64::from(device.limits().max_blas_primitive_count);
        if triangles.len() as u64 > limit {
            return Err(RenderError::Overflow {
                list: "acceleration structure",
                needed: triangles.len() as u64,
                limit,
                remedy: "use `shadows bvh` and `indirect-tracer bvh`",
            });
        }

        // One vertex buffer; each geometry selects its triangles by index.
        let corners: Vec<Vec3> = triangles.iter().flat_map(|t| t.corners).collect();
        let input = wgpu::BufferUsages::BLAS_INPUT;
        let copied = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let vertices = buffer(device, "scene/tlas_vertices", &corners, input | wgpu::BufferUsages::STORAGE | copied)?;
        let Lists { numbers, indices } = Lists::of(triangles.iter().map(|triangle| &triangle.source));
        let numbers = storage_buffer_of(device, "scene/tlas_triangles", &numbers, wgpu::BufferUsages::empty())?;
        let flags = [
            wgpu::AccelerationStructureGeometryFlags::OPAQUE,
            wgpu::AccelerationStructureGeometryFlags::NO_DUPLICATE_ANY_HIT_INVOCATION,
        ];
        let geometries: Vec<Geometry> = indices
            .iter()
            .zip(flags)
            .filter(|(indices, _)| !indices.is_empty())
            .map(|(indices, flags)| {
                let buffer = buffer(device, "scene/tlas_indices", indices, input | copied)?;
                let size = wgpu::BlasTriangleGeometrySizeDescriptor {
                    vertex_format: wgpu::VertexFormat::Float32x3,
                    vertex_count: corners.len() as u32,
                    index_format: Some(wgpu::IndexFormat::Uint32),
                    index_count: Some(indices.len() as u32),
                    flags,
                };
                Ok((buffer, size))
            })
            .collect::<Result<_, RenderError>>()?;

        let descriptors = || geometries.iter().map(|(_, size)| size.clone()).collect();
        let blas = (!geometries.is_empty()).then(|| {
            device.create_blas(
                &wgpu::CreateBlasDescriptor {
                    label: Some("scene/blas"),
                    flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
                    update_mode: wgpu::AccelerationStructureUpdateMode::Build,
                },
                wgpu::BlasGeometrySizeDescriptors::Triangles { descriptors: descriptors() },
            )
        });
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        tlas[0] = blas.as_ref().map(|blas| wgpu::TlasInstance::new(blas, identity, 0, 0xff));
        let made = Self { tlas, triangles: numbers, vertices, blas, geometries };
        let mut encoder = device.create_command_encoder(&Default::default());
        made.build(&mut encoder);
        queue.submit([encoder.finish()]);
        Ok(made)
    }

    /// Writes the triangles' indices again after a reordering. The caller reorders `vertices` and builds.
    pub fn reorder(&self, queue: &wgpu::Queue, sources: &[Source]) {
        let Lists { numbers, indices } = Lists::of(sources.iter());
        queue.write_buffer(&self.triangles, 0, bytemuck::cast_slice(&numbers));
        let indices = indices.iter().filter(|indices| !indices.is_empty());
        for ((buffer, _), indices) in self.geometries.iter().zip(indices) {
            queue.write_buffer(buffer, 0, bytemuck::cast_slice(indices));
        }
    }

    /// Builds the structure from the corners in `vertices` when these commands run.
    pub fn build(&self, encoder: &mut wgpu::CommandEncoder) {
        let Some(blas) = &self.blas else {
            return encoder.build_acceleration_structures([], [&self.tlas]);
        };
        let triangles = self
            .geometries
            .iter()
            .map(|(buffer, size)| wgpu::BlasTriangleGeometry {
                size,
                vertex_buffer: &self.vertices,
                first_vertex: 0,
                vertex_stride: size_of::<Vec3>() as u64,
                index_buffer: Some(buffer),
                first_index: Some(0),
                transform_buffer: None,
                transform_buffer_offset: None,
            })
            .collect();
        let entry = wgpu::BlasBuildEntry { blas, geometry: wgpu::BlasGeometries::TriangleGeometries(triangles) };
        encoder.build_acceleration_structures([&entry], [&self.tlas]);
    }
}

/// The solid and the masked triangles.
struct Lists {
    /// Number of triangles of the first geometry, then the triangles of both.
    numbers: Vec<u32>,
    /// Vertices of each geometry.
    indices: [Vec<u32>; 2],
}

impl Lists {
    fn of<'s>(sources: impl Iterator<Item = &'s Source>) -> Self {
        let (solid, mut masked): (Vec<_>, Vec<_>) = sources.zip(0u32..).partition(|(source, _)| source.record == 0);
        // The shader takes a masked triangle's index for that of its record; a reordering leaves the records where they are.
        masked.sort_unstable_by_key(|(source, _)| source.record);
        let parts = [solid, masked].map(|part| part.into_iter().map(|(_, i)| i).collect::<Vec<u32>>());
        let first = parts.iter().find(|part| !part.is_empty()).map_or(0, |part| part.len() as u32);
        let numbers = std::iter::once(first).chain(parts.iter().flatten().copied()).collect();
        let indices = parts.map(|numbers| numbers.iter().flat_map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
        Self { numbers, indices }
    }
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::{GpuError, checked, testing};

    use super::*;

    #[test]
    fn masked_triangles_have_the_order_of_their_records() {
        let sources = [3, 0, 1, 0, 2].map(|record| Source { record, ..Source::default() });
        let Lists { numbers, indices } = Lists::of(sources.iter());
        assert_eq!(numbers, [2, 1, 3, 2, 4, 0]);
        assert_eq!(indices[1], [6, 7, 8, 12, 13, 14, 0, 1, 2]);
    }

    #[gpu_test]
    fn gpu_tlas_buffers_are_limited_by_the_largest_buffer_not_by_the_largest_binding(gpu: &Gpu) {
        let test = "gpu_tlas_buffers_are_limited_by_the_largest_buffer_not_by_the_largest_binding";
        if !gpu.description.ray_query {
            return testing::left_out(test, "this adapter has no ray query");
        }
        // 300 triangles: 10,800 bytes of corners, 3,600 of indices.
        let corner = |x: usize| Vec3::new(x as f32, 0.0, 0.0);
        let triangle = |x| TracedTriangle { corners: [corner(x), corner(x + 1), Vec3::Y], source: Source::default() };
        let triangles: Vec<_> = (0..300).map(triangle).collect();
        let build = |binding_bytes, buffer_bytes| {
            let (device, queue) = device_of(&gpu.description.name, binding_bytes, buffer_bytes);
            checked(&device, "tlas", || Tlas::new(&device, &queue, &triangles)).map(|_| ())
        };
        build(4096, 1 << 20).unwrap();
        let refused = build(4096, 8192).unwrap_err();
        assert!(
            matches!(&refused, RenderError::Gpu(GpuError::TooLarge { what, needed: 10_800, limit: 8192 }) if what == "scene/tlas_vertices"),
            "{refused}"
        );
    }

    /// A device of the adapter of this name with ray query and these limits.
    fn device_of(name: &str, binding_bytes: u64, buffer_bytes: u64) -> (wgpu::Device, wgpu::Queue) {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
        let adapter = adapters.iter().find(|adapter| adapter.get_info().name == name).expect("the adapter exists");
        let descriptor = wgpu::DeviceDescriptor {
            required_features: wgpu::Features::EXPERIMENTAL_RAY_QUERY,
            required_limits: wgpu::Limits {
                max_storage_buffer_binding_size: binding_bytes,
                max_uniform_buffer_binding_size: binding_bytes,
                max_buffer_size: buffer_bytes,
                max_blas_primitive_count: 1024,
                max_blas_geometry_count: 2,
                max_tlas_instance_count: 1,
                max_acceleration_structures_per_shader_stage: 1,
                ..wgpu::Limits::default()
            },
            // Safety: ray query is used as wgpu documents it; acceleration structures outlive their use.
            experimental_features: unsafe { wgpu::ExperimentalFeatures::enabled() },
            ..Default::default()
        };
        pollster::block_on(adapter.request_device(&descriptor)).expect("the limits are small")
    }
}
