//! Procedural lighting for scenes without lights. It is defined relative to the camera, so that every view is lit alike.
//!
//! Use [`studio`], [`sun`], [`sky`] and [`lamp`] alone, or add a [`LightRig`] to a scene. [`is_dark`] tells if a scene
//! needs one.

pub mod albedo;
pub mod ground;

use glam::{Mat3, Vec2, Vec3};

use crate::{
    Camera, Environment, Light, Material, Scene, linear_from_srgb, named_enum,
    sight::{Face, look},
};

named_enum! {
    /// Built-in lighting that can be added to a scene.
    LightRig {
        /// Soft boxes and a grey backdrop; in a closed room, a lamp.
        Studio = "studio": "Soft boxes and a grey backdrop; in a closed room, a lamp",
        /// A sun from the camera's side and a sky.
        Sun = "sun": "A sun over the left shoulder, and a sky",
        /// No light is added.
        None = "none": "None: the scene as it is",
    }
}

impl LightRig {
    /// The rig for a scene without light ([`is_dark`]). The studio lights it through its environment, if that reaches surfaces.
    pub fn for_dark(environment_reaches_surfaces: bool) -> Self {
        if environment_reaches_surfaces { Self::Studio } else { Self::Sun }
    }

    /// Adds the rig's lights to the scene, for `camera`. An existing environment is kept; `scale` multiplies the studio's.
    /// Returns the exposure at which a white sheet in the studio is white, or that of dark materials, EV, if nothing else lights the
    /// scene and the camera is outside of it: what is seen from inside is lit by little of the studio.
    pub fn add(self, scene: &mut Scene, camera: &Camera, scale: f32) -> Option<f32> {
        let (was_dark, had_image) = (is_dark(scene), scene.environment.is_some());
        let has_environment = had_image || scene.sky != Vec3::ZERO;
        match self {
            Self::Studio => {
                scene.lights.extend(lamp(scene, camera));
                if !has_environment {
                    let mut environment = studio(camera);
                    environment.pixels.iter_mut().for_each(|pixel| *pixel *= scale);
                    scene.environment = Some(environment);
                }
            }
            Self::Sun => {
                scene.lights.push(sun(camera));
                if !has_environment {
                    scene.sky = sky();
                }
            }
            Self::None => {}
        }
        let has_studio = !had_image && scene.environment.is_some();
        // In a closed interior the studio has a lamp, too.
        let is_alone = has_studio && was_dark && scene.lights.is_empty() && !scene.bounds().contains(camera.eye());
        is_alone.then(|| scale.recip().log2() + albedo::exposure(scene)).filter(|ev| ev.is_finite())
    }
}

/// Mean emitted luminance over all surfaces from which the scene counts as lit, nits: a third of that of the Cornell box.
const LIT_BY_EMISSION: f64 = 0.03;
/// Luminance above which an emissive surface counts as a lamp, nits: brighter than a well-lit white sheet. Labels and
/// displays are darker.
const LAMP: f32 = 1.0;

/// True if nothing lights the scene: no lights, no environment, and no or little emission from lamps.
pub fn is_dark(scene: &Scene) -> bool {
    let has_light = scene.lights.iter().any(|light| light.intensity != Vec3::ZERO);
    let environment_light = scene
        .environment
        .as_ref()
        .map_or(scene.sky != Vec3::ZERO, |image| image.pixels.iter().any(|pixel| *pixel != Vec3::ZERO));
    !has_light && !environment_light && mean_luminance(scene) < LIT_BY_EMISSION
}

/// Mean luminance that a scene's surfaces emit, weighted by area, nits. Materials of at most 1 nit count as dark. A
/// texture counts with the mean of its image.
fn mean_luminance(scene: &Scene) -> f64 {
    let glow: Vec<f64> = scene.materials.iter().map(|material| emission(scene, material)).collect();
    if glow.iter().all(|luminance| *luminance == 0.0) {
        return 0.0;
    }
    let (mut light, mut area) = (0.0f64, 0.0f64);
    for instance in &scene.instances {
        for primitive in &scene.meshes[instance.mesh].primitives {
            let edge = |a: u32, b: u32| {
                let along = primitive.positions[b as usize] - primitive.positions[a as usize];
                instance.world_from_object.transform_vector3(along).as_dvec3()
            };
            let doubled = |corners: &[u32]| edge(corners[0], corners[1]).cross(edge(corners[0], corners[2])).length();
            let sum: f64 = primitive.indices.chunks_exact(3).map(doubled).sum();
            light += sum * glow[primitive.material];
            area += sum;
        }
    }
    if area > 0.0 { light / area } else { 0.0 }
}

/// Mean luminance that a material emits, nits; 0 if it is not brighter than [`LAMP`].
fn emission(scene: &Scene, material: &Material) -> f64 {
    /// Maximum number of texels that are read, evenly spaced: enough for a mean.
    const MOST: usize = 1 << 14;
    if luminance(material.emissive) <= LAMP {
        return 0.0;
    }
    let mean = material.emissive_texture.map_or(Vec3::ONE, |texture| {
        let texels = scene.images[scene.textures[texture.texture].image].rgba.as_chunks::<4>().0;
        let step = texels.len().div_ceil(MOST).max(1);
        let read = texels.iter().step_by(step).map(|[r, g, b, _]| Vec3::from([r, g, b].map(|c| linear_from_srgb(*c))));
        read.sum::<Vec3>() / texels.len().div_ceil(step) as f32
    });
    // In double precision, since the luminance of the brightest lamps overflows 32 bits.
    material.emissive.as_dvec3().dot((mean * LUMINANCE).into())
}

/// Weights of red, green and blue in the luminance of a linear Rec. 709 colour.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of a linear Rec. 709 colour, in the colour's unit.
fn luminance(color: Vec3) -> f32 {
    color.dot(LUMINANCE)
}

/// A soft box.
struct SoftBox {
    /// Direction towards the centre of the box, camera space (x right, y up, z towards the observer), any length.
    towards: Vec3,
    /// Half the box's width and height, as slopes relative to `towards`.
    half: [f32; 2],
    /// Radiance, linear Rec. 709, nits.
    radiance: Vec3,
}

/// The studio's lights: a warm key light from the upper left of the camera; a weaker fill light from the right; a cool rim light from
/// behind on the right, above the view; a broad light overhead.
const BOXES: [SoftBox; 4] = [
    SoftBox { towards: Vec3::new(-0.75, 0.75, 0.75), half: [0.5, 0.5], radiance: Vec3::new(4.9, 4.7, 4.4) },
    SoftBox { towards: Vec3::new(1.0, 0.15, 0.55), half: [0.35, 0.7], radiance: Vec3::new(1.15, 1.2, 1.25) },
    SoftBox { towards: Vec3::new(0.6, 1.2, -0.6), half: [0.45, 0.3], radiance: Vec3::new(2.9, 3.1, 3.4) },
    SoftBox { towards: Vec3::new(0.0, 1.0, 0.1), half: [0.7, 0.7], radiance: Vec3::new(1.2, 1.2, 1.2) },
];

/// Width of the soft edge of a soft box, as a fraction of its half width.
const EDGE: f32 = 0.45;

/// Environment for an object in front of this camera: soft boxes around it, and behind it a grey backdrop that darkens
/// away from the image's centre. A white sheet that faces the camera has about 0.9 nits, an 18 % grey one 0.2 nits, so
/// that exposure 0 shows them correctly. The image has 512 × 256 pixels.
pub fn studio(camera: &Camera) -> Environment {
    let (width, height) = (512, 256);
    let mut environment = Environment { width, height, pixels: Vec::new(), rotation: 0.0 };
    let camera_from_world = Mat3::from(camera.world_from_camera.matrix3).transpose();
    let pixel = |i: usize| {
        let (u, v) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        studio_radiance(camera_from_world * environment.direction(u / width as f32, v / height as f32))
    };
    environment.pixels = (0..width * height).map(pixel).collect();
    environment
}

/// Radiance of the studio from a camera-space direction, nits.
fn studio_radiance(direction: Vec3) -> Vec3 {
    // The backdrop: 0.34 at the image's centre, falling to 0.1 beside and behind the camera; darker below.
    let middle = (0.5 - 0.5 * direction.z).powi(6);
    let below = smoothstep(-1.0, 0.4, direction.y);
    let grey = (0.1 + 0.24 * middle) * (0.45 + 0.55 * below);
    let mut radiance = grey * Vec3::new(0.97, 1.0, 1.05);
    for SoftBox { towards, half, radiance: bright } in &BOXES {
        let axis = towards.normalize();
        let along = direction.dot(axis);
        if along <= 0.0 {
            continue;
        }
        let right = Vec3::Y.cross(axis).try_normalize().unwrap_or(Vec3::X);
        let position = [direction.dot(right), direction.dot(axis.cross(right))].map(|x| (x / along).abs());
        let inside = |x: f32, half: f32| 1.0 - smoothstep(half * (1.0 - EDGE), half * (1.0 + EDGE), x);
        radiance += inside(position[0], half[0]) * inside(position[1], half[1]) * *bright;
    }
    radiance
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A sun of 3 lx from over the observer's left shoulder, 45° high.
pub fn sun(camera: &Camera) -> Light {
    let axis = |a: Vec3| camera.world_from_camera.transform_vector3(a);
    // If the camera looks straight up or down, the image's up direction defines the back.
    let back = axis(Vec3::Z);
    let level = Vec3::new(back.x, 0.0, back.z);
    let upright = -axis(Vec3::Y) * back.y.signum();
    let level = if level.length() > 0.05 { level } else { Vec3::new(upright.x, 0.0, upright.z) };
    let behind = level.normalize_or(Vec3::Z);
    let left = behind.cross(Vec3::Y);
    let towards = (behind + 0.6 * left).normalize() + Vec3::Y;
    Light { name: "sun of the rig".to_owned(), ..Light::directional(-towards, Vec3::new(3.0, 2.85, 2.6)) }
}

/// Sky radiance to go with [`sun`], linear Rec. 709, nits: a third of the light on horizontal ground comes from the sky.
pub fn sky() -> Vec3 {
    Vec3::new(0.26, 0.32, 0.42)
}

/// Rays per side that measure the depths ahead of a camera.
const CELLS: usize = 8;

/// A lamp for a camera in a closed room without light from outside (see [`Camera::is_enclosed`]); `None` elsewhere. It hangs
/// over the observer's left shoulder, away from walls, and gives about 4 lx at the median distance ahead.
pub fn lamp(scene: &Scene, camera: &Camera) -> Option<Light> {
    if !camera.is_enclosed(scene) {
        return None;
    }
    let eye = camera.eye();
    let ahead = Face { world_from_face: camera.world_from_camera.matrix3.into(), slope: Vec2::splat(0.6) };
    let hits = look(scene, eye, &[ahead], CELLS);
    let mut depths: Vec<f32> = hits.iter().flatten().map(|hit| hit.depth).collect();
    depths.sort_unstable_by(f32::total_cmp);
    let middle = *depths.get(depths.len() / 2)?;
    // Above and to the left, half way to the nearest wall in that direction.
    let aside = camera.world_from_camera.transform_vector3(Vec3::new(-0.6, 0.8, 0.0));
    let face = Face {
        world_from_face: Mat3::from(Camera::looking_along(eye, aside, camera.projection).world_from_camera.matrix3),
        slope: Vec2::splat(0.2),
    };
    let free = look(scene, eye, &[face], 2).iter().flatten().map(|hit| hit.depth).fold(middle, f32::min);
    let position = eye + 0.5 * free * aside;
    Some(Light { name: "lamp of the rig".to_owned(), ..Light::point(position, Vec3::splat(4.0 * middle * middle)) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Image, Instance, Mesh, Primitive, Projection, Texture, TextureRef, Viewpoint, generate};

    fn cameras() -> Vec<Camera> {
        let scene = generate::demo("furnace").unwrap();
        let sides = Viewpoint::ALL.iter().map(|side| Camera::framing_scene(&scene, Some(*side), 0.8, 1.5));
        let below = Camera::look_at(Vec3::NEG_Y, Vec3::ZERO, Projection::Perspective { fov_y: 0.8, near: 0.1 });
        sides.chain([below]).collect()
    }

    /// Illuminance of a surface with this normal, lx: a sum over pixels.
    fn irradiance(environment: &Environment, normal: Vec3) -> Vec3 {
        let (width, height) = (environment.width, environment.height);
        let mut sum = Vec3::ZERO;
        for y in 0..height {
            for x in 0..width {
                let v = (y as f32 + 0.5) / height as f32;
                let direction = environment.direction((x as f32 + 0.5) / width as f32, v);
                let pi = std::f32::consts::PI;
                let solid_angle = 2.0 * pi * pi * (pi * v).sin() / (width * height) as f32;
                sum += environment.pixels[y * width + x] * direction.dot(normal).max(0.0) * solid_angle;
            }
        }
        sum
    }

    #[test]
    fn the_studio_lights_every_view_alike_and_from_the_upper_left() {
        for camera in cameras() {
            let studio = studio(&camera);
            studio.validate().unwrap();
            assert_eq!(studio, super::studio(&camera), "deterministic");
            let axis = |x, y, z| camera.world_from_camera.transform_vector3(Vec3::new(x, y, z)).normalize();
            // Radiance of a white sheet with this normal.
            let sheet = |normal: Vec3| irradiance(&studio, normal).element_sum() / 3.0 / std::f32::consts::PI;
            let facing = sheet(axis(0.0, 0.0, 1.0));
            assert!((0.75..1.05).contains(&facing), "facing the camera: {facing}");
            let (left, right) = (sheet(axis(-1.0, 0.0, 0.3)), sheet(axis(1.0, 0.0, 0.3)));
            let (up, down) = (sheet(axis(0.0, 1.0, 0.0)), sheet(axis(0.0, -1.0, 0.0)));
            assert!(left > 1.3 * right && up > 3.0 * down, "{left} {right}, {up} {down}");
            assert!(down > 0.08 && right > 0.3, "nothing is black: {down} {right}");
            // The backdrop: smooth, darker than white and brighter than black.
            let pixels = (0..400).map(|i| {
                let (x, y) = ((i % 20) as f32 / 10.0 - 0.95, (i / 20) as f32 / 10.0 - 0.95);
                studio.radiance(axis(0.74 * x, 0.41 * y, -1.0)).element_sum() / 3.0
            });
            let (least, most) = pixels.fold((f32::INFINITY, 0.0f32), |(a, b), p| (a.min(p), b.max(p)));
            assert!(least > 0.1 && most < 0.36 && most > 1.3 * least, "{least} to {most}");
        }
    }

    #[test]
    fn the_sun_comes_from_the_camera_and_from_above() {
        for camera in cameras() {
            let light = sun(&camera);
            assert!((light.direction.length() - 1.0).abs() < 1e-5 && light.direction.y < -0.65, "{light:?}");
            let forward = camera.world_from_camera.transform_vector3(Vec3::NEG_Z);
            if forward.y.abs() < 0.9 {
                assert!(light.direction.dot(forward) > 0.3, "not against the camera: {light:?}");
                let right = camera.world_from_camera.transform_vector3(Vec3::X);
                assert!(light.direction.dot(right) > 0.2, "from the left: {light:?}");
            }
        }
    }

    #[test]
    fn a_closed_room_gets_a_lamp_within_it() {
        let mut room = generate::demo("cornell").unwrap();
        let projection = Projection::Perspective { fov_y: 0.8, near: 0.01 };
        let (inside, outside) = (Vec3::new(0.0, 1.2, 0.7), Vec3::new(0.0, 1.0, 3.6));
        let [inside, outside] = [inside, outside].map(|eye| Camera::look_at(eye, Vec3::Y, projection));
        assert_eq!(lamp(&room, &outside), None);
        assert_eq!(lamp(&room, &inside), None, "light comes in from the open side");
        // Closes the open side.
        let bounds = room.bounds();
        let lid = Primitive {
            positions: bounds.corners()[4..].iter().map(|p| *p + 0.001 * Vec3::Z).collect(),
            indices: vec![0, 2, 1, 1, 2, 3],
            ..Primitive::default()
        };
        room.meshes.push(Mesh { primitives: vec![lid], ..Mesh::default() });
        let placed =
            Instance { name: String::new(), mesh: room.meshes.len() - 1, world_from_object: glam::Affine3A::IDENTITY };
        room.instances.push(placed);
        let light = lamp(&room, &inside).expect("it is closed");
        assert!(light.position.cmpgt(bounds.min).all() && light.position.cmplt(bounds.max).all(), "{light:?}");
        assert!(light.position.x < 0.0 && light.position.y > 1.2, "over the left shoulder: {light:?}");
        // Large and far from the origin, where a point one metre from the eye rounds to the eye.
        let mut far = room.clone();
        let far_from_near =
            glam::Affine3A::from_translation(Vec3::splat(1e9)) * glam::Affine3A::from_scale(Vec3::splat(1e4));
        far.instances.iter_mut().for_each(|at| at.world_from_object = far_from_near * at.world_from_object);
        let eye = far_from_near.transform_point3(inside.eye());
        let mut from_far = inside.clone();
        from_far.world_from_camera.translation = eye.into();
        let (light, bounds) = (lamp(&far, &from_far).expect("it is closed"), far.bounds());
        assert!(light.position.cmpgt(bounds.min).all() && light.position.cmplt(bounds.max).all(), "{light:?}");
        assert!(light.position.x < eye.x && light.position.y > eye.y, "over the left shoulder: {light:?}");
        assert_eq!(lamp(&room, &outside), None);
    }

    #[test]
    fn a_scene_without_light_sources_is_dark() {
        let mut scene = generate::demo("cornell").unwrap();
        assert!(!is_dark(&scene));
        scene.lights.clear();
        let glowing: Vec<_> = scene.materials.iter().map(|material| material.emissive).collect();
        scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
        assert!(is_dark(&scene));
        scene.sky = Vec3::splat(1e-3);
        assert!(!is_dark(&scene));
        // An environment image replaces the sky.
        scene.environment = Some(Environment { width: 1, height: 1, pixels: vec![Vec3::ZERO], rotation: 0.0 });
        assert!(is_dark(&scene));
        scene.environment = None;
        scene.sky = Vec3::ZERO;
        // A lamp lights the scene, a faint emitter does not. A half-black texture halves the luminance.
        scene.materials.iter_mut().zip(glowing).for_each(|(material, emissive)| material.emissive = emissive);
        scene.materials[0].emissive = Vec3::splat(10.0);
        let untextured = mean_luminance(&scene);
        assert!(!is_dark(&scene) && untextured > 0.1, "{untextured}");
        let rgba = [[255u8; 4], [0, 0, 0, 255]].concat();
        scene.images.push(Image { name: String::new(), width: 2, height: 1, rgba });
        scene.textures.push(Texture { image: scene.images.len() - 1, sampler: 0 });
        let others = {
            scene.materials[0].emissive = Vec3::ZERO;
            mean_luminance(&scene)
        };
        scene.materials[0].emissive = Vec3::splat(10.0);
        scene.materials[0].emissive_texture = Some(TextureRef::new(scene.textures.len() - 1));
        assert!((mean_luminance(&scene) - others - 0.5 * (untextured - others)).abs() < 1e-3 * untextured);
        scene.materials.iter_mut().for_each(|material| material.emissive *= 0.1);
        assert!(is_dark(&scene));
        // Areas whose squares overflow 32 bits: only a dark surface of such an area, and a lamp.
        let corners = [Vec3::ZERO, 1e11 * Vec3::X, 1e11 * Vec3::Y].to_vec();
        let vast = Primitive { positions: corners, indices: vec![0, 1, 2], material: 1, ..Primitive::default() };
        scene.materials[1].emissive = Vec3::ZERO;
        scene.meshes[scene.instances[0].mesh].primitives.push(vast);
        assert!(is_dark(&scene));
        scene.materials[1].emissive = Vec3::MAX;
        assert!(!is_dark(&scene));
    }

    #[test]
    fn existing_lighting_is_kept() {
        let camera = &cameras()[0];
        let mut scene = generate::demo("furnace").unwrap();
        LightRig::Sun.add(&mut scene, camera, 1.0);
        assert_eq!((scene.sky, scene.lights.len()), (Vec3::ONE, 2));
        LightRig::Studio.add(&mut scene, camera, 1.0);
        assert!(scene.environment.is_none());
        let mut empty = Scene::default();
        LightRig::None.add(&mut empty, camera, 1.0);
        assert!(is_dark(&empty));
        LightRig::Studio.add(&mut empty, camera, 1.0);
        assert!(!is_dark(&empty) && empty.lights.is_empty());
        let mut dim = Scene::default();
        LightRig::Studio.add(&mut dim, camera, 0.25);
        let pixels = |scene: Scene| scene.environment.unwrap().pixels;
        assert!(pixels(dim).iter().zip(pixels(empty)).all(|(dim, full)| *dim == 0.25 * full));
    }
}
