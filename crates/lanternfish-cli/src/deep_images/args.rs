//! The flags of `lanternfish deep-images`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use lanternfish_gpu::AdapterChoice;
use lanternfish_papers::{DeepBuilder, DeepImageSettings, deep_images::directions::DirectionSet};

use crate::{
    args::{PartArgs, ViewArgs, adapter, demos},
    choices::choice,
    error::CliError,
    parse::{self, Size},
    scene::SceneName,
};

/// Most texels of all images. Without any fragment they fill 8 GiB.
const MOST_TEXELS: u64 = 1 << 31;

pub const HELP: &str = "\
Examples:
  All fragments of all images, from a shot's camera:
    lanternfish deep-images shot.toml -o points.png
  Those of one image, and finer:
    lanternfish deep-images scene.glb --image 12 --resolution 256 --eye 6,2,-1 --target -4,3,0 -o points.png
  The first and the last layer of one image:
    lanternfish deep-images scene.glb --view layer --image 12 -o first.png
    lanternfish deep-images scene.glb --view layer --image 12 --layer -1 -o last.png
  Its first eight layers side by side:
    lanternfish deep-images scene.glb --view layers --image 12 --layers 8 -o layers.png
  Surfaces per texel, with 48 directions on a cube's faces:
    lanternfish deep-images scene.glb --view count --directions cube:4 --resolution 128 -o counts.png
  Images from six directions, with every surface transparent:
    lanternfish deep-images scene.glb --view transparent --directions stacks:13x13 --builder single_pass -o deep.png

Points: red faces ±x, green ±y, blue ±z. Layers: lighter is nearer, dark blue: no fragment.
The last line of standard output is the image's path.";

// `--view` selects what to show here, so the camera's `--view` is called `--side`.
#[derive(Debug, Args)]
#[command(mut_arg("view", |side| side.long("side")))]
pub struct DeepImagesArgs {
    #[arg(help = format!("A glTF 2.0 file (.gltf, .glb), an OBJ file, a shot (.toml), or a built-in scene: {}", demos()))]
    pub scene: SceneName,

    #[command(flatten, next_help_heading = "Output")]
    pub output: OutputArgs,
    #[command(flatten, next_help_heading = "Deep images")]
    pub images: DeepImageArgs,
    #[command(flatten, next_help_heading = "What is shown")]
    pub shown: ShownArgs,
    #[command(flatten, next_help_heading = "View")]
    pub part: PartArgs,
    #[command(flatten, next_help_heading = "View")]
    pub view: ViewArgs,
    #[command(flatten, next_help_heading = "View")]
    pub moment: MomentArgs,
    #[command(flatten, next_help_heading = "Run")]
    pub run: RunArgs,
}

#[derive(Debug, Args)]
pub struct OutputArgs {
    /// The image, a .png file. Without it: the scene's (or shot's) name with .deep-images.png, in the current folder.
    #[arg(id = "deep_images_output", short = 'o', long = "output", value_name = "FILE.png")]
    pub output: Option<PathBuf>,
    /// Width and height of the image of points, pixels, each from 1 to 16384.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse::size)]
    #[arg(allow_hyphen_values = true)]
    pub size: Size,
    /// Pixels per texel, across and down, in images of texels. Without it: chosen so that the image is about 1280 pixels wide.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024), allow_hyphen_values = true)]
    pub upscale: Option<u32>,
}

/// Parameters of the deep images.
#[derive(Debug, Args)]
pub struct DeepImageArgs {
    /// Direction set: zonal:N (N of equal area each), stacks:AxB (A steps from the pole down, B around it) or cube:K (K × K on
    /// each face of a cube).
    #[arg(long, value_name = "SET", value_parser = str::parse::<DirectionSet>, allow_hyphen_values = true)]
    #[arg(default_value = "zonal:169")]
    pub directions: DirectionSet,
    /// Texels across and down each image. More: finer, and more memory by the square.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096), allow_hyphen_values = true)]
    #[arg(default_value_t = DeepImageSettings::default().resolution)]
    pub resolution: u32,
    /// Resolution of the rasterized scene, as a multiple of an image's, with --builder single_pass. More: fewer holes, slower.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8), allow_hyphen_values = true)]
    #[arg(default_value_t = DeepImageSettings::default().supersampling)]
    pub supersampling: u32,
    /// Builder.
    #[arg(long, value_name = "NAME", value_parser = choice::<DeepBuilder>())]
    #[arg(default_value_t = DeepImageSettings::default().builder)]
    pub builder: DeepBuilder,
}

#[derive(Debug, Args)]
pub struct ShownArgs {
    /// What to show.
    #[arg(id = "deep_images_view", long = "view", value_name = "NAME", value_enum, default_value_t = DeepView::Points)]
    pub view: DeepView,
    /// Index of one image. Without it: all images as points, the texels of the first, or six transparent ones.
    #[arg(long, value_name = "I", allow_hyphen_values = true)]
    pub image: Option<u32>,
    /// Index of the fragment in each texel for --view layer: 0 is the first along the image's axis, -1 the last.
    #[arg(long, value_name = "K", allow_hyphen_values = true, default_value_t = 0)]
    pub layer: i32,
    /// Number of layers for --view layers, from the first; fewer if the image has fewer.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64), allow_hyphen_values = true)]
    #[arg(default_value_t = 6)]
    pub layers: u32,
    /// Diameter of a point in texel widths. More: fewer gaps, and more points hidden behind others. Without it: half a texel
    /// for one image, less for all images, whose points are denser.
    #[arg(long, value_name = "X", value_parser = parse::positive, allow_hyphen_values = true)]
    pub point_size: Option<f32>,
}

#[derive(Debug, Args)]
pub struct MomentArgs {
    /// Time on a shot's camera track, seconds. Without it: the first keyframe.
    #[arg(long, value_name = "SECONDS", value_parser = parse::time, allow_hyphen_values = true)]
    pub time: Option<f32>,
}

#[derive(Debug, Args)]
pub struct RunArgs {
    /// The adapter: a part of its name, gpu for a graphics card, cpu for software. Default: the most capable.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    /// Prints only errors and the results.
    #[arg(short, long)]
    pub quiet: bool,
}

/// What to show of the deep images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DeepView {
    /// Fragments at their positions in the scene, seen by the camera
    Points,
    /// Depth of one fragment per texel of an image
    Layer,
    /// The first layers of an image side by side
    Layers,
    /// Fragments per texel of an image, as a heat map
    Count,
    /// All fragments of an image as transparent surfaces; without --image, of six images
    Transparent,
}

impl DeepImageArgs {
    /// The library's settings that these flags choose. `limit` is the device's largest texture width, texels.
    pub fn settings(&self, limit: u32) -> Result<DeepImageSettings, CliError> {
        // The single pass draws three axes side by side.
        let drawn = match self.builder {
            DeepBuilder::SinglePass | DeepBuilder::SinglePassLiteral => 3 * self.resolution * self.supersampling,
            // This builder does not rasterize.
            DeepBuilder::PerTriangle => 0,
            DeepBuilder::PerDirection | DeepBuilder::DepthPeeling => self.resolution,
        };
        if drawn > limit {
            return Err(CliError::new(
                format!(
                    "--resolution {}: {drawn} pixels would be drawn across, this adapter has {limit}",
                    self.resolution
                ),
                "choose a smaller --resolution, or --builder per_triangle, which does not rasterize",
            ));
        }
        if self.supersampling > 1 && !self.builder.is_single_pass() {
            return Err(CliError::new(
                format!("--supersampling {}: --builder {} has nothing to sample", self.supersampling, self.builder),
                "leave it out, or choose --builder single_pass",
            ));
        }
        let texels = self.directions.count() * u64::from(self.resolution).pow(2);
        if texels > MOST_TEXELS {
            return Err(CliError::new(
                format!("{texels} texels in all images: at most {MOST_TEXELS} are supported"),
                "choose a smaller --resolution or fewer --directions",
            ));
        }
        Ok(DeepImageSettings {
            directions: self.directions,
            resolution: self.resolution,
            builder: self.builder,
            supersampling: self.supersampling,
            ..DeepImageSettings::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cli::Command, testing};

    fn parsed(words: &str) -> Result<DeepImagesArgs, clap::Error> {
        let Command::DeepImages(args) = testing::parsed(&format!("deep-images a.glb {words}"))? else {
            panic!("{words}")
        };
        Ok(*args)
    }

    #[test]
    fn without_flags_the_images_are_the_librarys() {
        assert_eq!(parsed("").unwrap().images.settings(8192).unwrap(), DeepImageSettings::default());
    }

    #[test]
    fn flags_choose_the_images() {
        let words = "--directions cube:2 --resolution 100 --supersampling 3 --builder single_pass";
        let settings = parsed(words).unwrap().images.settings(8192).unwrap();
        let expected = DeepImageSettings {
            directions: DirectionSet::Cube { k: 2 },
            resolution: 100,
            supersampling: 3,
            builder: DeepBuilder::SinglePass,
            ..DeepImageSettings::default()
        };
        assert_eq!(settings, expected);
        assert_eq!(parsed("--view layer --layer -2").unwrap().shown.layer, -2);
        let bad = "--directions ball:3, --resolution 0, --resolution 5000, --supersampling 9, --builder both, --view all, \
                   --image -1, --layer x, --layers 0, --upscale 0, --point-size 0";
        for bad in bad.split(", ") {
            assert!(parsed(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn images_beyond_the_adapters_limits_are_refused() {
        let settings = |words: &str| parsed(words).unwrap().images.settings(8192).map_err(|error| error.to_string());
        assert!(settings("--builder single_pass --resolution 2730").is_ok());
        assert!(settings("--builder single_pass --resolution 910 --supersampling 3").is_ok());
        for words in
            ["--builder single_pass --resolution 2731", "--builder single_pass --resolution 911 --supersampling 3"]
        {
            let error = settings(words).unwrap_err();
            assert!(error.contains("this adapter has 8192") && error.contains("--builder per_triangle"), "{error}");
        }
        let error = settings("--supersampling 2").unwrap_err();
        assert!(error.contains("--builder single_pass") && error.contains("per_triangle"), "{error}");
        let fine = "--resolution 4096 --builder per_direction --directions";
        assert!(settings(&format!("{fine} zonal:128")).is_ok());
        let error = settings(&format!("{fine} zonal:129")).unwrap_err();
        assert!(error.contains("2164260864 texels") && error.contains("fewer --directions"), "{error}");
    }
}
