use glam::{UVec2, Vec2, Vec3, Vec4};
use lanternfish::{gpu_scene::GpuScene, view::View};
use lanternfish_gpu::{Frame, Gpu, Profiler, read_texture, uniform_buffer_of};
use lanternfish_scene::{Scene, generate};

use super::{
    super::{
        DeepImages, Fragment,
        tests::{build, lists, settings, triangles, upload},
    },
    *,
};
use crate::{DeepBuilder, DeepImageSettings, shaders::SHADERS, testing};

const SIZE: UVec2 = UVec2::new(200, 150);

fn frame<R>(gpu: &Gpu, record: impl FnOnce(&mut Frame<'_>) -> Result<R, RenderError>) -> Result<R, RenderError> {
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let result = record(&mut frame)?;
    frame.submit();
    Ok(result)
}

/// 20 images of 48 x 48 texels in more than one chunk.
fn in_chunks(gpu: &Gpu, scene: &GpuScene) -> DeepImages {
    let fragments_a_texel = gpu.device.limits().max_storage_buffer_binding_size / (4 * 48 * 48 * 7);
    let images = build(gpu, scene, DeepImageSettings { fragments_a_texel, ..settings(DeepBuilder::SinglePass) });
    assert!(images.chunks.len() > 1, "one chunk");
    images
}

fn view_of(scene: &Scene) -> View {
    View::new(&scene.cameras[0], SIZE, Vec3::ZERO, &scene.bounds())
}

/// Depths of the points' image, by rows.
fn points(gpu: &Gpu, scene: &GpuScene, images: &DeepImages, image: Option<u32>, view: &View) -> Vec<f32> {
    let cloud = PointCloud::new(&gpu.device, &images.settings).unwrap();
    let size = PointSize { texels: 0.02, least_pixels: 2.0 };
    let rendering = frame(gpu, |frame| cloud.record(frame, scene, images, image, view, size)).unwrap();
    let depths = read_texture::<f32>(&gpu.device, &gpu.queue, rendering.depth.texture()).unwrap();
    let display = read_texture::<[u8; 4]>(&gpu.device, &gpu.queue, rendering.display.texture()).unwrap();
    assert!(depths.iter().zip(&display).all(|(depth, color)| (*depth > 0.0) == (color[..3] != [0; 3])));
    depths
}

/// Distance from a point to a triangle, m.
fn distance(p: Vec3, corners: &[Vec3; 3]) -> f32 {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(c - a).normalize();
    let edges = [(a, b), (b, c), (c, a)];
    if edges.iter().all(|(from, to)| (*to - *from).cross(p - *from).dot(normal) >= 0.0) {
        return normal.dot(p - a).abs();
    }
    let to_edge = |(from, to): (Vec3, Vec3)| {
        let along = (p - from).dot(to - from) / from.distance_squared(to);
        p.distance(from.lerp(to, along.clamp(0.0, 1.0)))
    };
    edges.into_iter().map(to_edge).fold(f32::INFINITY, f32::min)
}

/// Number of pixels that show a point, and the fraction of them whose point is within a texel of a surface.
fn points_on_surfaces(gpu: &Gpu, scene: &GpuScene, images: &DeepImages, view: &View) -> (usize, f64) {
    let triangles = triangles(gpu, scene);
    let texel = 1.0 / images.chunks[0].grid.texels_per_metre;
    let (mut shown, mut near) = (0, 0);
    for (i, depth) in points(gpu, scene, images, None, view).into_iter().enumerate().filter(|(_, d)| *d > 0.0) {
        let pixel = Vec2::new((i as u32 % SIZE.x) as f32, (i as u32 / SIZE.x) as f32) + 0.5;
        let ndc = Vec2::new(2.0, -2.0) * pixel / SIZE.as_vec2() + Vec2::new(-1.0, 1.0);
        let slope = ndc / Vec2::new(view.clip_from_view.x_axis.x, view.clip_from_view.y_axis.y);
        let p_view = slope.extend(-1.0) * view.clip_from_view.w_axis.z / depth;
        let p_world = view.world_from_view.transform_point3(p_view);
        shown += 1;
        near += usize::from(triangles.iter().any(|triangle| distance(p_world, triangle) < texel));
    }
    (shown, near as f64 / shown as f64)
}

#[gpu_test]
fn gpu_points_lie_on_surfaces(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let uploaded = upload(gpu, &scene);
    let view = view_of(&scene);
    let mut images = in_chunks(gpu, &uploaded);
    let (shown, near) = points_on_surfaces(gpu, &uploaded, &images, &view);
    // A point lies on a plane that passes its texel: its distance beside the triangle is at most half a texel's diagonal, plus its own
    // radius.
    assert!(shown > 10_000 && near > 0.99, "{near} of {shown}");
    // Negative control: a cloud displaced by three texels.
    for chunk in &mut images.chunks {
        chunk.grid.center += 3.0 / chunk.grid.texels_per_metre;
        chunk.grid_buffer = uniform_buffer_of(&gpu.device, "shifted", &chunk.grid);
    }
    let (shown, near) = points_on_surfaces(gpu, &uploaded, &images, &view);
    assert!(near < 0.5, "{near} of {shown}");
}

/// Lists of one image.
fn lists_of(gpu: &Gpu, images: &DeepImages, image: u32) -> Vec<Vec<Fragment>> {
    let (chunk, image) = invocation_index(images, image).unwrap();
    lists(gpu, images, chunk).into_iter().skip(image as usize * 48 * 48).take(48 * 48).collect()
}

/// Number of an image's fragments in the viewport that are neither visible nor hidden by a nearer point, and number of all in the viewport.
fn fragments_without_point(gpu: &Gpu, images: &DeepImages, image: u32, view: &View, depths: &[f32]) -> (usize, usize) {
    let grid = images.chunks[0].grid;
    let axes = images.directions.frame(image);
    let (mut within, mut missing) = (0, 0);
    for (texel, list) in lists_of(gpu, images, image).iter().enumerate() {
        let across = |texel: usize| (texel as f32 + 0.5 - 24.0) / grid.texels_per_metre;
        for fragment in list {
            let p = grid.center + axes * Vec3::new(across(texel % 48), across(texel / 48), fragment.depth);
            let clip: Vec4 = view.clip_from_view * (view.view_from_world * p.extend(1.0));
            let x = (0.5 + 0.5 * clip.x / clip.w) * SIZE.x as f32;
            let y = (0.5 - 0.5 * clip.y / clip.w) * SIZE.y as f32;
            let inside = clip.w > clip.z && x >= 0.0 && y >= 0.0 && x < SIZE.x as f32 && y < SIZE.y as f32;
            if inside {
                within += 1;
                let visible = depths[y as usize * SIZE.x as usize + x as usize];
                missing += usize::from(visible < clip.z / clip.w * (1.0 - 1e-4));
            }
        }
    }
    (missing, within)
}

#[gpu_test]
fn gpu_every_fragment_of_an_image_is_a_point(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let uploaded = upload(gpu, &scene);
    let images = in_chunks(gpu, &uploaded);
    let view = view_of(&scene);
    for image in [0, 9, 19] {
        let depths = points(gpu, &uploaded, &images, Some(image), &view);
        let (missing, within) = fragments_without_point(gpu, &images, image, &view, &depths);
        assert!(missing == 0 && within > 500, "image {image}: {missing} of {within}");
        // Negative control: another image has points elsewhere.
        let (missing, within) = fragments_without_point(gpu, &images, (image + 5) % 20, &view, &depths);
        assert!(2 * missing > within, "{missing} of {within}");
    }
}

#[gpu_test]
fn gpu_numbers_of_texels_are_those_of_the_lists(gpu: &Gpu) {
    let images = in_chunks(gpu, &upload(gpu, &generate::demo("atrium").unwrap()));
    let views = TexelViews::new(&gpu.device, &images.settings).unwrap();
    let radius = images.chunks[0].grid.radius;
    let [opacity, farthest] =
        ["OPACITY", "FARTHEST_GREY"].map(|name| SHADERS.constant("deep_images/view/fragments", name) as f32);
    for image in [0, 19] {
        let lists = lists_of(gpu, &images, image);
        let counts = frame(gpu, |frame| views.counts(frame, &images, image)).unwrap();
        let expected: Vec<_> = lists.iter().map(|list| Some(list.len() as f32)).collect();
        assert_eq!(counts.values, expected, "image {image}");
        let deepest = lists.iter().map(Vec::len).max().unwrap();
        assert_eq!(counts.extent().unwrap(), (0.0, deepest as f32), "corners of an image are outside the scene");
        let kept = lists.iter().map(Vec::len).sum::<usize>() as f64;
        assert!((counts.mean() - kept / lists.len() as f64).abs() < 1e-9);
        for layer in [0, 1, deepest - 1] {
            let from_start = frame(gpu, |frame| views.layer(frame, &images, image, layer as i32)).unwrap();
            let from_end = frame(gpu, |frame| views.layer(frame, &images, image, -1 - layer as i32)).unwrap();
            let depth = |fragment: Option<&Fragment>| fragment.map(|fragment| fragment.depth);
            let expected: Vec<_> = lists.iter().map(|list| depth(list.get(layer))).collect();
            assert_eq!(from_start.values, expected, "image {image}, layer {layer}");
            let expected: Vec<_> = lists.iter().map(|list| depth(list.iter().rev().nth(layer))).collect();
            assert_eq!(from_end.values, expected, "image {image}, layer {layer} from the end");
        }
        // Transparent, from the last to the first.
        let darkness = frame(gpu, |frame| views.transparent(frame, &images, image)).unwrap();
        for (list, found) in lists.iter().zip(&darkness.values) {
            assert_eq!(list.is_empty(), found.is_none());
            let light = list.iter().rev().fold(0.0, |behind, fragment| {
                let depth = 0.5 + 0.5 * fragment.depth / radius;
                behind + opacity * (1.0 + (farthest - 1.0) * depth - behind)
            });
            assert!(found.is_none_or(|found| (found - (1.0 - light)).abs() < 1e-5), "{found:?}, {light}");
        }
    }
}

#[gpu_test]
fn gpu_missing_images_and_layers_are_errors_that_name_the_valid_ones(gpu: &Gpu) {
    let images = in_chunks(gpu, &upload(gpu, &generate::demo("cornell").unwrap()));
    let views = TexelViews::new(&gpu.device, &images.settings).unwrap();
    let error = frame(gpu, |frame| views.counts(frame, &images, 20)).unwrap_err().to_string();
    assert!(error.contains("no image 20") && error.contains("0 to 19"), "{error}");
    let deepest = lists_of(gpu, &images, 19).iter().map(Vec::len).max().unwrap() as i32;
    for (layer, there) in
        [(deepest - 1, true), (-deepest, true), (deepest, false), (-1 - deepest, false), (i32::MIN, false)]
    {
        match frame(gpu, |frame| views.layer(frame, &images, 19, layer)) {
            Ok(_) => assert!(there, "{layer} of {deepest}"),
            Err(error) => {
                let (error, known) = (error.to_string(), format!("0 to {}, or -1 to -{deepest}", deepest - 1));
                assert!(!there && error.contains(&format!("no layer {layer}")) && error.contains(&known), "{error}");
            }
        }
    }
    let counts = frame(gpu, |frame| views.counts(frame, &images, 0)).unwrap();
    for upscale in [0, u32::MAX] {
        let error = frame(gpu, |frame| views.paint(frame, &counts, Colors::Heat(1.0), upscale)).unwrap_err();
        assert!(matches!(error, RenderError::Size { .. }), "{error}");
    }
}

/// The shader's colour of a number, as 8 bits.
fn color(number: Option<f32>, colors: Colors) -> [f32; 3] {
    match (number, colors) {
        (None, _) => [0.08, 0.10, 0.28],
        (Some(number), Colors::Grey(white, dark)) => {
            let darkest = SHADERS.constant("deep_images/view/paint", "DARKEST") as f32;
            [1.0 + (darkest - 1.0) * (number - white) / (dark - white); 3]
        }
        (Some(number), Colors::Heat(red)) => {
            let x = 5.0 * (number / red).min(1.0);
            let ramp = |from: f32| (x - from).clamp(0.0, 1.0);
            // Black, blue, cyan, green, yellow, red.
            [ramp(3.0), ramp(1.0) - ramp(4.0), ramp(0.0) - ramp(2.0)]
        }
    }
}

#[gpu_test]
fn gpu_images_show_the_numbers(gpu: &Gpu) {
    let images = in_chunks(gpu, &upload(gpu, &generate::demo("atrium").unwrap()));
    let views = TexelViews::new(&gpu.device, &images.settings).unwrap();
    let mut rotations = [false; 2];
    for image in [0, 7, 13, 19] {
        let up = images.directions.frame(image).y_axis.y > 0.0;
        rotations[usize::from(up)] = true;
        let depths = frame(gpu, |frame| views.layer(frame, &images, image, 1)).unwrap();
        let counts = frame(gpu, |frame| views.counts(frame, &images, image)).unwrap();
        let (white, dark) = depths.extent().unwrap();
        for (numbers, colors, upscale) in [(depths, Colors::Grey(white, dark), 3), (counts, Colors::Heat(10.0), 1)] {
            let rendering = frame(gpu, |frame| views.paint(frame, &numbers, colors, upscale)).unwrap();
            let pixels = read_texture::<[u8; 4]>(&gpu.device, &gpu.queue, rendering.texture()).unwrap();
            let edge = 48 * upscale as usize;
            assert_eq!(pixels.len(), edge * edge);
            for (i, pixel) in pixels.iter().enumerate() {
                let texel = i / edge / upscale as usize * 48 + i % edge / upscale as usize;
                let number = numbers.values[if up { 48 * 48 - 1 - texel } else { texel }];
                for (actual, expected) in pixel.iter().zip(color(number, colors)) {
                    assert!((f32::from(*actual) - 255.0 * expected).abs() <= 1.0, "{number:?}, {colors:?}: {pixel:?}");
                }
            }
        }
    }
    assert_eq!(rotations, [true; 2], "images with and without a rotation by 180°");
}
