//! A ground under an object that stands in front of nothing: it shows the object's shadow, and where there is none it looks like the
//! environment behind it.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Vec2, Vec3};

use crate::{AlphaMode, Bounds, Camera, Environment, Instance, LightKind, Material, Mesh, Primitive, Scene};

/// Circles of vertices, and vertices on each.
const RINGS: u32 = 24;
const SECTORS: u32 = 64;
/// Number of circles over which a shadow catcher fades towards its edge.
const FADING: f32 = 8.0;
/// Thickness of a scene, as a fraction of its size, below which it is a card or a floor, which stands on nothing.
const LEAST_THICKNESS: f32 = 0.05;
/// Albedo if nothing tells what the ground should look like, and the largest.
const GREY: Vec3 = Vec3::splat(0.2);
const MOST: Vec3 = Vec3::splat(0.9);

/// True if the scene is an object that this camera sees from outside and from above its foot.
pub fn suits(scene: &Scene, camera: &Camera) -> bool {
    let bounds = scene.bounds();
    if bounds.is_empty() {
        return false;
    }
    let (size, eye) = (bounds.size(), camera.eye());
    let is_thin = size.min_element() < LEAST_THICKNESS * size.max_element();
    !bounds.contains(eye) && !is_thin && eye.y > bounds.min.y + 0.1 * size.max_element()
}

/// Adds a disk just below the scene, for `camera`; returns the index of its instance. Every point has the albedo at which light of the
/// environment, the sky and directional lights that nothing blocks makes it as bright as the environment behind it. `found`: the fraction
/// of this light that a renderer finds. If it `catches_shadows`, it is grey and a shadow catcher, whose edge fades.
pub fn add(scene: &mut Scene, camera: &Camera, found: f32, catches_shadows: bool) -> usize {
    let (center, radius) = place(&tight_bounds(scene));
    let irradiance = found * irradiance(scene);
    let behind = |p: Vec3| {
        let direction = (p - camera.eye()).normalize_or(Vec3::NEG_Y);
        scene.environment.as_ref().map_or(scene.sky, |environment| environment.radiance(direction))
    };
    let unshadowed = GREY.x / PI * irradiance.element_sum() / 3.0;
    let catches_shadows = catches_shadows && unshadowed > 0.0 && unshadowed.is_finite();
    let mut primitive = Primitive { material: scene.materials.len(), ..Primitive::default() };
    for ring in 0..=RINGS {
        for sector in 0..SECTORS {
            let direction = Vec2::from_angle(sector as f32 / SECTORS as f32 * TAU);
            let p = radius * ring as f32 / RINGS as f32 * Vec3::new(direction.x, 0.0, -direction.y);
            let albedo = (PI * behind(center + p) / irradiance).min(MOST);
            let is_grey = catches_shadows || !albedo.is_finite() || albedo == Vec3::ZERO;
            let albedo = if is_grey { GREY } else { albedo };
            let alpha = if catches_shadows { ((RINGS - ring) as f32 / FADING).min(1.0) } else { 1.0 };
            primitive.positions.push(p);
            primitive.normals.push(Vec3::Y);
            primitive.colors.push(albedo.extend(alpha));
            if ring < RINGS {
                let next = (sector + 1) % SECTORS;
                let [a, b, c, d] = [(ring, sector), (ring, next), (ring + 1, sector), (ring + 1, next)]
                    .map(|(ring, sector)| ring * SECTORS + sector);
                primitive.indices.extend([a, c, d, a, d, b]);
            }
        }
    }
    let name = || "ground".to_owned();
    scene.materials.push(Material {
        name: name(),
        metallic: 0.0,
        perceptual_roughness: 1.0,
        specular: 0.0,
        alpha_mode: if catches_shadows { AlphaMode::ShadowCatcher { unshadowed } } else { AlphaMode::Opaque },
        ..Material::default()
    });
    scene.meshes.push(Mesh { name: name(), primitives: vec![primitive] });
    let world_from_object = Affine3A::from_translation(center);
    scene.instances.push(Instance { name: name(), mesh: scene.meshes.len() - 1, world_from_object });
    scene.instances.len() - 1
}

/// Box of all vertices: boxes of turned boxes would end below an object's foot.
fn tight_bounds(scene: &Scene) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for instance in &scene.instances {
        let positions = scene.meshes[instance.mesh].primitives.iter().flat_map(|primitive| &primitive.positions);
        positions.for_each(|p| bounds.add_point(instance.world_from_object.transform_point3(*p)));
    }
    bounds
}

/// Centre and radius of the ground, m: under the object, and as far as its shadow is worth seeing.
fn place(bounds: &Bounds) -> (Vec3, f32) {
    let size = bounds.size();
    let height = bounds.min.y - 1e-3 * size.max_element();
    let middle = bounds.center();
    (Vec3::new(middle.x, height, middle.z), 0.75 * Vec2::new(size.x, size.z).length() + size.y)
}

/// Irradiance of a surface that faces up by all light from afar, lx.
fn irradiance(scene: &Scene) -> Vec3 {
    let suns = scene.lights.iter().filter(|light| light.kind == LightKind::Directional);
    let suns: Vec3 = suns.map(|light| light.intensity * -light.direction.y.min(0.0)).sum();
    suns + scene.environment.as_ref().map_or(PI * scene.sky, of_environment)
}

/// That of an environment image.
fn of_environment(environment: &Environment) -> Vec3 {
    let (width, height) = (environment.width, environment.height);
    // Rows from the top; below the horizon nothing reaches the surface.
    let row = |y: usize| {
        let elevation = PI * (0.5 - (y as f32 + 0.5) / height as f32);
        let weight = elevation.sin().max(0.0) * elevation.cos() * (PI / height as f32) * (TAU / width as f32);
        weight * environment.pixels[y * width..][..width].iter().sum::<Vec3>()
    };
    (0..height).map(row).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Viewpoint, generate, rig};

    fn ball() -> (Scene, Camera) {
        let mut scene = generate::demo("furnace").unwrap();
        (scene.lights, scene.sky) = (Vec::new(), Vec3::ZERO);
        scene.instances.truncate(1);
        let camera = Camera::framing_scene(&scene, Some(Viewpoint::Iso), 0.8, 1.5);
        (scene, camera)
    }

    /// The box of the turned ball's box ends further below.
    #[test]
    fn the_ground_touches_a_turned_object() {
        let (mut scene, camera) = ball();
        let turned = Affine3A::from_rotation_z(0.7) * Affine3A::from_rotation_x(0.5);
        scene.instances[0].world_from_object = turned * scene.instances[0].world_from_object;
        let bottom = tight_bounds(&scene).min.y;
        assert!(scene.bounds().min.y < bottom - 0.1);
        let index = add(&mut scene, &camera, 1.0, false);
        let top = scene.instances[index].world_from_object.translation.y;
        assert!(top < bottom && top > bottom - 0.01, "{top}, {bottom}");
    }

    /// A white ground under a uniform sky is as bright as the sky; under a sun of equal strength it has half the albedo.
    #[test]
    fn the_ground_looks_like_what_is_behind_it() {
        for (sun, albedo) in [(0.0, 0.9), (PI * 0.5, 0.5)] {
            let (mut scene, camera) = ball();
            scene.sky = Vec3::splat(0.5);
            scene.lights.push(crate::Light::directional(Vec3::NEG_Y, Vec3::splat(sun)));
            let bottom = scene.bounds().min.y;
            let index = add(&mut scene, &camera, 1.0, false);
            let instance = &scene.instances[index];
            let primitive = &scene.meshes[instance.mesh].primitives[0];
            let expected = Vec3::splat(albedo);
            assert!(
                primitive.colors.iter().all(|color| color.truncate().abs_diff_eq(expected, 1e-3)),
                "{:?}",
                primitive.colors[9]
            );
            let top = instance.world_from_object.translation.y;
            assert!(top < bottom && top > bottom - 0.01, "{top}, {bottom}");
            scene.validate().unwrap();
        }
    }

    /// A shadow catcher knows the radiance of its grey under the sky, and fades. In the dark there is none.
    #[test]
    fn a_ground_may_catch_shadows_only() {
        let (mut scene, camera) = ball();
        for (sky, expected) in [(0.0, 0.0f32), (0.5, 0.1)] {
            scene.sky = Vec3::splat(sky);
            let index = add(&mut scene, &camera, 1.0, true);
            let found = match scene.materials.last().unwrap().alpha_mode {
                AlphaMode::ShadowCatcher { unshadowed } => unshadowed,
                _ => 0.0,
            };
            assert!((found - expected).abs() < 1e-6, "{found}");
            let colors = &scene.meshes[scene.instances[index].mesh].primitives[0].colors;
            let edge = if sky > 0.0 { 0.0 } else { 1.0 };
            assert_eq!((colors[0].w, colors.last().unwrap().w), (1.0, edge));
            scene.validate().unwrap();
        }
    }

    #[test]
    fn an_environments_irradiance_is_that_of_its_pixels() {
        let pixels =
            |top: f32, bottom: f32| (0..32 * 16).map(|i| Vec3::splat(if i < 256 { top } else { bottom })).collect();
        let of = |top, bottom| {
            of_environment(&Environment { width: 32, height: 16, pixels: pixels(top, bottom), rotation: 0.3 })
        };
        assert!(of(1.0, 0.0).abs_diff_eq(Vec3::splat(PI), 0.03), "{}", of(1.0, 0.0));
        assert_eq!(of(0.0, 5.0), Vec3::ZERO);
    }

    #[test]
    fn objects_seen_from_above_suit_a_ground() {
        let (scene, camera) = ball();
        assert!(suits(&scene, &camera));
        let from = |p: Vec3| Camera::look_at(p, Vec3::ZERO, camera.projection);
        assert!(!suits(&scene, &from(Vec3::new(3.0, -2.0, 0.0))), "from below");
        let mut card = scene.clone();
        card.instances[0].world_from_object.matrix3.z_axis *= 0.01;
        assert!(!suits(&card, &camera), "a card");
        assert!(!suits(&scene, &from(scene.bounds().center())), "from inside");
        assert!(!suits(&Scene::default(), &camera));
        let mut lit = scene;
        rig::LightRig::Studio.add(&mut lit, &camera, 1.0);
        let index = add(&mut lit, &camera, 1.0, false);
        let colors = &lit.meshes[lit.instances[index].mesh].primitives[0].colors;
        assert!(colors.iter().all(|color| color.x > 0.02 && color.x < 0.4), "the studio is grey: {:?}", colors[0]);
    }
}
