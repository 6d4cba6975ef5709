//! The flags of `render`, some of which other commands share. Scripts use these names, so they are fixed.

pub(crate) mod flags;
pub(crate) mod keys;
mod light;
pub(crate) mod part;
pub(crate) mod settings;
mod shared;
pub(crate) mod spelling;
#[cfg(test)]
mod tests;
pub(crate) mod view;

use std::{ffi::OsString, path::PathBuf};

use clap::{ArgAction, Args, Command, FromArgMatches as _};
use glam::{Affine3A, Vec3};
use lanternfish::settings::{Direct, GivenSettings, Preset, Settings};
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Camera, Eyes, Viewpoint, generate::DEMOS};

use self::{
    flags::flags,
    spelling::{
        Adapter, Elevation, FovY, Fps, FrameNumbers, Intrinsics, Legend, Orbit, Outputs, Path, PixelSize, Pose,
        Position, Rotation, Seconds, Seed, Stereo, Switch, Text,
    },
};
pub use self::{
    light::{EnvironmentSun, Ground, LightArgs},
    part::PartArgs,
    settings::{IndirectArgs, LightFlags, LookArgs, TechniqueArgs},
    shared::{Selection, SharedFlags},
};
use crate::{
    help,
    outputs::{Quantities, Quantity},
    paper::{self, Paper},
    parse::{self, Frames, PoseConvention, Size},
    scene::{self, SceneName},
    stereo::StereoLayout,
};

/// Text after the short help of `render`.
pub(crate) const RENDER_SHORT_HELP: &str = "\
Examples:
  lanternfish render demo:atrium --lights rain:1000 -o atrium.png
  lanternfish render scene.glb --eye 6,2,-1 --target -4,3,0 --sun 0.3,-1,-0.6,3 --exposure 1

Units: metres, degrees, candela, lux. +y is up. The last line of output is the image's path.
`lanternfish help render --all` shows every flag, and what each value means.";

/// Text after the long help of `render`.
pub(crate) const RENDER_HELP: &str = "\
Examples:
  A built-in scene with a thousand lights, and the time of each pass:
    lanternfish render demo:atrium --lights rain:1000 --timings -o atrium.png
  Your scene from a chosen viewpoint, in the sun:
    lanternfish render scene.glb --eye 6,2,-1 --target -4,3,0 --fov-y 60 --sun 0.3,-1,-0.6,3
  A warm lamp of 100 cd with a range of 5 m, and a cold one:
    lanternfish render scene.glb --point 0,2.5,0,100,1,0.9,0.7,5 --point 3,2,1,80,0.6,0.8,1
  A panel of 1.2 x 0.3 m and 2,000 nits that faces down:
    lanternfish render scene.glb --rectangle 0,2.5,0,0,-1,0,1.2,0.3,2000
  Linear radiance for further work:
    lanternfish render scene.glb -o scene.exr
  How many lights each pixel evaluates:
    lanternfish render demo:atrium --lights rain:1000 --debug-view lights-per-pixel -o lights.png
  All flags in a file, and a flag that overrides the file:
    lanternfish shot scene.glb --sun 0.3,-1,-0.6,3 -o shot.toml
    lanternfish render shot.toml --exposure 1

Units: metres, degrees, candela, lux. +y is up.
The last line of standard output is the image's path.";

/// Limits on what a run may read and how much memory it may take. Every subcommand has them, on the command line alone:
/// no shot sets them.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Files from strangers")]
pub struct TrustArgs {
    /// Reads nothing outside the scene's folder, through links either. Without it a scene may name any file that you
    /// can read. Files that the command line or a shot names are always read.
    #[arg(long, global = true, hide_short_help = true)]
    pub confine: bool,
    /// Most memory to take, in bytes or as 500M, 4G. A run that needs more ends with an error that states the amount.
    /// Without it: the machine's free memory.
    #[arg(long, global = true, value_name = "BYTES", value_parser = parse::bytes, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub memory_limit: Option<u64>,
}

impl TrustArgs {
    /// Applies these limits to the process. Call it once, before anything is read.
    pub fn obey(self) {
        scene::trust(self.confine, self.memory_limit);
    }
}

flags! {
    /// All flags of `render`.
    pub struct RenderArgs {
        /// The scene.
        #[arg(help = format!("A glTF 2.0 file (.gltf, .glb), an OBJ file, a shot (.toml), or a built-in scene: {}", demos()))]
        scene: SceneName,

        /// The image and its size.
        #[command(flatten, next_help_heading = "Output")]
        output: OutputArgs,
        /// The scene of the file.
        #[command(flatten, next_help_heading = "View")]
        part: PartArgs,
        /// The camera.
        #[command(flatten, next_help_heading = "View")]
        view: ViewArgs,
        /// Mono or stereo.
        #[command(flatten, next_help_heading = "View")]
        stereo: StereoArgs,
        /// A single frame or a sequence.
        #[command(flatten, next_help_heading = "Track (and what moves)")]
        track: TrackArgs,
        /// Lights and environment.
        #[command(flatten, next_help_heading = "Lights (beside those of the file)")]
        lights: LightArgs,
        /// Exposure, tone map, debug view.
        #[command(flatten, next_help_heading = "Look")]
        look: LookArgs,
        /// Light culling, shadows, antialiasing.
        #[command(flatten, next_help_heading = "Technique")]
        technique: TechniqueArgs,
        /// A paper's technique for every stage of the frame.
        ///
        /// A stage that the paper lacks is off. --timings lists what is set, and the section that says so. Flags beside
        /// it override it.
        #[arg(id = "paper", long = "as", value_name = "PAPER")]
        #[arg(help_heading = "Technique", hide_short_help = true)]
        paper: Option<Paper> as Paper,
        /// Preset.
        ///
        /// Sets the flags of light that are not given: with draft --indirect probes and --direct sampled; with realtime
        /// also --history on and --antialiasing temporal.
        #[arg(long, value_name = "NAME", default_value_t = Preset::default(), help_heading = "Indirect (light)")]
        quality: Preset as Preset,
        /// Indirect light and occlusion.
        #[command(flatten, next_help_heading = "Indirect (light)")]
        indirect: IndirectArgs,
        /// The adapter and the console output.
        #[command(flatten, next_help_heading = "Run")]
        run: RunArgs,
    }
    groups { output, part, view, stereo, track, lights, run }
}

/// The command `render` alone.
pub(crate) fn render_command() -> Command {
    let command =
        Command::new("render").bin_name("lanternfish render").disable_help_flag(true).arg(help::flag("lanternfish"));
    RenderArgs::augment_args(command).args_override_self(true)
}

flags! {
    /// Flags of the image.
    pub struct OutputArgs {
        /// The image: .png or .jpg (tone-mapped) or .exr (linear).
        ///
        /// Its ending chooses the format: .png or .jpg (tone-mapped), .exr (linear, scene-referred, half floats) or
        /// .npz (the same as an array for NumPy); .gif holds all frames of a sequence. Without it: the name of the
        /// scene or shot with .png, in the current folder. -o - writes a PNG image to standard output.
        #[arg(short, long = "output", value_name = "FILE")]
        output: Option<PathBuf> as Path,
        /// Width and height of the image, pixels.
        ///
        /// Each is from 1 to 16384.
        #[arg(long, value_name = "WxH", default_value = "1280x720", allow_hyphen_values = true)]
        size: Size as PixelSize,
        /// What the surface at each pixel's centre is, for data sets and compositing: some of depth, distance,
        /// position, normal, albedo, motion, instance, material, semantic, separated by commas. An .exr or .npz file
        /// has them beside the image; a .png has a file for each, image.depth.png. docs/outputs.md has units and
        /// spaces.
        #[arg(long, value_name = "NAMES", hide_short_help = true)]
        outputs: Option<Quantities> as Outputs,
        /// Classes of --outputs semantic, by names of nodes: JSON such as {"chair*": 3, "floor": 1}. * stands for any
        /// text; the longest pattern counts. Without it, and for other nodes: `extras.semantic` of the glTF node or its
        /// nearest ancestor.
        #[arg(long, value_name = "FILE.json", hide_short_help = true)]
        classes: Option<PathBuf> as Path,
        /// Whether the colour scale of a --debug-view is below the image: off keeps the image at --size.
        #[arg(long, value_name = "on|off", default_value = "on", action = ArgAction::Set, hide_short_help = true)]
        legend: bool as Legend,
        /// Opens the image in the system's viewer when it is ready.
        ///
        /// Of a sequence, the last frame.
        #[arg(long)]
        open: bool as Switch,
    }
}

flags! {
    /// Flags of the camera.
    #[derive(Default, PartialEq)]
    pub struct ViewArgs {
        /// Camera position, world space, m.
        ///
        /// Without --target the camera keeps its direction.
        #[arg(long, value_name = "x,y,z", allow_hyphen_values = true)]
        eye: Option<Vec3> as Position,
        /// Point that the camera looks at, world space, m.
        #[arg(long, value_name = "x,y,z", allow_hyphen_values = true)]
        target: Option<Vec3> as Position,
        /// Vertical field of view, degrees.
        ///
        /// Without it: that of the camera, or 45.
        #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
        fov_y: Option<f32> as FovY,
        /// A camera of the file, by name or index.
        ///
        /// `lanternfish info` lists them. Without it: the first camera of the file. A file without cameras is framed
        /// from the front, a little from the right and above; a closed interior is seen from inside.
        #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
        camera: Option<String> as Text,
        /// Frames the complete scene from one side, without the file's cameras.
        ///
        /// The scene's bounding box fills 80 % of the tighter side of the image.
        #[arg(long, value_name = "SIDE", conflicts_with_all = ["eye", "target", "camera"])]
        view: Option<Viewpoint> as Viewpoint,
        /// Focal lengths and principal point of the camera, pixels of --size: x right and y down from the image's top
        /// left corner, so that the centre of the first pixel is at 0.5,0.5. Add 0.5 to cx and cy of a calibration that
        /// has it at 0,0.
        #[arg(long, value_name = "fx,fy,cx,cy", allow_hyphen_values = true)]
        #[arg(conflicts_with = "fov_y", hide_short_help = true)]
        intrinsics: Option<[f32; 4]> as Intrinsics,
        /// Camera to world: the 16 numbers of a 4 x 4 matrix row by row, separated by commas, or a text file that has
        /// them (in a shot, too, relative to the current folder). A rotation and a translation, m.
        #[arg(long, value_name = "FILE|NUMBERS", allow_hyphen_values = true)]
        #[arg(conflicts_with_all = ["eye", "target", "view", "azimuth", "elevation"], hide_short_help = true)]
        pose: Option<Affine3A> as Pose,
        /// Axes of the camera of --pose.
        #[arg(long, value_name = "NAME", default_value_t = PoseConvention::default(), hide_short_help = true)]
        pose_convention: PoseConvention as PoseConvention,
        /// Size of the image, pixels, if there are --intrinsics.
        #[arg(skip)]
        size: [u32; 2],
        /// Frames the complete scene from this angle about its vertical axis, degrees.
        ///
        /// From the front (0), counter-clockwise seen from above: 90 is its right side. Without it: 22, a little from
        /// the right.
        #[arg(long, value_name = "DEG", allow_hyphen_values = true, hide_short_help = true)]
        #[arg(conflicts_with_all = ["eye", "target", "camera", "view"])]
        azimuth: Option<f32> as Rotation,
        /// Frames the complete scene from this angle above its middle, degrees.
        ///
        /// Without it: 16, a little from above.
        #[arg(long, value_name = "DEG", allow_hyphen_values = true, hide_short_help = true)]
        #[arg(conflicts_with_all = ["eye", "target", "camera", "view"])]
        elevation: Option<f32> as Elevation,
        /// Angle about the axis of `--orbit`, radians, counter-clockwise seen from above; in [0, 2π).
        #[arg(skip)]
        orbit_angle: f32,
        /// A recorded camera, in place of those of the file.
        #[arg(skip)]
        recorded: Option<Camera>,
    }
}

impl ViewArgs {
    /// True if angles choose the direction from which the scene is framed.
    pub fn is_turned(&self) -> bool {
        self.azimuth.is_some() || self.elevation.is_some()
    }
}

flags! {
    /// Flags of stereo images.
    pub struct StereoArgs {
        /// Renders in stereo: vive (HTC Vive), parallel (0.063 m apart) or parallel:METRES (both eyes have the camera's
        /// direction), or l,r,b,t,METRES with ,DEGREES for canted eyes: slopes of the left eye's frustum sides,
        /// mirrored for the right eye, distance between the eyes, and outward rotation of each eye. --size is that of
        /// one eye.
        #[arg(long, value_name = "EYES", allow_hyphen_values = true, hide_short_help = true)]
        stereo: Option<Eyes> as Stereo,
        /// Layout of the two eyes' images in one file.
        #[arg(long, value_name = "NAME", default_value_t = StereoLayout::default(), hide_short_help = true)]
        stereo_layout: StereoLayout as StereoLayout,
    }
}

flags! {
    /// Flags of time.
    pub struct TrackArgs {
        /// Time of the frame, seconds: position on the camera track, and time of everything else that moves. Without
        /// it: the first keyframe.
        #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, hide_short_help = true)]
        time: Option<f32> as Seconds,
        /// Renders a sequence, name.0001.png and so on. N: N frames, from the track's first keyframe to its last. A-B:
        /// the frames of these numbers, frame I at I / --fps seconds. A frame does not depend on which others are
        /// requested.
        #[arg(long, value_name = "N|A-B", allow_hyphen_values = true, hide_short_help = true)]
        frames: Option<Frames> as FrameNumbers,
        /// Renders a turntable: N frames, 360 / N degrees apart, once round the scene. The camera revolves about a
        /// vertical axis, counter-clockwise seen from above, and frame 1 is the image without this flag. The axis goes
        /// through --target, else through the middle of the scene, or in a closed interior through the camera. The
        /// lights of --light-rig revolve with the camera, all others stay. --frames A-B renders some of the frames.
        /// Frame I is at (I - 1) / --fps seconds; --time holds the scene still.
        #[arg(long, value_name = "N", allow_hyphen_values = true, hide_short_help = true)]
        orbit: Option<u32> as Orbit,
        /// Frames per second of --frames A-B and --orbit.
        #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 24.0, hide_short_help = true)]
        fps: f32 as Fps,
        /// The animation of the file to play, by name or index. It loops. Without it: the first, if a time or frames
        /// are requested.
        #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true, hide_short_help = true)]
        animation: Option<String> as Text,
        /// Skips frames whose files exist, are complete and have the requested size.
        #[arg(long, hide_short_help = true)]
        skip_existing: bool as Switch,
    }
}

impl TrackArgs {
    /// True if numbered images are requested.
    pub fn is_sequence(&self) -> bool {
        self.frames.is_some() || self.orbit.is_some()
    }
}

flags! {
    /// Flags of a run.
    pub struct RunArgs {
        /// The adapter: a part of its name, gpu or cpu.
        ///
        /// gpu is a graphics card, cpu a software adapter. Default: the most capable.
        #[arg(long, value_name = "NAME|gpu|cpu")]
        adapter: Option<AdapterChoice> as Adapter,
        /// Seed of --lights rain: positions and colours of the lights. The same seed gives the same image. Nothing else
        /// is random.
        #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true, hide_short_help = true)]
        seed: u32 as Seed,
        /// Prints the time and counters of each pass.
        #[arg(long)]
        timings: bool as Switch,
        /// Writes passes, counters, adapter, settings, time (s) and peak memory as JSON.
        #[arg(long, value_name = "FILE.json", hide_short_help = true)]
        report: Option<PathBuf> as Path,
        /// Prints only errors and the image's path.
        #[arg(short, long)]
        quiet: bool as Switch,
    }
}

/// The names of the built-in scenes on the command line.
pub(crate) fn demos() -> String {
    DEMOS.iter().map(|name| format!("demo:{name}")).collect::<Vec<_>>().join(", ")
}

/// The defaults of all flags.
impl Default for RenderArgs {
    fn default() -> Self {
        Self::of(["scene"]).expect("every flag is optional")
    }
}

impl RenderArgs {
    /// Parses words as the arguments of `lanternfish render`.
    pub fn of(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        let mut args = Self::from_arg_matches(&render_command().no_binary_name(true).try_get_matches_from(words)?)?;
        args.finish();
        Ok(args)
    }

    /// Tells the camera the size of the image, in whose pixels --intrinsics are.
    pub(crate) fn finish(&mut self) {
        if self.view.intrinsics.is_some() {
            self.view.size = [self.output.size.width, self.output.size.height];
        }
    }

    /// The requested output variables.
    pub(crate) fn quantities(&self) -> &[Quantity] {
        self.output.outputs.as_ref().map_or(&[], |quantities| &quantities.0)
    }

    /// The settings that are given.
    pub fn given(&self) -> GivenSettings {
        let of_light = self.lights.settings.0.clone().above(self.look.0.clone());
        self.indirect.0.clone().above(self.technique.0.clone().above(of_light))
    }

    /// Gives these settings, and no others.
    pub(crate) fn give(&mut self, given: &GivenSettings) {
        (self.lights.settings, self.look) = (LightFlags::of(given), LookArgs::of(given));
        (self.technique, self.indirect) = (TechniqueArgs::of(given), IndirectArgs::of(given));
    }

    /// The library's settings that these flags choose.
    pub fn settings(&self) -> Settings {
        self.settings_of(self.given().frames())
    }

    /// The same for an image that averages `frames` frames, instead of the count of `--accumulate`. A technique that is
    /// given has the effort of the preset.
    pub fn settings_of(&self, frames: u32) -> Settings {
        self.settings_with(&self.given(), frames)
    }

    /// The same with these settings instead of the given ones.
    pub(crate) fn settings_with(&self, given: &GivenSettings, frames: u32) -> Settings {
        let mut settings = given.techniques_over(self.quality, frames);
        if settings.indirect.is_some() {
            settings.structure = paper::structure(self.quality.quality());
        }
        given.set(&mut settings);
        settings.with_accumulate(frames)
    }

    /// Sampled direct light, with the parameters of these flags.
    pub fn sampled_direct(&self) -> Direct {
        let mut settings = Settings::default().with_direct(Direct::sampled());
        self.given().set(&mut settings);
        settings.direct
    }
}
