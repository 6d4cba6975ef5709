//! Texture maps of MTL files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use lanternfish_limits::memory::{Budget, TooMuch};
use rayon::prelude::*;

use super::Notes;
use crate::{
    Image, Sampler, Scene, Texture, TextureRef, Wrap,
    import::{
        files::{FileError, Files},
        pixels,
    },
};

/// Ends of names of images of base colours, after the name of the OBJ file.
const OWN: [&str; 7] = ["", "_diffuse", "_albedo", "_basecolor", "_color", "_col", "_D"];

/// An image beside the OBJ file at `path` that has its name: a base colour that no material names.
pub(super) fn own_image(path: &Path, files: &Files) -> Option<String> {
    let stem = path.file_stem()?.to_string_lossy();
    let names = OWN.iter().flat_map(|end| ["png", "jpg", "jpeg"].map(|format| format!("{stem}{end}.{format}")));
    names.into_iter().find(|name| files.has(Path::new(name)))
}

/// A texture map of a material, with its options.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// Path of the image, relative to the OBJ's folder.
    pub file: String,
    /// `-bm`: strength of the bump or normal map.
    pub strength: f32,
    /// `-clamp on`: texture coordinates are clamped to 0..=1; otherwise the texture repeats.
    pub clamps: bool,
}

impl Map {
    /// Parses `[-option arguments …] file name`; `None` without a file. Options not in [`Map`] are ignored.
    pub fn parse(text: &str) -> Option<Self> {
        let mut map = Self { file: String::new(), strength: 1.0, clamps: false };
        let mut words = text.split_whitespace().peekable();
        while let Some(option) = words.next_if(|word| word.starts_with('-')) {
            match option {
                "-bm" => map.strength = words.next()?.parse().ok().filter(|s: &f32| s.is_finite()).unwrap_or(1.0),
                "-clamp" => map.clamps = words.next()? == "on",
                "-mm" => drop((words.next(), words.next())),
                // One to three numbers.
                "-o" | "-s" | "-t" => {
                    for _ in 0..3 {
                        words.next_if(|word| word.parse::<f32>().is_ok());
                    }
                }
                _ => drop(words.next()),
            }
        }
        map.file = words.collect::<Vec<_>>().join(" ").replace('\\', "/");
        (!map.file.is_empty()).then_some(map)
    }
}

/// Decoded images and their textures.
#[derive(Default)]
pub(super) struct Textures {
    images: Vec<Image>,
    /// Indices into `images` by file name, without missing files.
    by_file: BTreeMap<String, usize>,
    /// Indices into `images` of images that combine the colours of one image with the opacity of another, by the indices of
    /// the colour image (if any) and the opacity image.
    with_opacity: BTreeMap<(Option<usize>, usize), usize>,
    textures: Vec<Texture>,
}

impl Textures {
    /// Decodes the named files on all cores. A file that cannot be read is noted and left out. An error, before decoding, if the
    /// encoded or decoded images exceed the budget.
    pub fn decode(names: &BTreeSet<String>, files: &Files, notes: &mut Notes) -> Result<Self, TooMuch> {
        let (mut encoded, mut sizes) = (Vec::new(), Vec::new());
        for name in names {
            let bytes = match files.named(Path::new(name)) {
                Err(FileError::TooMuch(need)) => return Err(need),
                bytes => bytes.map_err(|error| error.to_string()),
            };
            match bytes.and_then(|bytes| Ok((pixels::size(&bytes)?, bytes))) {
                Ok((size, bytes)) => {
                    encoded.push((name, bytes));
                    sizes.push((name.clone(), size));
                }
                Err(what) => drop(notes.insert(left_out(name, &what))),
            }
        }
        pixels::reserve(&sizes, files.budget)?;
        let decoded: Vec<_> = encoded.par_iter().map(|(name, bytes)| (*name, pixels::decode(name, bytes))).collect();
        let mut textures = Self::default();
        for (file, image) in decoded {
            match image {
                Ok(image) => {
                    textures.by_file.insert(file.clone(), textures.images.len());
                    textures.images.push(image);
                }
                Err(what) => drop(notes.insert(left_out(file, &what))),
            }
        }
        Ok(textures)
    }

    /// The decoded image of `map`; `None` if it could not be read.
    pub fn image(&self, map: &Map) -> Option<&Image> {
        self.by_file.get(&map.file).map(|index| &self.images[*index])
    }

    /// The texture of `map`; `None` if its image could not be read.
    pub fn texture(&mut self, map: &Map) -> Option<TextureRef> {
        let image = *self.by_file.get(&map.file)?;
        Some(self.add(image, map.clamps))
    }

    /// A texture of `color` (white if `None`) with the opacity of another map: its alpha channel, or red if alpha is 1 everywhere.
    /// Opacity is resampled to the size of the colour image (nearest texel).
    pub fn with_opacity(
        &mut self,
        color: Option<&Map>,
        opacity: &Map,
        budget: &Budget,
    ) -> Result<Option<TextureRef>, TooMuch> {
        let clamps = color.unwrap_or(opacity).clamps;
        let index = |map: &Map| self.by_file.get(&map.file).copied();
        let Some(opacity) = index(opacity) else { return Ok(None) };
        let color = color.and_then(index);
        if let Some(existing) = self.with_opacity.get(&(color, opacity)).copied() {
            return Ok(Some(self.add(existing, clamps)));
        }
        let source = &self.images[opacity];
        let channel = if source.rgba.as_chunks::<4>().0.iter().any(|p| p[3] < 255) { 3 } else { 0 };
        let base = &self.images[color.unwrap_or(opacity)];
        budget.take(base.rgba.len() as u64, || format!("{} with its opacity needs", base.name))?;
        let mut image = match color {
            Some(_) => base.clone(),
            None => Image { rgba: vec![255; source.rgba.len()], ..source.clone() },
        };
        let (width, height) = (image.width as usize, image.height as usize);
        for (i, pixel) in image.rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let x = i % width * source.width as usize / width;
            let y = i / width * source.height as usize / height;
            pixel[3] = source.rgba[4 * (y * source.width as usize + x) + channel];
        }
        self.images.push(image);
        self.with_opacity.insert((color, opacity), self.images.len() - 1);
        Ok(Some(self.add(self.images.len() - 1, clamps)))
    }

    fn add(&mut self, image: usize, clamps: bool) -> TextureRef {
        let texture = Texture { image, sampler: usize::from(clamps) };
        let index = self.textures.iter().position(|existing| *existing == texture).unwrap_or_else(|| {
            self.textures.push(texture);
            self.textures.len() - 1
        });
        TextureRef::new(index)
    }

    /// Moves the used images and the textures into the scene.
    pub fn finish(mut self, scene: &mut Scene) {
        let mut moved: BTreeMap<usize, usize> = BTreeMap::new();
        for texture in &mut self.textures {
            let next = moved.len();
            texture.image = *moved.entry(texture.image).or_insert(next);
        }
        let mut used: Vec<_> = moved.into_iter().collect();
        used.sort_by_key(|(_, new)| *new);
        scene.images = used.into_iter().map(|(old, _)| std::mem::take(&mut self.images[old])).collect();
        if !self.textures.is_empty() {
            let clamped = Sampler { wrap_u: Wrap::ClampToEdge, wrap_v: Wrap::ClampToEdge, ..Sampler::default() };
            scene.samplers = vec![Sampler::default(), clamped];
        }
        scene.textures = self.textures;
    }
}

fn left_out(name: &str, what: &str) -> String {
    format!("{name}: {what}; the texture is left out")
}
