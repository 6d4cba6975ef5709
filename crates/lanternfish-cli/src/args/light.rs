//! Flags of lights and environment.

use std::path::PathBuf;

use clap::Args;
use glam::Vec3;
use lanternfish::settings::{Attenuation, Settings};
use lanternfish_scene::{Light, rig::LightRig};

use crate::{
    choices::choice,
    parse::{self, LightSet},
};

/// Flags of lights and environment.
#[derive(Debug, Args)]
pub struct LightArgs {
    /// A point light. Repeatable.
    ///
    /// `x,y,z,cd[,r,g,b[,range]]`: position (m), intensity (cd), colour that scales it, and range (m).
    #[arg(long = "point", value_name = "x,y,z,cd[,...]")]
    #[arg(value_parser = parse::point_light, allow_hyphen_values = true)]
    pub points: Vec<Light>,
    /// A disk light that emits to one side. Repeatable.
    ///
    /// `x,y,z,dx,dy,dz,radius,nits[,r,g,b[,range]]`: its middle (m), the way it faces, radius (m), radiance (nits), colour that
    /// scales it, and range (m). The disk itself is invisible.
    #[arg(long = "disk", value_name = "x,y,z,...", hide_short_help = true)]
    #[arg(value_parser = parse::disk, allow_hyphen_values = true)]
    pub disks: Vec<Light>,
    /// A rectangle light that emits to one side. Repeatable.
    ///
    /// `x,y,z,dx,dy,dz,width,height,nits[,r,g,b[,range]]`: as a disk. Its width is level; along x where it faces straight up or
    /// down.
    #[arg(long = "rectangle", value_name = "x,y,z,...")]
    #[arg(value_parser = parse::rectangle, allow_hyphen_values = true)]
    pub rectangles: Vec<Light>,
    /// A directional light. Repeatable.
    ///
    /// `dx,dy,dz,lux[,r,g,b]`: the direction in which it travels, illuminance (lx), colour that scales it.
    #[arg(long, value_name = "dx,dy,dz,lux[,...]", value_parser = parse::sun, allow_hyphen_values = true)]
    pub sun: Option<Light>,
    /// The environment: an equirectangular image (.hdr, .exr).
    ///
    /// Linear radiance (nits), in place of --sky. Its centre is seen looking along -z, its right half towards +x. It is seen,
    /// and lights by --indirect sampled or --occlusion.
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
    /// Turns the --environment about +y, counter-clockwise seen from above, degrees.
    #[arg(long, value_name = "DEG", value_parser = parse::rotation, allow_hyphen_values = true, default_value_t = 0.0)]
    #[arg(hide_short_help = true)]
    pub environment_rotation: f32,
    /// Makes the --environment X times as bright.
    #[arg(long, value_name = "X", value_parser = parse::positive, allow_hyphen_values = true, default_value_t = 1.0)]
    #[arg(hide_short_help = true)]
    pub environment_scale: f32,
    /// A constant background, linear radiance (nits).
    ///
    /// It is seen, and lights by --indirect sampled or --occlusion.
    #[arg(long, value_name = "r,g,b", value_parser = parse::color, allow_hyphen_values = true)]
    pub sky: Option<Vec3>,
    /// A light rig.
    ///
    /// It is made, and is there beside the other flags'. Environment that the scene has, or flags say, stay. Without it: studio where nothing else lights the scene, or sun
    /// where environment lights nothing.
    #[arg(long, value_name = "NAME", value_parser = choice::<LightRig>())]
    pub light_rig: Option<LightRig>,
    /// Many coloured point lights: rain:N.
    ///
    /// At most 2097152, those of the file among them. rain:N or rain:N:radius: falling through the scene's box; --seed chooses
    /// where; the radius is how far each reaches, m, by default chosen by the scene's size and N.
    /// random:N:radius:seed:x0,y0,z0,x1,y1,z1: at random places of a box, by a rule that other renderers can follow.
    #[arg(long, value_name = "SET", value_parser = parse::light_set, allow_hyphen_values = true)]
    pub lights: Option<LightSet>,
    /// Distance attenuation. R is the light's range.
    #[arg(long, value_name = "NAME", value_parser = choice::<Attenuation>())]
    #[arg(default_value_t = Settings::default().attenuation, hide_short_help = true)]
    pub attenuation: Attenuation,
    /// Illuminance at which a light without a stated range ends, lx. Lower: larger ranges, less lost light, slower.
    #[arg(long, value_name = "X", value_parser = parse::positive, allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().range_threshold, hide_short_help = true)]
    pub range_threshold: f32,
    /// Radius of point and spot lights, m: soft shadows.
    ///
    /// 0: they are points.
    #[arg(long, value_name = "METRES", value_parser = parse::radius, allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().light_radius)]
    pub light_radius: f32,
}
