//! Flags of lights and environment.

use std::path::PathBuf;

use glam::Vec3;
use lanternfish_scene::{Light, named_enum, rig::LightRig};

use super::{
    flags::flags,
    settings::LightFlags,
    spelling::{Color, Disk, Lights, Path, Point, Positive, Rectangle, Rotation, Sun},
};
use crate::parse::LightSet;

named_enum! {
    /// What the sun of an environment image is.
    EnvironmentSun {
        Light = "light": "A directional light: sharp shadows in every frame",
        Image = "image": "A part of the image",
    }
}

named_enum! {
    /// Whether there is a ground under the scene.
    Ground {
        On = "on": "Under any scene",
        Off = "off": "None",
    }
}

flags! {
    /// Flags of lights and environment.
    pub struct LightArgs {
        /// Adds a point light. Repeatable.
        ///
        /// `x,y,z,cd[,r,g,b[,range]]`: position (m), intensity (cd), colour that scales it, range (m).
        #[arg(long = "point", value_name = "x,y,z,cd[,...]", allow_hyphen_values = true)]
        points: Vec<Light> as Point,
        /// Adds a one-sided disk light. Repeatable.
        ///
        /// `x,y,z,dx,dy,dz,radius,nits[,r,g,b[,range]]`: centre (m), normal, radius (m), radiance (nits), colour that
        /// scales it, range (m). The disk itself is not visible.
        #[arg(long = "disk", value_name = "x,y,z,...", hide_short_help = true, allow_hyphen_values = true)]
        disks: Vec<Light> as Disk,
        /// Adds a one-sided rectangle light. Repeatable.
        ///
        /// `x,y,z,dx,dy,dz,width,height,nits[,r,g,b[,range]]`: as a disk. Its width is horizontal; along x if it faces
        /// straight up or down.
        #[arg(long = "rectangle", value_name = "x,y,z,...", allow_hyphen_values = true)]
        rectangles: Vec<Light> as Rectangle,
        /// A directional light.
        ///
        /// `dx,dy,dz,lux[,r,g,b]`: the direction in which it travels, illuminance (lx), colour that scales it.
        #[arg(long, value_name = "dx,dy,dz,lux[,...]", allow_hyphen_values = true)]
        sun: Option<Light> as Sun,
        /// The environment: an equirectangular image (.hdr, .exr).
        ///
        /// Linear radiance (nits), instead of --sky. Its centre lies along -z, its right half towards +x. It is
        /// visible, and it lights the scene with --indirect sampled or --occlusion.
        #[arg(long, value_name = "FILE")]
        environment: Option<PathBuf> as Path,
        /// Rotates the --environment about +y, counter-clockwise seen from above, degrees.
        #[arg(long, value_name = "DEG", allow_hyphen_values = true, default_value_t = 0.0, hide_short_help = true)]
        environment_rotation: f32 as Rotation,
        /// Scales the radiance of the --environment, or of --light-rig studio, by X.
        #[arg(long, value_name = "X", allow_hyphen_values = true, default_value_t = 1.0, hide_short_help = true)]
        environment_scale: f32 as Positive,
        /// What the sun of the --environment is: a directional light, or a part of the image.
        ///
        /// A sun is a small area that sends more than a twentieth of all light. As a light it casts sharp shadows; the
        /// image shows the sky around it in its place. As a part of the image it needs many frames, since few rays see
        /// it blurred. Default: light; of `reference`, whose rays find it, image.
        #[arg(long, value_name = "AS", hide_short_help = true)]
        environment_sun: Option<EnvironmentSun> as EnvironmentSun,
        /// A constant background, linear radiance (nits).
        ///
        /// It is visible, and it lights the scene with --indirect sampled or --occlusion.
        #[arg(long, value_name = "r,g,b", allow_hyphen_values = true)]
        sky: Option<Vec3> as Color,
        /// Built-in light rig.
        ///
        /// It is around the camera, and adds to other lights; an environment stays. Without it: studio if nothing else
        /// lights the scene, or sun if an environment is present but does not light the scene.
        #[arg(long, value_name = "NAME")]
        light_rig: Option<LightRig> as LightRig,
        /// A ground that shows the object's shadow: on or off.
        ///
        /// It looks like the environment behind it where no shadow falls, from the first image's camera. Without it: on
        /// in images of an object in the studio, off otherwise. With --background only the shadow is visible.
        #[arg(long, value_name = "on|off", hide_short_help = true)]
        ground: Option<Ground> as Ground,
        /// Many coloured point lights: rain:N.
        ///
        /// At most 2097152, those of the file included. rain:N or rain:N:radius: falling through the scene's bounds.
        /// --seed chooses the positions; the radius is the range of each light, m, by default chosen by the scene's
        /// size and N. random:N:radius:seed:x0,y0,z0,x1,y1,z1: at random positions in a box, by a rule that other
        /// renderers can implement.
        #[arg(long, value_name = "SET", allow_hyphen_values = true)]
        lights: Option<LightSet> as Lights,
        /// Falloff and size of lights.
        #[command(flatten)]
        settings: LightFlags,
    }
}
