//! How much light flickers along a walk on what does not move.
//!
//! Surfaces are grey and diffuse, so that a place looks the same from everywhere: whatever changes there from frame to frame is flicker.

use glam::{Vec3, Vec3A};
use lanternfish::{GpuScene, RenderError, Renderer, settings::Settings};
use lanternfish_gpu::Gpu;
use lanternfish_reference::{Settings as TracerSettings, Tracer};
use lanternfish_scene::{Camera, Scene};
use serde::Serialize;

use super::configurations::Configuration;
use crate::{error::CliError, parse::Size};

/// Places that are looked at, across and down the picture in the middle of the walk.
const PLACES: [u32; 2] = [48, 27];
/// Frames in which a place must be seen to count.
const LEAST_FRAMES: usize = 8;

/// How steady one technique is.
#[derive(Clone, Debug, Serialize)]
pub struct Flicker {
    pub name: String,
    pub frames: usize,
    /// Places that count.
    pub places: usize,
    /// Standard deviation over the frames in which a place is seen, over its mean; the mean and the greatest of 95 % of all places.
    pub mean: f64,
    pub percentile_95: f64,
    /// Mean of the change from one frame to the next, over the mean.
    pub step: f64,
}

/// The scene in grey.
pub fn grey(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for material in &mut scene.materials {
        material.base_color = Vec3::splat(0.5).extend(1.0);
        (material.metallic, material.specular, material.emissive) = (0.0, 0.0, Vec3::ZERO);
        (material.base_color_texture, material.normal_texture, material.metallic_roughness_texture) =
            (None, None, None);
    }
    for color in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives).flat_map(|p| &mut p.colors) {
        *color = Vec3::ONE.extend(color.w);
    }
    scene
}

/// A walk through a scene.
pub struct Walk<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    cameras: &'a [Camera],
    size: Size,
    /// Where each place is seen in each frame, pixels; world-space points that a picture in the middle of the walk shows.
    seen: Vec<Vec<Option<[f32; 2]>>>,
}

impl<'a> Walk<'a> {
    /// `scene`: in grey.
    pub fn new(gpu: &'a Gpu, scene: &'a Scene, cameras: &'a [Camera], size: Size) -> Result<Self, CliError> {
        let exact = Tracer::new(scene, TracerSettings::default())?;
        let middle = &cameras[cameras.len() / 2];
        let [columns, rows] = PLACES;
        let place = |i: u32| {
            let x = (i % columns) as f32 + 0.5;
            let y = (i / columns) as f32 + 0.5;
            let at = [x / columns as f32 * size.width as f32, y / rows as f32 * size.height as f32];
            let (origin, direction) = ray(middle, size, at)?;
            let distance = exact.nearest(origin, direction)?;
            Some(origin + distance * direction)
        };
        let places: Vec<Vec3A> = (0..columns * rows).filter_map(place).collect();
        let sees = |camera: &Camera, p: Vec3A| {
            let at = pixel(camera, size, p)?;
            let (origin, direction) = ray(camera, size, at)?;
            let distance = exact.nearest(origin, direction)?;
            ((distance / (p - origin).length() - 1.0).abs() < 2e-3).then_some(at)
        };
        let seen = places.iter().map(|p| cameras.iter().map(|camera| sees(camera, *p)).collect()).collect();
        Ok(Self { gpu, scene, cameras, size, seen })
    }

    /// Walks it. `progress`: after each frame.
    pub fn flicker(&self, configuration: &Configuration, mut progress: impl FnMut()) -> Result<Flicker, CliError> {
        let settings =
            Settings { materials: lanternfish::settings::Materials::Lambert, ..configuration.settings.clone() };
        let mut renderer = Renderer::new(&self.gpu.device, &self.gpu.queue, settings)?;
        let uploaded = renderer.upload(self.scene)?;
        let mut found: Vec<Vec<f64>> = vec![Vec::new(); self.seen.len()];
        for (frame, camera) in self.cameras.iter().enumerate() {
            let luminances = self.luminances(&mut renderer, &uploaded, camera)?;
            for (place, found) in self.seen.iter().zip(&mut found) {
                found.extend(place[frame].map(|at| interpolated(&luminances, self.size, at)));
            }
            progress();
        }
        Ok(Flicker { name: configuration.name.clone(), frames: self.cameras.len(), ..of(&found) })
    }

    fn luminances(&self, renderer: &mut Renderer, scene: &GpuScene, camera: &Camera) -> Result<Vec<f32>, RenderError> {
        let picture = renderer.render(scene, camera, self.size.width, self.size.height)?;
        Ok(picture.radiance.iter().map(|[r, g, b, _]| 0.2126 * r + 0.7152 * g + 0.0722 * b).collect())
    }
}

/// The figures of places' luminances, frame by frame.
fn of(found: &[Vec<f64>]) -> Flicker {
    let figures = |luminances: &Vec<f64>| {
        let count = luminances.len() as f64;
        let mean = luminances.iter().sum::<f64>() / count;
        let variance = luminances.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / count;
        let steps = luminances.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>() / (count - 1.0);
        (mean > 0.0).then(|| (variance.sqrt() / mean, steps / mean))
    };
    let counted = found.iter().filter(|luminances| luminances.len() >= LEAST_FRAMES);
    let mut all: Vec<(f64, f64)> = counted.filter_map(figures).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = all.len().max(1) as f64;
    Flicker {
        name: String::new(),
        frames: 0,
        places: all.len(),
        mean: all.iter().map(|(deviation, _)| deviation).sum::<f64>() / count,
        percentile_95: all.get(all.len() * 95 / 100).map_or(0.0, |(deviation, _)| *deviation),
        step: all.iter().map(|(_, step)| step).sum::<f64>() / count,
    }
}

/// The ray through a point of the picture, pixels; none of a view with parallel rays.
fn ray(camera: &Camera, size: Size, [x, y]: [f32; 2]) -> Option<(Vec3A, Vec3A)> {
    let [left, right, bottom, top] = camera.projection.slopes(size.width as f32 / size.height as f32)?;
    let slopes =
        Vec3A::new(left + (right - left) * x / size.width as f32, top + (bottom - top) * y / size.height as f32, -1.0);
    Some((camera.eye().into(), camera.world_from_camera.transform_vector3a(slopes).normalize()))
}

/// Where a point is seen, pixels; none beside the picture.
fn pixel(camera: &Camera, size: Size, p: Vec3A) -> Option<[f32; 2]> {
    let [left, right, bottom, top] = camera.projection.slopes(size.width as f32 / size.height as f32)?;
    let p = camera.world_from_camera.inverse().transform_point3a(p);
    if p.z >= 0.0 {
        return None;
    }
    let x = (p.x / -p.z - left) / (right - left) * size.width as f32;
    let y = (p.y / -p.z - top) / (bottom - top) * size.height as f32;
    let is_inside = x >= 1.0 && y >= 1.0 && x <= size.width as f32 - 1.0 && y <= size.height as f32 - 1.0;
    is_inside.then_some([x, y])
}

fn interpolated(luminances: &[f32], size: Size, [x, y]: [f32; 2]) -> f64 {
    let (x, y) = (x - 0.5, y - 0.5);
    let (column, row) = (x.floor(), y.floor());
    let at = |dx: usize, dy: usize| {
        let (x, y) =
            ((column as usize + dx).min(size.width as usize - 1), (row as usize + dy).min(size.height as usize - 1));
        f64::from(luminances[y * size.width as usize + x])
    };
    let (u, v) = (f64::from(x - column), f64::from(y - row));
    (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::Projection;

    use super::*;

    #[test]
    fn what_is_steady_does_not_flicker_and_what_jumps_does() {
        let steady = of(&[vec![2.0; 10], vec![0.5; 20]]);
        assert_eq!((steady.places, steady.mean, steady.step), (2, 0.0, 0.0));
        let jumps = of(&[(0..10).map(|i| f64::from(i % 2)).collect()]);
        assert!((jumps.mean - 1.0).abs() < 1e-12 && (jumps.step - 2.0).abs() < 1e-12, "{jumps:?}");
        assert_eq!(of(&[vec![1.0; 3]]).places, 0, "seen too seldom");
    }

    #[test]
    fn a_point_is_seen_where_its_ray_goes_through() {
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, projection);
        let size = Size { width: 64, height: 36 };
        for at in [[10.0, 20.0], [40.25, 5.5], [32.0, 18.0]] {
            let (origin, direction) = ray(&camera, size, at).unwrap();
            let [x, y] = pixel(&camera, size, origin + 3.0 * direction).unwrap();
            assert!((x - at[0]).abs() < 1e-3 && (y - at[1]).abs() < 1e-3, "{at:?}: {x} {y}");
        }
        assert_eq!(interpolated(&[1.0, 3.0, 5.0, 7.0], Size { width: 2, height: 2 }, [1.0, 1.0]), 4.0);
    }
}
