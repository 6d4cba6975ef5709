//! A fingerprint of the settings. Samples of two runs may be combined if their fingerprints are equal.

use std::fmt::{self, Debug, Write as _};

use bytemuck::{NoUninit, cast_slice};
use lanternfish_reference::Settings;
use lanternfish_scene::{Camera, Environment, Image, Instance, Mesh, Primitive, Scene};

use crate::parse::Size;

/// Hash, 16 hexadecimal digits, of everything that affects the mean of a pixel: geometry, surfaces, images, lights,
/// environment, camera, size and settings, by value, and the version of this program. Excludes names and the seed.
pub fn of(scene: &Scene, camera: &Camera, size: Size, settings: &Settings) -> String {
    let mut hash = Fnv::new();
    hash.text(&env!("CARGO_PKG_VERSION"));
    // Destructure completely, so that a new field does not compile until it is handled here.
    let Scene {
        name: _,
        meshes,
        instances,
        materials,
        // They name other materials than these.
        variants: _,
        textures,
        images,
        samplers,
        lights,
        cameras: _,
        sky,
        environment,
        semantics: _,
        // The scene is already posed.
        motion: _,
    } = scene;
    for Mesh { name: _, primitives } in meshes {
        hash.text(&primitives.len());
        for Primitive { material, positions, normals, tangents, uv0, uv1, colors, indices, deformation: _ } in
            primitives
        {
            hash.text(material);
            hash.list(positions);
            hash.list(normals);
            hash.list(tangents);
            hash.list(uv0);
            hash.list(uv1);
            hash.list(colors);
            hash.list(indices);
        }
    }
    for Instance { name: _, mesh, world_from_object } in instances {
        hash.text(&(mesh, world_from_object));
    }
    for material in materials {
        hash.text(&lanternfish_scene::Material { name: String::new(), ..material.clone() });
    }
    hash.text(&(textures, samplers));
    for Image { name: _, width, height, rgba } in images {
        hash.text(&(width, height));
        hash.list(rgba);
    }
    for light in lights {
        hash.text(&lanternfish_scene::Light { name: String::new(), ..light.clone() });
    }
    hash.text(sky);
    if let Some(Environment { width, height, pixels, rotation }) = environment {
        hash.text(&(width, height, rotation));
        hash.list(pixels);
    }
    let Camera { name: _, world_from_camera, projection } = camera;
    hash.text(&(world_from_camera, projection));
    hash.text(&size);
    // Without a diameter of 0, which settings of earlier references do not have.
    let settings = format!("{:?}", Settings { seed: 0, ..settings.clone() }).replace(" sun_diameter: 0.0,", "");
    hash.text(&format_args!("{settings}"));
    format!("{:016x}", hash.0)
}

/// The state of a 64-bit FNV-1a hash.
struct Fnv(u64);

impl Fnv {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// Adds a value's `Debug` text, in which floats are exact, and a terminator that no value contains.
    fn text(&mut self, value: &dyn Debug) {
        write!(self, "{value:?}\n\n").expect("a number takes everything");
    }

    /// Adds a list's length and its elements, in the byte order of this machine.
    fn list<T: NoUninit>(&mut self, list: &[T]) {
        self.bytes(&(list.len() as u64).to_le_bytes());
        self.bytes(cast_slice(list));
    }
}

impl fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lanternfish_reference::settings::{Integrator, LightPaths};
    use lanternfish_scene::generate;

    use super::*;

    fn of_cornell(change: impl FnOnce(&mut Scene, &mut Size, &mut Settings)) -> String {
        let mut scene = lanternfish_scene::load(format!("demo:{}", generate::DEMOS[1])).unwrap();
        let camera = Camera::framing(&scene.bounds(), 0.7, 1.0);
        let (mut size, mut settings) = (Size { width: 4, height: 3 }, Settings::default());
        change(&mut scene, &mut size, &mut settings);
        of(&scene, &camera, size, &settings)
    }

    #[test]
    fn only_inputs_of_the_image_change_the_fingerprint() {
        let same = of_cornell(|_, _, _| {});
        assert_eq!(same.len(), 16);
        assert_eq!(of_cornell(|scene, _, _| scene.materials[0].name = "other".to_owned()), same);
        assert_eq!(of_cornell(|_, _, settings| settings.seed = 5), same);
        let others = [
            of_cornell(|scene, _, _| scene.materials[0].base_color.x += 1e-7),
            of_cornell(|_, _, settings| settings.light_paths = LightPaths::Off),
            of_cornell(|scene, _, _| scene.meshes[0].primitives[0].positions[0].y += 1e-6),
            of_cornell(|scene, _, _| scene.instances[0].world_from_object.translation.x += 1e-6),
            of_cornell(|scene, _, _| scene.lights.push(lanternfish_scene::Light::point(Vec3::ONE, Vec3::ONE))),
            of_cornell(|scene, _, _| scene.sky = Vec3::X),
            of_cornell(|_, size, _| size.width = 5),
            of_cornell(|_, _, settings| settings.max_depth = 2),
            of_cornell(|_, _, settings| settings.light_radius = 0.1),
            of_cornell(|_, _, settings| settings.sun_diameter = 0.1),
            of_cornell(|_, _, settings| settings.integrator = Integrator::Occlusion),
        ];
        for (i, other) in others.iter().enumerate() {
            assert!(*other != same && !others[..i].contains(other), "change {i}");
        }
    }
}
