//! Light sets whose count only the device knows: lights beyond the count must not be listed.

use lanternfish_gpu::{storage_buffer_of, uniform_buffer_of};
use lanternfish_scene::Bounds;

use super::*;
use crate::{
    lights::{self, LightCount, LightSet},
    view::ViewBuffer,
};

/// The number of lights, and the capacity of the buffer; neither is a multiple of a workgroup or of a tree node.
const COUNT: usize = 45;
const CAPACITY: usize = 1337;

/// The inputs of every technique.
struct Given<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    lights: &'a [lights::Light],
}

impl Bench<'_> {
    /// The first `count` lights; if `counted`, their count is read on the device.
    fn set(&self, given: &Given<'_>, count: usize, counted: bool) -> LightSet {
        let (device, settings) = (&self.gpu.device, Settings::direct_light().light_storage());
        let none = wgpu::BufferUsages::empty();
        let lights = if counted { given.lights } else { &given.lights[..count] };
        let buffer = storage_buffer_of(device, "lights", lights, none).unwrap();
        let mut bounds = Bounds::EMPTY;
        given.lights[..count].iter().for_each(|light| bounds.add_point(light.position));
        let set = LightSet::new(device, buffer, given.lights[..count].to_vec(), bounds, &settings);
        if !counted {
            return set;
        }
        let header = LightCount::new(count as u32, &settings);
        LightSet {
            count: uniform_buffer_of(device, "count", &header),
            counted: Some(storage_buffer_of(device, "counted", &[count as u32], none).unwrap()),
            capacity: lights.len() as u32,
            ..set
        }
    }

    /// Starts and entries of all lists of a technique.
    fn starts_and_entries(&mut self, index: usize, given: &Given<'_>, reach: Reach, set: &LightSet) -> [Vec<u32>; 2] {
        let uploaded = self.renderer.upload(given.scene).unwrap();
        let seen = View::new(given.camera, SIZE, Vec3::ZERO, &given.scene.bounds());
        let draws = uploaded.visible_draws(&seen);
        let view: ViewBuffer = seen.upload(&self.gpu.device);
        let mut frame = Frame::new(&self.gpu.device, &self.gpu.queue, &mut self.profiler);
        let surface = self.prepass.record(&mut frame, &uploaded, &draws, &view, SIZE, None).unwrap();
        let technique = &mut self.techniques[index];
        let lights = technique.passes.record(&mut frame, &[context(&uploaded, &seen, &view, &surface)], reach, set);
        let lights = lights.unwrap().remove(0);
        frame.submit();
        let read = |buffer, count| read_back::<u32>(&self.gpu.device, &self.gpu.queue, buffer, count).unwrap();
        let starts = read(&lights.cells, cell_count(&lights, technique.cells) + 1);
        let entries = read(&lights.indices, *starts.last().unwrap() as usize);
        [starts, entries]
    }

    /// Panics if a list contains lights beyond the device's count.
    pub fn lists_no_light_beyond_the_count(&mut self) {
        let scene = Scene { lights: Vec::new(), ..scattered() };
        let camera =
            Camera::look_at(Vec3::new(0.0, 0.0, 9.0), Vec3::ZERO, Projection::Perspective { fov_y: 0.6, near: 0.1 });
        let mut random = Random::new(21);
        let settings = Settings::direct_light();
        let lights: Vec<_> = (0..CAPACITY)
            .map(|i| {
                let position = random.point() * Vec3::new(3.0, 2.0, 6.0);
                // Lights outside the set reach everything.
                let range = if i < COUNT { random.between(0.3, 2.0) } else { 1e4 };
                let angles = LightKind::Spot { inner_angle: 0.1, outer_angle: random.between(0.2, 1.5) };
                let kind = match i {
                    7 => LightKind::Directional,
                    _ if i % 5 == 2 => LightKind::Disk { radius: 0.3 },
                    _ if i % 3 == 1 => angles,
                    _ => LightKind::Point,
                };
                let light = Light::point(position, Vec3::ONE);
                lights::Light::new(
                    &Light { range: Some(range), kind, direction: random.direction(), ..light },
                    &settings.light_storage(),
                )
            })
            .collect();
        let given = Given { scene: &scene, camera: &camera, lights: &lights };
        let exact = self.set(&given, COUNT, false);
        let counted = self.set(&given, COUNT, true);
        let all = self.set(&given, CAPACITY, true);
        for index in 0..self.techniques.len() {
            let culling = self.techniques[index].settings.clone();
            for reach in [Reach::Surface, Reach::Anywhere] {
                // Cluster lists for surfaces are checked against those of the surfaces only.
                if culling.is::<Clustered>() && reach == Reach::Anywhere {
                    continue;
                }
                let [expected, actual, other] =
                    [&exact, &counted, &all].map(|set| self.starts_and_entries(index, &given, reach, set));
                assert!(!expected[1].is_empty() && expected == actual, "{culling:?}, {reach:?}");
                // Check that the test can fail.
                assert!(
                    other[1].len() > 10 * actual[1].len(),
                    "{culling:?}, {reach:?}: the other lights are in no list"
                );
            }
        }
    }
}
