//! Agreement with an independent renderer: Mitsuba 3 images from the shared references.
//!
//! The references were rendered with uniform light selection, as the tests here are, so the variance of our samples gives the variance of
//! both images, scaled by the numbers of samples. If a reference is the sum of one image per light, it counts as having the samples of all
//! of them; its noise is lower than that, because light selection adds noise. The tests compare blocks of 10 × 10 pixels, over which the
//! noise is close to a normal distribution: z = difference / standard deviation of both.

use std::path::{Path, PathBuf};

use glam::Vec3;
use lanternfish_metrics::{RgbImage, read_exr};
use lanternfish_reference::{
    Film, Settings, Tracer,
    settings::{LightChoice, UNLIMITED},
};
use lanternfish_scene::{
    Camera, Light, Projection, Scene,
    shading::{Attenuation, Materials},
};

/// Width and height of a block, pixels.
const BLOCK: usize = 10;

/// The folder of shared assets and references. Without it, records that the test is left out and returns `None`.
fn shared(test: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("LANTERNFISH_SHARED")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")), PathBuf::from);
    if folder.join("references/references.json").is_file() {
        return Some(folder);
    }
    let line = format!("LEFT OUT (shared): {test}: there are no references in {}\n", folder.display());
    eprint!("{line}");
    if let Some(list) = std::env::var_os("LANTERNFISH_LEFT_OUT") {
        use std::io::Write;
        let mut file =
            std::fs::OpenOptions::new().append(true).create(true).open(list).expect("the list can be written");
        file.write_all(line.as_bytes()).expect("the list can be written");
    }
    None
}

fn vec3(value: &serde_json::Value) -> Vec3 {
    let at = |i: usize| value[i].as_f64().expect("a number") as f32;
    Vec3::new(at(0), at(1), at(2))
}

struct Reference {
    image: RgbImage,
    samples: f64,
    scene: Scene,
    camera: Camera,
    settings: Settings,
}

impl Reference {
    /// The references whose names start with `of`, from a folder of the shared files.
    fn all(shared: &Path, folder: &str, of: &str) -> Vec<(String, Self)> {
        let list = std::fs::read_to_string(shared.join(folder).join("references.json")).expect("readable");
        let list: serde_json::Value = serde_json::from_str(&list).expect("JSON");
        let entries = list["references"].as_array().expect("a list");
        let named = entries.iter().filter_map(|entry| Some((entry["name"].as_str()?, entry)));
        named
            .filter(|(name, _)| name.starts_with(of))
            .map(|(name, entry)| {
                (name.to_owned(), Self::new(shared, &shared.join(folder).join(format!("{name}.exr")), entry))
            })
            .collect()
    }

    fn new(shared: &Path, image: &Path, entry: &serde_json::Value) -> Self {
        let path = shared.join("assets").join(entry["scene"].as_str().expect("a path"));
        let mut scene = lanternfish_scene::load(path.to_str().expect("UTF-8")).expect("the scene loads");
        for light in entry["point_lights"].as_array().into_iter().flatten() {
            scene.lights.push(Light::point(vec3(&light["position"]), vec3(&light["intensity_cd"])));
        }
        if let Some(sky) = entry.get("sky") {
            scene.sky = vec3(&sky["radiance"]);
        }
        if let Some(sun) = entry.get("sun") {
            let illuminance = sun["illuminance_lx"].as_f64().expect("a number") as f32;
            scene.lights.push(Light::directional(vec3(&sun["direction"]), Vec3::splat(illuminance)));
        }
        emit_from_the_front(&mut scene);
        let each_light = entry["each_light"].as_bool().unwrap_or(false);
        let renderings = if each_light { scene.lights.len() } else { 1 };
        let camera = &entry["camera"];
        let fov_y = (camera["fov_y_deg"].as_f64().expect("a number") as f32).to_radians();
        let projection = Projection::Perspective { fov_y, near: 0.01 };
        let depth = entry["max_depth"].as_i64().expect("a number");
        Self {
            image: read_exr(image).expect("the image loads"),
            samples: entry["spp"].as_f64().expect("a number") * renderings as f64,
            scene,
            camera: Camera::look_at(vec3(&camera["eye"]), vec3(&camera["target"]), projection),
            settings: Settings {
                max_depth: u32::try_from(depth).unwrap_or(UNLIMITED),
                materials: Materials::Lambert,
                attenuation: Attenuation::Physical,
                light_choice: LightChoice::Uniform,
                ..Settings::default()
            },
        }
    }

    fn render(&self, samples: u64) -> Film {
        let tracer = Tracer::new(&self.scene, self.settings.clone()).expect("the scene is valid");
        let mut film = Film::new([self.image.width, self.image.height].map(|side| side as u32)).expect("a size");
        tracer.render(&self.camera, &mut film, samples);
        assert_eq!(film.dropped(), 0, "samples that are not finite");
        if let Ok(folder) = std::env::var("LANTERNFISH_TEST_IMAGES") {
            let ours = RgbImage::new(self.image.width, self.image.height, film.mean()).expect("one value per pixel");
            let path = Path::new(&folder).join(format!("{}-{}.exr", self.scene.name, self.settings.max_depth));
            lanternfish_metrics::write_exr(&path, &ours).expect("the folder can be written");
        }
        film
    }

    fn compare(&self, film: &Film) -> Agreement {
        Agreement::measure(film, &self.image, self.samples)
    }
}

/// Makes emitters single-sided, because the references' emitters emit from their front only.
fn emit_from_the_front(scene: &mut Scene) {
    let emitters = scene.materials.iter_mut().filter(|material| material.emissive != Vec3::ZERO);
    emitters.for_each(|material| material.double_sided = false);
}

#[derive(Debug)]
struct Agreement {
    /// Ratio of the image's energy to the reference's.
    energy_ratio: f64,
    /// Standard deviation of the energy ratio from noise.
    energy_deviation: f64,
    /// Median of z² over blocks and channels: 0.455 for normal noise.
    median_z2: f64,
    /// Fraction of blocks and channels with |z| > 3: 0.0027 for normal noise.
    beyond_three: f64,
}

impl Agreement {
    fn measure(film: &Film, reference: &RgbImage, reference_samples: f64) -> Self {
        let (ours, variance) = (film.mean(), film.variance());
        let both = 1.0 + film.samples() as f64 / reference_samples;
        // The references are half floats: uniform rounding errors of up to 2⁻¹¹ of the value.
        let rounding = |value: f32| (f64::from(value) * 2f64.powi(-11)).powi(2) / 3.0;
        let mut squares = Vec::new();
        let (mut energy, mut reference_energy, mut energy_variance) = (0.0, 0.0, 0.0);
        let (columns, rows) = (reference.width / BLOCK, reference.height / BLOCK);
        for block in 0..columns * rows {
            for channel in 0..3 {
                let (mut a, mut b, mut v) = (0.0, 0.0, 0.0);
                for i in 0..BLOCK * BLOCK {
                    let (x, y) = (block % columns * BLOCK + i % BLOCK, block / columns * BLOCK + i / BLOCK);
                    let pixel = y * reference.width + x;
                    a += f64::from(ours[pixel][channel]);
                    b += f64::from(reference.pixels[pixel][channel]);
                    v += f64::from(variance[pixel][channel]) * both + rounding(reference.pixels[pixel][channel]);
                }
                energy += a;
                reference_energy += b;
                energy_variance += v;
                if v > 0.0 {
                    squares.push((a - b) * (a - b) / v);
                }
            }
        }
        squares.sort_unstable_by(f64::total_cmp);
        let beyond = squares.len() - squares.partition_point(|z2| *z2 <= 9.0);
        Self {
            energy_ratio: energy / reference_energy,
            energy_deviation: energy_variance.sqrt() / reference_energy,
            median_z2: squares[squares.len() / 2],
            beyond_three: beyond as f64 / squares.len() as f64,
        }
    }

    /// `None` if noise explains the difference: the median of z² within a relative `median`, the tail below `tail`, and the energy within
    /// 0.5 % plus three standard deviations of the noise. Otherwise a description.
    fn fault(&self, median: f64, tail: f64) -> Option<String> {
        let energy = (self.energy_ratio - 1.0).abs();
        let sound = (self.median_z2 / 0.455 - 1.0).abs() < median
            && self.beyond_three < tail
            && energy < 0.005 + 3.0 * self.energy_deviation;
        (!sound).then(|| format!("{self:?}"))
    }
}

#[test]
fn cornell_matches_the_references() {
    let Some(shared) = shared("cornell_matches_the_references") else { return };
    let references = Reference::all(&shared, "references", "cornell");
    assert_eq!(references.len(), 4);
    for (name, reference) in references {
        let film = reference.render(32);
        let agreement = reference.compare(&film);
        println!("{name}: {agreement:?}");
        // The median of z² over 625 blocks has a standard deviation of 9 %, because the channels share their noise. Noise around small lights
        // is not normal: its tails are up to four times those of a normal distribution.
        assert_eq!(agreement.fault(0.25, 0.011), None, "{name}");
        // The check can fail: a difference of 1.5 % is detected in all images.
        let mut dimmer = reference;
        dimmer.image.pixels.iter_mut().flatten().for_each(|value| *value /= 1.015);
        let agreement = dimmer.compare(&film);
        assert!(agreement.fault(0.25, 0.011).is_some(), "{name}: a difference of 1.5 % is undetected: {agreement:?}");
    }
}

#[test]
#[ignore = "full"]
fn sponza_matches_the_references() {
    let Some(shared) = shared("sponza_matches_the_references") else { return };
    let references = Reference::all(&shared, "references/upright", "sponza");
    assert_eq!(references.len(), 6);
    for (name, reference) in references {
        let agreement = reference.compare(&reference.render(4));
        println!("{name}: {agreement:?}");
        // The tolerances are wide for three reasons. Few samples of a skewed distribution underestimate its variance (the median falls with
        // more samples). The references have up to twice the noise of their number of samples. The renderers filter alpha masks before and
        // after the cutoff, which is visible in almost black blocks.
        assert_eq!(agreement.fault(0.3, 0.08), None, "{name}");
    }
}
