//! Vertex and index buffers of all meshes, their instances, and the draws.

use std::ops::Range;

use glam::{Affine3A, Vec2, Vec3, Vec4};
use lanternfish_gpu::{GpuError, storage_buffer_of};
use lanternfish_scene::{AlphaMode, Bounds, Material, Primitive, Scene};
use rayon::prelude::*;
use wgpu::util::DeviceExt;

use super::{
    super::shaders::DrawInstance,
    lobes::{Lobes, Shading},
};
use crate::error::RenderError;

/// All attributes of a vertex except its position.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct VertexAttributes {
    /// xyz: unit normal; w: sign of the bitangent; snorm.
    normal: [i16; 4],
    /// xyz: unit tangent; snorm.
    tangent: [i16; 4],
    /// Two sets of texture coordinates.
    uv: [f32; 4],
    /// Linear RGBA; unorm.
    color: [u16; 4],
}

/// How the passes use a surface's alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DrawAlpha {
    /// Solid.
    Opaque,
    /// Solid where its alpha reaches the cutoff.
    Masked,
    /// Transparent: blended over everything else.
    Transparent,
}

/// What a transparent surface does to the image behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageBehind {
    /// Nothing but to cover it by its alpha.
    Covers,
    /// Multiplies it: a smooth thin surface.
    Tints,
    /// Shows it blurred or displaced: a rough thin surface, or the boundary of a volume.
    Refracts,
}

impl ImageBehind {
    /// Of a material's surfaces.
    pub(in crate::gpu_scene) fn of(material: &Material, shading: Shading) -> Self {
        match shading == Shading::File && material.transmission > 0.0 {
            false => Self::Covers,
            true if material.is_thin_dielectric() => Self::Tints,
            true => Self::Refracts,
        }
    }

    /// True for a surface that transmits light.
    pub fn is_seen_through(self) -> bool {
        self != Self::Covers
    }
}

fn scatters_from_behind(material: &Material, shading: Shading) -> bool {
    shading == Shading::File && material.scatters_from_behind()
}

/// Which faces are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Facing {
    /// The side of a triangle that is drawn; none: both.
    pub side: Option<Side>,
    /// The transform mirrors: the front is clockwise.
    pub mirrored: bool,
}

/// A side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// Seen counter-clockwise, unless mirrored.
    Front,
    /// The other one.
    Back,
}

/// A primitive and the instances for which it is drawn.
#[derive(Clone, Debug)]
pub struct Draw {
    /// Range of the index buffer.
    pub indices: Range<u32>,
    /// Added to every index.
    pub base_vertex: i32,
    /// Range of the draw instances.
    pub instances: Range<u32>,
    /// Index of the material.
    pub material: u32,
    /// Selects the passes that draw it.
    pub alpha: DrawAlpha,
    /// What a transparent surface does to the image behind it.
    pub behind: ImageBehind,
    /// The lobes of the material.
    pub lobes: Lobes,
    /// True for an opaque surface that scatters light from behind towards the viewer.
    pub scatters_from_behind: bool,
    /// Which faces are drawn.
    pub facing: Facing,
    /// Bounding box of all its instances, world space.
    pub bounds: Bounds,
}

/// All meshes of a scene in one vertex and one index buffer.
#[derive(Debug)]
pub struct Geometry {
    pub positions: wgpu::Buffer,
    pub attributes: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub instances: wgpu::Buffer,
    /// In the order of the meshes.
    pub draws: Vec<Draw>,
    templates: Vec<Template>,
    /// Contents of `instances`.
    placed: Vec<DrawInstance>,
}

/// A primitive without instances.
#[derive(Debug)]
struct Template {
    mesh: usize,
    draw: Draw,
    double_sided: bool,
    /// Object space.
    bounds: Bounds,
}

/// The vertex buffers of the pipelines: positions, attributes, and positions in the previous frame.
pub(in crate::gpu_scene) fn vertex_layouts() -> [Option<wgpu::VertexBufferLayout<'static>>; 3] {
    const POSITION: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x3];
    const PREVIOUS: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![5 => Float32x3];
    const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
        wgpu::vertex_attr_array![1 => Snorm16x4, 2 => Snorm16x4, 3 => Float32x4, 4 => Unorm16x4];
    let layout = |stride: usize, attributes| wgpu::VertexBufferLayout {
        array_stride: stride as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    };
    let [positions, previous] = [&POSITION, &PREVIOUS].map(|attributes| layout(size_of::<Vec3>(), attributes));
    [Some(positions), Some(layout(size_of::<VertexAttributes>(), &ATTRIBUTES)), Some(previous)]
}

impl Geometry {
    pub(in crate::gpu_scene) fn new(
        device: &wgpu::Device,
        scene: &Scene,
        shading: Shading,
    ) -> Result<Self, RenderError> {
        let primitives: Vec<(usize, &Primitive)> =
            scene.meshes.iter().enumerate().flat_map(|(i, m)| m.primitives.iter().map(move |p| (i, p))).collect();

        let positions: Vec<Vec3> = primitives.iter().flat_map(|(_, p)| p.positions.iter().copied()).collect();
        let attributes: Vec<VertexAttributes> = primitives
            .par_iter()
            .flat_map_iter(|(_, p)| (0..p.positions.len()).map(move |i| vertex_attributes(p, i)))
            .collect();
        let indices: Vec<u32> = primitives.iter().flat_map(|(_, p)| p.indices.iter().copied()).collect();

        let mut templates = Vec::new();
        let (mut first_index, mut base_vertex) = (0u32, 0i32);
        for (mesh, primitive) in &primitives {
            let draw = Draw {
                indices: first_index..first_index + primitive.indices.len() as u32,
                base_vertex,
                instances: 0..0,
                material: primitive.material as u32,
                alpha: alpha_of(&scene.materials[primitive.material]),
                behind: ImageBehind::of(&scene.materials[primitive.material], shading),
                lobes: Lobes::of(&scene.materials[primitive.material], shading),
                scatters_from_behind: scatters_from_behind(&scene.materials[primitive.material], shading),
                facing: Facing { side: None, mirrored: false },
                bounds: Bounds::EMPTY,
            };
            let double_sided = scene.materials[primitive.material].double_sided || shading == Shading::Lambert;
            templates.push(Template { mesh: *mesh, draw, double_sided, bounds: primitive.bounds() });
            first_index += primitive.indices.len() as u32;
            base_vertex += primitive.positions.len() as i32;
        }
        let (draws, instances) = place(&templates, standing(scene));

        // Read back, and copied for motion vectors.
        let copied = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let vertex = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::STORAGE | copied;
        Ok(Self {
            positions: buffer(device, "scene/positions", &positions, vertex)?,
            attributes: buffer(device, "scene/attributes", &attributes, vertex)?,
            indices: buffer(
                device,
                "scene/indices",
                &indices,
                wgpu::BufferUsages::INDEX | wgpu::BufferUsages::STORAGE,
            )?,
            instances: storage_buffer_of(device, "scene/instances", &instances, wgpu::BufferUsages::empty())?,
            placed: instances,
            draws,
            templates,
        })
    }

    /// Writes the draw instances for these transforms, each with its mesh: as many instances, of the same meshes, mirrored as before.
    /// Writes the changed instances and returns their size, bytes.
    pub(in crate::gpu_scene) fn place(
        &mut self,
        queue: &wgpu::Queue,
        standing: impl Iterator<Item = (usize, Affine3A)>,
    ) -> u64 {
        let (draws, instances) = place(&self.templates, standing);
        self.draws = draws;
        let changed: Vec<usize> = (0..instances.len()).filter(|i| instances[*i] != self.placed[*i]).collect();
        // One write for each run of neighbours.
        for run in changed.chunk_by(|a, b| a + 1 == *b) {
            let (first, last) = (run[0], run[run.len() - 1]);
            let offset = (first * size_of::<DrawInstance>()) as u64;
            queue.write_buffer(&self.instances, offset, bytemuck::cast_slice(&instances[first..=last]));
        }
        self.placed = instances;
        (changed.len() * size_of::<DrawInstance>()) as u64
    }

    /// Sets how the draws of each material are drawn, by the material's index.
    pub(in crate::gpu_scene) fn set_materials<'a>(
        &mut self,
        shading: Shading,
        changed: impl Fn(usize) -> Option<&'a Material>,
    ) {
        for draw in self.templates.iter_mut().map(|template| &mut template.draw).chain(&mut self.draws) {
            if let Some(material) = changed(draw.material as usize) {
                (draw.lobes, draw.behind) = (Lobes::of(material, shading), ImageBehind::of(material, shading));
                draw.scatters_from_behind = scatters_from_behind(material, shading);
            }
        }
    }

    /// The first index, the first vertex and the material of each primitive, in the order of the meshes; and the index of the first
    /// primitive of each mesh.
    pub(in crate::gpu_scene) fn primitives(&self) -> (Vec<[u32; 3]>, Vec<usize>) {
        let of = |template: &Template| {
            [template.draw.indices.start, template.draw.base_vertex as u32, template.draw.material]
        };
        let mut first_of_mesh: Vec<usize> = Vec::new();
        for (i, template) in self.templates.iter().enumerate() {
            while first_of_mesh.len() <= template.mesh {
                first_of_mesh.push(i);
            }
        }
        (self.templates.iter().map(of).collect(), first_of_mesh)
    }

    /// Writes the vertices of these meshes; their number and their other data must be unchanged.
    pub(in crate::gpu_scene) fn update_vertices(&mut self, queue: &wgpu::Queue, scene: &Scene, meshes: &[usize]) {
        let mut templates = self.templates.iter_mut();
        for (i, mesh) in scene.meshes.iter().enumerate() {
            for (primitive, template) in mesh.primitives.iter().zip(&mut templates) {
                if meshes.binary_search(&i).is_err() {
                    continue;
                }
                let first = template.draw.base_vertex as u64;
                let attributes: Vec<VertexAttributes> =
                    (0..primitive.positions.len()).into_par_iter().map(|i| vertex_attributes(primitive, i)).collect();
                let bytes = bytemuck::cast_slice(&primitive.positions);
                queue.write_buffer(&self.positions, first * size_of::<Vec3>() as u64, bytes);
                let offset = first * size_of::<VertexAttributes>() as u64;
                queue.write_buffer(&self.attributes, offset, bytemuck::cast_slice(&attributes));
                template.bounds = primitive.bounds();
            }
        }
    }

    /// Sets the object-space bounding boxes of primitives, by their index among all. [`Self::place`] updates the draws.
    pub(in crate::gpu_scene) fn set_bounds(&mut self, bounds: &[(usize, Bounds)]) {
        bounds.iter().for_each(|(primitive, bounds)| self.templates[*primitive].bounds = *bounds);
    }

    /// A draw instance as the device has it.
    pub(crate) fn draw_instance(&self, index: u32) -> &DrawInstance {
        &self.placed[index as usize]
    }

    /// The scene's instance of each draw instance.
    pub(crate) fn order(&self) -> Vec<u32> {
        self.placed.iter().map(|placed| placed.instance).collect()
    }

    /// World-space box of everything.
    pub(in crate::gpu_scene) fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        self.draws.iter().for_each(|draw| bounds.add_bounds(&draw.bounds));
        bounds
    }
}

/// True if a transform changes counter-clockwise to clockwise.
pub(in crate::gpu_scene) fn mirrors(transform: &Affine3A) -> bool {
    transform.matrix3.determinant() < 0.0
}

/// The mesh and the transform of each instance of a scene.
pub(in crate::gpu_scene) fn standing(scene: &Scene) -> impl Iterator<Item = (usize, Affine3A)> + '_ {
    scene.instances.iter().map(|instance| (instance.mesh, instance.world_from_object))
}

/// Draws of all primitives, and their draw instances.
fn place(templates: &[Template], standing: impl Iterator<Item = (usize, Affine3A)>) -> (Vec<Draw>, Vec<DrawInstance>) {
    // Instances of each mesh: their indices and transforms.
    let mut placed: Vec<Vec<(u32, Affine3A)>> =
        vec![Vec::new(); templates.last().map_or(0, |template| template.mesh + 1)];
    for (instance, (mesh, transform)) in (0..).zip(standing) {
        // A mesh after the last one that has a primitive has none.
        if let Some(placed) = placed.get_mut(mesh) {
            placed.push((instance, transform));
        }
    }
    let (mut draws, mut instances) = (Vec::new(), Vec::new());
    for template in templates {
        add_draws(template, &placed[template.mesh], &mut draws, &mut instances);
    }
    (draws, instances)
}

/// Number of a primitive's instances from which they are drawn in several draws, so that a view leaves out those outside it.
const MANY: usize = 1024;
/// Instances of such a draw: neighbours in the scene's list, which often are neighbours in the scene.
const CHUNK: usize = 64;

/// Draws of one primitive: one for its instances that keep handedness, one for those that mirror; of [`MANY`] instances more. A transparent
/// surface has one draw per instance, for sorting, and per side, the back first: the far side of a convex surface is drawn before the near
/// one.
fn add_draws(
    Template { draw, double_sided, bounds: object_bounds, .. }: &Template,
    placed: &[(u32, Affine3A)],
    draws: &mut Vec<Draw>,
    instances: &mut Vec<DrawInstance>,
) {
    for mirrored in [false, true] {
        let facing = |side| Facing { side, mirrored };
        let sides: &[Side] = if *double_sided { &[Side::Back, Side::Front] } else { &[Side::Front] };
        let matching = placed.iter().filter(|(_, transform)| mirrors(transform) == mirrored);
        let first = instances.len() as u32;
        let mut boxes = Vec::new();
        for (instance, transform) in matching {
            let bounds = object_bounds.transformed(transform);
            boxes.push(bounds);
            instances.push(draw_instance(*instance, transform, draw.material, mirrored));
            if draw.alpha == DrawAlpha::Transparent {
                let index = instances.len() as u32 - 1;
                let of_side = |side: &Side| Draw {
                    instances: index..index + 1,
                    facing: facing(Some(*side)),
                    bounds,
                    ..draw.clone()
                };
                draws.extend(sides.iter().map(of_side));
            }
        }
        if draw.alpha != DrawAlpha::Transparent {
            let facing = facing((!double_sided).then_some(Side::Front));
            let size = if boxes.len() < MANY { MANY } else { CHUNK };
            for (boxes, first) in boxes.chunks(size).zip((first..).step_by(size)) {
                let mut bounds = Bounds::EMPTY;
                boxes.iter().for_each(|of_one| bounds.add_bounds(of_one));
                draws.push(Draw { instances: first..first + boxes.len() as u32, facing, bounds, ..draw.clone() });
            }
        }
    }
}

fn draw_instance(instance: u32, transform: &Affine3A, material: u32, mirrored: bool) -> DrawInstance {
    let m = transform.matrix3;
    let t = transform.translation;
    DrawInstance {
        row_x: Vec3::from(m.row(0)).extend(t.x),
        row_y: Vec3::from(m.row(1)).extend(t.y),
        row_z: Vec3::from(m.row(2)).extend(t.z),
        material,
        handedness: if mirrored { -1.0 } else { 1.0 },
        instance,
        _pad: 0,
    }
}

fn alpha_of(material: &lanternfish_scene::Material) -> DrawAlpha {
    match material.alpha_mode {
        _ if material.is_transparent() => DrawAlpha::Transparent,
        AlphaMode::Mask { .. } => DrawAlpha::Masked,
        AlphaMode::Opaque | AlphaMode::Blend | AlphaMode::ShadowCatcher { .. } => DrawAlpha::Opaque,
    }
}

fn snorm(v: f32) -> i16 {
    (v.clamp(-1.0, 1.0) * 32767.0).round() as i16
}

/// A vertex normal with the precision of its stored form.
pub(in crate::gpu_scene) fn stored_normal(normal: Vec3) -> Vec3 {
    normal.map(|v| (f32::from(snorm(v)) / 32767.0).max(-1.0))
}

fn vertex_attributes(primitive: &Primitive, i: usize) -> VertexAttributes {
    let normal = primitive.normals[i];
    let tangent = primitive.tangents.get(i).copied().unwrap_or(Vec4::new(1.0, 0.0, 0.0, 1.0));
    let uv0 = primitive.uv0.get(i).copied().unwrap_or(Vec2::ZERO);
    let uv1 = primitive.uv1.get(i).copied().unwrap_or(Vec2::ZERO);
    let color = primitive.colors.get(i).copied().unwrap_or(Vec4::ONE);
    VertexAttributes {
        normal: [snorm(normal.x), snorm(normal.y), snorm(normal.z), snorm(tangent.w)],
        tangent: [snorm(tangent.x), snorm(tangent.y), snorm(tangent.z), 0],
        uv: [uv0.x, uv0.y, uv1.x, uv1.y],
        color: color.to_array().map(|c| (c.clamp(0.0, 1.0) * 65535.0).round() as u16),
    }
}

/// A buffer that no shader of a frame binds: the device's largest buffer bounds its size, not the largest binding.
pub(in crate::gpu_scene) fn buffer<T: bytemuck::NoUninit>(
    device: &wgpu::Device,
    label: &str,
    content: &[T],
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, RenderError> {
    let bytes: &[u8] = bytemuck::cast_slice(content);
    let limit = device.limits().max_buffer_size;
    if bytes.len() as u64 > limit {
        return Err(GpuError::TooLarge { what: label.to_owned(), needed: bytes.len() as u64, limit }.into());
    }
    let contents = if bytes.is_empty() { &[0; 16] } else { bytes };
    Ok(device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage }))
}
