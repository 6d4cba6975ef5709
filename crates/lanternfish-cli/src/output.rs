//! Output files: checked before any work, written completely or not at all.

use std::{
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};

use lanternfish::{RenderedImage, settings::Background};
use lanternfish_metrics::{
    ColorType, RgbImage, destination, read_png_texts, write_aside, write_exr_image, write_jpeg, write_png_with_texts,
};

use crate::{
    ending::has_ending,
    error::CliError,
    images,
    outputs::{Quantity, Surfaces, write_npz},
    scene::SceneName,
};

/// Where `-o -` writes a PNG image.
const STDOUT: &str = "/dev/stdout";

/// An image file in a supported format and a writable folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Output {
    /// Its path.
    pub path: PathBuf,
    format: Format,
    background: Background,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    /// Display colours: tone-mapped, sRGB-encoded, 8 bits.
    Png,
    /// The same, compressed with losses.
    Jpeg,
    /// The same in 256 colours, for all frames of a sequence.
    Gif,
    /// Linear, scene-referred, half-precision floats.
    Exr,
    /// Linear, scene-referred, an array of 32-bit floats.
    Npz,
}

impl Output {
    /// The file that `-o` names, or the scene's name with `.png`. Returns an error if it cannot be written.
    pub fn choose(path: Option<&Path>, scene: &SceneName) -> Result<Self, CliError> {
        let output = Self::named(path, scene)?;
        check_writable(&output.path)?;
        Ok(output)
    }

    /// As [`Output::choose`], for a file that is not written.
    pub fn named(path: Option<&Path>, scene: &SceneName) -> Result<Self, CliError> {
        if path == Some(Path::new("-")) {
            return Ok(Self { path: STDOUT.into(), format: Format::Png, background: Background::Environment });
        }
        let path = path.map_or_else(|| default_path(scene), Path::to_owned);
        let format = if has_ending(&path, "png") {
            Format::Png
        } else if has_ending(&path, "jpg") || has_ending(&path, "jpeg") {
            Format::Jpeg
        } else if has_ending(&path, "exr") {
            Format::Exr
        } else if has_ending(&path, "npz") {
            Format::Npz
        } else {
            return Err(CliError::new(
                format_args!("{}: unsupported output format", path.display()),
                "end the name with .png or .jpg (tone-mapped), .exr (linear) or .npz (linear, for NumPy); .gif is for --orbit and --frames",
            ));
        };
        Ok(Self { path, format, background: Background::Environment })
    }

    /// A .gif file for all frames of a sequence; `None` for other files.
    pub fn animation(path: Option<&Path>) -> Option<Self> {
        let path = path.filter(|path| has_ending(path, "gif"))?.to_owned();
        Some(Self { path, format: Format::Gif, background: Background::Environment })
    }

    /// True for the file of an animation, to which each frame is added.
    pub fn is_animation(&self) -> bool {
        self.format == Format::Gif
    }

    /// The file for images with this background: with alpha, if it holds any.
    pub fn over(self, background: Background) -> Self {
        Self { background, ..self }
    }

    /// The file of one frame of a sequence: `name.0001.png`, or the animation.
    pub fn numbered(&self, number: u32) -> Self {
        if self.is_animation() {
            return self.clone();
        }
        let mut name = self.path.file_stem().unwrap_or_default().to_owned();
        name.push(format!(".{number:04}."));
        name.push(self.path.extension().unwrap_or_default());
        Self { path: self.path.with_file_name(name), ..*self }
    }

    /// True if the file holds scene radiance, not display colours.
    pub fn is_radiance(&self) -> bool {
        matches!(self.format, Format::Exr | Format::Npz)
    }

    /// True if the format has no opacity.
    pub fn is_opaque(&self) -> bool {
        matches!(self.format, Format::Jpeg | Format::Gif)
    }

    /// True for a JPEG file.
    pub fn is_jpeg(&self) -> bool {
        self.format == Format::Jpeg
    }

    /// True if the image goes to standard output, where nothing else may be printed then.
    pub fn is_stdout(&self) -> bool {
        self.path == Path::new(STDOUT)
    }

    /// True if the file has layers by name.
    pub fn has_layers(&self) -> bool {
        self.format == Format::Exr
    }

    /// The file of this ending beside a .png image, for quantities that it cannot hold: `image.depth.png`.
    pub fn beside(&self, ending: &str) -> PathBuf {
        self.path.with_extension(ending)
    }

    /// The files of these quantities beside the image.
    pub fn others(&self, quantities: &[Quantity]) -> Vec<PathBuf> {
        let names = quantities.iter().filter(|_| !self.is_radiance()).map(|quantity| quantity.name());
        let images = names.map(|name| self.beside(&format!("{name}.png")));
        let has_names = !self.is_radiance() && quantities.iter().any(|quantity| quantity.is_identity());
        images.chain(has_names.then(|| self.beside("names.json"))).collect()
    }

    /// Memory that writing an image needs, bytes per pixel.
    pub fn bytes_per_pixel(&self) -> u64 {
        match self.format {
            Format::Png | Format::Jpeg | Format::Gif => 4,
            // Four floats, and four halves in the encoded file.
            Format::Exr => 16 + 8,
            Format::Npz => 16,
        }
    }

    /// Memory that writing these quantities needs besides, bytes per pixel: copies of 32-bit values, and the encoded
    /// file.
    pub fn bytes_of(&self, quantities: &[Quantity]) -> u64 {
        let channels = quantities.iter().map(|quantity| quantity.channels());
        match self.format {
            // One after the other: the values, as 16-bit numbers and as bytes, and the encoded file.
            Format::Png | Format::Jpeg | Format::Gif => (4 + 2 + 2 + 2) * channels.max().unwrap_or(0),
            // Of all at once the values, as channels and encoded.
            Format::Exr => (4 + 4 + 4) * channels.sum::<u64>(),
            Format::Npz => 4 * channels.sum::<u64>(),
        }
    }

    /// Writes images of one size as layers of an EXR file, by name, with texts.
    pub fn write_layers(
        &self,
        renderings: &[(&str, &RenderedImage)],
        texts: &[(&str, String)],
    ) -> Result<(), CliError> {
        let images =
            renderings.iter().map(|(name, rendering)| Ok((*name, radiance(rendering)?, self.alpha(rendering))));
        let images = images.collect::<Result<Vec<_>, CliError>>()?;
        let layers: Vec<_> = images.iter().map(|(name, image, alpha)| (*name, image, alpha.as_deref())).collect();
        Ok(write_exr_image(&self.path, &layers, &borrowed(texts))?)
    }

    /// Writes an image in the format of the file name's ending, with texts, and its surfaces.
    pub fn write(
        &self,
        rendering: &RenderedImage,
        surfaces: Option<&Surfaces<'_>>,
        texts: &[(&str, String)],
    ) -> Result<(), CliError> {
        let texts = borrowed(texts);
        match (self.format, surfaces) {
            (Format::Png, _) => {
                surfaces.map_or(Ok(()), |surfaces| surfaces.write_png(|ending| self.beside(ending)))?;
                let RenderedImage { width, height, .. } = *rendering;
                let (color, pixels) = match self.background {
                    Background::Transparent => (ColorType::Rgba, rendering.display.as_flattened().to_vec()),
                    _ => (ColorType::Rgb, images::rgb(rendering)),
                };
                write_png_with_texts(&self.path, [width, height], color, &pixels, &texts)?;
            }
            (Format::Jpeg, _) => {
                surfaces.map_or(Ok(()), |surfaces| surfaces.write_png(|ending| self.beside(ending)))?;
                write_jpeg(&self.path, [rendering.width, rendering.height], &images::rgb(rendering))?;
            }
            (Format::Gif, _) => unreachable!("frames are added to it"),
            (Format::Exr, None) => {
                let alpha = self.alpha(rendering);
                write_exr_image(&self.path, &[("", &radiance(rendering)?, alpha.as_deref())], &texts)?;
            }
            (Format::Exr, Some(surfaces)) => {
                let channel = |i: usize| rendering.radiance.iter().map(|pixel| pixel[i]).collect();
                let names = ["R", "G", "B", "A"].into_iter().take(if self.has_alpha() { 4 } else { 3 });
                let channels = names.enumerate().map(|(i, name)| (name.to_owned(), channel(i)));
                surfaces.write_exr(&self.path, channels.collect(), &texts)?;
            }
            (Format::Npz, _) => {
                let size = [rendering.width, rendering.height];
                let image = radiance(rendering)?.pixels.into_flattened();
                write_npz(&self.path, size, image, self.alpha(rendering), surfaces)?;
            }
        }
        Ok(())
    }

    fn has_alpha(&self) -> bool {
        self.background != Background::Environment
    }

    /// The opacity of an image's pixels, unless it has the environment for a background. That of a shadow catcher is
    /// noisy.
    fn alpha(&self, rendering: &RenderedImage) -> Option<Vec<f32>> {
        self.has_alpha().then(|| rendering.radiance.iter().map(|[.., alpha]| alpha.clamp(0.0, 1.0)).collect())
    }
}

fn borrowed<'t>(texts: &'t [(&str, String)]) -> Vec<(&'t str, &'t str)> {
    texts.iter().map(|(name, text)| (*name, text.as_str())).collect()
}

fn radiance(rendering: &RenderedImage) -> Result<RgbImage, CliError> {
    let pixels = rendering.radiance.iter().map(|[red, green, blue, _]| [*red, *green, *blue]).collect();
    Ok(RgbImage::new(rendering.width as usize, rendering.height as usize, pixels)?)
}

/// The scene's name with `.png`, in the current folder. The scene's own folder may not be writable.
pub(crate) fn default_path(scene: &SceneName) -> PathBuf {
    let name = match scene.demo() {
        Some(name) => name.as_ref(),
        None => scene.path().file_stem().unwrap_or("image".as_ref()),
    };
    let mut file = name.to_owned();
    file.push(".png");
    PathBuf::from(file)
}

/// Returns an error unless `path` can be written, before minutes of work depend on it. Leaves no file behind.
pub(crate) fn check_writable(path: &Path) -> Result<(), CliError> {
    lanternfish_metrics::check_writable(path).map_err(|error| {
        let hint = match error.kind() {
            ErrorKind::IsADirectory => "name a file in it",
            ErrorKind::NotFound => "create the folder first, or choose another",
            ErrorKind::InvalidFilename => "choose a shorter name",
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "make it writable, or choose another name",
            _ => "choose another path",
        };
        CliError::new(format_args!("{}: {error}", path.display()), hint)
    })
}

/// True if two paths in existing folders name the same file. The file itself need not exist.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    destination(a).is_some_and(|path| destination(b) == Some(path))
}

/// Returns an error if an output file is one of the other files. Each path comes with its name for the message.
pub(crate) fn refuse_same(written: &[(&Path, &str)], others: &[(&Path, &str)]) -> Result<(), CliError> {
    for (path, name) in written {
        if let Some((_, other)) = others.iter().find(|(other, _)| same_file(path, other)) {
            let what = format!("{}: both {other} and {name}", path.display());
            return Err(CliError::new(what, "give them different names"));
        }
    }
    Ok(())
}

/// Returns an error if a name that the program chose is that of a PNG image of somebody else's beside the scene: it may
/// be a texture.
pub fn refuse_texture(path: &Path, scene: &SceneName) -> Result<(), CliError> {
    let folder = |path: &Path| destination(path).and_then(|path| Some(path.parent()?.to_owned()));
    let is_beside = scene.demo().is_none() && folder(path).is_some() && folder(path) == folder(scene.path());
    let is_own = |software: &String| software.starts_with("lanternfish");
    match read_png_texts(path) {
        Ok(texts) if is_beside && !texts.get("Software").is_some_and(is_own) => {
            let what = format!("{}: an image that this program did not write, and perhaps a texture", path.display());
            Err(CliError::new(what, "name the image with -o, or another folder"))
        }
        _ => Ok(()),
    }
}

/// Writes to standard output and flushes it.
pub fn print(text: &str) -> Result<(), CliError> {
    let mut stdout = std::io::stdout();
    printed(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

/// Converts the result of writing to standard output. A reader that closed it has enough (`lanternfish render … | head
/// -1`): the rest is not printed, and the work and its exit code do not change.
pub(crate) fn printed(result: std::io::Result<()>) -> Result<(), CliError> {
    match result {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(CliError::new(format_args!("standard output: {error}"), "check where the output is sent to")),
        Ok(()) => Ok(()),
    }
}

/// Writes a text file completely or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<(), CliError> {
    write_aside(path, |file| file.write_all(text.as_bytes())).map_err(|error: std::io::Error| {
        CliError::new(format_args!("{}: {error}", path.display()), "check that the disk has free space")
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn chosen(path: &Path) -> Result<Output, String> {
        Output::choose(Some(path), &"scene.glb".into()).map_err(|error| error.to_string())
    }

    #[test]
    fn the_default_name_is_the_scenes() {
        for (scene, path) in [
            ("demo:atrium", "atrium.png"),
            ("Sponza.glb", "Sponza.png"),
            ("some/folder/a.b.gltf", "a.b.png"),
            ("..", "image.png"),
        ] {
            assert_eq!(default_path(&scene.into()), Path::new(path), "{scene}");
        }
    }

    #[test]
    fn the_ending_chooses_the_format() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(chosen(&folder.path().join("a.png")).unwrap().format, Format::Png);
        assert_eq!(chosen(&folder.path().join("a.EXR")).unwrap().format, Format::Exr);
        assert_eq!(chosen(&folder.path().join("a.b.npz")).unwrap().format, Format::Npz);
        assert!(chosen(&folder.path().join("a.jpeg")).unwrap().is_jpeg());
        for name in ["a.gif", "a", ".png", "a.png.txt"] {
            assert!(chosen(&folder.path().join(name)).unwrap_err().contains(".jpg (tone-mapped)"), "{name}");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "checking leaves nothing behind");
    }

    #[test]
    fn writing_quantities_takes_memory_for_each_or_the_largest() {
        let folder = tempfile::tempdir().unwrap();
        let quantities = crate::outputs::quantities("depth,normal,motion").unwrap().0;
        let of = |name: &str| chosen(&folder.path().join(name)).unwrap().bytes_of(&quantities);
        assert_eq!(["a.png", "a.exr", "a.npz"].map(of), [30, 72, 24]);
    }

    #[test]
    fn different_paths_to_one_file_are_equal() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("inner")).unwrap();
        assert!(same_file(&path("a"), &path("inner/../a")));
        assert!(!same_file(&path("a"), &path("inner/a")) && !same_file(&path("missing/a"), &path("missing/a")));
        fs::write(path("a"), "").unwrap();
        assert!(same_file(&path("inner/../a"), &path("a")) && !same_file(&path("a"), &path("b")));
    }

    #[test]
    fn textures_are_not_replaced_by_chance() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("inner")).unwrap();
        lanternfish_metrics::write_png(&path("cup.png"), [1, 1], ColorType::Rgb, &[0; 3]).unwrap();
        write_png_with_texts(&path("own.png"), [1, 1], ColorType::Rgb, &[0; 3], &[("Software", "lanternfish 1")])
            .unwrap();
        let refused = |name: &str, scene: &str| refuse_texture(&path(name), &path(scene).into()).is_err();
        assert!(refused("cup.png", "cup.obj") && !refused("own.png", "cup.obj") && !refused("new.png", "cup.obj"));
        assert!(!refused("cup.png", "inner/cup.obj"));
    }

    #[test]
    fn missing_and_invalid_folders_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(chosen(&folder.path().join("missing/a.png")).unwrap_err().contains("there is no folder"));
        fs::write(folder.path().join("file"), "").unwrap();
        assert!(chosen(&folder.path().join("file/a.png")).unwrap_err().contains("there is no folder"));
        fs::create_dir(folder.path().join("folder.png")).unwrap();
        assert!(chosen(&folder.path().join("folder.png")).unwrap_err().contains("this is a folder"));
    }
}
