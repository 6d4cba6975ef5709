//! Flags of lights and environment.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::Vec3;
use lanternfish_scene::{Light, rig::LightRig};

use super::settings::LightFlags;
use crate::{
    choices::choice,
    parse::{self, LightSet},
};

/// What the sun of an environment image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EnvironmentSun {
    /// A directional light: sharp shadows in every frame.
    Light,
    /// A part of the image.
    Image,
}

/// Whether there is a ground under the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Ground {
    /// Under any scene.
    On,
    /// None.
    Off,
}

/// Flags of lights and environment.
#[derive(Debug, Args)]
pub struct LightArgs {
    /// Adds a point light. Repeatable.
    ///
    /// `x,y,z,cd[,r,g,b[,range]]`: position (m), intensity (cd), colour that scales it, range (m).
    #[arg(long = "point", value_name = "x,y,z,cd[,...]")]
    #[arg(value_parser = parse::point_light, allow_hyphen_values = true)]
    pub points: Vec<Light>,
    /// Adds a one-sided disk light. Repeatable.
    ///
    /// `x,y,z,dx,dy,dz,radius,nits[,r,g,b[,range]]`: centre (m), normal, radius (m), radiance (nits), colour that scales it,
    /// range (m). The disk itself is not visible.
    #[arg(long = "disk", value_name = "x,y,z,...", hide_short_help = true)]
    #[arg(value_parser = parse::disk, allow_hyphen_values = true)]
    pub disks: Vec<Light>,
    /// Adds a one-sided rectangle light. Repeatable.
    ///
    /// `x,y,z,dx,dy,dz,width,height,nits[,r,g,b[,range]]`: as a disk. Its width is horizontal; along x if it faces straight up
    /// or down.
    #[arg(long = "rectangle", value_name = "x,y,z,...")]
    #[arg(value_parser = parse::rectangle, allow_hyphen_values = true)]
    pub rectangles: Vec<Light>,
    /// A directional light.
    ///
    /// `dx,dy,dz,lux[,r,g,b]`: the direction in which it travels, illuminance (lx), colour that scales it.
    #[arg(long, value_name = "dx,dy,dz,lux[,...]", value_parser = parse::sun, allow_hyphen_values = true)]
    pub sun: Option<Light>,
    /// The environment: an equirectangular image (.hdr, .exr).
    ///
    /// Linear radiance (nits), instead of --sky. Its centre lies along -z, its right half towards +x. It is visible, and it
    /// lights the scene with --indirect sampled or --occlusion.
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
    /// Rotates the --environment about +y, counter-clockwise seen from above, degrees.
    #[arg(long, value_name = "DEG", value_parser = parse::rotation, allow_hyphen_values = true, default_value_t = 0.0)]
    #[arg(hide_short_help = true)]
    pub environment_rotation: f32,
    /// Scales the radiance of the --environment, or of --light-rig studio, by X.
    #[arg(long, value_name = "X", value_parser = parse::positive, allow_hyphen_values = true, default_value_t = 1.0)]
    #[arg(hide_short_help = true)]
    pub environment_scale: f32,
    /// What the sun of the --environment is: a directional light, or a part of the image.
    ///
    /// A sun is a small area that sends more than a twentieth of all light. As a light it casts sharp shadows; the image shows
    /// the sky around it in its place. As a part of the image it needs many frames, since few rays see it blurred. Default:
    /// light; of `reference`, whose rays find it, image.
    #[arg(long, value_name = "AS", hide_short_help = true)]
    pub environment_sun: Option<EnvironmentSun>,
    /// A constant background, linear radiance (nits).
    ///
    /// It is visible, and it lights the scene with --indirect sampled or --occlusion.
    #[arg(long, value_name = "r,g,b", value_parser = parse::color, allow_hyphen_values = true)]
    pub sky: Option<Vec3>,
    /// Built-in light rig.
    ///
    /// It is around the camera, and adds to other lights; an environment stays. Without it: studio if nothing else
    /// lights the scene, or sun if an environment is present but does not light the scene.
    #[arg(long, value_name = "NAME", value_parser = choice::<LightRig>())]
    pub light_rig: Option<LightRig>,
    /// A ground that shows the object's shadow: on or off.
    ///
    /// It looks like the environment behind it where no shadow falls, from the first image's camera. Without it: on in images of
    /// an object in the studio, off otherwise. With --background only the shadow is visible.
    #[arg(long, value_name = "on|off", hide_short_help = true)]
    pub ground: Option<Ground>,
    /// Many coloured point lights: rain:N.
    ///
    /// At most 2097152, those of the file included. rain:N or rain:N:radius: falling through the scene's bounds. --seed chooses
    /// the positions; the radius is the range of each light, m, by default chosen by the scene's size and N.
    /// random:N:radius:seed:x0,y0,z0,x1,y1,z1: at random positions in a box, by a rule that other renderers can implement.
    #[arg(long, value_name = "SET", value_parser = parse::light_set, allow_hyphen_values = true)]
    pub lights: Option<LightSet>,
    /// Falloff and size of lights.
    #[command(flatten)]
    pub settings: LightFlags,
}
