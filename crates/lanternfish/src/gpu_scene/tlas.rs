//! The scene in the adapter's own acceleration structure, walked by `shadows/ray_query/trace.wesl`.
//!
//! One bottom level of world-space triangles in BVH leaf order (some drivers split in input order), under one instance.
//! Opaque and masked triangles are two geometries: the first ends a query, the second asks the shader.

use lanternfish_gpu::storage_buffer_of;
use wgpu::util::DeviceExt;

use super::tracing::{TracedTriangle, Tracing};
use crate::error::RenderError;

/// An acceleration structure on the device.
#[derive(Debug)]
pub struct Tlas {
    /// Bound as `scene_tlas`.
    pub tlas: wgpu::Tlas,
}

impl Tlas {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, tracing: &Tracing) -> Result<Self, RenderError> {
        let mut tlas = device.create_tlas(&wgpu::CreateTlasDescriptor {
            label: Some("scene/tlas"),
            max_instances: 1,
            flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
            update_mode: wgpu::AccelerationStructureUpdateMode::Build,
        });
        let limit = u64::from(device.limits().max_blas_primitive_count);
        if tracing.triangles.len() as u64 > limit {
            return Err(RenderError::Overflow {
                list: "acceleration structure",
                needed: tracing.triangles.len() as u64,
                limit,
                remedy: "use --shadows bvh",
            });
        }

        // One vertex buffer; each geometry picks its triangles by index.
        let corners: Vec<[f32; 3]> =
            tracing.triangles.iter().flat_map(|t| t.corners).map(|corner| corner.to_array()).collect();
        let vertices = storage_buffer_of(device, "scene/tlas_vertices", &corners, wgpu::BufferUsages::BLAS_INPUT)?;
        let parts = [indices(tracing, |t| t.record == 0), indices(tracing, |t| t.record != 0)];
        let flags = [
            wgpu::AccelerationStructureGeometryFlags::OPAQUE,
            wgpu::AccelerationStructureGeometryFlags::NO_DUPLICATE_ANY_HIT_INVOCATION,
        ];
        let geometries: Vec<_> = parts
            .iter()
            .zip(flags)
            .filter(|(indices, _)| !indices.is_empty())
            .map(|(indices, flags)| {
                let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("scene/tlas_indices"),
                    contents: bytemuck::cast_slice(indices),
                    usage: wgpu::BufferUsages::BLAS_INPUT,
                });
                let size = wgpu::BlasTriangleGeometrySizeDescriptor {
                    vertex_format: wgpu::VertexFormat::Float32x3,
                    vertex_count: corners.len() as u32,
                    index_format: Some(wgpu::IndexFormat::Uint32),
                    index_count: Some(indices.len() as u32),
                    flags,
                };
                (buffer, size)
            })
            .collect();

        let mut encoder = device.create_command_encoder(&Default::default());
        if geometries.is_empty() {
            encoder.build_acceleration_structures([], [&tlas]);
            queue.submit([encoder.finish()]);
            return Ok(Self { tlas });
        }
        let blas = device.create_blas(
            &wgpu::CreateBlasDescriptor {
                label: Some("scene/blas"),
                flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
                update_mode: wgpu::AccelerationStructureUpdateMode::Build,
            },
            wgpu::BlasGeometrySizeDescriptors::Triangles {
                descriptors: geometries.iter().map(|(_, size)| size.clone()).collect(),
            },
        );
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        tlas[0] = Some(wgpu::TlasInstance::new(&blas, identity, 0, 0xff));
        let triangles = geometries
            .iter()
            .map(|(buffer, size)| wgpu::BlasTriangleGeometry {
                size,
                vertex_buffer: &vertices,
                first_vertex: 0,
                vertex_stride: size_of::<[f32; 3]>() as u64,
                index_buffer: Some(buffer),
                first_index: Some(0),
                transform_buffer: None,
                transform_buffer_offset: None,
            })
            .collect();
        let entry = wgpu::BlasBuildEntry { blas: &blas, geometry: wgpu::BlasGeometries::TriangleGeometries(triangles) };
        encoder.build_acceleration_structures([&entry], [&tlas]);
        queue.submit([encoder.finish()]);
        Ok(Self { tlas })
    }
}

/// Vertex indices of the triangles that are wanted, in order.
fn indices(tracing: &Tracing, wanted: impl Fn(&TracedTriangle) -> bool) -> Vec<u32> {
    let numbered = tracing.triangles.iter().zip(0u32..);
    numbered.filter(|(t, _)| wanted(t)).flat_map(|(_, i)| [3 * i, 3 * i + 1, 3 * i + 2]).collect()
}
