//! A program with its own renderer: it draws a G-buffer, Lanternfish computes the light, and the program shades.
//!
//! ```text
//! cargo run --release --package lanternfish --example own_g_buffer [FILE.png]
//! ```
//!
//! 1. The program draws depth, normals with roughness, and its own colours.
//! 2. Lanternfish computes the shadowed light of two thousand lamps and the light between surfaces: direct and indirect irradiance.
//! 3. The program multiplies both by its colours.

mod support;

use std::path::PathBuf;

use glam::{Affine3A, Mat4, Vec3};
use lanternfish::{
    Renderer, Settings, SurfaceSource, Target, ViewRequest,
    settings::{Exposure, Materials, Samples, ToneMap},
};
use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::{Camera, Instance, Material, Mesh, Primitive, Projection, Scene, generate::light_rain};
use support::{Result, open, pixels, texture};
use wgpu::util::DeviceExt;

/// Width and height, pixels.
pub const SIZE: [u32; 2] = [320, 240];

fn main() -> Result<()> {
    let path = std::env::args_os().nth(1).map_or("own_g_buffer.png".into(), PathBuf::from);
    let (device, queue) = open()?;
    let rendering = draw(&device, &queue, settings())?;
    write_png(&path, SIZE, ColorType::Rgba, rendering.as_flattened())?;
    println!("{}", path.display());
    Ok(())
}

/// Lambertian surfaces like the program's, and the exposure of `SHADE`.
pub fn settings() -> Settings {
    let (exposure, tone_map) = (Exposure::Ev(-4.0), ToneMap::None);
    Settings::default()
        .with_materials(Materials::Lambert)
        .with_samples(Samples::One)
        .with_exposure(exposure)
        .with_tone_map(tone_map)
}

/// Renders a frame of the program.
pub fn draw(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Vec<[u8; 4]>> {
    let mut renderer = Renderer::new(device, queue, settings)?;
    let uploaded = renderer.upload(&scene())?;
    let program = Program::new(device);
    let target = |format| texture(device, SIZE, format);
    let half = wgpu::TextureFormat::Rgba16Float;
    let (depth, normals, colors) =
        (target(wgpu::TextureFormat::Depth32Float), target(half), target(wgpu::TextureFormat::Rgba8Unorm));
    let (direct, indirect, shown) = (target(half), target(half), target(wgpu::TextureFormat::Rgba8UnormSrgb));
    let view = ViewRequest {
        surface: SurfaceSource::Given { depth: &depth, normal_roughness: &normals },
        ..ViewRequest::of_camera(0, &camera(), SIZE, Target::Demodulated { direct: &direct, indirect: &indirect })
    };
    renderer.ready(&uploaded, &[view])?;

    let mut commands = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let clip_from_world =
        Mat4::from_cols_array_2d(&view.clip_from_view) * Mat4::from_cols_array_2d(&view.world_from_view).inverse();
    program.draw_surfaces(device, &mut commands, clip_from_world, &depth, [&normals, &colors]);
    let frame = renderer.record(&mut commands, &uploaded, &[view])?;
    program.shade(device, &mut commands, [&colors, &direct, &indirect], &shown);
    queue.submit([commands.finish()]);
    renderer.submitted(frame);
    pixels(device, queue, &shown)
}

/// The program's camera.
pub fn camera() -> Camera {
    let projection = Projection::Perspective { fov_y: 40f32.to_radians(), near: 0.1 };
    Camera::look_at(Vec3::new(3.0, 2.2, 4.0), Vec3::new(0.0, 0.4, 0.0), projection)
}

/// Rectangles: centre, half extent to the right, half extent up, colour.
fn rectangles() -> Vec<[Vec3; 4]> {
    let mut all = vec![[Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z, Vec3::splat(0.6)]];
    for (center, color) in
        [(Vec3::new(-0.8, 0.5, 0.0), Vec3::new(0.8, 0.3, 0.2)), (Vec3::new(0.7, 0.5, 0.4), Vec3::new(0.2, 0.5, 0.8))]
    {
        for normal in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z] {
            let right = normal.any_orthonormal_vector();
            all.push([center + 0.5 * normal, 0.5 * right, 0.5 * normal.cross(right), color]);
        }
    }
    all
}

fn corners([center, right, up, _]: [Vec3; 4]) -> [Vec3; 4] {
    [center - right - up, center + right - up, center + right + up, center - right + up]
}

/// The scene for Lanternfish: surfaces, which cast shadows and reflect light, and lights.
pub fn scene() -> Scene {
    let (mut primitives, mut materials) = (Vec::new(), Vec::new());
    for (material, rectangle) in rectangles().into_iter().enumerate() {
        let [_, right, up, color] = rectangle;
        primitives.push(Primitive {
            material,
            positions: corners(rectangle).to_vec(),
            normals: vec![right.cross(up).normalize(); 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        });
        materials.push(Material { base_color: color.extend(1.0), ..Material::default() });
    }
    let mut scene = Scene {
        name: "the program's".to_owned(),
        meshes: vec![Mesh { name: String::new(), primitives }],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials,
        ..Scene::default()
    };
    let mut air = scene.bounds();
    air.max.y = 2.0;
    scene.lights = light_rain(&air, 2000, Some(1.0), 1, 0.0);
    scene
}

/// The program's own pipelines and vertices.
struct Program {
    surfaces: wgpu::RenderPipeline,
    shading: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    vertex_count: u32,
}

const SURFACES: &str = "
struct Vertex { @builtin(position) position: vec4f, @location(0) normal: vec3f, @location(1) color: vec3f }
struct Surface { @location(0) normal_roughness: vec4f, @location(1) color: vec4f }
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
@vertex fn vertex(@location(0) p: vec3f, @location(1) normal: vec3f, @location(2) color: vec3f) -> Vertex {
    return Vertex(clip_from_world * vec4f(p, 1.0), normal, color);
}
@fragment fn fragment(in: Vertex) -> Surface {
    return Surface(vec4f(in.normal, 0.8), vec4f(in.color, 1.0));
}";

const SHADE: &str = "
@group(0) @binding(0) var color: texture_2d<f32>;
@group(0) @binding(1) var direct: texture_2d<f32>;
@group(0) @binding(2) var indirect: texture_2d<f32>;
@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
@fragment fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(position.xy);
    let light = textureLoad(direct, pixel, 0).rgb + textureLoad(indirect, pixel, 0).rgb;
    // Four stops darker, for display.
    return vec4f(exp2(-4.0) * textureLoad(color, pixel, 0).rgb * light, 1.0);
}";

impl Program {
    fn new(device: &wgpu::Device) -> Self {
        let vertices: Vec<[Vec3; 3]> = rectangles()
            .into_iter()
            .flat_map(|rectangle| {
                let [_, right, up, color] = rectangle;
                let corners = corners(rectangle);
                [0, 1, 2, 0, 2, 3].map(|i| [corners[i], right.cross(up).normalize(), color])
            })
            .collect();
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3];
        let layout = wgpu::VertexBufferLayout {
            array_stride: 36,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let depth = wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            // Reverse-Z: nearer surfaces have greater depth.
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let formats = [wgpu::TextureFormat::Rgba16Float, wgpu::TextureFormat::Rgba8Unorm];
        let surfaces = pipeline(device, SURFACES, &[Some(layout)], Some(depth), &formats);
        let shading = pipeline(device, SHADE, &[], None, &[wgpu::TextureFormat::Rgba8UnormSrgb]);
        let vertex_count = vertices.len() as u32;
        let contents = bytemuck::cast_slice(&vertices);
        let usage = wgpu::BufferUsages::VERTEX;
        let vertices = device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
        Self { surfaces, shading, vertices, vertex_count }
    }

    fn draw_surfaces(
        &self,
        device: &wgpu::Device,
        commands: &mut wgpu::CommandEncoder,
        clip_from_world: Mat4,
        depth: &wgpu::TextureView,
        targets: [&wgpu::TextureView; 2],
    ) {
        let (contents, usage) = (bytemuck::bytes_of(&clip_from_world), wgpu::BufferUsages::UNIFORM);
        let matrix = device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
        let bind_group = bind_group(device, &self.surfaces, &[matrix.as_entire_binding()]);
        let colors = targets.map(|view| Some(cleared(view)));
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surfaces of the program"),
            color_attachments: &colors,
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.surfaces);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.draw(0..self.vertex_count, 0..1);
    }

    fn shade(
        &self,
        device: &wgpu::Device,
        commands: &mut wgpu::CommandEncoder,
        read: [&wgpu::TextureView; 3],
        shown: &wgpu::TextureView,
    ) {
        let bind_group = bind_group(device, &self.shading, &read.map(wgpu::BindingResource::TextureView));
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("the program shades"),
            color_attachments: &[Some(cleared(shown))],
            ..Default::default()
        });
        pass.set_pipeline(&self.shading);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn pipeline(
    device: &wgpu::Device,
    text: &str,
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    depth_stencil: Option<wgpu::DepthStencilState>,
    formats: &[wgpu::TextureFormat],
) -> wgpu::RenderPipeline {
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let targets: Vec<_> = formats.iter().map(|format| Some((*format).into())).collect();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers,
        },
        primitive: Default::default(),
        depth_stencil,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn bind_group(
    device: &wgpu::Device,
    pipeline: &wgpu::RenderPipeline,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() });
    let (layout, entries) = (pipeline.get_bind_group_layout(0), entries.collect::<Vec<_>>());
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries })
}

fn cleared(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}
