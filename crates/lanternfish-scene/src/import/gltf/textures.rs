//! Import of textures, samplers and the materials' references to them.

use glam::{Affine2, Mat2, Vec2, Vec3};
use lanternfish_limits::memory::Budget;

use super::fault::{Place, Result, invalid, item};
use super::glossiness::Glossy;
use super::lobes::Mean;
use super::notes::Notes;
use super::schema::{self, Root, TextureInfo, TextureTransform};
use crate::{Filter, Image, Material, MipFilter, Sampler, Texture, TextureRef, Wrap};

/// Largest number in a texture transform.
const MOST_TRANSFORM: f32 = 1e9;

/// The distinct textures that materials refer to, in the order of first use.
pub(super) struct Textures {
    /// For each of the file's images the first one of the same bytes.
    first_images: Vec<usize>,
    /// The list for [`crate::Scene::textures`].
    pub textures: Vec<Texture>,
    /// The list for [`crate::Scene::samplers`].
    pub samplers: Vec<Sampler>,
    /// The file's image index for each of [`crate::Scene::images`].
    pub images: Vec<usize>,
    /// Textures of which materials need the mean alone.
    pub means: Vec<Mean>,
    /// Materials whose textures become others.
    pub glossy: Vec<Glossy>,
}

impl Textures {
    /// No textures yet. `first_images`: for each of the file's images the first one of the same bytes.
    pub fn new(first_images: Vec<usize>) -> Self {
        Self {
            first_images,
            textures: Vec::new(),
            samplers: Vec::new(),
            images: Vec::new(),
            means: Vec::new(),
            glossy: Vec::new(),
        }
    }

    /// Adds a texture that a material refers to. `None`, with a note, for an unsupported texture: its image is in the
    /// format of an extension, or it uses a third set of texture coordinates.
    pub fn add(&mut self, root: &Root, info: &TextureInfo, notes: &mut Notes) -> Result<Option<TextureRef>> {
        let texture = item(&root.textures, info.index, "textures")?;
        let transform = info.extensions.transform.as_ref();
        let uv_set = transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord);
        if uv_set > 1 {
            notes.add("textures of a third or further set of texture coordinates");
            return Ok(None);
        }
        let extensions = &texture.extensions;
        let of_extension = extensions.webp.as_ref().or(extensions.basisu.as_ref()).and_then(|texture| texture.source);
        let Some(source) = of_extension.or(texture.source) else {
            notes.add("textures without an image in a supported format");
            return Ok(None);
        };
        let sampler = self.sampler(root, texture, notes).place(|| format!("textures[{}]", info.index))?;
        item(&root.images, source, "images").place(|| format!("textures[{}]", info.index))?;
        let image = index_of(&mut self.images, self.first_images[source]);
        let texture = index_of(&mut self.textures, Texture { image, sampler });
        let texture_from_uv = transform.map_or(Affine2::IDENTITY, texture_from_uv);
        if !texture_from_uv.is_finite() {
            return Err(invalid("its KHR_texture_transform is not finite"))
                .place(|| format!("textures[{}]", info.index));
        }
        // Coordinates that overflow are not numbers, and so are the pixels that they colour.
        let largest = texture_from_uv.to_cols_array().into_iter().fold(0.0, |most: f32, value| most.max(value.abs()));
        let texture_from_uv = match largest > MOST_TRANSFORM {
            true => {
                notes.add("texture transforms beyond 10⁹, which are left out");
                Affine2::IDENTITY
            }
            false => texture_from_uv,
        };
        Ok(Some(TextureRef { texture, uv_set, texture_from_uv }))
    }

    /// Applies the means, converts specular-glossiness textures, and removes the materials' references to images that could not be read, with a note for each. Returns the images, with one
    /// white pixel instead of these and of those of which only the mean is used.
    pub fn keep_readable(
        &mut self,
        mut images: Vec<std::result::Result<Image, String>>,
        materials: &mut [Material],
        budget: &Budget,
        notes: &mut Notes,
    ) -> Result<Vec<Image>> {
        for mean in &self.means {
            if let Ok(image) = &images[self.textures[mean.texture()].image] {
                mean.apply(materials, image);
            }
        }
        // Materials of one atlas share what is converted.
        let mut known: Vec<(_, [Option<TextureRef>; 2])> = Vec::new();
        for glossy in std::mem::take(&mut self.glossy) {
            let image = |used: TextureRef| images[self.textures[used.texture].image].as_ref().ok();
            let material = &mut materials[glossy.material];
            let diffuse = material.base_color_texture.and_then(image);
            let Some(specular) = image(glossy.texture) else { continue };
            let key = (material.base_color_texture, glossy.texture, glossy.diffuse, glossy.specular, glossy.glossiness);
            let [color, roughness] = match known.iter().find(|(other, _)| *other == key) {
                Some((_, converted)) => *converted,
                None => {
                    let needed = Glossy::bytes_needed(diffuse, specular);
                    budget.take(needed, || "converted textures need".to_owned())?;
                    let sampler = self.textures[glossy.texture.texture].sampler;
                    let converted = glossy.convert(diffuse, specular).map(|converted| {
                        images.push(Ok(converted));
                        self.textures.push(Texture { image: images.len() - 1, sampler });
                        Some(TextureRef { texture: self.textures.len() - 1, ..glossy.texture })
                    });
                    known.push((key, converted));
                    converted
                }
            };
            (material.base_color_texture, material.metallic_roughness_texture) = (color, roughness);
            material.base_color = Vec3::ONE.extend(material.base_color.w);
            (material.metallic, material.perceptual_roughness) = (1.0, 1.0);
        }
        let mut is_sampled = vec![false; images.len()];
        for slot in materials.iter_mut().flat_map(Material::texture_slots) {
            *slot = slot.filter(|used| images[self.textures[used.texture].image].is_ok());
            slot.iter().for_each(|used| is_sampled[self.textures[used.texture].image] = true);
        }
        let white = || Image { name: String::new(), width: 1, height: 1, rgba: vec![255; 4] };
        let keep = |(index, image): (usize, std::result::Result<Image, String>)| match image {
            Ok(image) if is_sampled[index] => image,
            Ok(_) => white(),
            Err(what) => {
                notes.add_image(what);
                white()
            }
        };
        Ok(images.into_iter().enumerate().map(keep).collect())
    }

    fn sampler(&mut self, root: &Root, texture: &schema::Texture, notes: &mut Notes) -> Result<usize> {
        let sampler = match texture.sampler {
            Some(index) => read_sampler(item(&root.samplers, index, "samplers")?, notes),
            None => Sampler::default(),
        };
        Ok(index_of(&mut self.samplers, sampler))
    }
}

/// The index of `value` in `list`; appends it if it is missing.
fn index_of<T: PartialEq>(list: &mut Vec<T>, value: T) -> usize {
    list.iter().position(|existing| *existing == value).unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    })
}

/// Converts a sampler. Unknown values become the default, with a note. The codes are OpenGL's.
fn read_sampler(sampler: &schema::Sampler, notes: &mut Notes) -> Sampler {
    let default = Sampler::default();
    let mut unknown = || notes.add("sampler settings of unknown value");
    let mag = match sampler.mag_filter {
        Some(9728) => Filter::Nearest,
        Some(9729) | None => Filter::Linear,
        Some(_) => {
            unknown();
            default.mag
        }
    };
    let (min, mip) = match sampler.min_filter {
        Some(9728) => (Filter::Nearest, MipFilter::None),
        Some(9729) => (Filter::Linear, MipFilter::None),
        Some(9984) => (Filter::Nearest, MipFilter::Nearest),
        Some(9985) => (Filter::Linear, MipFilter::Nearest),
        Some(9986) => (Filter::Nearest, MipFilter::Linear),
        Some(9987) | None => (Filter::Linear, MipFilter::Linear),
        Some(_) => {
            unknown();
            (default.min, default.mip)
        }
    };
    let mut wrap = |code| match code {
        Some(33_071) => Wrap::ClampToEdge,
        Some(33_648) => Wrap::MirroredRepeat,
        Some(10_497) | None => Wrap::Repeat,
        Some(_) => {
            unknown();
            Wrap::Repeat
        }
    };
    Sampler { mag, min, mip, wrap_u: wrap(sampler.wrap_s), wrap_v: wrap(sampler.wrap_t) }
}

/// Texture from UV: offset * rotation * scale. The rotation is counter-clockwise in the image, whose v points down: the
/// extension's example (offset (0, 1), rotation by 90°, scale 1/2) must show the lower left quadrant.
fn texture_from_uv(transform: &TextureTransform) -> Affine2 {
    let rotation = Mat2::from_angle(-transform.rotation);
    let scale = Mat2::from_diagonal(Vec2::from(transform.scale));
    Affine2::from_mat2_translation(rotation * scale, transform.offset.into())
}
