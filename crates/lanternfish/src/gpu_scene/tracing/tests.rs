//! Gathering, order, and packing of masks.

use glam::UVec2;
use lanternfish_gpu::testing::{self, Memory};
use lanternfish_scene::{AlphaMode, Filter, Image, Material, Mesh, Primitive, Sampler, Texture, TextureRef, Wrap};

use super::{masks::HEADER_WORDS, *};
use crate::{gpu_scene::shaders::MaskHeader, testing::probe};

fn scene() -> Scene {
    let quad = |material: usize, z: f32| Primitive {
        material,
        positions: vec![Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(0.0, 1.0, z), Vec3::NAN],
        uv0: vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ZERO],
        normals: vec![Vec3::Z; 4],
        indices: vec![0, 1, 2, 0, 0, 2, 0, 1, 3],
        ..Default::default()
    };
    let masked = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.25 },
        base_color_texture: Some(TextureRef::new(0)),
        ..Default::default()
    };
    let rough_glass = Material { transmission: 1.0, ..Default::default() };
    Scene {
        meshes: vec![Mesh { primitives: vec![quad(0, 0.0), quad(1, 1.0), quad(2, 2.0)], ..Default::default() }],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: glam::Affine3A::IDENTITY }; 2],
        materials: vec![Material::default(), masked, rough_glass],
        textures: vec![Texture { image: 0, sampler: 0 }],
        samplers: vec![Sampler::default()],
        images: vec![Image {
            name: String::new(),
            width: 3,
            height: 1,
            rgba: vec![9, 9, 9, 1, 9, 9, 9, 2, 9, 9, 9, 3],
        }],
        ..Default::default()
    }
}

/// More bytes than any test needs.
pub(super) const ANY: u64 = 1 << 20;

fn records(tracing: &Tracing) -> &[MaskRecord] {
    bytemuck::cast_slice(&tracing.masks[..RECORD_WORDS * tracing.record_count])
}

fn header(tracing: &Tracing, record: usize) -> MaskHeader {
    let at = records(tracing)[record].header as usize;
    bytemuck::cast_slice(&tracing.masks[at..at + HEADER_WORDS])[0]
}

fn texels(tracing: &Tracing, header: MaskHeader) -> &[u8] {
    let bytes: &[u8] = bytemuck::cast_slice(&tracing.masks[header.texels as usize..]);
    &bytes[..header.size.element_product() as usize]
}

/// One masked triangle for each of these: image, wrap, cutoff. Images are square, of these sizes, with random texels.
pub(super) fn masked_scene(sizes: &[u32], masks: &[(usize, Wrap, f32)]) -> Scene {
    let mut random = crate::testing::Random::new(3);
    let mut scene = Scene::default();
    for size in sizes {
        let rgba = (0..4 * size * size).map(|_| (256.0 * random.unit()) as u8).collect();
        scene.images.push(Image { name: String::new(), width: *size, height: *size, rgba });
    }
    let mut primitives = Vec::new();
    for (material, (image, wrap, cutoff)) in masks.iter().enumerate() {
        scene.samplers.push(Sampler { wrap_u: *wrap, wrap_v: Wrap::ClampToEdge, ..Sampler::default() });
        scene.textures.push(Texture { image: *image, sampler: material });
        scene.materials.push(Material {
            alpha_mode: AlphaMode::Mask { cutoff: *cutoff },
            base_color_texture: Some(TextureRef::new(material)),
            ..Material::default()
        });
        primitives.push(Primitive {
            material,
            positions: [0; 3].map(|_| random.point()).to_vec(),
            normals: vec![Vec3::Z; 3],
            uv0: [0; 3].map(|_| Vec2::new(random.unit(), random.unit())).to_vec(),
            colors: [0; 3].map(|_| glam::Vec4::splat(random.unit())).to_vec(),
            indices: vec![0, 1, 2],
            ..Primitive::default()
        });
    }
    scene.meshes = vec![Mesh { name: String::new(), primitives }];
    scene.instances = vec![Instance { name: String::new(), mesh: 0, world_from_object: glam::Affine3A::IDENTITY }];
    assert_eq!(scene.validate(), Ok(()));
    scene
}

#[test]
fn constants_are_the_shaders() {
    let file = "gpu_scene/mask";
    assert_eq!(crate::shaders::constant(file, "RECORD_WORDS"), RECORD_WORDS as f64);
    for (wrap, name) in [(Wrap::Repeat, "REPEAT"), (Wrap::MirroredRepeat, "MIRRORED_REPEAT")] {
        let tracing = Tracing::new(&masked_scene(&[4], &[(0, wrap, 0.5)]), ANY);
        assert_eq!(f64::from(header(&tracing, 0).wrap.x), crate::shaders::constant(file, name));
    }
}

#[gpu_test]
fn gpu_records_and_headers_are_read_as_they_are_packed(gpu: &Gpu) {
    // All words of the second header differ, and so do those of the first record: a swap of any two is detected.
    let masks = [(0, Wrap::MirroredRepeat, 0.25), (1, Wrap::Repeat, 0.75)];
    let mut scene = masked_scene(&[4, 6], &masks);
    (scene.images[1].width, scene.images[1].height) = (12, 3);
    scene.samplers[0].mag = Filter::Nearest;
    let tracing = Tracing::new(&scene, ANY);

    let kernel = probe(gpu, "testing/masks", &[], "read_masks");
    let mut memory = Memory::new();
    memory.bind(&["masks"], &tracing.masks);
    memory.bind(&["found_records"], &[MaskRecord::default(); 2]);
    memory.bind(&["found_headers"], &[MaskHeader::default(); 2]);
    memory.run(gpu, &kernel, [1, 1, 1]);
    assert_eq!(memory.get::<MaskRecord>("found_records"), records(&tracing));
    let actual: Vec<MaskHeader> = memory.get("found_headers");
    assert_eq!(actual, [0, 1].map(|record| header(&tracing, record)));

    let differ = |words: &[u32]| words.iter().collect::<std::collections::BTreeSet<_>>().len() == words.len();
    assert!(differ(&bytemuck::cast_slice(&actual[1..])[..HEADER_WORDS - 1]), "{actual:?}");
    assert!(differ(&tracing.masks[..RECORD_WORDS]), "{:?}", records(&tracing)[0]);
}

#[test]
fn masks_of_one_image_share_its_texels_and_equal_ones_their_header() {
    // Nine materials of one image take as many bytes as one, except for headers.
    let mut masks: Vec<_> = (0..8).map(|i| (0, Wrap::Repeat, 0.1 * i as f32)).collect();
    masks.push((0, Wrap::MirroredRepeat, 0.0));
    masks.push(masks[3]);
    let scene = masked_scene(&[64], &masks);
    let tracing = Tracing::new(&scene, ANY);
    assert_eq!(tracing.masks.len(), 10 * RECORD_WORDS + 9 * HEADER_WORDS + 64 * 64 / 4);
    let alpha: Vec<u8> = scene.images[0].rgba.iter().skip(3).step_by(4).copied().collect();
    for (record, (_, wrap, cutoff)) in masks.iter().enumerate() {
        let header = header(&tracing, record);
        assert_eq!((header.cutoff, header.wrap.x), (*cutoff, u32::from(*wrap == Wrap::MirroredRepeat)));
        assert_eq!(texels(&tracing, header), alpha);
    }
}

#[test]
fn masks_that_do_not_fit_are_halved_the_largest_first() {
    let masks = [(0, Wrap::Repeat, 0.5), (1, Wrap::Repeat, 0.5), (2, Wrap::Repeat, 0.5)];
    let scene = masked_scene(&[64, 16, 33], &masks);
    let fixed = 4 * (3 * (RECORD_WORDS + HEADER_WORDS)) as u64;
    let full = fixed + 64 * 64 + 16 * 16 + 33 * 33 + 3;
    let sizes = |bytes: u64| {
        let tracing = Tracing::new(&scene, bytes);
        assert!(4 * tracing.masks.len() as u64 <= bytes.max(fixed + 12), "{bytes} bytes");
        [0, 1, 2].map(|record| header(&tracing, record).size.x)
    };
    assert_eq!(sizes(full), [64, 16, 33]);
    assert_eq!(sizes(full - 1), [32, 16, 33]);
    assert_eq!(sizes(fixed + 32 * 32 + 2 * 16 * 16), [32, 16, 16]);
    assert_eq!(sizes(fixed + 3 * 16 * 16), [16, 16, 16]);
    // Records are kept; a device's limit would refuse them.
    assert_eq!(sizes(0), [2, 2, 2]);

    // Two by two texels are averaged.
    let tracing = Tracing::new(&scene, full - 1);
    let alpha = |x: usize, y: usize| u32::from(scene.images[0].rgba[4 * (64 * y + x) + 3]);
    let halved = texels(&tracing, header(&tracing, 0));
    for (i, texel) in halved.iter().enumerate() {
        let (x, y) = (2 * (i % 32), 2 * (i / 32));
        let sum = alpha(x, y) + alpha(x + 1, y) + alpha(x, y + 1) + alpha(x + 1, y + 1);
        assert_eq!(u32::from(*texel), (sum + 2) / 4, "texel {i}");
    }
}

#[test]
fn degenerate_and_rough_glass_triangles_are_left_out_and_records_follow_their_triangles() {
    let mut tracing = Tracing::new(&scene(), ANY);
    let of_triangles: Vec<u32> = tracing.triangles.iter().map(|t| t.source.record).collect();
    assert_eq!(of_triangles, [0, 1, 0, 2]);
    // The mask: one header, three alphas in one word.
    assert_eq!(tracing.masks.len(), 2 * RECORD_WORDS + HEADER_WORDS + 1);
    assert_eq!(
        header(&tracing, 1),
        MaskHeader {
            size: UVec2::new(3, 1),
            linear_filter: 1,
            cutoff: 0.25,
            texels: (2 * RECORD_WORDS + HEADER_WORDS) as u32,
            ..MaskHeader::default()
        }
    );
    assert_eq!(tracing.masks.last(), Some(&0x030201));

    tracing.masks[0] = 7;
    tracing.reorder(&[3, 2, 1, 0]);
    assert_eq!(tracing.triangles.iter().map(|t| t.source.record).collect::<Vec<_>>(), [1, 0, 2, 0]);
    assert_eq!((tracing.masks[0], tracing.masks[RECORD_WORDS]), (0, 7));
}

#[test]
fn posed_triangles_match_gathered_ones_and_overflow_gives_points() {
    let mut scene = scene();
    let mut tracing = Tracing::new(&scene, ANY);
    tracing.reorder(&[3, 2, 1, 0]);
    let sources: Vec<Source> = tracing.triangles.iter().map(|triangle| triangle.source).collect();
    assert_eq!(pose(&scene, &tracing.parts, &sources), tracing.triangles);
    // The second instance moves: its two triangles come first in the order.
    scene.instances[1].world_from_object = glam::Affine3A::from_translation(Vec3::X);
    let posed = pose(&scene, &tracing.parts, &sources);
    assert_eq!(posed[2..], tracing.triangles[2..]);
    for (posed, before) in posed[..2].iter().zip(&tracing.triangles) {
        assert_eq!((posed.corners, posed.source), (before.corners.map(|corner| corner + Vec3::X), before.source));
    }
    // All entries of the transform are finite, but its image of the corner at x = 1 is not.
    scene.instances[1].world_from_object.translation.x = 3e38;
    scene.instances[1].world_from_object.matrix3.x_axis.x = 1e38;
    let posed = pose(&scene, &tracing.parts, &sources);
    assert!(posed[..2].iter().all(|triangle| triangle.corners == [Vec3::ZERO; 3]), "{posed:?}");
    assert_eq!(posed[2..], tracing.triangles[2..]);
}

#[test]
fn panes_are_masks_that_are_solid_nowhere_and_have_a_block_each() {
    let mut scene = scene();
    let glass = Material { transmission: 0.5, perceptual_roughness: 0.0, ..Material::default() };
    scene.materials[0] = Material { base_color: glam::Vec4::new(0.8, 0.4, 0.2, 0.9), metallic: 0.0, ..glass };
    scene.materials[2] = Material { alpha_mode: AlphaMode::Blend, ..Material::default() };
    scene.materials[2].base_color.w = 0.6;
    let mut tracing = Tracing::new(&scene, ANY);
    assert_eq!(tracing.triangles.iter().map(|t| t.source.record).collect::<Vec<_>>(), [1, 2, 3, 4, 5, 6]);
    // The masks are solid, the panes are kept.
    for texel in scene.images[0].rgba.iter_mut() {
        *texel = 255;
    }
    tracing = Tracing::new(&scene, ANY);
    tracing.decide_opacity(ANY);
    tracing.write_panes(&scene, Shading::File);
    let of_triangles =
        |t: &Tracing| t.triangles.iter().map(|t| (t.source.record, t.source.opacity)).collect::<Vec<_>>();
    assert_eq!(of_triangles(&tracing), [(1, 0), (0, 0), (2, 0), (3, 0), (0, 0), (4, 0)]);
    let block = |record: usize| -> &[f32] {
        let header = header(&tracing, record);
        assert_eq!(header.cutoff, f32::MAX);
        bytemuck::cast_slice(&tracing.masks[header.pane as usize..][..PANE_WORDS])
    };
    let [glass, leaf] = [block(0), block(1)];
    assert_eq!((block(2), block(3)), (glass, leaf));
    assert!(
        glass.iter().zip([0.4, 0.2, 0.1, 0.04, 0.04, 0.04, 1.0, 0.9]).all(|(a, b)| (a - b).abs() < 1e-6),
        "{glass:?}"
    );
    assert_eq!((&leaf[..3], &leaf[7..]), (&[0.0; 3][..], &[0.6, -1.0][..]));
}
