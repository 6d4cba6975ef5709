//! Light for scenes that bring none: made by formulas about the camera, so that every view is lit alike.
//!
//! Use one by itself ([`studio`], [`sun`], [`sky`], [`lamp`]), or let a [`LightRig`] put into a scene what belongs
//! together. [`is_dark`] says whether a scene needs any.

use glam::{Mat3, Vec2, Vec3};

use crate::{
    Camera, Environment, Light, Material, Scene, linear_from_srgb, named_enum,
    sight::{Face, look},
};

named_enum! {
    /// Built-in lighting that can be added to a scene.
    LightRig {
        /// Soft boxes and a calm backdrop, and where no light from outside comes in, a lamp.
        Studio = "studio": "Soft boxes and a grey backdrop; in a closed room, a lamp",
        /// A sun from the camera's side and a sky.
        Sun = "sun": "A sun over the left shoulder, and a sky",
        /// No light is added.
        None = "none": "None: the scene as it is",
    }
}

impl LightRig {
    /// Adds its light to the scene, for `camera`; environment that the scene has stay.
    pub fn add(self, scene: &mut Scene, camera: &Camera) {
        let has_environment = scene.environment.is_some() || scene.sky != Vec3::ZERO;
        match self {
            Self::Studio => {
                scene.lights.extend(lamp(scene, camera));
                if !has_environment {
                    scene.environment = Some(studio(camera));
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
    }
}

/// Mean luminance over all surfaces from which on they light a scene, nits: a third of what the lamp of the Cornell box comes to.
const LIT_BY_EMISSION: f64 = 0.03;
/// Luminance above which a glowing surface counts as a lamp, nits: brighter than a white sheet in good light. Labels and
/// displays are not.
const LAMP: f32 = 1.0;

/// Whether nothing lights the scene: it has no lights and no environment, and what glows is no lamp, or sends little.
pub fn is_dark(scene: &Scene) -> bool {
    let has_light = scene.lights.iter().any(|light| light.intensity != Vec3::ZERO);
    let environment_light = scene
        .environment
        .as_ref()
        .map_or(scene.sky != Vec3::ZERO, |image| image.pixels.iter().any(|pixel| *pixel != Vec3::ZERO));
    !has_light && !environment_light && mean_luminance(scene) < LIT_BY_EMISSION
}

/// Mean luminance that a scene's surfaces emit, over all their area, nits. Materials of at most 1 nit count as dark, and a
/// texture by the mean of its image.
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

/// Mean luminance that a material emits, nits; 0 where it glows no brighter than [`LAMP`].
fn emission(scene: &Scene, material: &Material) -> f64 {
    /// Most texels that are read, evenly spaced: enough for a mean.
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
    // In double precision: the luminance of the brightest lamp is beyond what 32 bits hold.
    material.emissive.as_dvec3().dot((mean * LUMINANCE).into())
}

/// Weights of red, green and blue in the luminance of a linear Rec. 709 colour.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of a linear Rec. 709 colour, in the colour's unit.
fn luminance(color: Vec3) -> f32 {
    color.dot(LUMINANCE)
}

/// A box of soft light.
struct SoftBox {
    /// Direction towards the middle of the box in the camera's frame: x right, y up, z towards who looks; any length.
    towards: Vec3,
    /// Half the box's width and height, as slopes about `towards`.
    half: [f32; 2],
    /// Radiance, linear Rec. 709, nits.
    radiance: Vec3,
}

/// The studio's lights: a warm key light from the upper left of the camera; a weaker fill light from the right; a cool rim light from
/// behind on the right, above what a camera sees; a broad one overhead.
const BOXES: [SoftBox; 4] = [
    SoftBox { towards: Vec3::new(-0.75, 0.75, 0.75), half: [0.5, 0.5], radiance: Vec3::new(4.9, 4.7, 4.4) },
    SoftBox { towards: Vec3::new(1.0, 0.15, 0.55), half: [0.35, 0.7], radiance: Vec3::new(1.15, 1.2, 1.25) },
    SoftBox { towards: Vec3::new(0.6, 1.2, -0.6), half: [0.45, 0.3], radiance: Vec3::new(2.9, 3.1, 3.4) },
    SoftBox { towards: Vec3::new(0.0, 1.0, 0.1), half: [0.7, 0.7], radiance: Vec3::new(1.2, 1.2, 1.2) },
];

/// Width of the edge of a soft box, as a share of its half width.
const EDGE: f32 = 0.45;

/// Environment for a thing before this camera: soft boxes around it, and behind it a backdrop of grey that darkens
/// away from the middle of the image. A white sheet that faces the camera is about 0.9 nits bright, a grey one of
/// 18 % 0.2: an image without exposure shows them as they are. An image of 512 × 256 pixels.
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

/// Radiance of the studio in a direction of the camera's frame, nits.
fn studio_radiance(direction: Vec3) -> Vec3 {
    // The backdrop: 0.34 in the middle of the image, falling to 0.1 beside and behind the camera; darker below.
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
        let place = [direction.dot(right), direction.dot(axis.cross(right))].map(|x| (x / along).abs());
        let inside = |x: f32, half: f32| 1.0 - smoothstep(half * (1.0 - EDGE), half * (1.0 + EDGE), x);
        radiance += inside(place[0], half[0]) * inside(place[1], half[1]) * *bright;
    }
    radiance
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A sun of 3 lx that shines from over the left shoulder of who looks through the camera, 45° high.
pub fn sun(camera: &Camera) -> Light {
    let axis = |a: Vec3| camera.world_from_camera.transform_vector3(a);
    // Looking straight up or down, what is up in the image says where behind is.
    let back = axis(Vec3::Z);
    let level = Vec3::new(back.x, 0.0, back.z);
    let upright = -axis(Vec3::Y) * back.y.signum();
    let level = if level.length() > 0.05 { level } else { Vec3::new(upright.x, 0.0, upright.z) };
    let behind = level.normalize_or(Vec3::Z);
    let left = behind.cross(Vec3::Y);
    let towards = (behind + 0.6 * left).normalize() + Vec3::Y;
    Light { name: "sun of the rig".to_owned(), ..Light::directional(-towards, Vec3::new(3.0, 2.85, 2.6)) }
}

/// Radiance of the sky that goes with [`sun`], linear Rec. 709, nits: it gives level ground a third of its light.
pub fn sky() -> Vec3 {
    Vec3::new(0.26, 0.32, 0.42)
}

/// Cells a side into which the view ahead of a camera is divided to measure depths.
const CELLS: usize = 8;

/// A lamp for a camera in a closed room, to which no light from outside comes (see [`Camera::is_enclosed`]); `None`
/// elsewhere. It hangs over the left shoulder, free of walls, and gives about 4 lx at the middle distance of what is ahead.
pub fn lamp(scene: &Scene, camera: &Camera) -> Option<Light> {
    if !camera.is_enclosed(scene) {
        return None;
    }
    let eye = camera.eye();
    let ahead = Face { world_from_face: camera.world_from_camera.matrix3.into(), slope: Vec2::splat(0.6) };
    let seen = look(scene, eye, &[ahead], CELLS);
    let mut depths: Vec<f32> = seen.iter().flatten().map(|hit| hit.depth).collect();
    depths.sort_unstable_by(f32::total_cmp);
    let middle = *depths.get(depths.len() / 2)?;
    // Above and to the left, as far as half the way to the next wall there.
    let aside = camera.world_from_camera.transform_vector3(Vec3::new(-0.6, 0.8, 0.0));
    let face = Face {
        world_from_face: Mat3::from(Camera::looking_along(eye, aside, camera.projection).world_from_camera.matrix3),
        slope: Vec2::splat(0.2),
    };
    let free = look(scene, eye, &[face], 2).iter().flatten().map(|hit| hit.depth).fold(middle, f32::min);
    let place = eye + 0.5 * free * aside;
    Some(Light { name: "lamp of the rig".to_owned(), ..Light::point(place, Vec3::splat(4.0 * middle * middle)) })
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

    /// Light that falls on a surface of this normal, lx: the sum over pixels.
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
            assert_eq!(studio, super::studio(&camera), "the same every time");
            let axis = |x, y, z| camera.world_from_camera.transform_vector3(Vec3::new(x, y, z)).normalize();
            // Radiance of a white sheet that faces so.
            let sheet = |normal: Vec3| irradiance(&studio, normal).element_sum() / 3.0 / std::f32::consts::PI;
            let facing = sheet(axis(0.0, 0.0, 1.0));
            assert!((0.75..1.05).contains(&facing), "facing the camera: {facing}");
            let (left, right) = (sheet(axis(-1.0, 0.0, 0.3)), sheet(axis(1.0, 0.0, 0.3)));
            let (up, down) = (sheet(axis(0.0, 1.0, 0.0)), sheet(axis(0.0, -1.0, 0.0)));
            assert!(left > 1.3 * right && up > 3.0 * down, "{left} {right}, {up} {down}");
            assert!(down > 0.08 && right > 0.3, "nothing is black: {down} {right}");
            // What is behind the thing: calm, and neither as bright as white nor black.
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
        // A lid on the open side.
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
        // Large, and far from the origin, where a metre beside the eye is the eye.
        let mut far = room.clone();
        let place = glam::Affine3A::from_translation(Vec3::splat(1e9)) * glam::Affine3A::from_scale(Vec3::splat(1e4));
        far.instances.iter_mut().for_each(|at| at.world_from_object = place * at.world_from_object);
        let eye = place.transform_point3(inside.eye());
        let mut from_far = inside.clone();
        from_far.world_from_camera.translation = eye.into();
        let (light, bounds) = (lamp(&far, &from_far).expect("it is closed"), far.bounds());
        assert!(light.position.cmpgt(bounds.min).all() && light.position.cmplt(bounds.max).all(), "{light:?}");
        assert!(light.position.x < eye.x && light.position.y > eye.y, "over the left shoulder: {light:?}");
        assert_eq!(lamp(&room, &outside), None);
    }

    #[test]
    fn a_scene_is_dark_where_nothing_sends_light() {
        let mut scene = generate::demo("cornell").unwrap();
        assert!(!is_dark(&scene));
        scene.lights.clear();
        let glowing: Vec<_> = scene.materials.iter().map(|material| material.emissive).collect();
        scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
        assert!(is_dark(&scene));
        scene.sky = Vec3::splat(1e-3);
        assert!(!is_dark(&scene));
        // An image goes before the sky.
        scene.environment = Some(Environment { width: 1, height: 1, pixels: vec![Vec3::ZERO], rotation: 0.0 });
        assert!(is_dark(&scene));
        scene.environment = None;
        scene.sky = Vec3::ZERO;
        // A lamp lights, a gleam does not; and half of a glowing texture is half as bright.
        scene.materials.iter_mut().zip(glowing).for_each(|(material, emissive)| material.emissive = emissive);
        scene.materials[0].emissive = Vec3::splat(10.0);
        let whole = mean_luminance(&scene);
        assert!(!is_dark(&scene) && whole > 0.1, "{whole}");
        let rgba = [[255u8; 4], [0, 0, 0, 255]].concat();
        scene.images.push(Image { name: String::new(), width: 2, height: 1, rgba });
        scene.textures.push(Texture { image: scene.images.len() - 1, sampler: 0 });
        let others = {
            scene.materials[0].emissive = Vec3::ZERO;
            mean_luminance(&scene)
        };
        scene.materials[0].emissive = Vec3::splat(10.0);
        scene.materials[0].emissive_texture = Some(TextureRef::new(scene.textures.len() - 1));
        assert!((mean_luminance(&scene) - others - 0.5 * (whole - others)).abs() < 1e-3 * whole);
        scene.materials.iter_mut().for_each(|material| material.emissive *= 0.1);
        assert!(is_dark(&scene));
        // Areas that squares of 32 bits do not hold: a dark one of them beside a lamp, and nothing else.
        let corners = [Vec3::ZERO, 1e11 * Vec3::X, 1e11 * Vec3::Y].to_vec();
        let vast = Primitive { positions: corners, indices: vec![0, 1, 2], material: 1, ..Primitive::default() };
        scene.materials[1].emissive = Vec3::ZERO;
        scene.meshes[scene.instances[0].mesh].primitives.push(vast);
        assert!(is_dark(&scene));
        scene.materials[1].emissive = Vec3::MAX;
        assert!(!is_dark(&scene));
    }

    #[test]
    fn what_a_scene_has_stays() {
        let camera = &cameras()[0];
        let mut scene = generate::demo("furnace").unwrap();
        LightRig::Sun.add(&mut scene, camera);
        assert_eq!((scene.sky, scene.lights.len()), (Vec3::ONE, 2));
        LightRig::Studio.add(&mut scene, camera);
        assert!(scene.environment.is_none());
        let mut empty = Scene::default();
        LightRig::None.add(&mut empty, camera);
        assert!(is_dark(&empty));
        LightRig::Studio.add(&mut empty, camera);
        assert!(!is_dark(&empty) && empty.lights.is_empty());
    }
}
