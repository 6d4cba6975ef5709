//! The step response: how many frames an image takes to follow a lamp that goes out and on again.

use lanternfish::RenderError;
use lanternfish_cli::parse::Size;
use lanternfish_scene::Light;

use super::rooms;
use crate::{bench::Bench, case::Case, table::Row, view::View};

pub const TEXT: &str = "Two rooms of 128 × 72 pixels: the lamp in the left one, which lights the right one through a \
                        gap, goes out and on again. A dim light moves, so that the scene changes in every frame. \
                        Frames until the light of the right room has 50, 90 and 99 % of the change. Walks without a \
                        history follow at once and have no row.";

const SIZE: Size = Size { width: 128, height: 72 };
/// Thickness of the wall between the rooms, m.
const WALL: f32 = 0.2;
/// Frames of each state, and those at its end whose mean is its light.
const FRAMES: usize = 40;
const SETTLED: usize = 8;

/// The row of a walk.
pub fn row(bench: &Bench, Case { name, settings, .. }: &Case) -> Result<Row, RenderError> {
    let (mut scene, first) = (rooms::rooms(WALL, 0.5), rooms::columns(WALL, SIZE.width)[1] as usize);
    let (lamp, camera) = (scene.lights[0].clone(), scene.cameras[0].clone());
    scene.lights.push(Light { intensity: 1e-4 * lamp.intensity, ..lamp.clone() });
    let mut stage = bench.stage(&scene, settings)?;
    let mut view = View { name: String::new(), camera, look: settings.clone(), size: SIZE, scene };
    let mut frames_lit_by = |part: f32| {
        view.scene.lights[0].intensity = part * lamp.intensity;
        let mut frame = || {
            view.scene.lights[1].position.y += 1e-3;
            stage.update(&view.scene)?;
            let image = stage.frame(&view)?;
            let right = image.radiance.chunks(SIZE.width as usize).flat_map(|row| &row[first..]);
            Ok::<_, RenderError>(right.map(|[r, g, b, _]| f64::from(r + g + b)).sum::<f64>())
        };
        (0..FRAMES).map(|_| frame()).collect::<Result<Vec<_>, _>>()
    };
    let (on, out, again) = (frames_lit_by(1.0)?, frames_lit_by(0.0)?, frames_lit_by(1.0)?);
    let [[a, b, c], [d, e, f]] = [frames_until(&on, &out), frames_until(&out, &again)];
    let row = Row::default().text("name", "walk", name);
    let row = row.optional("out_50", "out: 50 %", a).optional("out_90", "90 %", b).optional("out_99", "99 %", c);
    Ok(row.optional("on_50", "on: 50 %", d).optional("on_90", "90 %", e).optional("on_99", "99 %", f))
}

/// Frames, counted from 1, until 50, 90 and 99 % of the change from one state to the next.
fn frames_until(before: &[f64], after: &[f64]) -> [Option<usize>; 3] {
    let [from, to] = [before, after].map(|all| all[FRAMES - SETTLED..].iter().sum::<f64>() / SETTLED as f64);
    [0.5, 0.1, 0.01].map(|left| Some(1 + after.iter().position(|light| (light - to) / (from - to) <= left)?))
}

#[test]
fn an_exponential_decay_has_its_frames() {
    let [on, out] = [vec![2.0; FRAMES], (1..=FRAMES as i32).map(|k| 2.0 * 0.5f64.powi(k)).collect()];
    assert_eq!(frames_until(&on, &out), [Some(1), Some(4), Some(7)]);
    assert_eq!(frames_until(&on, &on), [None; 3], "nothing changes");
}
