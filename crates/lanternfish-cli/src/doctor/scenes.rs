//! The small scenes that a check renders, each made by code.

use std::f32::consts::PI;

use glam::{Affine3A, Quat, Vec2, Vec3};
use lanternfish_scene::{
    AlphaMode, Bounds, Camera, Image, Instance, Light, Material, Mesh, Primitive, Projection, Sampler, Scene, Texture,
    TextureRef,
    generate::{demo, light_rain, sky},
};

use super::figure;
use crate::error::CliError;

/// A view of a scene.
pub struct Subject {
    pub scene: Scene,
    pub camera: Camera,
    /// Of the reference image, pixels. The renderer's image is [`Subject::FACTOR`] times as wide and high, and box-filtered.
    pub size: [u32; 2],
    /// The animation that plays, and the moment of it, s.
    pub moment: Option<(usize, f32)>,
}

impl Subject {
    pub const FACTOR: u32 = 4;

    fn of(scene: Scene, size: [u32; 2]) -> Self {
        let camera = scene.default_camera(size[0] as f32 / size[1] as f32);
        Self { scene, camera, size, moment: None }
    }

    /// The scene as the path tracer sees it: posed by the host.
    pub fn posed(&self) -> Scene {
        let mut scene = self.scene.clone();
        if let Some((animation, time)) = self.moment {
            scene.pose(animation, time);
        }
        scene
    }
}

/// Which scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Name {
    Atrium,
    Spheres,
    Hall,
    Cornell,
    CornellLights,
    AreaLights,
    Masks,
    Glass,
    Figure,
    Environment,
    White,
}

impl Name {
    /// As the report calls it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Atrium => "atrium, 100 lights",
            Self::Spheres => "row of spheres",
            Self::Hall => "turned hall",
            Self::Cornell => "Cornell box",
            Self::CornellLights => "Cornell box, no emission",
            Self::AreaLights => "area lights",
            Self::Masks => "alpha mask",
            Self::Glass => "transparent pane",
            Self::Figure => "skinned figure",
            Self::Environment => "spheres in an environment",
            Self::White => "white Cornell box",
        }
    }

    pub fn subject(self) -> Result<Subject, CliError> {
        Ok(match self {
            Self::Atrium => {
                let mut scene = lights_alone(demo("atrium")?);
                // Over the court, away from surfaces: a spot beside a light is smaller than a pixel.
                let court = Bounds { min: Vec3::new(-8.0, 2.5, -3.0), max: Vec3::new(8.0, 7.0, 3.0) };
                scene.lights.extend(light_rain(&court, 100, Some(5.0), 0, 0.0));
                Subject::of(scene, [64, 36])
            }
            Self::Spheres => {
                let mut scene = lights_alone(demo("furnace")?);
                // The highlight of a smoother one is smaller than a pixel.
                scene.materials.iter_mut().for_each(|m| m.perceptual_roughness = m.perceptual_roughness.max(0.3));
                Subject::of(scene, [72, 36])
            }
            Self::Hall => Subject::of(lights_alone(demo("hall")?), [64, 36]),
            Self::Cornell => Subject::of(cornell()?, [48, 48]),
            Self::CornellLights => Subject::of(lights_alone(cornell()?), [48, 48]),
            Self::AreaLights => Subject::of(area_lights()?, [48, 48]),
            Self::Masks => Subject::of(masks(), [48, 48]),
            Self::Glass => Subject::of(glass()?, [48, 48]),
            Self::Figure => {
                let scene = figure::scene();
                Subject { moment: Some((0, 0.7)), ..Subject::of(scene, [48, 48]) }
            }
            Self::Environment => {
                let mut scene = demo("furnace")?;
                scene.lights.clear();
                (scene.sky, scene.environment) = (Vec3::ZERO, Some(sky()));
                Subject::of(scene, [72, 36])
            }
            Self::White => Subject::of(white(demo("cornell")?), [48, 48]),
        })
    }
}

/// The Cornell box with its light well below the lamp: a bright spot on the lamp would be most of the noise.
fn cornell() -> Result<Scene, CliError> {
    let mut scene = demo("cornell")?;
    scene.lights.iter_mut().for_each(|light| light.position.y = 1.5);
    Ok(scene)
}

/// The scene without light but that of its lights.
fn lights_alone(mut scene: Scene) -> Scene {
    (scene.sky, scene.environment) = (Vec3::ZERO, None);
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene
}

/// The scene white and diffuse under a white sky, without other light: what it sends is its ambient visibility.
fn white(mut scene: Scene) -> Scene {
    scene.lights.clear();
    scene.sky = Vec3::ONE;
    for material in &mut scene.materials {
        (material.base_color, material.specular, material.emissive) = (Vec3::ONE.extend(1.0), 0.0, Vec3::ZERO);
        material.metallic = 0.0;
    }
    scene
}

/// A disk and a rectangle for the lamp of the Cornell box.
fn area_lights() -> Result<Scene, CliError> {
    let mut scene = lights_alone(demo("cornell")?);
    scene.lights = vec![
        Light::disk(Vec3::new(-0.5, 1.9, 0.2), Vec3::NEG_Y, 0.2, Vec3::new(9.0, 7.0, 5.0)),
        Light::rectangle(Vec3::new(0.9, 1.2, 0.4), Vec3::NEG_X, Vec3::Z, [0.6, 0.3], Vec3::new(3.0, 4.0, 6.0)),
    ];
    Ok(scene)
}

/// A pane of coloured glass before the open side of the Cornell box, and one that covers by alpha.
fn glass() -> Result<Scene, CliError> {
    let mut scene = lights_alone(demo("cornell")?);
    let dielectric = Material { metallic: 0.0, perceptual_roughness: 0.3, ..Material::default() };
    let first = scene.materials.len();
    scene.materials.push(Material {
        base_color: Vec3::new(0.9, 0.5, 0.2).extend(0.5),
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..dielectric.clone()
    });
    scene.materials.push(Material {
        base_color: Vec3::new(0.3, 0.8, 0.9).extend(1.0),
        transmission: 1.0,
        perceptual_roughness: 0.0,
        double_sided: true,
        ..dielectric
    });
    // The lamp's light does not come back to the box from where they stand.
    for (i, x) in [-0.45, 0.45].into_iter().enumerate() {
        place(&mut scene, rectangle(first + i, Vec3::new(x, 1.0, 1.3), 0.35 * Vec3::X, 0.6 * Vec3::Y));
    }
    Ok(scene)
}

/// A card with holes between a lamp and the floor and wall behind it.
fn masks() -> Scene {
    let matte = |color: [f32; 3]| Material {
        base_color: Vec3::from(color).extend(1.0),
        metallic: 0.0,
        double_sided: true,
        ..Material::default()
    };
    let mut scene = Scene { name: "masks".to_owned(), ..Scene::default() };
    const EDGE: u32 = 8;
    let is_hole = |i: u32| (i % EDGE + i / EDGE).is_multiple_of(2);
    let rgba = (0..EDGE * EDGE).flat_map(|i| [230, 200, 90, if is_hole(i) { 0 } else { 255 }]).collect();
    scene.images.push(Image { name: "holes".to_owned(), width: EDGE, height: EDGE, rgba });
    scene.samplers.push(Sampler::default());
    scene.textures.push(Texture { image: 0, sampler: 0 });
    scene.materials = vec![
        matte([0.7, 0.7, 0.7]),
        Material {
            base_color_texture: Some(TextureRef::new(0)),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            ..matte([1.0, 1.0, 1.0])
        },
    ];
    place(&mut scene, rectangle(0, Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::NEG_Z));
    place(&mut scene, rectangle(0, Vec3::new(0.0, 1.0, -1.0), 2.0 * Vec3::X, Vec3::Y));
    place(&mut scene, rectangle(1, Vec3::new(0.0, 0.8, 0.2), 0.6 * Vec3::X, 0.6 * Vec3::Y));
    // Close to the card: a shadow ray that ends too early misses it.
    scene.lights.push(Light::point(Vec3::new(0.15, 0.9, 0.36), Vec3::new(2.0, 2.0, 1.7)));
    let projection = Projection::Perspective { fov_y: PI / 4.0, near: 0.05 };
    scene.cameras.push(Camera::look_at(Vec3::new(-1.6, 1.7, 2.4), Vec3::new(0.0, 0.6, -0.3), projection));
    scene
}

/// Places a mesh of one primitive where it was built.
pub fn place(scene: &mut Scene, primitive: Primitive) {
    let mesh = scene.meshes.len();
    scene.meshes.push(Mesh { name: String::new(), primitives: vec![primitive] });
    scene.instances.push(Instance { name: String::new(), mesh, world_from_object: Affine3A::IDENTITY });
}

/// A rectangle whose front is where `half_right` runs to the right and `half_up` upwards; uv 0..1 from its top left.
pub fn rectangle(material: usize, center: Vec3, half_right: Vec3, half_up: Vec3) -> Primitive {
    let corner = |s: f32, t: f32| center + s * half_right + t * half_up;
    Primitive {
        material,
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![half_right.cross(half_up).normalize(); 4],
        uv0: vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

/// The scene after a change that an update brings to the device: an instance moved and turned, and a light moved.
pub fn changed(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let Some(instance) = scene.instances.last_mut() {
        let step = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.3), Vec3::new(0.02, 0.05, 0.0));
        instance.world_from_object = step * instance.world_from_object;
    }
    if let Some(light) = scene.lights.first_mut() {
        light.position += Vec3::new(0.1, -0.1, 0.2);
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_is_valid_and_seen() {
        use Name::*;
        let all = [Atrium, Spheres, Hall, Cornell, CornellLights, AreaLights, Masks, Glass, Figure, Environment, White];
        for name in all {
            let subject = name.subject().unwrap();
            assert_eq!(subject.posed().validate(), Ok(()), "{name:?}");
            assert_eq!(subject.camera.validate(), Ok(()), "{name:?}");
            let is_lit = !subject.scene.lights.is_empty()
                || subject.scene.environment.is_some()
                || subject.scene.sky != Vec3::ZERO;
            assert!(is_lit, "{name:?}");
        }
        let figure = Figure.subject().unwrap();
        let places = |scene: &Scene| scene.meshes.last().unwrap().primitives[0].positions.clone();
        assert_ne!(places(&figure.posed()), places(&figure.scene), "it moves");
    }
}
