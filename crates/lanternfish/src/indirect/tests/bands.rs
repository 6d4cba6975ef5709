//! Images whose rows are processed in bands.

use super::*;
use crate::denoise::smoothing::MOST_IRRADIANCE_BYTES_IN_TESTS;

/// An image of 64 x 72 pixels, in bands of at most `rows` sampled rows.
fn in_bands_of(gpu: &Gpu, rows: u32, rays: Sampled, accumulate: u32) -> Vec<Vec3> {
    let size = UVec2::new(64, 72);
    let width = size.x.div_ceil(if rays.resolution == IndirectResolution::Half { 2 } else { 1 });
    let most = MOST_IRRADIANCE_BYTES_IN_TESTS.replace(u64::from(48 * width * rows));
    let scene = demo("cornell").unwrap();
    let image = image_of(gpu, size, over_frames(rays, accumulate), &scene, &scene.cameras[0]);
    MOST_IRRADIANCE_BYTES_IN_TESTS.set(most);
    image
}

/// Light at bounded hits: the first band is the same, the others differ in noise alone, at either resolution. Light of the radiance cache, which all
/// bands fill, is that of one band: the points of its samples differ. Images of one to four more or fewer rows differ from each other by up to 8 % in
/// a third of the image after one frame, and by 4 % after eight.
#[gpu_test]
fn gpu_bands_make_the_image_of_all_rows(gpu: &Gpu) {
    for resolution in [IndirectResolution::Full, IndirectResolution::Half] {
        let rays = Sampled { diffuse_rays: 8, glossy_rays: 0, resolution, ..sampled(Tracer::BVH) };
        let [all, bands] = [72, 33].map(|rows| in_bands_of(gpu, rows, rays, 8));
        // All rows of the first band are those of the whole image, except for the last, from which half resolution interpolates.
        let same = 64 * 31;
        assert!(all[..same] == bands[..same], "{resolution}");
        let (light, apart) = (mean(&bands) / mean(&all), off(&bands, &all));
        println!("{resolution}: {light:.4} of the light, off by {apart:.4}");
        // At half resolution, all sampled rows are 36.
        assert!(all[same..] != bands[same..], "{resolution}: the image was not divided");
        assert!((light - 1.0).abs() < 0.012 && apart < 0.28, "{resolution}: {light} of the light, off by {apart}");
    }
    let rays = Sampled { diffuse_rays: 12, glossy_rays: 4, hit_light: HitLight::Cached, ..sampled(Tracer::BVH) };
    let [all, bands] = [72, 33].map(|rows| in_bands_of(gpu, rows, rays, 1));
    for (half, (all, bands)) in all.chunks(64 * 36).zip(bands.chunks(64 * 36)).enumerate() {
        let light = mean(bands) / mean(all);
        println!("half {half}: {light:.4} of the light");
        assert!((light - 1.0).abs() < 0.1, "half {half}: {light} of the light");
    }
}
