//! Direct light against an independent path tracer (Mitsuba 3). The references are linear and box-filtered over many samples per pixel, so
//! our images are rendered at a higher resolution and box-averaged.

use glam::Vec3;
use lanternfish::{
    Settings,
    settings::{Attenuation, Materials, ToneMap},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_metrics::{RelativeError, RgbImage, read_exr};
use lanternfish_scene::{Camera, Light, Projection, Scene};

use crate::support::{left_out_on_old_software, linear, render};

/// A reference: its image, scene, camera and lights.
struct Reference {
    image: RgbImage,
    scene: Scene,
    camera: Camera,
}

fn vec3(value: &serde_json::Value) -> Vec3 {
    let at = |i: usize| value[i].as_f64().expect("a number") as f32;
    Vec3::new(at(0), at(1), at(2))
}

impl Reference {
    /// Loads a reference by name from a shared folder.
    fn load(test: &str, folder: &str, name: &str) -> Option<Self> {
        let list = testing::shared(test, &format!("{folder}/references.json"))?;
        let list: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(list).expect("readable")).expect("JSON");
        let entry = list["references"].as_array()?.iter().find(|r| r["name"] == name).expect("it is listed");
        let scene = testing::shared(test, &format!("assets/{}", entry["scene"].as_str()?))?;
        let mut scene = lanternfish_scene::load(scene.to_str()?).expect("the scene loads");
        for light in entry["point_lights"].as_array()? {
            scene.lights.push(Light::point(vec3(&light["position"]), vec3(&light["intensity_cd"])));
        }
        let camera = &entry["camera"];
        let fov_y = (camera["fov_y_deg"].as_f64()? as f32).to_radians();
        let projection = Projection::Perspective { fov_y, near: 0.01 };
        let camera = Camera::look_at(vec3(&camera["eye"]), vec3(&camera["target"]), projection);
        let image = read_exr(&testing::shared(test, &format!("{folder}/{name}.exr"))?).expect("the image loads");
        Some(Self { image, scene, camera })
    }

    /// Our image, rendered at `scale` times the resolution of the reference and box-averaged.
    fn rendered(&self, gpu: &Gpu, scale: u32) -> RgbImage {
        let settings = Settings::direct_light()
            .with_materials(Materials::Lambert)
            .with_attenuation(Attenuation::Physical)
            .with_tone_map(ToneMap::None);
        let size = (scale * self.image.width as u32, scale * self.image.height as u32);
        let ours = linear(&render(gpu, &self.scene, &self.camera, size, settings));
        let ours = ours.box_downsampled(scale as usize).expect("a whole factor");
        if let Ok(folder) = std::env::var("LANTERNFISH_TEST_IMAGES") {
            let path = std::path::Path::new(&folder).join(format!("{}.exr", self.scene.name));
            lanternfish_metrics::write_exr(&path, &ours).expect("the folder can be written");
        }
        ours
    }

    fn compare(&self, ours: &RgbImage) -> RelativeError {
        RelativeError::measure(ours, &self.image, LIT).expect("equal sizes")
    }
}

/// Luminance above which a pixel counts as lit: above the noise of the references.
const LIT: f32 = 1e-3;

fn report(name: &str, error: &RelativeError, within: f32) {
    println!(
        "{name}: {} lit pixels, median {:.3} %, {:.2} % within {} %, energy {:+.3} %",
        error.lit_count(),
        100.0 * error.median(),
        100.0 * error.fraction_within(within),
        100.0 * within,
        100.0 * (error.energy_ratio() - 1.0)
    );
}

#[gpu_test]
fn gpu_cornell_direct_light_is_the_reference(gpu: &Gpu) {
    let name = "gpu_cornell_direct_light_is_the_reference";
    let Some(reference) = Reference::load(name, "references", "cornell-point-direct") else { return };
    let mut ours = reference.rendered(gpu, 8);
    let error = reference.compare(&ours);
    report("cornell-point-direct", &error, 0.02);
    assert!(error.median() < 0.005, "median {}", error.median());
    assert!(error.fraction_within(0.02) > 0.98, "within 2 %: {}", error.fraction_within(0.02));
    assert!((error.energy_ratio() - 1.0).abs() < 0.005, "energy {}", error.energy_ratio());

    // Check that the test can fail: it detects an image that is 1 % too bright.
    ours.pixels.iter_mut().flatten().for_each(|value| *value *= 1.01);
    let brighter = reference.compare(&ours);
    assert!(brighter.median() > 0.005 && brighter.energy_ratio() > 1.005, "does not detect 1 % of light");
}

#[gpu_test(full)]
fn gpu_sponza_direct_light_is_the_reference(gpu: &Gpu) {
    let name = "gpu_sponza_direct_light_is_the_reference";
    if left_out_on_old_software(name, gpu, "without anisotropic filtering textures are blurred, median error 5.3 %") {
        return;
    }
    let Some(reference) = Reference::load(name, "references/upright", "sponza-ten-direct") else { return };
    // Remaining difference: the reference samples textures at their finest level, and the sample positions at edges differ.
    let error = reference.compare(&reference.rendered(gpu, 4));
    report("sponza-ten-direct", &error, 0.1);
    assert!(error.median() < 0.015, "median {}", error.median());
    assert!(error.fraction_within(0.1) > 0.9, "within 10 %: {}", error.fraction_within(0.1));
    assert!((error.energy_ratio() - 1.0).abs() < 0.005, "energy {}", error.energy_ratio());
}
