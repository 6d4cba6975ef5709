//! Flicker of indirect light on static surfaces along a walk.
//!
//! Surfaces are grey and diffuse, so that a surface point has the same radiance in every view. The image without indirect light, with its
//! shadow edges, is subtracted from every image. The remaining changes of a point from frame to frame are flicker of indirect light.

use glam::{Vec3, Vec3A};
use lanternfish::{
    RenderError,
    settings::{Materials, Settings},
};
use lanternfish_cli::{error::CliError, parse::Size};
use lanternfish_reference::{Settings as TracerSettings, Tracer};
use lanternfish_scene::{Camera, Scene};

use crate::{bench::Bench, case::Case, table::Row, view::View};

/// Numbers of tested surface points, across and down the image in the middle of the walk.
const POINTS: [u32; 2] = [48, 27];
/// Least number of frames with a visible point for the point to count.
const LEAST_FRAMES: usize = 8;

/// What the table of flicker says.
pub const TEXT: &str = "Surfaces are grey, diffuse and static, and so are lights. The image without indirect light is subtracted, so no reference is \
                        needed. Standard deviation of the indirect light of a surface point over the frames in which it is visible, and its \
                        mean change from frame to frame, both relative to its mean.";

/// Flicker of one technique.
#[derive(Debug)]
struct Flicker {
    /// Number of counted points.
    points: usize,
    /// Standard deviation over the frames with a visible point, relative to the point's mean; mean over all points.
    mean: f64,
    /// 95th percentile of the same deviation.
    percentile_95: f64,
    /// Mean change from one frame to the next, relative to the mean.
    step: f64,
}

/// The scene with grey diffuse surfaces.
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
    bench: &'a Bench,
    view: View,
    cameras: &'a [Camera],
    /// Position of each point in each frame, pixels; `None` if it is not visible. The points are those visible in the middle of the walk.
    seen: Vec<Vec<Option<[f32; 2]>>>,
    /// Luminances of each frame without indirect light.
    direct: Vec<Vec<f32>>,
}

impl<'a> Walk<'a> {
    /// Returns a walk through `view`, of a grey scene, with `look`, settings of direct light.
    pub fn new(bench: &'a Bench, view: View, cameras: &'a [Camera], look: &Settings) -> Result<Self, CliError> {
        let (exact, size) = (Tracer::new(&view.scene, TracerSettings::default())?, view.size);
        let middle = &cameras[cameras.len() / 2];
        let [columns, rows] = POINTS;
        let point = |i: u32| {
            let x = (i % columns) as f32 + 0.5;
            let y = (i / columns) as f32 + 0.5;
            let at = [x / columns as f32 * size.width as f32, y / rows as f32 * size.height as f32];
            let (origin, direction) = ray(middle, size, at)?;
            let distance = exact.nearest(origin, direction)?;
            Some(origin + distance * direction)
        };
        let points: Vec<Vec3A> = (0..columns * rows).filter_map(point).collect();
        let sees = |camera: &Camera, p: Vec3A| {
            let at = pixel(camera, size, p)?;
            let (origin, direction) = ray(camera, size, at)?;
            let distance = exact.nearest(origin, direction)?;
            ((distance / (p - origin).length() - 1.0).abs() < 2e-3).then_some(at)
        };
        let seen = points.iter().map(|p| cameras.iter().map(|camera| sees(camera, *p)).collect()).collect();
        drop(exact);
        let mut walk = Self { bench, view, cameras, seen, direct: Vec::new() };
        walk.direct = walk.luminances(look)?;
        Ok(walk)
    }

    /// Renders the walk with each configuration, and returns rows of flicker.
    pub fn rows(&self, cases: &[Case]) -> Result<Vec<Row>, CliError> {
        self.bench.rows("walk", cases, |case| format!("Walking: {}", case.name), |case| self.row(case))
    }

    fn row(&self, Case { name, settings, .. }: &Case) -> Result<Row, CliError> {
        let (luminances, size) = (self.luminances(settings)?, self.view.size);
        let at = |i: usize, at| interpolated(&luminances[i], size, at) - interpolated(&self.direct[i], size, at);
        let of_point = |positions: &Vec<Option<[f32; 2]>>| {
            positions.iter().enumerate().map(|(i, p)| p.map(|p| at(i, p))).collect()
        };
        let flicker = of(&self.seen.iter().map(of_point).collect::<Vec<_>>());
        Ok(Row::default()
            .text("name", "", name)
            .number("frames", "frames", self.cameras.len())
            .count("places", "points", flicker.points as u64)
            .percent("mean", "deviation", 2, flicker.mean)
            .percent("percentile_95", "95th percentile", 2, flicker.percentile_95)
            .percent("step", "change per frame", 2, flicker.step))
    }

    /// Renders the walk, and returns the luminances of each frame.
    fn luminances(&self, settings: &Settings) -> Result<Vec<Vec<f32>>, RenderError> {
        let settings = settings.clone().with_materials(Materials::Lambert);
        let mut stage = self.bench.stage(&self.view.scene, &settings)?;
        let mut view = self.view.clone();
        let mut of_view = |camera: &Camera| {
            view.camera = camera.clone();
            let image = stage.frame(&view)?;
            Ok(image.radiance.iter().map(|[r, g, b, _]| 0.2126 * r + 0.7152 * g + 0.0722 * b).collect())
        };
        self.cameras.iter().map(&mut of_view).collect()
    }
}

/// Flicker of points, from the luminance of each point in each frame; `None` if the point is not visible.
fn of(points: &[Vec<Option<f64>>]) -> Flicker {
    let figures = |luminances: &Vec<Option<f64>>| {
        let seen = || luminances.iter().flatten();
        let count = seen().count() as f64;
        let mean = seen().sum::<f64>() / count;
        let variance = seen().map(|l| (l - mean).powi(2)).sum::<f64>() / count;
        let changes: Vec<f64> = luminances.windows(2).filter_map(|pair| Some((pair[1]? - pair[0]?).abs())).collect();
        let step = changes.iter().sum::<f64>() / changes.len().max(1) as f64;
        (mean > 0.0).then(|| (variance.sqrt() / mean, step / mean))
    };
    let counted = points.iter().filter(|luminances| luminances.iter().flatten().count() >= LEAST_FRAMES);
    let mut all: Vec<(f64, f64)> = counted.filter_map(figures).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = all.len().max(1) as f64;
    Flicker {
        points: all.len(),
        mean: all.iter().map(|(deviation, _)| deviation).sum::<f64>() / count,
        percentile_95: all.get(all.len() * 95 / 100).map_or(0.0, |(deviation, _)| *deviation),
        step: all.iter().map(|(_, step)| step).sum::<f64>() / count,
    }
}

/// The ray through a point of the image, pixels. `None` for an orthographic view.
fn ray(camera: &Camera, size: Size, [x, y]: [f32; 2]) -> Option<(Vec3A, Vec3A)> {
    let [left, right, bottom, top] = camera.projection.slopes(size.width as f32 / size.height as f32)?;
    let slopes =
        Vec3A::new(left + (right - left) * x / size.width as f32, top + (bottom - top) * y / size.height as f32, -1.0);
    Some((camera.eye().into(), camera.world_from_camera.transform_vector3a(slopes).normalize()))
}

/// Projects a point into the image, pixels. `None` if it is outside the image.
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

/// Bilinearly interpolated luminance at a point of the image, pixels.
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
    fn constant_light_does_not_flicker_and_changing_light_does() {
        let constant = of(&[vec![Some(2.0); 10], vec![Some(0.5); 20]]);
        assert_eq!((constant.points, constant.mean, constant.step), (2, 0.0, 0.0));
        let jumps = of(&[(0..10).map(|i| Some(f64::from(i % 2))).collect()]);
        assert!((jumps.mean - 1.0).abs() < 1e-12 && (jumps.step - 2.0).abs() < 1e-12, "{jumps:?}");
        assert_eq!(of(&[vec![Some(1.0); 3]]).points, 0, "visible in too few frames");
        // A change while the point is not visible does not count.
        let gap = of(&[(0..20).map(|i| (i % 10 != 0).then(|| f64::from(1 + i / 10))).collect()]);
        assert!(gap.mean > 0.3 && gap.step == 0.0, "{gap:?}");
    }

    #[test]
    fn a_point_on_the_ray_of_a_pixel_projects_to_that_pixel() {
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
