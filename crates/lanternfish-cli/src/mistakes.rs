//! Tips for arguments that other programs have, and for a file without a command.

#[cfg(test)]
mod tests;

use std::path::Path;

use clap::{
    Error,
    builder::StyledStr,
    error::{ContextKind, ContextValue, ErrorKind},
};

use crate::scene::SceneName;

/// Flags of other renderers and viewers, and removed ones, and what does the same here.
const ELSEWHERE: [(&str, &str); 34] = [
    ("--cluster-test", "leave it out: every light is tested against the cluster's planes and the box around it"),
    ("--width", "--size WIDTHxHEIGHT sets both sides"),
    ("--height", "--size WIDTHxHEIGHT sets both sides"),
    ("--resolution", "--size WIDTHxHEIGHT sets the image's size"),
    ("-s", "--size WIDTHxHEIGHT sets the image's size"),
    ("--spp", SAMPLES),
    ("--hdri", "--environment FILE.hdr|.exr lights the scene"),
    ("--env", "--environment FILE.hdr|.exr lights the scene"),
    ("--gpu", "--adapter gpu takes a graphics card"),
    ("--device", "--adapter NAME chooses the adapter"),
    ("--turntable", TURNTABLE),
    ("--turn", TURNTABLE),
    ("--orbit", "a shot holds it: `lanternfish shot SCENE --orbit N -o shot.toml`"),
    ("--samples-per-pixel", SAMPLES),
    ("--light", "--sun, --point and --environment add light; --light-rig studio|sun lights any scene"),
    ("--output-size", "--size WIDTHxHEIGHT sets the image's size"),
    ("--time-limit", "`lanternfish reference` traces until a --time-limit; --time is a moment of an animation"),
    ("--fov", "--fov-y DEGREES is the vertical field of view"),
    ("--frames", "`lanternfish frames SHOT A-B` takes the range without a flag"),
    ("--camera-position", EYE),
    ("--camera-pos", EYE),
    ("--camera-orbit", "--azimuth DEGREES and --elevation DEGREES turn the camera that frames the scene"),
    ("--animation-time", "--time SECONDS is the moment of an animation"),
    ("--no-env", "--light-rig none leaves the built-in lights out; without --environment there is no environment"),
    ("--bg", BACKGROUND),
    ("--background", "only `render` and `view` hide what is behind the scene; the path tracer shows the environment"),
    ("--background-color", BACKGROUND),
    ("--transparent", BACKGROUND),
    ("--alpha", BACKGROUND),
    ("--aov", "--outputs NAMES writes depth, normals and more beside the image"),
    ("--aovs", "--outputs NAMES writes depth, normals and more beside the image"),
    (
        "--denoiser",
        "indirect light is always denoised; --accumulate N averages frames, --quality best traces more rays",
    ),
    ("--threads", "only `lanternfish reference` traces on CPU threads; --adapter NAME chooses what renders"),
    ("-v", "--timings prints the time of each pass; --version the version"),
];

/// What is gone, or of other programs: the command that it was given to, the flag or command, and what to use instead.
const GONE: &[(&str, &str, &str)] = &[
    ("lanternfish", "turntable", "`lanternfish render SCENE --orbit N` renders N frames around the scene"),
    (
        "lanternfish",
        "deep-images",
        "`lanternfish-bench deep-images SCENE` writes the layers of a deep image, layers.png",
    ),
    #[cfg(not(feature = "window"))]
    ("lanternfish", "view", "a window needs the feature `window`, which this program was built without"),
    #[cfg(not(feature = "papers"))]
    ("lanternfish", "papers", NO_PAPERS),
    ("doctor", "--page", "--read FILE prints a report as a table"),
    ("doctor", "--size", FRAMES_ARE_TIMED),
    ("doctor", "--seconds", FRAMES_ARE_TIMED),
    ("doctor", "--commit", "the report states the program's version"),
    ("replay", "--compare", PAIR),
    ("replay", "--matters", PAIR),
    ("lanternfish-bench", "moving", "`lanternfish-bench walks` times frames in motion"),
    ("lanternfish-bench", "history", "`lanternfish-bench walks` has the step response of a history"),
    ("lanternfish-bench", "probes", "`lanternfish-bench walks` compares techniques in motion"),
];
const FRAMES_ARE_TIMED: &str = "`lanternfish-bench walks` times frames, with --size and --seconds";
const PAIR: &str = "`lanternfish replay SCENE --pair A B` times two sets of flags, or two folders of shaders, in turn";

/// Why a name of the papers is unknown.
pub(crate) const NO_PAPERS: &str =
    "the papers' techniques need the feature `papers`, which this program was built without";
/// Beginnings of the names of the papers' techniques, and of their parameters.
const OF_PAPERS: &str = "across- caustic- deep grid- hbao occlusion- photon raster-grid virtual-lights vpl- within-";

const AFTER_COMMAND: &str = "flags go after the command: lanternfish render SCENE FLAGS";
/// What shows image files.
pub(crate) const IMAGE_TOOLS: &str =
    "`lanternfish compare A B --map difference.png` compares two images; the system's viewer shows one";
const BACKGROUND: &str = "--background COLOR|transparent|environment is what is behind the scene";
const EYE: &str = "--eye X,Y,Z is the camera's position, and --target X,Y,Z the point that it looks at";
const TURNTABLE: &str = "--orbit N renders N frames around the scene";
const SAMPLES: &str = "--accumulate N averages N frames; --spp is of `reference`";

const JOINED: &str = "numbers of one flag are joined by commas: 1,2,3";

/// What does the same as a flag that is none here, or no longer.
pub(crate) fn tip(flag: &str) -> Option<&'static str> {
    let elsewhere = ELSEWHERE.iter().find(|(known, _)| *known == flag).map(|(_, tip)| *tip);
    elsewhere.or_else(|| missing(flag.trim_start_matches('-')))
}

/// Why the name of a technique or a parameter is unknown in a program without the papers.
pub(crate) fn missing(name: &str) -> Option<&'static str> {
    (cfg!(not(feature = "papers")) && is_of_papers(name)).then_some(NO_PAPERS)
}

fn is_of_papers(name: &str) -> bool {
    OF_PAPERS.split(' ').any(|begin| name.starts_with(begin))
}

/// Replaces clap's tip, to pass the argument as a value, by one that helps.
pub(crate) fn explain(error: &mut Error) {
    let argument = |kind| match error.get(kind) {
        Some(ContextValue::String(argument)) => Some(argument.clone()),
        _ => None,
    };
    let usage = error.get(ContextKind::Usage).map(ToString::to_string).unwrap_or_default();
    let gone = |name: &str| {
        let is_this =
            |(command, gone, _): &&(&str, &str, &str)| *gone == name && usage.contains(&format!(" {command} "));
        GONE.iter().find(is_this).map(|(.., tip)| *tip)
    };
    let tips = match error.kind() {
        ErrorKind::UnknownArgument => {
            let argument = argument(ContextKind::InvalidArg).unwrap_or_default();
            let known = gone(&argument).or(tip(&argument)).or(argument.parse::<f64>().is_ok().then_some(JOINED));
            // Before the command there are no flags but --help and --version.
            let known = match argument.starts_with("--") {
                true if usage.contains("COMMAND") => Some(AFTER_COMMAND),
                false if usage.contains(" view ") && !argument.starts_with('-') => {
                    let is_image = SceneName::from(&argument).image().is_some();
                    known.or(Some(if is_image { IMAGE_TOOLS } else { "the window shows one scene" }))
                }
                _ => known,
            };
            let known = known.map(str::to_owned);
            if known.is_none() && error.get(ContextKind::SuggestedArg).is_some() {
                return;
            }
            error.remove(ContextKind::SuggestedArg);
            known.into_iter().collect::<Vec<_>>()
        }
        ErrorKind::ValueValidation
            if argument(ContextKind::InvalidValue).is_some_and(|value| value.parse::<f64>().is_ok())
                && error.to_string().contains("numbers") =>
        {
            vec![JOINED.to_owned()]
        }
        ErrorKind::InvalidValue => {
            let [flag, value] =
                [ContextKind::InvalidArg, ContextKind::InvalidValue].map(|kind| argument(kind).unwrap_or_default());
            let tip = match flag.split(' ').next() {
                _ if missing(&value).is_some() => NO_PAPERS.to_owned(),
                Some("--samples") => format!("--samples is for edges; {SAMPLES}"),
                Some("--indirect") if value.starts_with("path") => {
                    "`lanternfish reference SCENE` is the path tracer".to_owned()
                }
                Some("--only") if value == "ab" => PAIR.to_owned(),
                _ => return,
            };
            error.remove(ContextKind::SuggestedValue);
            vec![tip]
        }
        ErrorKind::InvalidSubcommand => {
            let name = argument(ContextKind::InvalidSubcommand).unwrap_or_default();
            if let Some(tip) = gone(&name) {
                error.remove(ContextKind::SuggestedSubcommand);
                vec![tip.to_owned()]
            } else if !is_file(&name) {
                return;
            } else if SceneName::from(&name).image().is_some() {
                vec![format!("`lanternfish info {name}` prints how it was made"), IMAGE_TOOLS.to_owned()]
            } else {
                vec![
                    format!("`lanternfish view {name}` opens a window"),
                    format!("`lanternfish render {name}` writes an image"),
                ]
            }
        }
        _ => return,
    };
    error.remove(ContextKind::Suggested);
    if !tips.is_empty() {
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips.into_iter().map(StyledStr::from).collect()));
    }
}

/// True for a name with an ending or a folder, or of a built-in scene.
fn is_file(name: &str) -> bool {
    Path::new(name).extension().is_some() || name.contains(['/', '\\']) || name.starts_with("demo:")
}
