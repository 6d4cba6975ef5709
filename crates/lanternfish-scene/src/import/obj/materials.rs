//! Conversion of MTL materials to metallic-roughness materials.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;
use lanternfish_limits::memory::{Budget, TooMuch};

use super::Notes;
use super::clean::split_key;
use super::textures::{Map, Textures};
use crate::{AlphaMode, Image, Material, Scene, import::files::Files};

/// Upper bound of the memory that reading an MTL file takes, bytes: its text, which grows where numbers are written without
/// an exponent; and for each line a `tobj` material, in a list that doubles as it grows, and two entries in tables of names.
pub(super) fn bytes_needed(file: &[u8]) -> u64 {
    let lines = 1 + file.iter().filter(|byte| **byte == b'\n').count() as u64;
    4 * file.len() as u64 + (2 * size_of::<tobj::Material>() as u64 + 512) * lines
}

/// The text of the MTL file `name` without the lines on which `tobj` 4 panics or fails; these are noted. A colour of one
/// number is grey.
pub(super) fn clean(text: &str, name: &str, notes: &mut Notes) -> String {
    let mut out = String::with_capacity(text.len());
    let mut dropped: Vec<(usize, &str)> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let (key, rest) = split_key(line);
        let numbers = || rest.split_whitespace().map_while(|word| word.parse::<f32>().ok());
        let rest = match key {
            "newmtl" if rest.is_empty() => "unnamed".to_owned(),
            "Ka" | "Kd" | "Ks" | "Ke" => match numbers().collect::<Vec<_>>()[..] {
                [grey] if grey.is_finite() => format!("{grey} {grey} {grey}"),
                [r, g, b, ..] if [r, g, b].iter().all(|c: &f32| c.is_finite()) => format!("{r} {g} {b}"),
                _ => {
                    dropped.push((number, line));
                    continue;
                }
            },
            "Ns" | "Ni" | "d" | "Tr" | "Pr" | "Pm" => match numbers().next().filter(|number| number.is_finite()) {
                Some(number) => number.to_string(),
                None => {
                    dropped.push((number, line));
                    continue;
                }
            },
            "illum" => match rest.split_whitespace().next().and_then(|word| word.parse::<u8>().ok()) {
                Some(model) => model.to_string(),
                None => {
                    dropped.push((number, line));
                    continue;
                }
            },
            _ if rest.is_empty() || key.starts_with('#') => continue,
            _ => rest.to_owned(),
        };
        out.extend([key, " ", &rest, "\n"]);
    }
    if let Some((number, line)) = dropped.first() {
        let (count, number, line) = (dropped.len(), number + 1, line.trim());
        let line: String = line.chars().take(60).collect();
        notes.insert(format!("{name}: {count} lines have no readable value and are left out; line {number}: {line}"));
    }
    out
}

/// The scene's materials, converted on first use.
pub(super) struct Materials {
    pub list: Vec<Material>,
    /// Indices into `list` by the name in the library; `None` is the default material.
    indices: BTreeMap<Option<String>, usize>,
    textures: Textures,
    /// Albedo of the default material.
    default: f32,
}

impl Materials {
    /// Decodes the textures of all `used` materials.
    pub fn new<'a>(
        used: impl Iterator<Item = &'a tobj::Material>,
        default: f32,
        files: &Files,
        notes: &mut Notes,
    ) -> Result<Self, TooMuch> {
        let names: BTreeSet<String> = used.flat_map(|m| Maps::of(m).all().map(|map| map.file)).collect();
        Ok(Self {
            list: Vec::new(),
            indices: BTreeMap::new(),
            textures: Textures::decode(&names, files, notes)?,
            default,
        })
    }

    /// The index of a material; `None` is the default one.
    pub fn index(
        &mut self,
        source: Option<&tobj::Material>,
        budget: &Budget,
        notes: &mut Notes,
    ) -> Result<usize, TooMuch> {
        let key = source.map(|material| material.name.clone());
        if let Some(index) = self.indices.get(&key) {
            return Ok(*index);
        }
        let material = match source {
            Some(source) => convert(source, &mut self.textures, budget, notes)?,
            None => {
                Material { base_color: Vec3::splat(self.default).extend(1.0), metallic: 0.0, ..Material::default() }
            }
        };
        self.list.push(material);
        self.indices.insert(key, self.list.len() - 1);
        Ok(self.list.len() - 1)
    }

    /// Moves materials and textures into the scene.
    pub fn finish(self, scene: &mut Scene) {
        scene.materials = self.list;
        self.textures.finish(scene);
    }
}

/// The texture maps of a material that are read.
struct Maps {
    color: Option<Map>,
    opacity: Option<Map>,
    emission: Option<Map>,
    normal: Option<Map>,
}

impl Maps {
    fn of(source: &tobj::Material) -> Self {
        let parse = |text: Option<&String>| text.and_then(|text| Map::parse(text));
        let other = |key: &str| source.unknown_param.get(key);
        Self {
            color: parse(source.diffuse_texture.as_ref()),
            opacity: parse(source.dissolve_texture.as_ref()),
            emission: parse(other("map_Ke")),
            normal: parse(other("norm").or(source.normal_texture.as_ref())),
        }
    }

    fn all(self) -> impl Iterator<Item = Map> {
        [self.color, self.opacity, self.emission, self.normal].into_iter().flatten()
    }
}

/// True if a material names a texture that is read.
pub(super) fn is_mapped(source: &tobj::Material) -> bool {
    Maps::of(source).all().next().is_some()
}

/// Converts a material. Non-finite numbers count as absent.
///
/// - base colour: `Kd` (linear; default 0.8, or 1 with a `map_Kd`) × `map_Kd` (sRGB-encoded);
/// - metallic: `Pm`, else 0;
/// - roughness: `Pr`; else 1 if there is no highlight (`illum` 0 or 1, `Ks` black, no `Ns`); else the roughness whose
///   microfacet distribution is as wide as a Blinn lobe of exponent `Ns`: alpha² = 2 / (Ns + 2) [Walter2007, §5.2];
/// - emission: `Ke` (default 1 with a `map_Ke`) × `map_Ke`, nits;
/// - alpha: `d`, else 1 − `Tr`; less than 1 is alpha blending. `map_d` is a mask with cutoff 0.5, or part of the blended alpha if `d` < 1;
/// - normal map: `norm`, else `map_Bump` or `bump` if its pixels are tangent-space normals; a height map is left out
///   with a warning.
fn convert(
    source: &tobj::Material,
    textures: &mut Textures,
    budget: &Budget,
    notes: &mut Notes,
) -> Result<Material, TooMuch> {
    let maps = Maps::of(source);
    let color = |value: Option<[f32; 3]>| value.map(Vec3::from).filter(|c| c.is_finite()).map(|c| c.max(Vec3::ZERO));
    let finite = |value: &f32| value.is_finite();
    let other = |key: &str| source.unknown_param.get(key)?.split_whitespace().next()?.parse().ok().filter(finite);
    let unit = |value: f32| value.clamp(0.0, 1.0);

    let base_texture = match (&maps.color, &maps.opacity) {
        (color, Some(opacity)) if textures.image(opacity).is_some() => {
            textures.with_opacity(color.as_ref(), opacity, budget)?
        }
        (Some(color), _) => textures.texture(color),
        (None, _) => None,
    };
    let has_mask = maps.opacity.as_ref().is_some_and(|map| textures.image(map).is_some());
    let diffuse = color(source.diffuse).unwrap_or(Vec3::splat(if base_texture.is_some() { 1.0 } else { 0.8 }));
    let alpha = unit(source.dissolve.filter(finite).or(other("Tr").map(|tr: f32| 1.0 - tr)).unwrap_or(1.0));
    let alpha_mode = match (alpha < 1.0, has_mask) {
        (true, _) => AlphaMode::Blend,
        (false, true) => AlphaMode::Mask { cutoff: 0.5 },
        (false, false) => AlphaMode::Opaque,
    };
    let is_dull = matches!(source.illumination_model, Some(0 | 1)) || color(source.specular) == Some(Vec3::ZERO);
    let roughness = match (other("Pr"), source.shininess.filter(finite)) {
        (Some(roughness), _) => roughness,
        (None, Some(exponent)) if !is_dull => (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25),
        _ => 1.0,
    };
    let emissive_texture = maps.emission.as_ref().and_then(|map| textures.texture(map));
    let no_emission = if emissive_texture.is_some() { Vec3::ONE } else { Vec3::ZERO };
    let normal_map = maps.normal.filter(|map| match textures.image(map) {
        Some(image) if is_normal_map(image) => true,
        Some(_) => {
            notes.insert("height maps (bump) are left out; normal maps are read".to_owned());
            false
        }
        None => false,
    });
    Ok(Material {
        name: source.name.clone(),
        base_color: diffuse.min(Vec3::ONE).extend(alpha),
        base_color_texture: base_texture,
        metallic: unit(other("Pm").unwrap_or(0.0)),
        perceptual_roughness: unit(roughness),
        normal_scale: normal_map.as_ref().map_or(1.0, |map| map.strength),
        normal_texture: normal_map.and_then(|map| textures.texture(&map)),
        emissive: color(source.emissive).unwrap_or(no_emission),
        emissive_texture,
        alpha_mode,
        ..Material::default()
    })
}

/// True if the pixels are tangent-space normals: their mean points out of the surface. A height map is grey.
fn is_normal_map(image: &Image) -> bool {
    let pixels = image.rgba.as_chunks::<4>().0;
    let mean = |channel: usize| pixels.iter().map(|p| f64::from(p[channel])).sum::<f64>() / pixels.len() as f64;
    // Mean blue above 3/4 is a mean tilt of less than 60°. Mean red and green are within 1/5 of the range of its centre.
    mean(2) > 191.0 && (mean(0) - 127.5).abs() < 51.0 && (mean(1) - 127.5).abs() < 51.0
}
