//! Adds light to dark scenes, and notes for the user.

use glam::{Affine3A, Mat3, Vec3};
use lanternfish::{
    RenderedImage,
    settings::{Background, Exposure, Occlusion},
};
use lanternfish_scene::{
    Bounds, Camera, LightKind, Scene,
    rig::{self, LightRig, ground},
};

use crate::{
    args::{Ground, LightArgs, RenderArgs},
    error::CliError,
};

/// How an image depends on light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lighting {
    /// True if the image shows light.
    pub is_seen: bool,
    /// True if environment light reaches surfaces.
    pub reaches_surfaces: bool,
    /// True if the image shows the environment, from one side: a ground that looks like it may be added.
    pub takes_ground: bool,
    /// True if a ground shows shadows only: there is no environment behind it.
    pub catches_shadows: bool,
    /// True if the exposure is metered, so that a rig can be scaled to the scene's lamps.
    pub is_metered: bool,
}

impl Lighting {
    /// For images with these flags.
    pub fn of(args: &RenderArgs) -> Self {
        let settings = args.settings();
        let reaches_surfaces = settings.indirect.sees_environment() || settings.occlusion != Occlusion::NONE;
        // Debug views need no light.
        // Output variables are those of the file.
        let catches_shadows = settings.image.background != Background::Environment;
        let takes_ground = !catches_shadows && args.quantities().is_empty();
        let is_metered = settings.image.exposure == Exposure::Auto;
        let is_seen = settings.image.debug_view.is_none();
        Self { is_seen, reaches_surfaces, takes_ground, catches_shadows, is_metered }
    }
}

/// Fraction of the studio's light that a frame of the default quality finds on a ground: its few rays see the soft boxes blurred. In a mean of
/// many frames, and in the path tracer's image, the ground is brighter than the backdrop by up to this.
const FOUND_IN_STUDIO: f32 = 0.965;

/// What a rig adds to a scene. The studio's environment and the sun revolve with the camera of an orbit; a lamp in a room stays.
#[derive(Clone, Copy, Debug, Default)]
pub struct AddedLights {
    has_studio: bool,
    /// Exposure at which a white sheet in the studio is white, or that of dark materials, EV, if nothing else lights the scene.
    exposure: Option<f32>,
    /// Index of the sun among the scene's lights, and its direction before the orbit.
    sun: Option<(usize, Vec3)>,
    /// The instance of the ground, and its transform before the orbit.
    ground: Option<(usize, Affine3A)>,
    /// The bounds of what stands on it.
    object: Option<Bounds>,
}

impl AddedLights {
    /// Adds a rig to the scene, for `camera`.
    fn add(rig: LightRig, scene: &mut Scene, camera: &Camera, scale: f32) -> Self {
        let (first, had_environment) = (scene.lights.len(), scene.environment.is_some());
        let exposure = rig.add(scene, camera, scale);
        let has_studio = !had_environment && scene.environment.is_some();
        let mut added = scene.lights.iter().enumerate().skip(first);
        let sun = added.find(|(_, light)| light.kind == LightKind::Directional);
        Self {
            has_studio,
            exposure,
            sun: sun.map(|(index, light)| (index, light.direction)),
            ground: None,
            object: None,
        }
    }

    /// Adds the ground of `--ground`, or by default that of an object in the studio.
    fn stand(&mut self, scene: &mut Scene, camera: &Camera, wanted: Option<Ground>, lighting: Lighting) {
        let is_wanted = match wanted {
            Some(wanted) => wanted == Ground::On,
            None => self.has_studio && lighting.takes_ground && ground::suits(scene, camera),
        };
        let bounds = scene.bounds();
        if lighting.is_seen && is_wanted && !bounds.is_empty() {
            self.object = Some(bounds);
            let found = if self.has_studio { FOUND_IN_STUDIO } else { 1.0 };
            let index = ground::add(scene, camera, found, lighting.catches_shadows);
            self.ground = Some((index, scene.instances[index].world_from_object));
        }
    }

    /// The automatic exposure, EV, of a scene that the studio alone lights: white materials are white, whatever else is in the image; dark
    /// scenes are brighter.
    pub fn exposure(&self) -> Option<f32> {
        self.exposure
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        !self.has_studio && self.sun.is_none() && self.ground.is_none()
    }

    /// Rotates them about +y to this angle of the camera's orbit, radians, counter-clockwise seen from above.
    pub fn revolve(&self, scene: &mut Scene, angle: f32) {
        if let Some(environment) = scene.environment.as_mut().filter(|_| self.has_studio) {
            environment.rotation = angle;
        }
        if let Some((index, direction)) = self.sun {
            scene.lights[index].direction = Mat3::from_rotation_y(angle) * direction;
        }
        // It looks like the environment behind it.
        if let Some((index, still)) = self.ground.filter(|_| self.has_studio) {
            scene.instances[index].world_from_object = still * Affine3A::from_rotation_y(angle);
        }
    }
}

/// Adds the rig of `--light-rig`. If nothing else lights the scene, it adds a rig around `camera` by default. `say` receives
/// notes about an added rig, missing light or missing geometry. Returns what revolves with the camera of an orbit.
pub(crate) fn light(
    scene: &mut Scene,
    flags: &LightArgs,
    camera: &Camera,
    lighting: Lighting,
    say: impl Fn(&str),
) -> Result<AddedLights, CliError> {
    if scene.bounds().is_empty() {
        say("the scene has no geometry: only its environment is visible");
        return add(scene, flags, camera);
    }
    let mut added = rig_of(scene, flags, camera, lighting, say)?;
    added.stand(scene, camera, flags.ground, lighting);
    Ok(added)
}

/// The rig of `--light-rig`, or the default one.
fn rig_of(
    scene: &mut Scene,
    flags: &LightArgs,
    camera: &Camera,
    lighting: Lighting,
    say: impl Fn(&str),
) -> Result<AddedLights, CliError> {
    if lighting.is_metered && FillLight::is_scaled(scene, flags) {
        return Ok(AddedLights::default());
    }
    let requested = add(scene, flags, camera)?;
    if !lighting.is_seen || !rig::is_dark(scene) {
        return Ok(requested);
    }
    if flags.light_rig.is_some() || has_light(flags) {
        let towards = rig::sun(camera).direction;
        let sun = [towards.x, towards.y, towards.z].map(|x| format!("{x:.2}")).join(",");
        say(&format!("the scene has little or no light; try --light-rig studio, --sun {sun},3 or --lights rain:100"));
        return Ok(requested);
    }
    let rig = LightRig::for_dark(lighting.reaches_surfaces);
    let name = if rig == LightRig::Studio { "the built-in studio" } else { "a built-in sun" };
    say(&format!("the scene has no light of its own: lit by {name} (--light-rig studio|sun|none)"));
    Ok(AddedLights::add(rig, scene, camera, flags.environment_scale))
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
    /// True if a scene may lack it: it has no environment, and no rig is chosen.
    pub fn may_lack(scene: &Scene, flags: &LightArgs) -> bool {
        let has_environment = scene.environment.is_some() || scene.sky != Vec3::ZERO;
        !has_environment && (flags.light_rig.is_none() || Self::is_scaled(scene, flags))
    }

    /// True if `--light-rig studio` is to be as bright as suits the scene's own lamps.
    fn is_scaled(scene: &Scene, flags: &LightArgs) -> bool {
        let has_own = !rig::is_dark(scene) && !has_light(flags);
        has_own && flags.light_rig == Some(LightRig::Studio) && flags.environment_scale == 1.0
    }

    /// The light that a scene needs in addition, seen by `camera` as `rendering`. `None` if enough is visible.
    /// `flags` may ask for the studio; `added` tells a ground from the scene.
    pub fn of(
        rendering: &RenderedImage,
        scene: &Scene,
        camera: &Camera,
        flags: &LightArgs,
        added: &AddedLights,
    ) -> Option<Self> {
        let white = (-rendering.exposure?).exp2();
        if Self::is_scaled(scene, flags) {
            return Some(Self::Studio(DIM_STUDIO * white));
        }
        let (mut surface, mut black) = (0.0, 0.0);
        for [red, green, blue, covered] in &rendering.radiance {
            surface += covered;
            if 0.2126 * red + 0.7152 * green + 0.0722 * blue < NEARLY_BLACK * white {
                black += covered;
            }
        }
        let bounds = added.object.unwrap_or_else(|| scene.bounds());
        let is_between = camera.eye().cmpge(bounds.min).all() && camera.eye().cmple(bounds.max).all();
        // An object in front of nothing, lit by its own lamps only, is black on black.
        let is_alone = 2.0 * surface < rendering.radiance.len() as f32 && !is_between && !scene.is_room();
        if black <= MOST_NEARLY_BLACK * surface && !is_alone {
            return None;
        }
        Some(if is_between { Self::Sky(FAINT_SKY * white) } else { Self::Studio(DIM_STUDIO * white) })
    }

    /// Adds it, and a ground unless there is one `before`; returns what revolves with the camera of an orbit.
    pub fn add(
        self,
        scene: &mut Scene,
        camera: &Camera,
        before: AddedLights,
        flags: &LightArgs,
        lighting: Lighting,
    ) -> AddedLights {
        let mut added = match self {
            Self::Sky(radiance) => {
                scene.sky = radiance;
                AddedLights::default()
            }
            Self::Studio(scale) => AddedLights::add(LightRig::Studio, scene, camera, scale),
        };
        match before.ground {
            Some(_) => (added.ground, added.object) = (before.ground, before.object),
            None => added.stand(scene, camera, flags.ground, lighting),
        }
        added
    }

    /// What was added, and the flags that repeat it.
    pub fn note(self) -> String {
        let what = match self {
            Self::Sky(_) => "a faint sky was",
            Self::Studio(_) => "the built-in studio was",
        };
        let flags = self.flags();
        format!(
            "the scene's lights leave most of the image black: {what} added ({flags} \
             repeats it, --light-rig none omits it)"
        )
    }

    /// What would help where flags set the light, which is kept as it is.
    pub fn advice(self) -> String {
        let flags = self.flags();
        format!("these lights leave most of the image black: {flags} adds light")
    }

    /// The flags that add it.
    fn flags(self) -> String {
        match self {
            Self::Sky(radiance) => format!("--sky {}", radiance.to_array().map(|x| x.to_string()).join(",")),
            Self::Studio(scale) => format!("--light-rig studio --environment-scale {scale}"),
        }
    }
}

/// Adds the rig of `--light-rig`, if given. Returns what revolves with the camera of an orbit.
pub fn add(scene: &mut Scene, flags: &LightArgs, camera: &Camera) -> Result<AddedLights, CliError> {
    let Some(rig) = flags.light_rig else { return Ok(AddedLights::default()) };
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
    Ok(AddedLights::add(rig, scene, camera, flags.environment_scale))
}

/// True if a flag adds light.
pub(crate) fn has_light(flags: &LightArgs) -> bool {
    [&flags.points, &flags.disks, &flags.rectangles].iter().any(|lights| !lights.is_empty())
        || flags.sun.is_some()
        || flags.environment.is_some()
        || flags.sky.is_some()
        || flags.lights.is_some()
}

#[cfg(test)]
mod tests;
