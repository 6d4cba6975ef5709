//! The fixed list of shots for measuring every technique.

use std::path::{Path, PathBuf};

use glam::Vec3;
use lanternfish::settings::{Attenuation, Exposure, Settings};
use lanternfish_cli::{
    args::PartArgs,
    error::CliError,
    parse::Size,
    scene::{self, SceneName},
};
use lanternfish_scene::{
    Camera, Environment, Light, Projection, Scene,
    generate::{light_rain, sky},
    near_plane,
};

/// One view of one scene.
#[derive(Clone, Copy)]
pub struct Shot {
    pub name: &'static str,
    /// `demo:NAME`, or a file below the shared assets.
    scene: &'static str,
    view: View,
    /// Size of the ground truth, pixels.
    pub size: Size,
    /// Ratio of the rendered image's width and height to those of the ground truth, before box filtering.
    pub factor: u32,
    /// Point lights in addition to those of the scene: position, m, and intensity, cd.
    points: &'static [([f32; 3], [f32; 3])],
    /// Number of additional lights of light rain (seed 0).
    rain: u32,
    attenuation: Attenuation,
    range_threshold: f32,
    /// Exposure of the images that LDR-FLIP compares, stops.
    pub exposure: f32,
}

#[derive(Clone, Copy)]
enum View {
    /// One of the scene's cameras, by number.
    Camera(usize),
    /// Position of the eye and of its target, world space, m, and the vertical angle of view, degrees.
    At([f32; 3], [f32; 3], f32),
}

const fn size(width: u32, height: u32) -> Size {
    Size { width, height }
}

/// The point lights of `docs/shots/sponza-ten.toml`; a test compares the two.
const SPONZA_TEN: &[([f32; 3], [f32; 3])] = &[
    ([6.5, 2.0, -2.2], [60.0, 50.0, 40.0]),
    ([5.0, 1.2, 1.8], [15.0, 30.0, 60.0]),
    ([2.5, 5.2, -3.8], [60.0, 20.0, 20.0]),
    ([-1.0, 1.5, -1.5], [20.0, 60.0, 20.0]),
    ([-4.0, 6.5, 3.5], [50.0, 50.0, 60.0]),
    ([-6.5, 2.0, 1.0], [60.0, 45.0, 15.0]),
    ([-9.5, 1.5, -2.0], [15.0, 15.0, 60.0]),
    ([0.5, 8.0, 0.0], [80.0, 80.0, 80.0]),
    ([4.0, 1.0, -5.5], [40.0, 25.0, 10.0]),
    ([-5.0, 1.0, 6.0], [25.0, 10.0, 40.0]),
];

/// The smallest shot, and base of the others.
const CORNELL: Shot = Shot {
    name: "cornell",
    scene: "demo:cornell",
    view: View::Camera(0),
    size: size(128, 128),
    factor: 4,
    points: &[],
    rain: 0,
    attenuation: Attenuation::Gltf,
    range_threshold: 0.02,
    exposure: 1.0,
};

/// The view, the light and the attenuation of the reference cornell-point-direct.
const CORNELL_BLOCKS: Shot = Shot {
    name: "cornell-blocks",
    scene: "cornell/CornellBox-Blocks.glb",
    view: View::At([0.0, 1.0, 3.6], [0.0, 1.0, 0.0], 36.0),
    points: &[([0.0, 1.7, 0.1], [2.5, 2.3, 2.0])],
    attenuation: Attenuation::Physical,
    ..CORNELL
};

/// A built-in interior.
const INTERIOR: Shot = Shot { size: size(160, 90), factor: 3, exposure: 0.0, ..CORNELL };

/// All shots, the smallest first. Another scene, camera or size needs a new entry, because results of one shot are compared over time.
pub const SHOTS: &[Shot] = &[
    CORNELL,
    CORNELL_BLOCKS,
    // A mirror instead of a block.
    Shot { name: "cornell-mirror", scene: "cornell/CornellBox-Mirror.glb", ..CORNELL_BLOCKS },
    // A mirror sphere and a glass sphere, in a lower box.
    Shot {
        name: "cornell-sphere",
        scene: "cornell/CornellBox-Sphere.glb",
        view: View::At([0.0, 0.8, 3.6], [0.0, 0.8, 0.0], 34.0),
        points: &[([0.0, 1.4, 0.1], [2.5, 2.3, 2.0])],
        ..CORNELL_BLOCKS
    },
    // Its own lanterns and sun, and coloured lights of short range.
    Shot { name: "atrium", scene: "demo:atrium", rain: 100, ..INTERIOR },
    // Nave and aisles inside an unlit outer shell, rotated about all axes. Shows light leaks through surfaces.
    Shot { name: "hall", scene: "demo:hall", ..INTERIOR },
    // Textures, normal maps, alpha masks.
    Shot {
        name: "sponza-ten",
        scene: "sponza/Sponza.glb",
        view: View::At([6.6, 2.6, -0.6], [-4.0, 3.2, 0.4], 65.0),
        size: size(192, 108),
        points: SPONZA_TEN,
        range_threshold: 0.5,
        exposure: 0.0,
        ..CORNELL
    },
    // A street at night: 94 point lights and a moon, instances, transparent surfaces. The file's intensities are not photometric.
    // The beams are transparent: they shadow the ground in the ground truth, but not in the renderer, whose image is brighter.
    Shot {
        name: "candela-city",
        scene: "candela-city/candela_city.glb",
        view: View::At([70.0, 4.0, -3.0], [-30.0, -8.0, 0.0], 45.0),
        size: size(192, 108),
        exposure: 2.0,
        ..CORNELL
    },
];

/// The folder of shared scenes: `assets` in the stated folder, or in that of LANTERNFISH_SHARED, or in ../shared.
pub fn assets(shared: Option<PathBuf>) -> PathBuf {
    let variable = || std::env::var_os("LANTERNFISH_SHARED").map(PathBuf::from);
    shared.or_else(variable).unwrap_or_else(|| "../shared".into()).join("assets")
}

impl Shot {
    /// The shot with so many lights of light rain.
    pub fn with_rain(self, rain: u32) -> Self {
        Self { rain, ..self }
    }

    /// Reason for leaving the shot out: a missing scene file.
    pub fn missing(&self, assets: &Path) -> Option<String> {
        (!self.is_built_in() && !assets.join(self.scene).is_file()).then(|| format!("there is no {}", self.scene))
    }

    fn is_built_in(&self) -> bool {
        self.scene.starts_with("demo:")
    }

    /// The scene with all lights, and the camera.
    pub fn load(&self, assets: &Path) -> Result<(Scene, Camera), CliError> {
        let file = assets.join(self.scene);
        let source: SceneName = if self.is_built_in() { self.scene.into() } else { file.into() };
        let mut scene = scene::load_part(&source, &PartArgs::default())?;
        let bounds = scene.bounds();
        scene.lights.extend(light_rain(&bounds, self.rain, None, 0, 0.0));
        scene.lights.extend(self.points());
        let camera = match self.view {
            View::At(eye, target, fov_y) => {
                let projection = Projection::Perspective { fov_y: fov_y.to_radians(), near: near_plane(&bounds) };
                Camera::look_at(eye.into(), target.into(), projection)
            }
            View::Camera(number) => scene.cameras.get(number).cloned().ok_or_else(|| {
                CliError::new(format_args!("{source}: no camera {number}"), "check that the shared assets are complete")
            })?,
        };
        Ok((scene, camera))
    }

    fn points(&self) -> impl Iterator<Item = Light> {
        self.points.iter().map(|(p, intensity)| Light::point(Vec3::from(*p), Vec3::from(*intensity)))
    }

    /// Settings of direct light, with this shot's attenuation and exposure.
    pub fn settings(&self) -> Settings {
        Settings::direct_light()
            .with_attenuation(self.attenuation)
            .with_range_threshold(self.range_threshold)
            .with_exposure(Exposure::Ev(self.exposure))
    }
}

/// The environment of ground truths with environment light: an overcast field from the shared assets, or [`sky`] if the file is missing.
pub fn environment_light(assets: &Path) -> Result<Environment, CliError> {
    let file = assets.join("env/kloppenheim_05_1k.hdr");
    Ok(if file.is_file() { Environment::load(&file)? } else { sky() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanternfish_cli::shot;

    #[test]
    fn names_are_unique_file_names() {
        for (i, shot) in SHOTS.iter().enumerate() {
            assert!(
                shot.name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-'),
                "{}",
                shot.name
            );
            assert!(SHOTS[..i].iter().all(|other| other.name != shot.name), "{}", shot.name);
        }
    }

    #[test]
    fn the_environment_needs_no_assets() {
        let mut scene = lanternfish_scene::generate::demo("cornell").unwrap();
        scene.environment = Some(environment_light(Path::new("no such folder")).unwrap());
        scene.validate().unwrap();
        let brightest = sky().pixels.into_iter().fold(Vec3::ZERO, Vec3::max);
        assert!(brightest.min_element() > 10.0, "no patch: {brightest}");
    }

    #[test]
    fn sponza_is_the_shot_of_the_docs() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/shots/sponza-ten.toml");
        let docs = shot::read(&path, Vec::new()).unwrap();
        let ours = SHOTS.iter().find(|shot| shot.name == "sponza-ten").unwrap();
        assert_eq!(ours.points().collect::<Vec<_>>(), docs.args.lights.points);
        assert_eq!(ours.settings().lights.range_threshold, docs.args.settings().lights.range_threshold);
        assert_eq!(ours.settings().lights.attenuation, docs.args.settings().lights.attenuation);
        let View::At(eye, target, fov_y) = ours.view else { panic!() };
        let view = &docs.args.view;
        assert_eq!((view.eye, view.target), (Some(eye.into()), Some(target.into())));
        assert_eq!(view.fov_y, Some(fov_y.to_radians()));
    }
}
