//! Directional albedo table of the specular layer, by view angle and roughness (split-sum).

use std::{f64::consts::TAU, sync::LazyLock};

use glam::DVec3;
use half::f16;

/// Entries across (cosine to the normal, 0 to 1) and down (perceptual roughness, 0 to 1).
pub(super) const SIDE: u32 = 32;

/// Number of directions that an entry averages.
const COUNT: u32 = 512;

/// The same value as in `materials/brdf.wesl`.
pub(super) const LEAST_ROUGHNESS: f64 = 0.03;

/// With m = (1 − v·h)⁵: the integrals over the hemisphere of the specular BRDF without its Fresnel term, times n·l (1 − m), and times n·l
/// m. A surface reflects f0 times the first and f90 times the second [Karis2013].
pub(crate) fn fractions(n_dot_v: f64, perceptual_roughness: f64) -> [f64; 2] {
    let roughness = perceptual_roughness.max(LEAST_ROUGHNESS);
    let alpha = roughness * roughness;
    let n_dot_v = n_dot_v.max(1e-4);
    let v = DVec3::new((1.0 - n_dot_v * n_dot_v).sqrt(), 0.0, n_dot_v);
    let fifth = |v_dot_h: f64| (1.0 - v_dot_h).clamp(0.0, 1.0).powi(5);
    // Smith's term of each side: `visibility_term` of `materials/brdf.wesl` times 4 (n·l) (n·v).
    let k = 0.5 * alpha;
    let smith = |cosine: f64| cosine / (cosine * (1.0 - k) + k);
    let mut irradiance = [0.0; 2];
    for i in 0..COUNT {
        let u = (f64::from(i) + 0.5) / f64::from(COUNT);
        // Van der Corput's sequence.
        let (sin, cos) = (TAU * f64::from(i.reverse_bits()) / 2f64.powi(32)).sin_cos();
        let unit = |cosine_squared: f64| {
            let across = (1.0 - cosine_squared).max(0.0).sqrt();
            DVec3::new(across * cos, across * sin, cosine_squared.sqrt())
        };
        // Half vectors with the density D (n·h) [Walter2007, eq. 35].
        let h = unit((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u));
        let v_dot_h = v.dot(h);
        let n_dot_l = 2.0 * v_dot_h * h.z - v.z;
        if v_dot_h > 0.0 && n_dot_l > 0.0 {
            let weight = smith(n_dot_l) * smith(n_dot_v) * v_dot_h / (h.z * n_dot_v);
            let grazing = fifth(v_dot_h);
            irradiance[0] += weight * (1.0 - grazing);
            irradiance[1] += weight * grazing;
        }
    }
    irradiance.map(|sum| sum / f64::from(COUNT))
}

/// Rows from roughness 0 on; half floats: the two values of [`fractions`].
static TABLE: LazyLock<Vec<[f16; 2]>> = LazyLock::new(|| {
    let part = |i: u32| f64::from(i) / f64::from(SIDE - 1);
    let entry = |row: u32, column: u32| fractions(part(column), part(row)).map(f16::from_f64);
    (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| entry(row, column))).collect()
});

/// Bound as `brdf_fractions`.
pub(super) fn upload(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let size = wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("environment_light/brdf_fractions"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rg16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let bits: Vec<[u16; 2]> = TABLE.iter().map(|entry| entry.map(f16::to_bits)).collect();
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * SIDE), rows_per_image: None };
    queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&bits), layout, size);
    texture.create_view(&Default::default())
}
