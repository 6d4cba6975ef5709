//! Light for a scene that has none, and what is said about it.

use glam::Vec3;
use lanternfish::RenderedImage;
use lanternfish_scene::{
    Camera, Scene,
    rig::{self, LightRig},
};

use crate::{args::LightArgs, error::CliError};

/// What an image makes of light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lighting {
    /// True if light is what it shows.
    pub is_seen: bool,
    /// True if environment lights surfaces.
    pub reaches_surfaces: bool,
}

/// Adds the rig of `--light-rig`, or where nothing else lights the scene one of its own choice, made about `camera`; `say`
/// is told what, and where light or surfaces are missing all the same.
pub(crate) fn light(
    scene: &mut Scene,
    flags: &LightArgs,
    camera: &Camera,
    lighting: Lighting,
    say: impl Fn(&str),
) -> Result<(), CliError> {
    add(scene, flags, camera)?;
    if scene.bounds().is_empty() {
        say("the scene has no geometry: nothing but its environment is seen");
        return Ok(());
    }
    if !lighting.is_seen || !rig::is_dark(scene) {
        return Ok(());
    }
    if flags.light_rig.is_some() || has_light(flags) {
        let towards = rig::sun(camera).direction;
        let sun = [towards.x, towards.y, towards.z].map(|x| format!("{x:.2}")).join(",");
        say(&format!(
            "little or nothing in the scene shines; try --light-rig studio, --sun {sun},3 or --lights rain:100"
        ));
        return Ok(());
    }
    match lighting.reaches_surfaces {
        true => {
            LightRig::Studio.add(scene, camera);
            say("the scene has no light of its own: lit by the built-in studio (--light-rig studio|sun|none)");
        }
        // The studio's light comes from its environment.
        false => {
            LightRig::Sun.add(scene, camera);
            say("the scene has no light of its own: lit by a built-in sun (--light-rig studio|sun|none)");
        }
    }
    Ok(())
}

/// Luminance below which next to nothing is made out, as a share of white at the image's exposure.
const NEARLY_BLACK: f32 = 0.02;
/// Share of the surfaces in an image that may be nearly black.
const MOST_NEARLY_BLACK: f32 = 0.6;
/// The sky that is added then, as a share of white.
const FAINT_SKY: Vec3 = Vec3::new(0.08, 0.11, 0.16);

/// Whether a scene may be given a faint sky: it has no environment, and no flag says what light there is.
pub(crate) fn may_have_faint_sky(scene: &Scene, flags: &LightArgs) -> bool {
    let has_environment = scene.environment.is_some() || scene.sky != Vec3::ZERO;
    !has_environment && flags.light_rig.is_none() && !has_light(flags)
}

/// A faint sky, nits, for a scene whose own lights leave most of `rendering` black, as streets at night are. None where there is enough
/// to see.
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

/// Adds the rig of `--light-rig`, if there is one.
pub fn add(scene: &mut Scene, flags: &LightArgs, camera: &Camera) -> Result<(), CliError> {
    let Some(rig) = flags.light_rig else { return Ok(()) };
    let environment_light = match (&flags.environment, flags.sky) {
        (Some(_), _) => Some("--environment"),
        (None, Some(_)) => Some("--sky"),
        (None, None) => None,
    };
    if let Some(flag) = environment_light.filter(|_| rig == LightRig::Studio) {
        return Err(CliError::new(
            format_args!("both --light-rig studio and {flag}: the studio is environment"),
            "choose one of them, or --light-rig sun, whose sun shines beside other environment",
        ));
    }
    rig.add(scene, camera);
    Ok(())
}

/// True if a flag says what light there is.
fn has_light(flags: &LightArgs) -> bool {
    [&flags.points, &flags.disks, &flags.rectangles].iter().any(|lights| !lights.is_empty())
        || flags.sun.is_some()
        || flags.environment.is_some()
        || flags.sky.is_some()
        || flags.lights.is_some()
}
