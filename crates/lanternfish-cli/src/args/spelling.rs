//! How values of flags are spelled, on the command line and in a shot.

use std::{
    ffi::{OsStr, OsString},
    path::PathBuf,
    str::FromStr,
};

use clap::builder::{NonEmptyStringValueParser, TypedValueParser as _, ValueParser};
use glam::{Affine3A, Mat4, Vec3};
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Eyes, Light, Named};

use crate::{
    choices::{choice, names},
    outputs::{self, Quantities},
    parse::{self, Frames, LightSet, Size},
    stereo,
};

/// How a shot states a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// `true` or `false`, a number, or a list of numbers, which this character separates on the command line. Other
    /// texts are strings.
    Numbers(char),
    /// A string.
    Text,
    /// A string: a path, relative to the shot's folder.
    Path,
}

/// A spelling of values of one type.
pub(crate) trait Spelling: 'static {
    type Value: Clone + Send + Sync + 'static;
    const FORM: Form = Form::Numbers(',');

    /// Reads a value, or says what is expected.
    fn read(text: &OsStr) -> Result<Self::Value, String>;

    /// The text of which [`Self::read`] makes the same value, to the bit.
    fn text(value: &Self::Value) -> OsString;

    /// The parser of the flag.
    fn parser() -> ValueParser {
        ValueParser::new(|text: &str| Self::read(text.as_ref()))
    }
}

/// Declares spellings: `Name: Type [form; parser] = read, text;`, without a form and a parser where they are the usual ones.
macro_rules! spellings {
    ($($Name:ident: $Value:ty $([$form:expr $(; $parser:expr)?])? = $read:expr, $text:expr;)+) => { $(
        pub(crate) struct $Name;

        impl Spelling for $Name {
            type Value = $Value;
            $(const FORM: Form = $form;)?

            fn read(text: &OsStr) -> Result<$Value, String> {
                $read(text.to_str().ok_or("expected UTF-8")?)
            }

            fn text(value: &$Value) -> OsString {
                let text: fn(&$Value) -> String = $text;
                text(value).into()
            }

            $($(fn parser() -> ValueParser {
                $parser.into()
            })?)?
        }
    )+ };
}

spellings! {
    Switch: bool [Form::Numbers(','); ValueParser::bool()] = switch, bool::to_string;
    Legend: bool [Form::Text; names([("on", "Below the image"), ("off", "No scale")]).map(|name| name == "on")] = switch,
        |on| if *on { "on" } else { "off" }.to_owned();
    Text: String [Form::Text; NonEmptyStringValueParser::new()] =
        |text: &str| (!text.is_empty()).then(|| text.to_owned()).ok_or("expected a name".to_owned()), String::clone;
    PixelSize: Size [Form::Numbers('x')] = parse::size, |size| format!("{}x{}", size.width, size.height);
    Outputs: Quantities [Form::Text] = outputs::quantities,
        |outputs| outputs.0.iter().map(|quantity| quantity.name()).collect::<Vec<_>>().join(",");
    Adapter: AdapterChoice [Form::Text] = parse::adapter, |adapter| match adapter {
        AdapterChoice::Auto => String::new(),
        AdapterChoice::Cpu => "cpu".to_owned(),
        AdapterChoice::Hardware => "gpu".to_owned(),
        AdapterChoice::Name(name) => name.clone(),
    };
    Position: Vec3 = parse::position, |position| parse::list(&position.to_array());
    FovY: f32 = parse::fov_y, |angle| parse::degrees(*angle);
    Rotation: f32 = parse::rotation, f32::to_string;
    Elevation: f32 = parse::elevation, f32::to_string;
    Intrinsics: [f32; 4] = parse::intrinsics, |values| parse::list(values);
    Pose: Affine3A = parse::pose, |pose| parse::list(&Mat4::from(*pose).transpose().to_cols_array());
    Stereo: Eyes = stereo::eyes, |eyes| stereo::text(*eyes);
    Seconds: f32 = parse::time, f32::to_string;
    FrameNumbers: Frames = parse::frames, |frames| match frames {
        Frames::Count(count) => count.to_string(),
        Frames::Span(span) => span.to_string(),
    };
    Orbit: u32 = parse::orbit, u32::to_string;
    Fps: f32 = parse::fps, f32::to_string;
    Point: Light = parse::point_light, numbers;
    Disk: Light = parse::disk, numbers;
    Rectangle: Light = parse::rectangle, numbers;
    Sun: Light = parse::sun, numbers;
    Positive: f32 = parse::positive, f32::to_string;
    Color: Vec3 = parse::color, |color| parse::list(&color.to_array());
    Lights: LightSet [Form::Text] = parse::light_set, LightSet::to_string;
    Seed: u32 = parse::seed, u32::to_string;
}

fn switch(text: &str) -> Result<bool, String> {
    match text {
        "true" | "on" => Ok(true),
        "false" | "off" => Ok(false),
        _ => Err("expected true or false".to_owned()),
    }
}

/// The text of a light that a flag can state.
fn numbers(light: &Light) -> String {
    parse::light_text(light).map(|(_, text)| text).unwrap_or_default()
}

/// The name of a value.
impl<T: Named + FromStr<Err = String>> Spelling for T {
    type Value = T;
    const FORM: Form = Form::Text;

    fn read(text: &OsStr) -> Result<T, String> {
        text.to_str().unwrap_or_default().parse()
    }

    fn text(value: &T) -> OsString {
        value.name().into()
    }

    fn parser() -> ValueParser {
        choice::<T>().into()
    }
}

/// The path of a file.
pub(crate) struct Path;

impl Spelling for Path {
    type Value = PathBuf;
    const FORM: Form = Form::Path;

    fn read(text: &OsStr) -> Result<PathBuf, String> {
        (!text.is_empty()).then(|| text.into()).ok_or_else(|| "expected the name of a file".to_owned())
    }

    fn text(value: &PathBuf) -> OsString {
        value.into()
    }

    fn parser() -> ValueParser {
        ValueParser::path_buf()
    }
}
