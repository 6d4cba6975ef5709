//! Opacity micromaps in images: with and without them.

use glam::Vec2;

use super::*;

/// Texels of a disk.
pub(super) fn leaf(radius: f32) -> Image {
    let is_leaf = |i: u32| (Vec2::new((i % 64) as f32, (i / 64) as f32) - 31.5).length() < radius;
    let alpha = |i| if is_leaf(i) { [255, 200] } else { [0, 100] }[i as usize / 64 % 2];
    let rgba = (0..64 * 64).flat_map(|i| [255, 255, 255, alpha(i)]).collect();
    Image { name: String::new(), width: 64, height: 64, rgba }
}

/// The scene with leaves: the masked part has an image of disks.
pub(super) fn leaves(mut scene: Scene) -> Scene {
    scene.textures.push(Texture { image: scene.images.len(), sampler: scene.samplers.len() });
    scene.images.push(leaf(22.0));
    scene.samplers.push(Sampler::default());
    let primitive = &mut scene.meshes[4].primitives[0];
    primitive.uv0 = primitive.positions.iter().map(|p| 0.8 * Vec2::new(p.x + p.z, p.y + 0.3 * p.z)).collect();
    let material = &mut scene.materials[primitive.material];
    material.base_color.w = 1.0;
    material.alpha_mode = AlphaMode::Mask { cutoff: 0.6 };
    material.base_color_texture = Some(TextureRef::new(scene.textures.len() - 1));
    assert_eq!(scene.validate(), Ok(()));
    scene
}

#[gpu_test]
fn gpu_micromaps_change_no_pixel(gpu: &Gpu) {
    let scene = leaves(scene());
    let mut renderer = renderer(gpu, Shadows::BVH);
    let mut uploaded = renderer.upload(&scene).unwrap();
    let with = shown(&mut renderer, &uploaded, &scene);
    let mapped = uploaded.placed.sources().to_vec();
    let maps: Vec<u32> = mapped.iter().map(|source| source.opacity).filter(|map| *map > 0).collect();
    assert!(!maps.is_empty(), "triangles have maps");
    // Other maps, and boxes around complete triangles: first none, then those at another address.
    let mut with_maps = |change: &dyn Fn(u32) -> u32| {
        let sources: Vec<_> =
            mapped.iter().map(|source| tracing::Source { opacity: change(source.opacity), ..*source }).collect();
        let triangles = pose(&scene, uploaded.placed.parts(), &sources);
        uploaded.bvh.as_mut().unwrap().update(&gpu.queue, &triangles, &[]);
        shown(&mut renderer, &uploaded, &scene)
    };
    let without = with_maps(&|_| 0);
    assert_eq!(differing(&with, &without), 0);
    let wrong = with_maps(&|map| if map == 0 { 0 } else { map + 8 * 3 });
    assert!(differing(&with, &wrong) > 0, "blind to a wrong map");
}
