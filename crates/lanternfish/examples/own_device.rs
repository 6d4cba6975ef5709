//! Your own wgpu device, a scene built in code → an image.
//!
//! ```text
//! cargo run --release --package lanternfish --example own_device [FILE.png]
//! ```
//!
//! The library opens nothing: instance, adapter and device are the caller's. WebGPU's default limits and no optional feature are enough.

use std::{error::Error, path::PathBuf};

use glam::{Affine3A, Vec3};
use lanternfish::{Renderer, Settings};
use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::{Camera, Instance, Light, Material, Mesh, Primitive, Projection, Scene};

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).map_or("own_device.png".into(), PathBuf::from);
    let (device, queue) = pollster::block_on(open())?;

    let scene = scene();
    let camera = Camera::look_at(
        Vec3::new(3.0, 2.2, 4.0),
        Vec3::new(0.0, 0.5, 0.0),
        Projection::Perspective { fov_y: 40f32.to_radians(), near: 0.1 },
    );

    let mut renderer = Renderer::new(&device, &queue, Settings::default())?;
    let uploaded = renderer.upload(&scene)?;
    let rendering = renderer.render(&uploaded, &camera, [WIDTH, HEIGHT])?;

    for (name, count) in &rendering.report.counters {
        println!("{name:<32} {count:>10}");
    }
    write_png(&path, [WIDTH, HEIGHT], ColorType::Rgba, rendering.display.as_flattened())?;
    println!("{}", path.display());
    Ok(())
}

/// As in any wgpu program; a program with a device passes its own.
async fn open() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = instance.request_adapter(&wgpu::RequestAdapterOptions::default()).await?;
    Ok(adapter.request_device(&wgpu::DeviceDescriptor::default()).await?)
}

/// A cube on a floor between a warm and a cold light. Metres; +y is up.
fn scene() -> Scene {
    let floor = quad(0, Vec3::ZERO, Vec3::X * 4.0, Vec3::NEG_Z * 4.0);
    let material = |color: Vec3, perceptual_roughness| Material {
        base_color: color.extend(1.0),
        metallic: 0.0,
        perceptual_roughness,
        ..Material::default()
    };
    let mesh = |name: &str, primitives| Mesh { name: name.to_owned(), primitives };
    let instance = |mesh, world_from_object| Instance { name: String::new(), mesh, world_from_object };
    Scene {
        name: "own device".to_owned(),
        meshes: vec![mesh("floor", vec![floor]), mesh("cube", cube(1))],
        instances: vec![
            instance(0, Affine3A::IDENTITY),
            instance(1, Affine3A::from_translation(0.5 * Vec3::Y) * Affine3A::from_rotation_y(0.5)),
        ],
        materials: vec![material(Vec3::new(0.6, 0.6, 0.6), 0.8), material(Vec3::new(0.8, 0.5, 0.2), 0.3)],
        lights: vec![
            Light::point(Vec3::new(2.0, 2.5, 0.5), 12.0 * Vec3::new(1.0, 0.8, 0.5)),
            Light::point(Vec3::new(-1.5, 2.0, 2.5), 10.0 * Vec3::new(0.4, 0.6, 1.0)),
        ],
        sky: Vec3::new(0.02, 0.03, 0.05),
        ..Scene::default()
    }
}

/// Six faces around the origin, 1 m long.
fn cube(material: usize) -> Vec<Primitive> {
    let half = 0.5;
    [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z]
        .into_iter()
        .map(|normal| {
            let right = normal.any_orthonormal_vector();
            quad(material, half * normal, half * right, half * normal.cross(right))
        })
        .collect()
}

/// A rectangle seen from its front: `half_right` points right and `half_up` up.
fn quad(material: usize, center: Vec3, half_right: Vec3, half_up: Vec3) -> Primitive {
    Primitive {
        material,
        positions: vec![
            center - half_right - half_up,
            center + half_right - half_up,
            center + half_right + half_up,
            center - half_right + half_up,
        ],
        normals: vec![half_right.cross(half_up).normalize(); 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}
