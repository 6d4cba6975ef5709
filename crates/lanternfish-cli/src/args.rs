//! The flags of `render`, some of which other commands share. Scripts use these names, so they are fixed.

mod light;
pub(crate) mod part;
pub(crate) mod settings;
mod shared;
#[cfg(test)]
mod tests;
mod track;
pub(crate) mod view;

use std::{ffi::OsString, path::PathBuf};

use clap::{ArgAction, ArgMatches, Args, Command, FromArgMatches, builder::TypedValueParser as _};
use glam::{Affine3A, Vec3};
use lanternfish::{
    direct_light::auto::AutoLights,
    settings::{Direct, GivenSettings, Preset, Settings},
};
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Camera, Eyes, Viewpoint, generate::DEMOS};

pub use self::{
    light::{EnvironmentSun, Ground, LightArgs},
    part::PartArgs,
    settings::{IndirectArgs, LightFlags, LookArgs, TechniqueArgs},
    shared::{Selection, SharedFlags},
    track::TrackArgs,
};
use crate::{
    choices::{choice, names},
    help,
    outputs::{self, Quantities, Quantity},
    paper::{self, Paper},
    parse::{self, PoseConvention, Size},
    progress::ToldTo,
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

/// All flags of `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// The scene.
    #[arg(help = format!("A glTF 2.0 file (.gltf, .glb), an OBJ file, a shot (.toml), or a built-in scene: {}", demos()))]
    pub scene: SceneName,

    /// The image and its size.
    #[command(flatten, next_help_heading = "Output")]
    pub output: OutputArgs,
    /// The scene of the file.
    #[command(flatten, next_help_heading = "View")]
    pub part: PartArgs,
    /// The camera.
    #[command(flatten, next_help_heading = "View")]
    pub view: ViewArgs,
    /// Mono or stereo.
    #[command(flatten, next_help_heading = "View")]
    pub stereo: StereoArgs,
    /// A single frame or a sequence.
    #[command(flatten, next_help_heading = "Track (and what moves)")]
    pub track: TrackArgs,
    /// Lights and environment.
    #[command(flatten, next_help_heading = "Lights (beside those of the file)")]
    pub lights: LightArgs,
    /// Exposure, tone map, debug view.
    #[command(flatten, next_help_heading = "Look")]
    pub look: LookArgs,
    /// Light culling, shadows, antialiasing.
    #[command(flatten, next_help_heading = "Technique")]
    pub technique: TechniqueArgs,
    /// A paper's technique for every stage of the frame.
    ///
    /// A stage that the paper lacks is off. --timings lists what is set, and the section that says so. Flags beside it
    /// override it.
    #[arg(id = "paper", long = "as", value_name = "PAPER", value_parser = paper::parser())]
    #[arg(help_heading = "Technique", hide_short_help = true)]
    pub paper: Option<Paper>,
    /// Preset.
    ///
    /// Sets the flags of light that are not given, and with draft --indirect probes; with realtime also
    /// --direct sampled, --history on and --antialiasing temporal.
    #[arg(long, value_name = "NAME", value_parser = choice::<Preset>(), default_value_t = Preset::default())]
    #[arg(help_heading = "Indirect (light)")]
    pub quality: Preset,
    /// Indirect light and occlusion.
    #[command(flatten, next_help_heading = "Indirect (light)")]
    pub indirect: IndirectArgs,
    /// The adapter and the console output.
    #[command(flatten, next_help_heading = "Run")]
    pub run: RunArgs,
}

/// The command `render` alone.
pub(crate) fn render_command() -> Command {
    let command =
        Command::new("render").bin_name("lanternfish render").disable_help_flag(true).arg(help::flag("lanternfish"));
    RenderArgs::augment_args(command).args_override_self(true)
}

/// The flags of `render`; `help render` describes them.
#[derive(Debug)]
pub(crate) struct ShotArgs(pub RenderArgs);

impl Args for ShotArgs {
    fn augment_args(command: Command) -> Command {
        RenderArgs::augment_args(command).mut_args(|arg| if arg.is_positional() { arg } else { arg.hide(true) })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ShotArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        RenderArgs::from_arg_matches(matches).map(Self)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.0.update_from_arg_matches(matches)
    }
}

/// Flags of the image.
#[derive(Debug, Args)]
pub struct OutputArgs {
    /// The image: .png or .jpg (tone-mapped) or .exr (linear).
    ///
    /// Its ending chooses the format: .png or .jpg (tone-mapped), .exr (linear, scene-referred, half floats) or .npz
    /// (the same as an array for NumPy); .gif holds all frames of a sequence. Without it: the name of the scene or shot
    /// with .png, in the current folder. -o - writes a PNG image to standard output.
    #[arg(short, long = "output", value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Width and height of the image, pixels.
    ///
    /// Each is from 1 to 16384.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse::size)]
    #[arg(allow_hyphen_values = true)]
    pub size: Size,
    /// What the surface at each pixel's centre is, for data sets and compositing: some of depth, distance, position,
    /// normal, albedo, motion, instance, material, semantic, separated by commas. An .exr or .npz file has them beside
    /// the image; a .png has a file for each, image.depth.png. docs/outputs.md has units and spaces.
    #[arg(long, value_name = "NAMES", value_parser = outputs::quantities, hide_short_help = true)]
    pub outputs: Option<Quantities>,
    /// Classes of --outputs semantic, by names of nodes: JSON such as {"chair*": 3, "floor": 1}. * stands for any text;
    /// the longest pattern counts. Without it, and for other nodes: `extras.semantic` of the glTF node or its nearest
    /// ancestor.
    #[arg(long, value_name = "FILE.json", hide_short_help = true)]
    pub classes: Option<PathBuf>,
    /// Whether the colour scale of a --debug-view is below the image: off keeps the image at --size.
    #[arg(long, value_name = "on|off", default_value = "on", action = ArgAction::Set, hide_short_help = true)]
    #[arg(value_parser = names([("on", "Below the image"), ("off", "No scale")]).map(|name| name == "on"))]
    pub legend: bool,
    /// Opens the image in the system's viewer when it is ready.
    ///
    /// Of a sequence, the last frame.
    #[arg(long)]
    pub open: bool,
}

/// Flags of the camera.
#[derive(Clone, Debug, Default, PartialEq, Args)]
pub struct ViewArgs {
    /// Camera position, world space, m.
    ///
    /// Without --target the camera keeps its direction.
    #[arg(long, value_name = "x,y,z", value_parser = parse::position, allow_hyphen_values = true)]
    pub eye: Option<Vec3>,
    /// Point that the camera looks at, world space, m.
    #[arg(long, value_name = "x,y,z", value_parser = parse::position, allow_hyphen_values = true)]
    pub target: Option<Vec3>,
    /// Vertical field of view, degrees.
    ///
    /// Without it: that of the camera, or 45.
    #[arg(long, value_name = "DEG", value_parser = parse::fov_y, allow_hyphen_values = true)]
    pub fov_y: Option<f32>,
    /// A camera of the file, by name or index.
    ///
    /// `lanternfish info` lists them. Without it: the first camera of the file. A file without cameras is framed from
    /// the front, a little from the right and above; a closed interior is seen from inside.
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub camera: Option<String>,
    /// Frames the complete scene from one side, without the file's cameras.
    ///
    /// The scene's bounding box fills 80 % of the tighter side of the image.
    #[arg(long, value_name = "SIDE", value_parser = choice::<Viewpoint>())]
    #[arg(conflicts_with_all = ["eye", "target", "camera"])]
    pub view: Option<Viewpoint>,
    /// Focal lengths and principal point of the camera, pixels of --size: x right and y down from the image's top left
    /// corner, so that the centre of the first pixel is at 0.5,0.5. Add 0.5 to cx and cy of a calibration that has it
    /// at 0,0.
    #[arg(long, value_name = "fx,fy,cx,cy", value_parser = parse::intrinsics, allow_hyphen_values = true)]
    #[arg(conflicts_with = "fov_y", hide_short_help = true)]
    pub intrinsics: Option<[f32; 4]>,
    /// Camera to world: the 16 numbers of a 4 x 4 matrix row by row, separated by commas, or a text file that has them
    /// (in a shot, too, relative to the current folder). A rotation and a translation, m.
    #[arg(long, value_name = "FILE|NUMBERS", value_parser = parse::pose, allow_hyphen_values = true)]
    #[arg(conflicts_with_all = ["eye", "target", "view", "azimuth", "elevation"], hide_short_help = true)]
    pub pose: Option<Affine3A>,
    /// Axes of the camera of --pose.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = PoseConvention::default(), hide_short_help = true)]
    pub pose_convention: PoseConvention,
    /// Size of the image, pixels, if there are --intrinsics.
    #[arg(skip)]
    pub size: [u32; 2],
    /// Frames the complete scene from this angle about its vertical axis, degrees.
    ///
    /// From the front (0), counter-clockwise seen from above: 90 is its right side. Without it: 22, a little from the
    /// right.
    #[arg(long, value_name = "DEG", value_parser = parse::rotation, allow_hyphen_values = true, hide_short_help = true)]
    #[arg(conflicts_with_all = ["eye", "target", "camera", "view"])]
    pub azimuth: Option<f32>,
    /// Frames the complete scene from this angle above its middle, degrees.
    ///
    /// Without it: 16, a little from above.
    #[arg(long, value_name = "DEG", value_parser = parse::elevation, allow_hyphen_values = true, hide_short_help = true)]
    #[arg(conflicts_with_all = ["eye", "target", "camera", "view"])]
    pub elevation: Option<f32>,
    /// Angle about the axis of `--orbit`, radians, counter-clockwise seen from above; in [0, 2π).
    #[arg(skip)]
    pub orbit_angle: f32,
    /// A recorded camera, in place of those of the file.
    #[arg(skip)]
    pub recorded: Option<Camera>,
}

impl ViewArgs {
    /// True if angles choose the direction from which the scene is framed.
    pub fn is_turned(&self) -> bool {
        self.azimuth.is_some() || self.elevation.is_some()
    }
}

/// Flags of stereo images.
#[derive(Debug, Args)]
pub struct StereoArgs {
    /// Renders in stereo: vive (HTC Vive), parallel (0.063 m apart) or parallel:METRES (both eyes have the camera's
    /// direction), or l,r,b,t,METRES with ,DEGREES for canted eyes: slopes of the left eye's frustum sides, mirrored
    /// for the right eye, distance between the eyes, and outward rotation of each eye. --size is that of one eye.
    #[arg(long, value_name = "EYES", value_parser = crate::stereo::eyes, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub stereo: Option<Eyes>,
    /// Layout of the two eyes' images in one file.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = StereoLayout::default(), hide_short_help = true)]
    pub stereo_layout: StereoLayout,
}

/// Flags of a run.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The adapter: a part of its name, gpu or cpu.
    ///
    /// gpu is a graphics card, cpu a software adapter. Default: the most capable.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    /// Seed of --lights rain: positions and colours of the lights. The same seed gives the same image. Nothing else is
    /// random.
    #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true, hide_short_help = true)]
    pub seed: u32,
    /// Prints the time and counters of each pass.
    #[arg(long)]
    pub timings: bool,
    /// Writes passes, counters, adapter, settings, time (s) and peak memory as JSON.
    #[arg(long, value_name = "FILE.json", hide_short_help = true)]
    pub report: Option<PathBuf>,
    /// Prints only errors and the image's path.
    #[arg(short, long)]
    pub quiet: bool,
    /// Reports the progress of a sequence to a render farm, on standard output, frame by frame.
    #[arg(long, value_name = "NAME", value_enum, hide_short_help = true)]
    pub progress: Option<ToldTo>,
}

/// The names of the built-in scenes on the command line.
pub(crate) fn demos() -> String {
    DEMOS.iter().map(|name| format!("demo:{name}")).collect::<Vec<_>>().join(", ")
}

/// Reads `cpu`, `gpu` or a part of an adapter's name.
pub fn adapter(text: &str) -> Result<AdapterChoice, String> {
    match text {
        "" => Err("expected a part of an adapter's name, gpu or cpu".to_owned()),
        "cpu" => Ok(AdapterChoice::Cpu),
        "gpu" => Ok(AdapterChoice::Hardware),
        name => Ok(AdapterChoice::Name(name.to_owned())),
    }
}

impl RenderArgs {
    /// Parses words as the arguments of `lanternfish render`.
    pub fn of(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        let mut args = Self::from_arg_matches(&render_command().no_binary_name(true).try_get_matches_from(words)?)?;
        if args.view.intrinsics.is_some() {
            args.view.size = [args.output.size.width, args.output.size.height];
        }
        Ok(args)
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

    /// The technique that follows the number of lights, with the parameters of these flags.
    pub fn automatic_direct(&self) -> Direct {
        let mut settings = Settings::default().with_direct(AutoLights::default());
        self.given().set(&mut settings);
        settings.direct
    }
}
