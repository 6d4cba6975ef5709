//! not committed
use glam::Vec3;
use lanternfish_gpu::{Frame, Profiler, read_back, testing};
use super::*;
use crate::{deep_images::trace::SEARCH, settings::*, testing::Random};

fn rays(images: &DeepImages, exact: &lanternfish_reference::Tracer<'_>, bounds: (Vec3, Vec3), n: usize, sorted: bool) -> Vec<TracedRay> {
    let mut random = Random::new(3);
    let offset = 0.75 * bounds.1.length() / images.settings.resolution as f32;
    let mut rays = Vec::new();
    while rays.len() < n {
        let inside = bounds.0 + bounds.1 * (0.5 * random.point() + 0.5);
        let (towards, away) = (random.direction(), random.direction());
        let Some(d) = exact.nearest(inside.into(), towards.into()) else { continue };
        rays.push(TracedRay::new(images, inside + 0.999 * d * towards, away, offset));
    }
    if sorted { rays.sort_by_key(|r| r.image_and_side); }
    rays
}

#[test]
#[ignore]
fn gpu_measure() {
    let Some(gpu) = testing::gpu("gpu_measure") else { return };
    let scene = lanternfish_scene::generate::demo("atrium").unwrap();
    let uploaded = upload(gpu, &scene);
    let exact = lanternfish_reference::Tracer::new(&scene, lanternfish_reference::Settings::default()).unwrap();
    let b = scene.bounds();
    let bounds = (b.min, b.size());
    let resolutions: Vec<u32> = std::env::var("RES").unwrap_or("64,256".into()).split(',').map(|s| s.parse().unwrap()).collect();
    for resolution in resolutions {
        let base = DeepImageSettings { resolution, ..Default::default() };
        for (name, settings, search) in [
            ("linear 32 linsearch", base, 0),
            ("linear 32 bisect", base, 1),
            ("linear 32 both", base, 2),
            ("linear 32 merge 0 bisect", DeepImageSettings { merge_texels: 0.0, ..base }, 1),
            ("linear 32 no payload", DeepImageSettings { payload: false, ..base }, 1),
            ("linear 16 bisect", DeepImageSettings { depth: DeepDepth::Bits16, ..base }, 1),
            ("linear 16 nopayload", DeepImageSettings { depth: DeepDepth::Bits16, payload: false, ..base }, 1),
            ("linked", DeepImageSettings { store: DeepStore::LinkedList, ..base }, 0),
            ("sorted", DeepImageSettings { store: DeepStore::SortedLinkedList, ..base }, 0),
        ] {
            let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
            let mut builder = DeepImageBuilder::new(&gpu.device, settings).unwrap();
            let mut best = f64::INFINITY;
            let mut steps = String::new();
            let mut images = None;
            for run in 0..4 {
                drop(images.take());
                let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
                images = Some(builder.record(&mut frame, &uploaded).unwrap());
                frame.submit();
                read_back::<u32>(&gpu.device, &gpu.queue, &images.as_ref().unwrap().chunks[0].list_starts, 1).unwrap();
                let passes = profiler.finished();
                let total: f64 = passes.iter().map(|p| p.ms).sum();
                if run > 0 && total < best {
                    best = total;
                    steps = passes.iter().map(|p| format!("{} {:.1} ", p.name.trim_start_matches("deep_images/"), p.ms)).collect();
                }
            }
            let images = images.unwrap();
            let c = images.counts;
            println!("## {resolution} {name}: build {best:.1} ms; drawn {} kept {} MB {:.1}; {steps}", c.drawn, c.kept, c.bytes as f64 / 1e6);
            SEARCH.store(search, std::sync::atomic::Ordering::Relaxed);
            let tracer = RayTracer::new(&gpu.device).unwrap();
            for sorted in [false, true] {
                let rays = rays(&images, &exact, bounds, 1 << 18, sorted);
                let expected: Vec<Option<f32>> = rays.iter().map(|r| {
                    let start = r.origin + r.offset * r.direction;
                    exact.nearest(start.into(), r.direction.into()).map(|d| d + r.offset)
                }).collect();
                let buffer = tracer.upload(&gpu.device, &rays).unwrap();
                for (what, structure) in [("within", Structure::WithinTexel(&images)), ("across", Structure::AcrossTexels(&images))] {
                    let mut least = f64::INFINITY;
                    let mut found = Vec::new();
                    for run in 0..4 {
                        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
                        let d = tracer.record(&mut frame, &uploaded, structure, &buffer, rays.len() as u32).unwrap();
                        frame.submit();
                        found = read_back::<f32>(&gpu.device, &gpu.queue, &d, rays.len()).unwrap();
                        let ms: f64 = profiler.finished().iter().map(|p| p.ms).sum();
                        if run > 0 { least = least.min(ms); }
                    }
                    let (mut e, mut missed) = (Vec::new(), 0);
                    for (f, x) in found.iter().zip(&expected) {
                        match x { Some(x) if *f >= 0.0 => e.push((f - x).abs() / x), Some(_) => missed += 1, None => {} }
                    }
                    e.sort_by(f32::total_cmp);
                    println!("   {what} sorted {sorted}: {:.2} M/s; error {:.2} % p95 {:.1} %, missed {:.2} %",
                        rays.len() as f64 / least / 1e3, 100.0 * e[e.len() / 2], 100.0 * e[e.len() * 95 / 100], 100.0 * missed as f64 / rays.len() as f64);
                }
            }
        }
    }
}
