//! Checks existing images against those that a run would write.

use std::path::{Path, PathBuf};

use lanternfish::debug_views::Scale;
use lanternfish_metrics::{MetricsError, exr_layer_size, exr_layers, read_exr_layer, read_jpeg, read_png};

use crate::{
    args::RenderArgs,
    ending::has_ending,
    legend,
    output::Output,
    outputs::{Quantity, holds},
    stereo::StereoLayout,
};

/// Size and layers of the requested images.
#[derive(Debug)]
pub struct Expected {
    width: usize,
    height: usize,
    layers: &'static [&'static str],
    quantities: Vec<Quantity>,
}

/// Layer names of the two eyes.
pub const EYES: [&str; 2] = ["left", "right"];

impl Expected {
    pub fn of(args: &RenderArgs) -> Self {
        let (mut width, mut height) = (args.output.size.width as usize, args.output.size.height as usize);
        let has_layers = args.stereo.stereo.is_some() && args.stereo.stereo_layout == StereoLayout::Layers;
        if args.stereo.stereo.is_some() && !has_layers {
            width *= 2;
        }
        if args.settings().image.debug_view.and_then(Scale::of).is_some() && args.output.legend {
            (width, height) = legend::size_with(width, height);
        }
        let layers: &[&str] = if has_layers { &EYES } else { &[""] };
        Self { width, height, layers, quantities: args.quantities().to_vec() }
    }

    /// The fault of a file; `None` if it is complete. All pixels of a file of the right size are decoded.
    pub fn fault(&self, output: &Output) -> Option<Fault> {
        if !output.path.exists() {
            return Some(Fault::Missing);
        }
        let is_broken = |path: &PathBuf| match has_ending(path, "png") {
            true => read_png(path).is_err(),
            false => !path.exists(),
        };
        if let Some(missing) = output.others(&self.quantities).into_iter().find(is_broken) {
            return Some(Fault::Broken(format!("{}: missing or broken", missing.display())));
        }
        let path = &output.path;
        let checked = match output.is_radiance() {
            true if !output.has_layers() => {
                let names = self.quantities.iter().map(|quantity| quantity.name());
                let what =
                    || format!("{}: not {} x {} pixels with all --outputs", path.display(), self.width, self.height);
                holds(path, [self.width, self.height], names).then_some(()).ok_or_else(|| Fault::Broken(what()))
            }
            true => self.check_quantities(path).and_then(|()| {
                self.layers.iter().try_for_each(|layer| {
                    self.check_size(output, exr_layer_size(path, layer).map_err(broken)?)?;
                    read_exr_layer(path, layer).map(drop).map_err(broken)
                })
            }),
            false => {
                let read = if output.is_jpeg() { read_jpeg } else { read_png };
                read(path).map_err(broken).and_then(|image| self.check_size(output, (image.width, image.height)))
            }
        };
        checked.err()
    }

    /// An error if an EXR file lacks the layer of a quantity.
    fn check_quantities(&self, path: &Path) -> Result<(), Fault> {
        let layers = exr_layers(path).map_err(broken)?;
        let has = |quantity: &&Quantity| layers.iter().any(|layer| layer == quantity.layer());
        match self.quantities.iter().find(|quantity| !has(quantity)) {
            Some(quantity) => Err(Fault::Broken(format!("{}: no layer {}", path.display(), quantity.layer()))),
            None => Ok(()),
        }
    }

    fn check_size(&self, output: &Output, (width, height): (usize, usize)) -> Result<(), Fault> {
        if (width, height) == (self.width, self.height) {
            return Ok(());
        }
        let what = format!("{width} x {height} pixels, not {} x {}", self.width, self.height);
        Err(Fault::Broken(format!("{}: {what}", output.path.display())))
    }
}

fn broken(error: MetricsError) -> Fault {
    Fault::Broken(error.to_string())
}

/// The fault of an image file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    Missing,
    /// The file exists but is invalid: the path and the reason.
    Broken(String),
}

/// The pixels of a file of another size are not read: here they are missing.
#[cfg(test)]
#[test]
fn the_size_of_an_exr_file_is_read_before_its_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
    let image = lanternfish_metrics::RgbImage::new(40, 40, vec![[0.5; 3]; 1600]).unwrap();
    lanternfish_metrics::write_exr(&path, &image).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 20]).unwrap();
    let output = Output::named(Some(&path), &"scene.glb".into()).unwrap();
    let fault =
        |width: usize| match (Expected { width, height: 40, layers: &[""], quantities: Vec::new() }).fault(&output) {
            Some(Fault::Broken(why)) => why,
            other => panic!("{other:?}"),
        };
    assert!(fault(41).contains("40 x 40 pixels, not 41 x 40"), "{}", fault(41));
    assert!(fault(40).contains("can be read"), "{}", fault(40));
}
