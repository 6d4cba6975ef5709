//! `lanternfish frames`: lists the complete, broken and missing frames of a sequence.

use clap::{Arg, ArgMatches, Args};
use rayon::prelude::*;

use crate::{
    args::{Selection, SharedFlags, demos},
    error::CliError,
    output::{self, Output},
    parse::{self, Span},
    render::existing::{Expected, Fault},
    scene::SceneName,
    shot,
};

pub const HELP: &str = "\
Examples:
  Check whether a sequence is complete:
    lanternfish frames shot.toml 1-240
  Render only the missing frames:
    lanternfish render shot.toml --frames 1-240 --skip-existing

Each frame that is missing or broken is a line of standard output; the last line counts those that
are complete.";

#[derive(Debug, Args)]
pub struct FramesArgs {
    #[arg(help = format!("The scene or shot of the frames, as for `render`: a file, or {}", demos()))]
    pub scene: SceneName,
    /// Frame range: A-B, or one frame.
    #[arg(value_name = "A-B", value_parser = parse::span)]
    pub wanted: Span<u32>,
    #[command(flatten)]
    pub shared: SharedFlags<ImageArgs>,
}

/// The flags of `render` that set an image's file and size.
#[derive(Debug)]
pub struct ImageArgs;

/// The ids of these flags.
const SHARED: [&str; 7] = ["output", "outputs", "legend", "size", "stereo", "stereo_layout", "debug_view"];

impl Selection for ImageArgs {
    fn flag(flag: &Arg) -> Option<Arg> {
        SHARED.contains(&flag.get_id().as_str()).then(|| flag.clone())
    }
}

/// Prints the broken and missing frames. Returns the exit code: 0 if all frames are complete.
pub fn run(args: &FramesArgs, matches: &ArgMatches) -> Result<u8, CliError> {
    let shot = shot::resolve(&args.scene, matches)?;
    let flags = &shot.args;
    let output = Output::named(flags.output.output.as_deref(), &flags.scene)?;
    let (expected, wanted) = (Expected::of(flags), args.wanted);
    let numbers: Vec<u32> = (wanted.first..=wanted.last).collect();
    let faults: Vec<_> = numbers
        .par_iter()
        .filter_map(|number| {
            let rendering = output.numbered(*number);
            expected.fault(&rendering).map(|fault| (*number, rendering.path, fault))
        })
        .collect();
    let mut text = String::new();
    for (_, path, fault) in &faults {
        text += &match fault {
            Fault::Missing => format!("missing  {}\n", path.display()),
            Fault::Broken(why) => format!("broken   {why}\n"),
        };
    }
    text += &format!("{} of {} frames are complete", numbers.len() - faults.len(), numbers.len());
    let others: Vec<_> = faults.iter().map(|(number, ..)| *number).collect();
    if !others.is_empty() {
        text += &format!("; still to do: {}", spans(&others));
    }
    output::print(&(text + "\n"))?;
    Ok(u8::from(!faults.is_empty()))
}

/// Formats ascending numbers as ranges: `1-3, 7`.
fn spans(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let spans = runs.map(|run| match run {
        [alone] => alone.to_string(),
        _ => format!("{}-{}", run[0], run[run.len() - 1]),
    });
    spans.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use lanternfish_metrics::{ColorType, RgbImage, write_exr, write_png};

    use super::*;
    use crate::testing::Place;

    #[test]
    fn consecutive_numbers_form_ranges() {
        assert_eq!(spans(&[1, 2, 3, 7, 9, 10]), "1-3, 7, 9-10");
        assert_eq!(spans(&[0]), "0");
    }

    #[test]
    fn complete_frames_have_the_size_and_the_eyes_of_the_shot() {
        let place = Place::with(&[(
            "walk.toml",
            "scene = \"demo:cornell\"\n[output]\noutput = \"walk.png\"\nsize = [64, 36]\n",
        )]);
        write_png(&place.path("walk.0002.png"), [64, 36], ColorType::Rgb, &[7; 64 * 36 * 3]).unwrap();
        let exr = RgbImage::new(64, 36, vec![[0.5; 3]; 64 * 36]).unwrap();
        write_exr(&place.path("walk.0007.exr"), &exr).unwrap();
        for (words, code) in [
            ("2", 0),
            ("1-3", 1),
            // Flags override the shot's keys.
            ("2-2 --size 128x72", 1),
            ("2 -o %other.png", 1),
            // Two eyes are twice as wide, or have a layer each.
            ("2 --stereo vive", 1),
            ("7 -o %walk.exr", 0),
            ("7 -o %walk.exr --stereo vive --stereo-layout layers", 1),
        ] {
            assert_eq!(place.run(&format!("frames %walk.toml {words}")), Ok(code), "{words}");
        }
    }
}
