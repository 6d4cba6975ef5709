//! A light that goes out, and an object that moves: how indirect light follows.

use glam::{Affine3A, Vec3};
use lanternfish::RenderedImage;
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress};
use lanternfish_metrics::{Pair, RgbImage};
use lanternfish_scene::{Camera, Instance, Mesh, Scene};

use super::{
    Bench, Case, Cost, NONE,
    motion::STEP,
    restarts,
    rooms::{cuboid, grey},
    sheet::Sheet,
    views::View,
};
use crate::{
    document::Document,
    image::{hdr_flip, linear, rgb, shown},
    run::median,
    table::Row,
    walked::Walked,
};

const LAMP: &str = "A view at rest. After the warm frames the brightest light goes out. HDR-FLIP of each single frame against the reference of the \
                    new light, frames counted from 1; *before*: of the last frame before, against the reference of the old light. *Time*: median of \
                    indirect light's passes over the 16 frames, ms. Rows of lamp-sheet.png: techniques and reference.";
const OBJECT: &str = "A view at rest, in which a grey box of half a metre slides 0.8 m over the floor. The frame in which it arrives, in the pixels \
                      around it: HDR-FLIP, mean of |difference| on a display, 0..1, and its 99.9th percentile; then FLIP of the whole image. Rows of \
                      object-sheet.png: techniques and reference.";
/// Frames after the light has gone out that are compared, counted from 1.
const AFTER: [u32; 3] = [1, 4, 16];
/// Columns of the table for them.
const KEYS: [(&str, &str); 3] = [("flip_1", "FLIP, frame 1"), ("flip_4", "frame 4"), ("flip_16", "frame 16")];
/// Frames of the moving object, its way per second, m, its side, m, and its distance from the eye, m.
const FRAMES: u32 = 16;
const SPEED: f32 = 1.5;
const SIDE: f32 = 0.5;
const DISTANCE: f32 = 4.0;
/// Half the size of the compared region, in sizes of the object.
const AROUND: f32 = 1.5;

impl Bench {
    /// Adds the tables of changes.
    pub fn changes(&self, view: &View, report: &mut Document, progress: &mut Progress) -> Result<(), CliError> {
        let rows = self.lamp(view, progress)?;
        report.section("A light goes out", LAMP, "lamp", rows);
        let rows = self.object(view, progress)?;
        report.section("An object moves", OBJECT, "object", rows);
        Ok(())
    }

    fn all(&self) -> Vec<&Case> {
        [&NONE].into_iter().chain(&self.cases).collect()
    }

    fn lamp(&self, view: &View, progress: &mut Progress) -> Result<Vec<Row>, CliError> {
        let dark = self.view_with(view, without_brightest(&view.scene));
        let [old, new] = [self.reference(view, progress)?, self.reference(&dark, progress)?];
        let colors = shown(&new, view.look.image.exposure, view.look.image.tone_map).0;
        let cases = self.all();
        let mut sheet = Sheet::new(view.size, cases.len() + 1);
        let mut rows = Vec::new();
        for (number, case) in cases.iter().enumerate() {
            let row = || {
                let mut renderer = self.renderer((case.settings)(&view.look))?;
                let mut uploaded = renderer.upload(&view.scene)?;
                let mut before = None;
                for _ in 0..self.warm_frames(&renderer) {
                    before = Some(self.frame(&mut renderer, &uploaded, &view.camera, view.size)?);
                }
                let before = before.expect("at least one warm frame");
                renderer.update(&mut uploaded, &dark.scene)?;
                let (mut flips, mut times) = (Vec::new(), Vec::new());
                for frame in
                    (1..=AFTER[2]).filter(|frame| AFTER.contains(frame) || !restarts(&renderer)).collect::<Vec<_>>()
                {
                    let image = self.frame(&mut renderer, &uploaded, &view.camera, view.size)?;
                    times.push(Cost::of(&image).indirect_ms);
                    if AFTER.contains(&frame) {
                        flips.push(flip(&image, &new)?);
                        sheet.add(number, &rgb(&image));
                    }
                }
                let row = Row::default().text("technique", "", case.name);
                let row = row.fixed("flip_before", "before", 4, flip(&before, &old)?);
                let with = |row: Row, ((key, heading), flip): (_, f64)| row.fixed(key, heading, 4, flip);
                let row = KEYS.into_iter().zip(flips).fold(row, with);
                Ok::<_, CliError>(row.fixed("indirect_ms", "time, ms", 1, median(&mut times)))
            };
            rows.push(progress.step("lamp", case.name, row)?);
        }
        sheet.add(cases.len(), &colors);
        sheet.write(&self.path(&["lamp", "sheet"]))?;
        Ok(rows)
    }

    fn object(&self, view: &View, progress: &mut Progress) -> Result<Vec<Row>, CliError> {
        let track = Track::before(&view.camera, view.scene.bounds().min.y.max(0.0));
        let at = |frame: u32| self.view_with(view, track.with_object(&view.scene, frame as f32 * STEP));
        let end = at(FRAMES - 1);
        let reference = self.reference(&end, progress)?;
        let region = track.region(FRAMES - 1, &view.camera, view.size).ok_or_else(|| {
            CliError::new(format_args!("{}: the object is not in view", view.name), "choose another scene with --scene")
        })?;
        let near = crop(&reference, region);
        let colors_of = |image: &RgbImage| shown(image, view.look.image.exposure, view.look.image.tone_map).0;
        let (colors, near_colors) = (colors_of(&reference), colors_of(&near));
        let cases = self.all();
        let mut sheet = Sheet::new(view.size, cases.len() + 1);
        let mut rows = Vec::new();
        for (number, case) in cases.iter().enumerate() {
            let row = || {
                let mut renderer = self.renderer((case.settings)(&view.look))?;
                let start = at(0);
                let mut uploaded = renderer.upload(&start.scene)?;
                let mut last = None;
                for frame in 0..self.warm + FRAMES - 1 {
                    let moment = (frame + 1).saturating_sub(self.warm);
                    if moment > 0 {
                        renderer.update(&mut uploaded, &at(moment).scene)?;
                    }
                    if moment < FRAMES - 1 && restarts(&renderer) {
                        continue;
                    }
                    last = Some(self.frame(&mut renderer, &uploaded, &view.camera, view.size)?);
                }
                let image = last.expect("frames of a motion");
                sheet.add(number, &rgb(&image));
                let around = crop(&linear(&image)?, region);
                let mut walked = Walked::default();
                walked.add(&colors_of(&around), &near_colors);
                Ok::<_, CliError>(
                    Row::default()
                        .text("technique", "", case.name)
                        .fixed("flip_around", "FLIP around it", 4, hdr_flip(&Pair::new(around, near.clone())?)?)
                        .fixed("error_around", "error around it", 4, walked.mean())
                        .fixed("p999_around", "p99.9", 3, walked.percentile(0.999))
                        .fixed("flip", "FLIP, whole", 4, flip(&image, &reference)?),
                )
            };
            rows.push(progress.step("object", case.name, row)?);
        }
        sheet.add(cases.len(), &colors);
        sheet.write(&self.path(&["object", "sheet"]))?;
        Ok(rows)
    }
}

fn flip(image: &RenderedImage, reference: &RgbImage) -> Result<f64, CliError> {
    Ok(hdr_flip(&Pair::new(linear(image)?, reference.clone())?)?)
}

/// The scene, its brightest light dark.
fn without_brightest(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let brightest =
        scene.lights.iter_mut().max_by(|a, b| a.intensity.max_element().total_cmp(&b.intensity.max_element()));
    if let Some(light) = brightest {
        light.intensity = Vec3::ZERO;
    }
    scene
}

/// The way of an object over the floor, aside.
struct Track {
    /// Middle of its bottom at the start, and the direction of its motion.
    start: Vec3,
    aside: Vec3,
}

impl Track {
    /// In front of the eye, on a floor of this height; the middle of the way is in the middle of the view.
    fn before(camera: &Camera, floor: f32) -> Self {
        let forwards = Vec3::from(-camera.world_from_camera.matrix3.z_axis);
        let aside = Vec3::new(-forwards.z, 0.0, forwards.x).normalize_or(Vec3::X);
        let middle = camera.eye() + DISTANCE * Vec3::new(forwards.x, 0.0, forwards.z).normalize_or(Vec3::Z);
        let half = 0.5 * SPEED * STEP * (FRAMES - 1) as f32;
        Self { start: middle.with_y(floor) - half * aside, aside }
    }

    fn place(&self, time: f32) -> Vec3 {
        self.start + SPEED * time * self.aside
    }

    fn with_object(&self, scene: &Scene, time: f32) -> Scene {
        let mut scene = scene.clone();
        let half = 0.5 * SIDE;
        let primitive = cuboid(Vec3::new(-half, 0.0, -half), Vec3::new(half, SIDE, half), scene.materials.len());
        scene.materials.push(grey());
        scene.meshes.push(Mesh { name: "object".to_owned(), primitives: vec![primitive] });
        scene.instances.push(Instance {
            name: "object".to_owned(),
            mesh: scene.meshes.len() - 1,
            world_from_object: Affine3A::from_translation(self.place(time)),
        });
        scene
    }

    /// Pixels around the object in a frame: left, top, right, bottom. `None` if it is not in view.
    fn region(&self, frame: u32, camera: &Camera, size: Size) -> Option<[usize; 4]> {
        let [left, right, bottom, top] = camera.projection.slopes(size.width as f32 / size.height as f32)?;
        let center = self.place(frame as f32 * STEP) + 0.5 * SIDE * Vec3::Y;
        let p = camera.world_from_camera.inverse().transform_point3(center);
        if p.z > -SIDE {
            return None;
        }
        let half = AROUND * SIDE / -p.z;
        let [x, y] = [p.x / -p.z, p.y / -p.z];
        let column = |slope: f32| (slope - left) / (right - left) * size.width as f32;
        let row = |slope: f32| (slope - top) / (bottom - top) * size.height as f32;
        let within = |value: f32, most: u32| value.clamp(0.0, most as f32) as usize;
        let [west, east] = [column(x - half), column(x + half)].map(|value| within(value, size.width));
        let [north, south] = [row(y + half), row(y - half)].map(|value| within(value, size.height));
        (west + 8 <= east && north + 8 <= south).then_some([west, north, east, south])
    }
}

/// The part of an image from left and top to before right and bottom, pixels.
fn crop(image: &RgbImage, [left, top, right, bottom]: [usize; 4]) -> RgbImage {
    let row = |y: usize| image.pixels[y * image.width + left..y * image.width + right].iter().copied();
    RgbImage { width: right - left, height: bottom - top, pixels: (top..bottom).flat_map(row).collect() }
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::generate::demo;

    use super::*;

    #[test]
    fn the_object_moves_and_is_in_its_region() {
        let scene = demo("atrium").unwrap();
        let (camera, size) = (&scene.cameras[0], Size { width: 160, height: 90 });
        let track = Track::before(camera, 0.0);
        let [first, last] = [0, FRAMES - 1].map(|frame| track.region(frame, camera, size).unwrap());
        assert!(first[0] < last[0] && first[2] < last[2], "it moves to the right: {first:?} {last:?}");
        let image = RgbImage::new(160, 90, (0..160 * 90).map(|i| [(i % 160) as f32, (i / 160) as f32, 0.0]).collect());
        let part = crop(&image.unwrap(), last);
        assert_eq!(part.pixels[0], [last[0] as f32, last[1] as f32, 0.0]);
        assert_eq!(
            (part.width, part.height, part.pixels.len()),
            (last[2] - last[0], last[3] - last[1], part.width * part.height)
        );
        track.with_object(&scene, 0.1).validate().unwrap();
    }

    #[test]
    fn the_brightest_light_goes_out() {
        let scene = demo("atrium").unwrap();
        let sum = |scene: &Scene| scene.lights.iter().map(|light| light.intensity.max_element()).sum::<f32>();
        let most = scene.lights.iter().map(|light| light.intensity.max_element()).fold(0.0, f32::max);
        let dark = without_brightest(&scene);
        assert!((sum(&scene) - sum(&dark) - most).abs() < 1e-3 * most && dark.lights.len() == scene.lights.len());
    }
}
