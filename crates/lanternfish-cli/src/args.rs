//! The flags. Their names are fixed: scripts call them.

mod indirect;
mod light;
mod look;
mod parameters;
mod technique;
#[cfg(test)]
mod tests;
mod track;

use std::path::PathBuf;

use clap::{ArgMatches, Args, FromArgMatches, Parser, Subcommand, builder::NonEmptyStringValueParser};
use glam::Vec3;
use lanternfish::settings::Settings;
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Eyes, Viewpoint, generate::DEMOS};

use self::indirect::IndirectArgs;
pub use self::{light::LightArgs, look::LookArgs, technique::TechniqueArgs, track::TrackArgs};
use crate::{
    bench::BenchArgs,
    choices::choice,
    compare::{self, CompareArgs},
    deep_images::{self, DeepImagesArgs},
    doctor::{self, DoctorArgs},
    farm::{self, FarmArgs},
    frames::{self, FramesArgs},
    help::{self, HelpArgs},
    parse::{self, Size},
    progress::ToldTo,
    reference::{self, MergeArgs, ReferenceArgs},
    replay::{self, ReplayArgs},
    scene::SceneName,
    shot,
    stereo::StereoLayout,
    window,
};

const EXAMPLES: &str = "\
Examples:
  lanternfish render demo:atrium --lights rain:1000 -o atrium.png
  lanternfish render scene.glb --view iso --sun 0.3,-1,-0.6,3 --exposure 1 -o scene.png
  lanternfish info scene.glb

`lanternfish help render` shows the flags of every day, `lanternfish help render --all` every flag.";

/// After the flags of every day.
const RENDER_SHORT: &str = "\
Examples:
  lanternfish render demo:atrium --lights rain:1000 -o atrium.png
  lanternfish render scene.glb --eye 6,2,-1 --target -4,3,0 --sun 0.3,-1,-0.6,3 --exposure 1

Units: metres, degrees, candela, lux. +y is up. The last line of output is the picture's path.
`lanternfish help render --all` shows every flag, and what each value means.";

const RENDER_EXAMPLES: &str = "\
Examples:
  A built-in scene with a thousand lights, and what each pass cost:
    lanternfish render demo:atrium --lights rain:1000 --timings -o atrium.png
  Your scene from where you want to stand, in the sun:
    lanternfish render scene.glb --eye 6,2,-1 --target -4,3,0 --fov-y 60 --sun 0.3,-1,-0.6,3
  A warm lamp of 100 cd that reaches 5 m, and a cold one:
    lanternfish render scene.glb --point 0,2.5,0,100,1,0.9,0.7,5 --point 3,2,1,80,0.6,0.8,1
  A panel of 1.2 x 0.3 m and 2,000 nits that faces down:
    lanternfish render scene.glb --rectangle 0,2.5,0,0,-1,0,1.2,0.3,2000
  Linear radiance for further work:
    lanternfish render scene.glb -o scene.exr
  How many lights each pixel looks at:
    lanternfish render demo:atrium --lights rain:1000 --debug-view light-count -o lights.png
  All flags in a file, and a flag that goes before the file's:
    lanternfish shot scene.glb --sun 0.3,-1,-0.6,3 > shot.toml
    lanternfish render shot.toml --exposure 1

Units: metres, degrees, candela, lux. +y is up.
The last line of standard output is the picture's path.";

/// Renders scenes with thousands of lights and ray-traced shadows, on any GPU, or none.
#[derive(Debug, Parser)]
#[command(name = "lanternfish", version, after_help = EXAMPLES, max_term_width = 100, arg_required_else_help = true)]
#[command(disable_help_flag = true, disable_help_subcommand = true, arg = help::flag())]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub trust: TrustArgs,
}

/// What a run may read and take. For every subcommand, and for the command line alone: no shot decides it.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Files from strangers")]
pub struct TrustArgs {
    /// Reads nothing outside the scene's folder, whatever the scene names and wherever links lead. (Without it a scene may
    /// name any file that you can read.) What the command line and a shot name is read all the same.
    #[arg(long, global = true, hide_short_help = true)]
    pub confine: bool,
    /// Most memory to take, in bytes or as 500M, 4G: what needs more ends with an error that says how much. Without it: what
    /// the machine has free.
    #[arg(long, global = true, value_name = "BYTES", value_parser = parse::bytes, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub memory_limit: Option<u64>,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Renders a scene to a PNG or EXR file.
    ///
    /// A flag that is repeated counts as it was said last; --point, --disk and --rectangle add a light each time.
    // `cargo xtask demo FLAGS` puts FLAGS after its own.
    #[command(after_help = RENDER_SHORT, after_long_help = RENDER_EXAMPLES, args_override_self = true)]
    Render(Box<RenderArgs>),
    /// Opens a window on a scene: fly through it, change every setting, see what each pass costs.
    ///
    /// Takes the flags of `render`; without a scene it shows the built-in atrium.
    #[command(after_help = window::HELP, args_override_self = true)]
    #[command(
        override_usage = "lanternfish view [--record TRACK.toml] [--shaders FOLDER] [OPTIONS OF render] [SCENE]\n       \
        lanternfish view PICTURE [PICTURE...]"
    )]
    View(Box<WindowArgs>),
    /// Prints a shot: a file that renders what these flags render, with every flag as a key.
    ///
    /// Takes the flags of `render`. A path is written as it is given, and is read relative to the shot's folder.
    #[command(after_help = shot::HELP, args_override_self = true)]
    #[command(override_usage = "lanternfish shot [OPTIONS OF render] <SCENE>")]
    Shot(Box<ShotArgs>),
    /// Says which frames of a sequence are there and whole, and names the others.
    ///
    /// Every pixel is decoded, and sizes are compared with what is asked for. Exits with 0 if all are whole, else with 1.
    #[command(after_help = frames::HELP, args_override_self = true)]
    Frames(Box<FramesArgs>),
    /// Writes a job that renders a sequence on many machines, for Open Job Description.
    ///
    /// The job renders chunks of frames, in any order and at once, and verifies them with `lanternfish frames`.
    #[command(after_help = farm::HELP)]
    Farm(FarmArgs),
    /// Traces every path light takes, on the processor: the ground truth of a picture.
    ///
    /// Takes what `render` takes. What a shot says of culling, shadows and the like has no meaning here and is left aside, as
    /// is the shot's output.
    #[command(after_help = reference::HELP, args_override_self = true)]
    Reference(Box<ReferenceArgs>),
    /// Adds up parts of one ground truth, traced on many machines: the same file as traced at once.
    #[command(after_help = reference::merge::HELP)]
    Merge(MergeArgs),
    /// Checks this machine: which adapters and techniques it has, whether images are right, how fast it is.
    ///
    /// Renders small built-in scenes by every technique and compares them with a path tracer on the processor; times rays, sorting and
    /// the passes of a fixed frame. Takes three minutes at most without a graphics card, 40 seconds with --quick.
    #[command(after_help = doctor::HELP)]
    Doctor(DoctorArgs),
    /// Prints what a scene holds, or which adapters can render it.
    Info(InfoArgs),
    /// Says how two pictures differ: in numbers, in a picture, and by its exit code.
    ///
    /// A is the picture under test, B the reference.
    #[command(after_help = compare::HELP)]
    Compare(Box<CompareArgs>),
    /// Plays a camera track frame by frame: what every pass takes, what every frame counts, and what became slower.
    ///
    /// Takes the flags of `render`. Times are of --runs equal runs, in which nothing is read back; counts and pictures' hashes are of
    /// one run of their own. Writes report.html with plots, report.json, passes.csv and counts.csv.
    #[command(after_help = replay::HELP, args_override_self = true)]
    Replay(Box<ReplayArgs>),
    /// Shows the scene as sorted rays: deep images as points in the scene, by layers, or by how many surfaces each texel holds.
    ///
    /// Takes the camera of `render`. What a shot says of lights, look and technique has no meaning here and is left aside, as is
    /// the shot's output.
    #[command(after_help = deep_images::HELP, args_override_self = true)]
    DeepImages(Box<DeepImagesArgs>),
    /// Repeats the tables of the papers this renderer is built from.
    Bench(BenchArgs),
    /// Prints this, or the help of a command.
    Help(HelpArgs),
}

#[derive(Debug, Args)]
pub struct InfoArgs {
    #[arg(help = format!("A glTF 2.0 file (.gltf, .glb), an OBJ file, or a built-in scene: {}", demos()))]
    #[arg(required_unless_present = "adapters")]
    pub scene: Option<SceneName>,
    #[command(flatten)]
    pub part: PartArgs,
    /// Lists the adapters of this machine: name, driver, and which optional features they have.
    #[arg(long)]
    pub adapters: bool,
}

#[derive(Debug, Args)]
pub struct RenderArgs {
    #[arg(help = format!("A glTF 2.0 file (.gltf, .glb), an OBJ file, a shot (.toml), or a built-in scene: {}", demos()))]
    pub scene: SceneName,

    #[command(flatten, next_help_heading = "Output")]
    pub output: OutputArgs,
    #[command(flatten, next_help_heading = "View")]
    pub part: PartArgs,
    #[command(flatten, next_help_heading = "View")]
    pub view: ViewArgs,
    #[command(flatten, next_help_heading = "View")]
    pub stereo: StereoArgs,
    #[command(flatten, next_help_heading = "Track (and what moves)")]
    pub track: TrackArgs,
    #[command(flatten, next_help_heading = "Lights (beside those of the file)")]
    pub lights: LightArgs,
    #[command(flatten, next_help_heading = "Look")]
    pub look: LookArgs,
    #[command(flatten, next_help_heading = "Technique")]
    pub technique: TechniqueArgs,
    #[command(flatten, next_help_heading = "Indirect (light)")]
    pub indirect: IndirectArgs,
    #[command(flatten, next_help_heading = "Run")]
    pub run: RunArgs,
}

/// The flags of `render`, which `help render` tells of.
#[derive(Debug)]
pub struct ShotArgs(pub RenderArgs);

impl Args for ShotArgs {
    fn augment_args(command: clap::Command) -> clap::Command {
        RenderArgs::augment_args(command).mut_args(|arg| if arg.is_positional() { arg } else { arg.hide(true) })
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
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

/// The flags of `render`, a scene where none is named, and what the window alone does.
#[derive(Debug)]
pub struct WindowArgs {
    pub render: RenderArgs,
    pub window: OnlyWindowArgs,
}

#[derive(Debug, Args)]
pub struct OnlyWindowArgs {
    /// More pictures, where the first file is one (.exr, .png): they are compared.
    #[arg(value_name = "PICTURE", index = 2)]
    pub pictures: Vec<PathBuf>,
    /// Keeps what is done to the camera, step by step, for `lanternfish replay`. The file is written when the window is closed.
    #[arg(long, value_name = "TRACK.toml")]
    pub record: Option<PathBuf>,
    /// Renders with the shaders below this folder, the library's `src`, and reads them again when they are saved. One that does not
    /// compile changes nothing but the line below the picture.
    #[arg(long, value_name = "FOLDER")]
    pub shaders: Option<PathBuf>,
}

impl Args for WindowArgs {
    fn augment_args(command: clap::Command) -> clap::Command {
        let command = OnlyWindowArgs::augment_args(ShotArgs::augment_args(command));
        command.mut_arg("scene", |scene| scene.required(false).default_value(window::FIRST).index(1))
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for WindowArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let (render, window) = (RenderArgs::from_arg_matches(matches)?, OnlyWindowArgs::from_arg_matches(matches)?);
        Ok(Self { render, window })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.render.update_from_arg_matches(matches)?;
        self.window.update_from_arg_matches(matches)
    }
}

#[derive(Debug, Args)]
pub struct OutputArgs {
    /// The picture: .png (tone-mapped) or .exr (linear).
    ///
    /// Its ending chooses the format: .png (tone-mapped) or .exr (linear, scene-referred, half floats). Without it: the scene's
    /// (or shot's) name with .png, in the current folder.
    #[arg(short, long = "output", value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Width and height of the picture, pixels.
    ///
    /// Each is from 1 to 16384.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse::size)]
    #[arg(allow_hyphen_values = true)]
    pub size: Size,
    /// Shows the picture in a window once it is there; of a sequence, the last one.
    #[arg(long)]
    pub open: bool,
}

#[derive(Debug, Args)]
pub struct PartArgs {
    /// A scene of the file, by name or by its number. Without it: the one that the file opens with.
    #[arg(long = "scene", value_name = "NAME|INDEX", value_parser = NonEmptyStringValueParser::new())]
    #[arg(allow_hyphen_values = true, hide_short_help = true)]
    pub scene_of_file: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Args)]
pub struct ViewArgs {
    /// Where the camera is, world space, m.
    ///
    /// Without --target it looks the way it did.
    #[arg(long, value_name = "x,y,z", value_parser = parse::position, allow_hyphen_values = true)]
    pub eye: Option<Vec3>,
    /// What the camera looks at, world space, m.
    #[arg(long, value_name = "x,y,z", value_parser = parse::position, allow_hyphen_values = true)]
    pub target: Option<Vec3>,
    /// Vertical angle of view, degrees.
    ///
    /// Without it: the camera's, or 45.
    #[arg(long, value_name = "DEG", value_parser = parse::fov_y, allow_hyphen_values = true)]
    pub fov_y: Option<f32>,
    /// A camera of the file, by name or by number.
    ///
    /// `lanternfish info` lists them. Without it: the first of the file, or one that sees the whole scene from the front, a
    /// little from the right and above; a closed interior, from inside.
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub camera: Option<String>,
    /// Looks at the whole scene from one side, in place of the file's cameras.
    ///
    /// What is placed takes 80 % of the tighter side of the picture.
    #[arg(long, value_name = "SIDE", value_parser = choice::<Viewpoint>())]
    #[arg(conflicts_with_all = ["eye", "target", "camera"])]
    pub view: Option<Viewpoint>,
}

#[derive(Debug, Args)]
pub struct StereoArgs {
    /// Renders for two eyes: vive (HTC Vive), parallel or parallel:METRES (both see what the camera sees), or
    /// l,r,b,t,METRES with ,DEGREES if they are turned:
    /// slopes of the left eye's sides, mirrored for the right one, the distance of the eyes, and how far each is turned out.
    /// --size is that of one eye.
    #[arg(long, value_name = "EYES", value_parser = crate::stereo::eyes, allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    pub stereo: Option<Eyes>,
    /// How the two eyes' pictures become one file.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = StereoLayout::default(), hide_short_help = true)]
    pub stereo_layout: StereoLayout,
}

#[derive(Debug, Args)]
pub struct RunArgs {
    /// The adapter to render on: a part of its name, gpu or cpu.
    ///
    /// gpu is a graphics card, cpu a software adapter. Without it: the most capable.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    /// Where the rain of --lights falls: another seed, other places and colours; the same seed, the same picture.
    /// Nothing else is random.
    #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true, hide_short_help = true)]
    pub seed: u32,
    /// Prints what each pass cost, and what it counted.
    #[arg(long)]
    pub timings: bool,
    /// Writes passes, counters, adapter, settings, seconds and peak memory as JSON.
    #[arg(long, value_name = "FILE.json", hide_short_help = true)]
    pub report: Option<PathBuf>,
    /// Says nothing but errors and the picture's path.
    #[arg(short, long)]
    pub quiet: bool,
    /// Tells a farm how far a sequence is, on standard output, frame by frame.
    #[arg(long, value_name = "NAME", value_enum, hide_short_help = true)]
    pub progress: Option<ToldTo>,
}

/// The built-in scenes as they are named on the command line.
pub fn demos() -> String {
    DEMOS.iter().map(|name| format!("demo:{name}")).collect::<Vec<_>>().join(", ")
}

pub fn adapter(text: &str) -> Result<AdapterChoice, String> {
    match text {
        "" => Err("expected a part of an adapter's name, gpu or cpu".to_owned()),
        "cpu" => Ok(AdapterChoice::Cpu),
        "gpu" => Ok(AdapterChoice::Hardware),
        name => Ok(AdapterChoice::Name(name.to_owned())),
    }
}

impl RenderArgs {
    /// The library's settings as these flags choose them.
    pub fn settings(&self) -> Settings {
        self.settings_of(self.technique.accumulate)
    }

    /// The same where a picture is the mean of so many frames, whatever `--accumulate` says.
    pub fn settings_of(&self, frames: u32) -> Settings {
        let technique = &self.technique;
        Settings {
            culling: technique.culling(),
            shadows: technique.shadows,
            ray_culling: technique.ray_culling,
            light_radius: self.lights.light_radius,
            shadow_rays: technique.shadow_rays,
            history: technique.history,
            occlusion: self.indirect.occlusion(),
            attenuation: self.lights.attenuation,
            range_threshold: self.lights.range_threshold,
            materials: self.look.materials,
            exposure: self.look.exposure,
            tone_map: self.look.tone_map,
            debug_view: self.look.debug_view,
            textures: technique.textures,
            anisotropy: self.look.anisotropy,
            samples: technique.samples.unwrap_or(self.indirect.samples(frames)),
            indirect: self.indirect.indirect(),
            deep_images: self.indirect.deep_images(),
            accumulate: frames,
        }
    }
}
