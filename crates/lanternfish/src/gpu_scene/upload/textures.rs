//! Textures with their mip levels, and samplers.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use lanternfish_gpu::{Bindings, Gpu, GpuError, software_mesa};
use lanternfish_scene::{Filter, Image, LayerTextures, Material, MipFilter, Scene, TextureRef, Wrap};
use rayon::prelude::*;

use super::{lobes::Shading, mips};

/// Number of textures whose mip levels are made at a time: bounds the staging memory.
pub(super) const BATCH: usize = 16;
/// Value of [`Anisotropy::Auto`] on hardware: every adapter supports it.
const HARDWARE_ANISOTROPY: u16 = 16;
/// Value of [`Anisotropy::Auto`] on a software adapter: the README lists the time and the error of each value there.
const SOFTWARE_ANISOTROPY: u16 = 4;
/// First version of Mesa's software rasterizer with usable anisotropic filtering. 22.3.6 takes minutes for a frame that
/// takes a second without; 25.0.7 is fine; those between are untested.
const FIRST_ANISOTROPIC_MESA: u32 = 25;
/// Names of a material's textures and samplers, if textures are not one array.
const NAMES: [(&str, &str); MAPS] = [
    ("base_color_texture", "base_color_sampler"),
    ("metallic_roughness_texture", "metallic_roughness_sampler"),
    ("normal_texture", "normal_sampler"),
    ("emissive_texture", "emissive_sampler"),
    ("specular_texture", "specular_sampler"),
    ("specular_color_texture", "specular_color_sampler"),
    ("transmission_texture", "transmission_sampler"),
    ("diffuse_transmission_texture", "diffuse_transmission_sampler"),
    ("diffuse_transmission_color_texture", "diffuse_transmission_color_sampler"),
    ("coat_or_sheen_texture", "coat_or_sheen_sampler"),
    ("coat_roughness_or_anisotropy_texture", "coat_roughness_or_anisotropy_sampler"),
    ("coat_normal_or_iridescence_texture", "coat_normal_or_iridescence_sampler"),
];
/// Number of materials above which textures are one array where the device has arrays, whatever the settings say: a
/// software adapter maps memory for each material that a pass binds, and a process has 65,530 mappings. Few passes of a
/// frame draw a material again.
const MOST_BOUND_MATERIALS: usize = 8192;
/// Textures of a material that are shaded.
const MAPS: usize = 12;

/// Images on the device, by their index in the scene and whether they are read as sRGB: the view, and the size of all
/// levels, bytes.
pub(in crate::gpu_scene) type Images = BTreeMap<(usize, bool), (wgpu::TextureView, u64)>;

/// The textures of a scene on the device. Texture 0 is one white texel.
#[derive(Debug)]
pub struct Textures {
    /// True if shaders bind them as one array.
    pub arrays: bool,
    /// Size of the texels of all levels, bytes.
    pub bytes: u64,
    images: Images,
    /// Views of `images` in their order, after the white texel.
    views: Vec<wgpu::TextureView>,
    samplers: Vec<wgpu::Sampler>,
    /// Texture and sampler of each scene texture, by (index, whether read as sRGB).
    slots: HashMap<(usize, bool), (u32, u32)>,
    /// Textures and samplers of each material, by index.
    by_material: Vec<[(u32, u32); MAPS]>,
    /// By material: the first material with the same textures and samplers.
    sets: Vec<u32>,
}

/// The textures of a material that are shaded, and whether they are sRGB-encoded.
fn references(material: &Material, shading: Shading) -> [(Option<TextureRef>, bool); MAPS] {
    let file = shading == Shading::File;
    let of_file = |texture: &Option<TextureRef>| texture.filter(|_| file);
    let LayerTextures { sheen_color, sheen_roughness, anisotropy, iridescence, iridescence_thickness } =
        material.layer_textures();
    let sheen = sheen_color.or(sheen_roughness);
    [
        (material.base_color_texture, true),
        (of_file(&material.metallic_roughness_texture), false),
        (of_file(&material.normal_texture), false),
        (material.emissive_texture, true),
        (of_file(&material.specular_texture), false),
        (of_file(&material.specular_color_texture), true),
        (of_file(&material.transmission_texture), false),
        (of_file(&material.diffuse_transmission_texture), false),
        (of_file(&material.diffuse_transmission_color_texture), true),
        (of_file(&sheen.or(material.clearcoat_texture)), sheen.is_some()),
        (of_file(&material.clearcoat_roughness_texture.or(anisotropy)), false),
        (of_file(&material.clearcoat_normal_texture.or(iridescence).or(iridescence_thickness)), false),
    ]
}

/// Images that are shaded, and whether each is read as sRGB: an image that is read both ways is uploaded twice.
pub(in crate::gpu_scene) fn read(scene: &Scene, shading: Shading) -> BTreeSet<(usize, bool)> {
    let references = scene.materials.iter().flat_map(|material| references(material, shading));
    references.filter_map(|(reference, srgb)| Some((scene.textures[reference?.texture].image, srgb))).collect()
}

impl Textures {
    /// `kept`: images that are already on the device. `skipped`: levels that are left out, the largest first.
    pub(in crate::gpu_scene) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        shading: Shading,
        arrays: bool,
        anisotropy: u16,
        (kept, skipped): (Images, u32),
    ) -> Result<Self, GpuError> {
        let requested: Vec<(usize, bool)> = read(scene, shading).into_iter().collect();
        let mut slots = HashMap::new();
        for (reference, srgb) in scene.materials.iter().flat_map(|material| references(material, shading)) {
            let Some(reference) = reference else { continue };
            let texture = scene.textures[reference.texture];
            let index = requested.binary_search(&(texture.image, srgb)).expect("what is read is uploaded");
            slots.insert((reference.texture, srgb), (index as u32 + 1, texture.sampler as u32));
        }

        let limit = device.limits().max_texture_dimension_2d;
        if let Some((image, _)) =
            requested.iter().find(|(i, _)| scene.images[*i].width.max(scene.images[*i].height) > limit)
        {
            let Image { name, width, height, .. } = &scene.images[*image];
            return Err(GpuError::TextureSize { name: name.clone(), width: *width, height: *height, limit });
        }

        let white = upload(device, queue, "white", &[(&[255; 4], 1, 1)], false);
        let mut images = kept;
        images.retain(|key, _| requested.binary_search(key).is_ok());
        let missing: Vec<_> = requested.iter().copied().filter(|key| !images.contains_key(key)).collect();
        for batch in missing.chunks(BATCH) {
            let levels: Vec<_> = batch.par_iter().map(|(image, srgb)| levels(&scene.images[*image], *srgb)).collect();
            for ((index, srgb), smaller) in batch.iter().zip(levels) {
                let image = &scene.images[*index];
                let mut levels = vec![(&image.rgba[..], image.width, image.height)];
                levels.extend(smaller.iter().map(|(rgba, width, height)| (&rgba[..], *width, *height)));
                let levels = &levels[(skipped as usize).min(levels.len() - 1)..];
                let bytes = levels.iter().map(|(rgba, ..)| rgba.len() as u64).sum();
                images.insert((*index, *srgb), (upload(device, queue, &image.name, levels, *srgb), bytes));
            }
            // Submits pending copies, so that their staging memory can be freed.
            queue.submit([]);
        }

        let bytes = 4 + images.values().map(|(_, bytes)| bytes).sum::<u64>();
        let views: Vec<_> = std::iter::once(white).chain(images.values().map(|(view, _)| view.clone())).collect();
        let mut samplers: Vec<_> = scene.samplers.iter().map(|s| sampler(device, s, anisotropy)).collect();
        if samplers.is_empty() {
            samplers.push(sampler(device, &Default::default(), anisotropy));
        }
        let slot = |reference: Option<TextureRef>, srgb| reference.map_or((0, 0), |r| slots[&(r.texture, srgb)]);
        let by_material: Vec<_> = scene
            .materials
            .iter()
            .map(|material| references(material, shading).map(|(reference, srgb)| slot(reference, srgb)))
            .collect();
        let mut first = HashMap::new();
        let sets = by_material.iter().zip(0..).map(|(slots, index)| *first.entry(*slots).or_insert(index)).collect();
        let has_arrays = device.features().contains(Gpu::TEXTURE_ARRAYS);
        let arrays = arrays || (has_arrays && scene.materials.len() > MOST_BOUND_MATERIALS);
        let most = device.limits().max_binding_array_elements_per_shader_stage as usize;
        Ok(Self { arrays: arrays && views.len() <= most, bytes, images, views, samplers, slots, by_material, sets })
    }

    /// The uploaded images for which `is_as_it_was` is true.
    pub(in crate::gpu_scene) fn images(&self, is_as_it_was: impl Fn(usize) -> bool) -> Images {
        let kept = self.images.iter().filter(|((image, _), _)| is_as_it_was(*image));
        kept.map(|(key, uploaded)| (*key, uploaded.clone())).collect()
    }

    /// Index of the texture and of the sampler of a scene texture; the white texel if it was not uploaded.
    pub(in crate::gpu_scene) fn slot(&self, texture: usize, srgb: bool) -> (u32, u32) {
        self.slots.get(&(texture, srgb)).copied().unwrap_or_default()
    }

    /// Lengths of the arrays, by their names in the shaders.
    pub(in crate::gpu_scene) fn array_lengths(&self) -> [(&'static str, u32); 2] {
        [("material_textures", self.views.len() as u32), ("material_samplers", self.samplers.len() as u32)]
    }

    /// Calls `with` with all textures as arrays.
    pub(in crate::gpu_scene) fn with_arrays<R>(&self, with: impl FnOnce(&Bindings<'_>) -> R) -> R {
        let views: Vec<_> = self.views.iter().collect();
        let samplers: Vec<_> = self.samplers.iter().collect();
        let bindings = Bindings::new()
            .resource("material_textures", wgpu::BindingResource::TextureViewArray(&views))
            .resource("material_samplers", wgpu::BindingResource::SamplerArray(&samplers));
        with(&bindings)
    }

    /// Equal for materials with the same textures and samplers.
    pub(in crate::gpu_scene) fn set_of_material(&self, material: u32) -> u32 {
        self.sets[material as usize]
    }

    /// The textures of one material.
    pub(in crate::gpu_scene) fn of_material(&self, material: u32) -> Bindings<'_> {
        let slots = self.by_material[material as usize];
        NAMES.iter().zip(slots).fold(Bindings::new(), |bindings, ((texture_name, sampler_name), (texture, sampler))| {
            bindings
                .texture(texture_name, &self.views[texture as usize])
                .sampler(sampler_name, &self.samplers[sampler as usize])
        })
    }
}

type Level = (Vec<u8>, u32, u32);

/// All levels below the first.
fn levels(image: &Image, srgb: bool) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    loop {
        let (rgba, width, height) = match levels.last() {
            Some((rgba, width, height)) => (rgba, *width, *height),
            None => (&image.rgba, image.width, image.height),
        };
        if width == 1 && height == 1 {
            return levels;
        }
        let next = mips::half(rgba, width, height, srgb);
        levels.push(next);
    }
}

/// `levels`: texels, width and height of each.
fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    levels: &[(&[u8], u32, u32)],
    srgb: bool,
) -> wgpu::TextureView {
    let texture = create(device, label, (levels[0].1, levels[0].2), levels.len() as u32, srgb);
    for (level, (rgba, width, height)) in levels.iter().enumerate() {
        write(queue, &texture, level as u32, rgba, (*width, *height));
    }
    texture.create_view(&Default::default())
}

fn create(device: &wgpu::Device, label: &str, (width, height): (u32, u32), levels: u32, srgb: bool) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: if srgb { wgpu::TextureFormat::Rgba8UnormSrgb } else { wgpu::TextureFormat::Rgba8Unorm },
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, level: u32, rgba: &[u8], (width, height): (u32, u32)) {
    let target = wgpu::TexelCopyTextureInfo { mip_level: level, ..texture.as_image_copy() };
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
    queue.write_texture(target, rgba, layout, wgpu::Extent3d { width, height, depth_or_array_layers: 1 });
}

/// Greatest number of anisotropic samples if the adapter decides: 1 on a software driver that is known to stall with
/// more.
pub fn automatic_anisotropy(adapter: &wgpu::AdapterInfo) -> u16 {
    match (adapter.device_type, software_mesa(adapter)) {
        (_, Some(0..FIRST_ANISOTROPIC_MESA)) => 1,
        (wgpu::DeviceType::Cpu, _) => SOFTWARE_ANISOTROPY,
        _ => HARDWARE_ANISOTROPY,
    }
}

fn sampler(device: &wgpu::Device, sampler: &lanternfish_scene::Sampler, anisotropy: u16) -> wgpu::Sampler {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
        Wrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
    };
    let filter = |f: Filter| match f {
        Filter::Nearest => wgpu::FilterMode::Nearest,
        Filter::Linear => wgpu::FilterMode::Linear,
    };
    let all_linear = sampler.mag == Filter::Linear && sampler.min == Filter::Linear && sampler.mip == MipFilter::Linear;
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("material"),
        address_mode_u: wrap(sampler.wrap_u),
        address_mode_v: wrap(sampler.wrap_v),
        mag_filter: filter(sampler.mag),
        min_filter: filter(sampler.min),
        mipmap_filter: match sampler.mip {
            MipFilter::Linear => wgpu::MipmapFilterMode::Linear,
            MipFilter::None | MipFilter::Nearest => wgpu::MipmapFilterMode::Nearest,
        },
        lod_max_clamp: if sampler.mip == MipFilter::None { 0.0 } else { 32.0 },
        anisotropy_clamp: if all_linear { anisotropy } else { 1 },
        ..Default::default()
    })
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::testing;
    use lanternfish_scene::{Sampler, Texture};

    use super::*;
    use crate::settings::Anisotropy;

    #[test]
    fn anisotropy_is_as_asked_or_as_the_driver_bears() {
        let (hardware, software) = (wgpu::DeviceType::DiscreteGpu, wgpu::DeviceType::Cpu);
        for (device_type, driver, samples) in [
            (hardware, "Mesa 22.3.6", 16),
            (hardware, "555.42", 16),
            (software, "Mesa 22.3.6", 1),
            (software, "Mesa 24.3.1 (LLVM 19)", 1),
            (software, "Mesa 25.0.7-2 (LLVM 15.0.6)", 4),
            (software, "SwiftShader", 4),
        ] {
            let adapter = wgpu::AdapterInfo {
                driver_info: driver.to_owned(),
                ..wgpu::AdapterInfo::new(device_type, wgpu::Backend::Vulkan)
            };
            assert_eq!(automatic_anisotropy(&adapter), samples, "{driver}");
        }
        for setting in Anisotropy::ALL {
            assert_eq!(setting.samples().map(|n| n.to_string()).unwrap_or("auto".to_owned()), setting.to_string());
        }
    }

    #[gpu_test]
    fn gpu_an_image_larger_than_textures_can_be_is_refused_by_its_pixels(gpu: &Gpu) {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        let upload = |width: u32, height: u32| {
            let rgba = vec![255; 4 * width as usize * height as usize];
            let texture = TextureRef::new(0);
            let scene = Scene {
                images: vec![Image { name: "moss".to_owned(), width, height, rgba }],
                samplers: vec![Sampler::default()],
                textures: vec![Texture { image: 0, sampler: 0 }],
                materials: vec![Material { base_color_texture: Some(texture), ..Material::default() }],
                ..Scene::default()
            };
            Textures::new(&gpu.device, &gpu.queue, &scene, Shading::Lambert, false, 1, (Images::new(), 0))
                .err()
                .map(|e| e.to_string())
        };
        assert_eq!(upload(1, limit), None);
        for (width, height) in [(limit + 1, 1), (1, limit + 1)] {
            let expected =
                format!("texture \"moss\" of {width} x {height} pixels: the adapter's limit is {limit} a side");
            assert_eq!(upload(width, height), Some(expected));
        }
    }
}
