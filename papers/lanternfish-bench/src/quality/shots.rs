//! The fixed list of shots for measuring every technique.

use std::path::{Path, PathBuf};

use lanternfish::settings::Settings;
use lanternfish_cli::{
    args::{PartArgs, RenderArgs},
    error::CliError,
    parse::Size,
    scene,
};
use lanternfish_scene::{Environment, generate::sky};

use crate::view::View;

/// One view of one scene.
#[derive(Clone, Copy)]
pub struct Shot {
    pub name: &'static str,
    /// `demo:NAME`, or a file below the shared assets; then flags of `lanternfish render`.
    flags: &'static str,
    /// Size of the ground truth, pixels.
    pub size: Size,
    /// Ratio of the rendered image's width and height to those of the ground truth, before box filtering.
    pub factor: u32,
}

const fn shot(name: &'static str, [width, height, factor]: [u32; 3], flags: &'static str) -> Shot {
    Shot { name, flags, size: Size { width, height }, factor }
}

/// All shots, the smallest first. Another scene, camera or size needs a new entry, because results of one shot are
/// compared over time.
pub const SHOTS: &[Shot] = &[
    shot("cornell", [128, 128, 4], "demo:cornell --exposure 1"),
    // The view, the light and the attenuation of the reference cornell-point-direct.
    shot(
        "cornell-blocks",
        [128, 128, 4],
        "cornell/CornellBox-Blocks.glb --eye 0,1,3.6 --target 0,1,0 --fov-y 36 --point 0,1.7,0.1,1,2.5,2.3,2 --attenuation physical \
         --exposure 1",
    ),
    // A mirror instead of a block.
    shot(
        "cornell-mirror",
        [128, 128, 4],
        "cornell/CornellBox-Mirror.glb --eye 0,1,3.6 --target 0,1,0 --fov-y 36 --point 0,1.7,0.1,1,2.5,2.3,2 --attenuation physical \
         --exposure 1",
    ),
    // A mirror sphere and a glass sphere, in a lower box.
    shot(
        "cornell-sphere",
        [128, 128, 4],
        "cornell/CornellBox-Sphere.glb --eye 0,0.8,3.6 --target 0,0.8,0 --fov-y 34 --point 0,1.4,0.1,1,2.5,2.3,2 --attenuation physical \
         --exposure 1",
    ),
    // Its own lanterns and sun, and coloured lights of short range.
    shot("atrium", [160, 90, 3], "demo:atrium --lights rain:100 --exposure 0"),
    // Nave and aisles inside an unlit outer shell, rotated about all axes. Shows light leaks through surfaces.
    shot("hall", [160, 90, 3], "demo:hall --exposure 0"),
    // Textures, normal maps, alpha masks. The view and the lights of `docs/shots/sponza-ten.toml`; a test compares the
    // two.
    shot(
        "sponza-ten",
        [192, 108, 4],
        "sponza/Sponza.glb --eye 6.6,2.6,-0.6 --target=-4,3.2,0.4 --fov-y 65 --range-threshold 0.5 --exposure 0 \
         --point 6.5,2,-2.2,1,60,50,40 --point 5,1.2,1.8,1,15,30,60 --point 2.5,5.2,-3.8,1,60,20,20 --point=-1,1.5,-1.5,1,20,60,20 \
         --point=-4,6.5,3.5,1,50,50,60 --point=-6.5,2,1,1,60,45,15 --point=-9.5,1.5,-2,1,15,15,60 --point 0.5,8,0,1,80,80,80 \
         --point 4,1,-5.5,1,40,25,10 --point=-5,1,6,1,25,10,40",
    ),
    // A street at night: 94 point lights and a moon, instances, transparent surfaces. The file's intensities are not
    // photometric. The beams are transparent: they shadow the ground in the ground truth, but not in the renderer,
    // whose image is brighter.
    shot(
        "candela-city",
        [192, 108, 4],
        "candela-city/candela_city.glb --eye 70,4,-3 --target=-30,-8,0 --fov-y 45 --exposure 2",
    ),
];

/// The folder of shared scenes: `assets` in the stated folder, or in that of LANTERNFISH_SHARED, or in ../shared.
pub fn assets(shared: Option<PathBuf>) -> PathBuf {
    let variable = || std::env::var_os("LANTERNFISH_SHARED").map(PathBuf::from);
    shared.or_else(variable).unwrap_or_else(|| "../shared".into()).join("assets")
}

impl Shot {
    fn scene(&self) -> &'static str {
        self.flags.split(' ').next().unwrap_or_default()
    }

    /// Reason for leaving the shot out: a missing scene file.
    pub fn missing(&self, assets: &Path) -> Option<String> {
        let is_there = self.scene().starts_with("demo:") || assets.join(self.scene()).is_file();
        (!is_there).then(|| format!("there is no {}", self.scene()))
    }

    /// The flags, with light rain in place of the shot's where `rain` is stated.
    fn args(&self, rain: Option<&str>) -> Result<RenderArgs, CliError> {
        let mut words: Vec<&str> = self.flags.split(' ').collect();
        match (rain, words.iter().position(|word| *word == "--lights")) {
            (Some(rain), Some(own)) => words[own + 1] = rain,
            (Some(rain), None) => words.extend(["--lights", rain]),
            (None, _) => {}
        }
        RenderArgs::of(words).map_err(|error| CliError::new(error, "this is a bug in the list of shots"))
    }

    /// The view, with light rain in place of the shot's where `rain` is stated, and settings of direct light.
    pub fn load(&self, assets: &Path, rain: Option<&str>) -> Result<View, CliError> {
        let args = self.args(rain)?;
        let file = assets.join(self.scene());
        let source = if self.scene().starts_with("demo:") { args.scene.clone() } else { file.into() };
        let scene = scene::load_part(&source, &PartArgs::default())?;
        let (mut view, _) = View::of_args(scene, &args, std::slice::from_ref(&args.view), self.size)?;
        (view.name, view.look.shadows.technique) = (self.name.to_owned(), Settings::direct_light().shadows.technique);
        Ok(view)
    }
}

/// The environment of ground truths with environment light: an overcast field from the shared assets, or [`sky`] if the
/// file is missing.
pub fn environment_light(assets: &Path) -> Result<Environment, CliError> {
    let file = assets.join("env/kloppenheim_05_1k.hdr");
    Ok(if file.is_file() { Environment::load(&file)? } else { sky() })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lanternfish_cli::shot;

    use super::*;

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
        let docs = shot::read(&path).unwrap();
        let ours = SHOTS.iter().find(|shot| shot.name == "sponza-ten").unwrap().args(None).unwrap();
        assert_eq!(ours.lights.points, docs.args.lights.points);
        assert_eq!(ours.settings().lights.range_threshold, docs.args.settings().lights.range_threshold);
        assert_eq!(ours.settings().lights.attenuation, docs.args.settings().lights.attenuation);
        let of = |args: &RenderArgs| (args.view.eye, args.view.target, args.view.fov_y);
        assert_eq!(of(&ours), of(&docs.args));
        for rain in [None, Some("rain:1000")] {
            assert!(SHOTS.iter().all(|shot| shot.args(rain).is_ok()));
        }
    }
}
