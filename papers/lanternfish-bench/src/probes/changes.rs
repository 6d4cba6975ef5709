//! A light that goes out, and an object that moves: how indirect light follows.

use glam::{Affine3A, Vec3};
use lanternfish_cli::{
    error::CliError,
    images::{hdr_flip, linear, rgb},
    parse::Size,
    timed::Timed,
};
use lanternfish_metrics::{Pair, RgbImage};
use lanternfish_scene::{Camera, Instance, Mesh, Scene};

use super::{
    Cost, InMotion, restarts,
    rooms::{cuboid, grey},
    sheet::Sheet,
};
use crate::{
    case::Case,
    reference::flip,
    table::Row,
    view::View,
    walked::{STEP, Walked, put_out_brightest},
};

const LAMP: &str = "A view at rest. After the warm frames the brightest light goes out. HDR-FLIP of each single frame against the reference of the \
                    new light, frames counted from 1; *before*: of the last frame before, against the reference of the old light. *Time*: median of \
                    indirect light's passes over the 16 frames, ms. Rows of lamp-sheet.png: techniques and reference.";
const OBJECT: &str = "A view at rest, in which a grey box of half a metre slides 0.8 m over the floor. The frame in which it arrives, in the pixels \
                      around it: HDR-FLIP, mean of |difference| on a display, 0..1, and its 99.9th percentile; then FLIP of the whole image. Rows of \
                      object-sheet.png: techniques and reference.";
/// Frames after the light has gone out that are compared, counted from 1, with their keys and headings.
const KEYS: [(u32, &str, &str); 3] =
    [(1, "flip_1", "FLIP, frame 1"), (4, "flip_4", "frame 4"), (16, "flip_16", "frame 16")];
/// Frames of the moving object, its way per second, m, its side, m, and its distance from the eye, m.
const FRAMES: u32 = 16;
const SPEED: f32 = 1.5;
const SIDE: f32 = 0.5;
const DISTANCE: f32 = 4.0;
/// Half the size of the compared region, in sizes of the object.
const AROUND: f32 = 1.5;

impl InMotion<'_> {
    /// Adds the tables of changes.
    pub fn changes(&self, view: &View) -> Result<(), CliError> {
        let rows = self.lamp(view)?;
        self.bench.section("A light goes out", LAMP, "lamp", rows);
        let rows = self.object(view)?;
        self.bench.section("An object moves", OBJECT, "object", rows);
        Ok(())
    }

    fn lamp(&self, view: &View) -> Result<Vec<Row>, CliError> {
        let mut dark = view.clone();
        put_out_brightest(&mut dark.scene);
        let [old, new] = [self.reference(view)?, self.reference(&dark)?];
        self.with_sheet("lamp", view, &new, |Case { name, settings, .. }, sheet| {
            let (mut stage, before) = self.warm(view, settings)?;
            stage.update(&dark.scene)?;
            let row = Row::default().text("technique", "", name);
            let (mut row, mut times) = (row.fixed("flip_before", "before", 4, flip(&before, &old)?), Vec::new());
            let is_shown = |frame: &u32| KEYS.iter().any(|(shown, ..)| shown == frame);
            let is_skipped = restarts(&stage);
            for frame in (1..=16).filter(|frame| is_shown(frame) || !is_skipped) {
                let image = stage.frame(view)?;
                times.push(Cost::of(&image).indirect_ms);
                if let Some((_, key, heading)) = KEYS.iter().find(|(shown, ..)| *shown == frame) {
                    row = row.fixed(*key, heading, 4, flip(&image, &new)?);
                    sheet.push(rgb(&image));
                }
            }
            Ok(row.fixed("indirect_ms", "time, ms", 1, Timed { runs: times }.median()))
        })
    }

    fn object(&self, view: &View) -> Result<Vec<Row>, CliError> {
        let track = Track::before(&view.camera, view.scene.bounds().min.y.max(0.0));
        let at = |frame: u32| view.with(track.with_object(&view.scene, frame as f32 * STEP));
        let reference = self.reference(&at(FRAMES - 1))?;
        let region = track.region(FRAMES - 1, &view.camera, view.size).ok_or_else(|| {
            CliError::new(format_args!("{}: the object is not in view", view.name), "choose another scene with --scene")
        })?;
        let near = crop(&reference, region);
        let near_colors = view.shown(&near);
        self.with_sheet("object", view, &reference, |Case { name, settings, .. }, sheet| {
            let (start, warm) = (at(0), self.args.warm);
            let mut stage = self.bench.stage(&start.scene, settings)?;
            for frame in 0..warm + FRAMES - 2 {
                let moment = (frame + 1).saturating_sub(warm);
                if moment > 0 {
                    stage.update(&at(moment).scene)?;
                }
                if !restarts(&stage) {
                    stage.frame(view)?;
                }
            }
            stage.update(&at(FRAMES - 1).scene)?;
            let image = stage.frame(view)?;
            sheet.push(rgb(&image));
            let around = crop(&linear(&image)?, region);
            let mut walked = Walked::default();
            walked.add(&view.shown(&around), &near_colors);
            Ok(Row::default()
                .text("technique", "", name)
                .fixed("flip_around", "FLIP around it", 4, hdr_flip(&Pair::new(around, near.clone())?)?)
                .fixed("error_around", "error around it", 4, walked.mean())
                .fixed("p999_around", "p99.9", 3, walked.percentile(0.999))
                .fixed("flip", "FLIP, whole", 4, flip(&image, &reference)?))
        })
    }

    /// Rows of all techniques, whose images stand on a sheet above the reference.
    fn with_sheet(
        &self,
        name: &'static str,
        view: &View,
        reference: &RgbImage,
        row: impl Fn(&Case, &mut Vec<Vec<u8>>) -> Result<Row, CliError>,
    ) -> Result<Vec<Row>, CliError> {
        let mut images = Vec::new();
        let rows = self.bench.rows(
            name,
            self.with_none(view),
            |case| case.name.clone(),
            |case| {
                images.push(Vec::new());
                let last = images.len() - 1;
                row(case, &mut images[last])
            },
        )?;
        images.push(vec![view.shown(reference)]);
        let mut sheet = Sheet::new(view.size, images.len());
        images.iter().enumerate().for_each(|(row, images)| images.iter().for_each(|image| sheet.add(row, image)));
        sheet.write(&self.bench.path(&format!("{name}-sheet")))?;
        Ok(rows)
    }
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
}
