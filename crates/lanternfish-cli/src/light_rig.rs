//! Adds light to dark scenes, and notes for the user.

use glam::Vec3;
use lanternfish::{
    RenderedImage,
    settings::{Occlusion, Settings},
};
use lanternfish_scene::{
    Camera, Scene,
    rig::{self, LightRig},
};

use crate::{args::LightArgs, error::CliError};

/// How an image depends on light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lighting {
    /// True if the image shows light.
    pub is_seen: bool,
    /// True if environment light reaches surfaces.
    pub reaches_surfaces: bool,
}

impl Lighting {
    /// For images with these settings.
    pub fn of(settings: &Settings) -> Self {
        let reaches_surfaces = settings.indirect.sees_environment() || settings.occlusion != Occlusion::NONE;
        // Debug views need no light.
        Self { is_seen: settings.debug_view.is_none(), reaches_surfaces }
    }
}

/// Adds the rig of `--light-rig`. If nothing else lights the scene, it adds a rig around `camera` by default. `say` receives
/// notes about an added rig, missing light or missing geometry.
pub(crate) fn light(
    scene: &mut Scene,
    flags: &LightArgs,
    camera: &Camera,
    lighting: Lighting,
    say: impl Fn(&str),
) -> Result<(), CliError> {
    add(scene, flags, camera)?;
    if scene.bounds().is_empty() {
        say("the scene has no geometry: only its environment is visible");
        return Ok(());
    }
    if !lighting.is_seen || !rig::is_dark(scene) {
        return Ok(());
    }
    if flags.light_rig.is_some() || has_light(flags) {
        let towards = rig::sun(camera).direction;
        let sun = [towards.x, towards.y, towards.z].map(|x| format!("{x:.2}")).join(",");
        say(&format!("the scene has little or no light; try --light-rig studio, --sun {sun},3 or --lights rain:100"));
        return Ok(());
    }
    match lighting.reaches_surfaces {
        true => {
            LightRig::Studio.add(scene, camera, flags.environment_scale);
            say("the scene has no light of its own: lit by the built-in studio (--light-rig studio|sun|none)");
        }
        // The studio lights the scene through its environment.
        false => {
            LightRig::Sun.add(scene, camera, 1.0);
            say("the scene has no light of its own: lit by a built-in sun (--light-rig studio|sun|none)");
        }
    }
    Ok(())
}

/// Luminance below which surfaces are hardly visible, as a fraction of white at the image's exposure.
const NEARLY_BLACK: f32 = 0.02;
/// Fraction of the surfaces in an image that may be nearly black.
const MOST_NEARLY_BLACK: f32 = 0.6;
/// The sky to add around a camera between surfaces, as a fraction of white.
const FAINT_SKY: Vec3 = Vec3::new(0.08, 0.11, 0.16);
/// Radiance of a white sheet in the studio to add around an object, as a fraction of white.
const DIM_STUDIO: f32 = 0.3;

/// Light to add to a scene whose own lights leave most of an image black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FillLight {
    /// A constant sky, nits: a street at night.
    Sky(Vec3),
    /// The studio, times this factor: an object beside a lamp.
    Studio(f32),
}

impl FillLight {
    /// True if a scene may get it: it has no environment, and no flag sets light.
    pub fn is_allowed(scene: &Scene, flags: &LightArgs) -> bool {
        let has_environment = scene.environment.is_some() || scene.sky != Vec3::ZERO;
        !has_environment && flags.light_rig.is_none() && !has_light(flags)
    }

    /// The light that a scene needs in addition, seen by `camera` as `rendering`. `None` if enough is visible.
    pub fn of(rendering: &RenderedImage, scene: &Scene, camera: &Camera) -> Option<Self> {
        let white = (-rendering.exposure?).exp2();
        let (mut surface, mut black) = (0.0, 0.0);
        for [red, green, blue, covered] in &rendering.radiance {
            surface += covered;
            if 0.2126 * red + 0.7152 * green + 0.0722 * blue < NEARLY_BLACK * white {
                black += covered;
            }
        }
        if black <= MOST_NEARLY_BLACK * surface {
            return None;
        }
        let bounds = scene.bounds();
        let is_between = camera.eye().cmpge(bounds.min).all() && camera.eye().cmple(bounds.max).all();
        Some(if is_between { Self::Sky(FAINT_SKY * white) } else { Self::Studio(DIM_STUDIO * white) })
    }

    pub fn add(self, scene: &mut Scene, camera: &Camera) {
        match self {
            Self::Sky(radiance) => scene.sky = radiance,
            Self::Studio(scale) => LightRig::Studio.add(scene, camera, scale),
        }
    }

    /// What was added, and the flags that repeat it.
    pub fn note(self) -> String {
        let (what, flags) = match self {
            Self::Sky(radiance) => {
                ("a faint sky was", format!("--sky {}", radiance.to_array().map(|x| x.to_string()).join(",")))
            }
            Self::Studio(scale) => {
                ("the built-in studio was", format!("--light-rig studio --environment-scale {scale}"))
            }
        };
        format!(
            "the scene's lights leave most of the image black, and it has no environment: {what} added ({flags} \
             repeats it, --light-rig none omits it)"
        )
    }
}

/// Adds the rig of `--light-rig`, if given.
pub fn add(scene: &mut Scene, flags: &LightArgs, camera: &Camera) -> Result<(), CliError> {
    let Some(rig) = flags.light_rig else { return Ok(()) };
    let environment_flag = match (&flags.environment, flags.sky) {
        (Some(_), _) => Some("--environment"),
        (None, Some(_)) => Some("--sky"),
        (None, None) => None,
    };
    if let Some(flag) = environment_flag.filter(|_| rig == LightRig::Studio) {
        return Err(CliError::new(
            format_args!("both --light-rig studio and {flag}: the studio is an environment"),
            "choose one of them, or --light-rig sun, which keeps the environment",
        ));
    }
    rig.add(scene, camera, flags.environment_scale);
    Ok(())
}

/// True if a flag adds light.
fn has_light(flags: &LightArgs) -> bool {
    [&flags.points, &flags.disks, &flags.rectangles].iter().any(|lights| !lights.is_empty())
        || flags.sun.is_some()
        || flags.environment.is_some()
        || flags.sky.is_some()
        || flags.lights.is_some()
}

#[cfg(test)]
mod tests {
    use lanternfish::Report;
    use lanternfish_scene::{Projection, generate::demo};

    use super::*;

    #[test]
    fn nearly_black_images_get_a_sky_in_streets_and_a_studio_around_objects() {
        let scene = demo("furnace").unwrap();
        let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
        let eye = |eye| Camera::look_at(eye, Vec3::NEG_Z, projection);
        let (outside, between) = (eye(Vec3::new(0.0, 0.0, 50.0)), eye(scene.bounds().center()));
        // Of ten pixels on surfaces, `black` have a hundredth of white's luminance.
        let image = |black: usize| RenderedImage {
            width: 11,
            height: 1,
            radiance: (0..11)
                .map(|i| if i < black { [0.04, 0.04, 0.04, 1.0] } else { [2.0, 2.0, 2.0, (i < 10).into()] })
                .collect(),
            display: Vec::new(),
            exposure: Some(-2.0),
            report: Report::default(),
        };
        let of = |black, camera| FillLight::of(&image(black), &scene, camera);
        assert_eq!(of(7, &between), Some(FillLight::Sky(4.0 * FAINT_SKY)));
        assert_eq!(of(7, &outside), Some(FillLight::Studio(4.0 * DIM_STUDIO)));
        assert_eq!((of(6, &between), of(6, &outside)), (None, None));
        assert!(of(7, &outside).unwrap().note().contains("--light-rig studio --environment-scale 1.2"));
    }
}
