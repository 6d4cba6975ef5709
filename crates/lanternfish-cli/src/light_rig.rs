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
            LightRig::Studio.add(scene, camera);
            say("the scene has no light of its own: lit by the built-in studio (--light-rig studio|sun|none)");
        }
        // The studio lights the scene through its environment.
        false => {
            LightRig::Sun.add(scene, camera);
            say("the scene has no light of its own: lit by a built-in sun (--light-rig studio|sun|none)");
        }
    }
    Ok(())
}

/// Luminance below which surfaces are hardly visible, as a fraction of white at the image's exposure.
const NEARLY_BLACK: f32 = 0.02;
/// Fraction of the surfaces in an image that may be nearly black.
const MOST_NEARLY_BLACK: f32 = 0.6;
/// The sky to add in that case, as a fraction of white.
const FAINT_SKY: Vec3 = Vec3::new(0.08, 0.11, 0.16);

/// True if a scene may get a faint sky: it has no environment, and no flag sets light.
pub(crate) fn may_have_faint_sky(scene: &Scene, flags: &LightArgs) -> bool {
    let has_environment = scene.environment.is_some() || scene.sky != Vec3::ZERO;
    !has_environment && flags.light_rig.is_none() && !has_light(flags)
}

/// A faint sky, nits, for a scene whose lights leave most of `rendering` black, such as streets at night. `None` if enough is
/// visible.
pub(crate) fn faint_sky(rendering: &RenderedImage) -> Option<Vec3> {
    let white = (-rendering.exposure?).exp2();
    let (mut surface, mut black) = (0.0, 0.0);
    for [red, green, blue, covered] in &rendering.radiance {
        surface += covered;
        if 0.2126 * red + 0.7152 * green + 0.0722 * blue < NEARLY_BLACK * white {
            black += covered;
        }
    }
    (black > MOST_NEARLY_BLACK * surface).then_some(FAINT_SKY * white)
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
    rig.add(scene, camera);
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
