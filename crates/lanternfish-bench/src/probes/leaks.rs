//! Light in a dark closed room beside a lit one, both in one view.

use lanternfish::{
    RenderedImage,
    settings::{Exposure, Settings},
};
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress};
use lanternfish_metrics::{ColorType, write_png};

use super::{Bench, NONE, rooms, views::View};
use crate::{
    document::Document,
    image::{linear, shown},
    table::Row,
};

const TEXT: &str = "Two closed rooms, a lamp in the left one; the view cuts the front wall away and sees both. *Leak*: mean radiance of the dark \
                    room's pixels over the mean indirect light of the lit room's, which must be 0; *worst*: the greatest of the dark room's pixels \
                    over the same. Each image is written a second time, 6 stops brighter. *Gap* is the control: a slit of 30 cm at the front of the \
                    wall lets light through.";

/// Name, thickness of the dividing wall, and its gap, m.
const WALLS: [(&str, f32, f32); 3] =
    [("box, wall of 50 cm", 0.5, 0.0), ("wall of 1 cm", 0.01, 0.0), ("gap", 0.01, 0.3)];
/// Exposures of the images, stops.
const EXPOSURES: [(&str, f32); 2] = [("plain", -1.0), ("bright", 5.0)];

impl Bench {
    /// Adds the table of leaks.
    pub fn leaks(&mut self, report: &mut Document, progress: &mut Progress) -> Result<(), CliError> {
        let size = self.size.unwrap_or(if self.is_quick {
            Size { width: 128, height: 72 }
        } else {
            Size { width: 480, height: 270 }
        });
        let mut rows = Vec::new();
        for (name, thickness, gap) in WALLS {
            let scene = rooms::rooms(thickness, gap);
            let camera = scene.cameras[0].clone();
            let view = View { name, scene, camera, look: Settings::direct_light(), size };
            let without = self.first_frame(&view, (NONE.settings)(&view.look))?;
            for case in &self.cases {
                let step = || {
                    let image = self.at_rest(&view, (case.settings)(&view.look), 1)?.remove(0);
                    for (words, ev) in EXPOSURES {
                        let path = self.path(&["leaks", name, case.name, words]);
                        let bytes = shown(&linear(&image)?, Exposure::Ev(ev), view.look.image.tone_map).0;
                        write_png(&path, size.width, size.height, ColorType::Rgb, &bytes)?;
                    }
                    Ok::<_, CliError>(leak(&image, &without, rooms::columns(thickness, size.width)))
                };
                let [leak, worst] = progress.step("leaks", &format!("{name}, {}", case.name), step)?;
                rows.push(
                    Row::default()
                        .text("scene", "", name)
                        .text("technique", "", case.name)
                        .percent("leak", "leak", 3, leak)
                        .percent("worst", "worst", 2, worst),
                );
            }
        }
        report.section("Leaks", TEXT, "leaks", rows);
        Ok(())
    }
}

/// Mean and greatest radiance of the dark room's pixels, over the mean of the lit room's indirect light.
fn leak(image: &RenderedImage, without: &RenderedImage, [lit_end, dark]: [u32; 2]) -> [f64; 2] {
    let sum = |pixel: &[f32; 4]| pixel[..3].iter().map(|value| f64::from(*value)).sum::<f64>();
    let (mut lit, mut lit_count, mut leaked, mut dark_count, mut worst) = (0.0, 0u32, 0.0, 0u32, 0.0f64);
    for (i, (pixel, direct)) in image.radiance.iter().zip(&without.radiance).enumerate() {
        let column = i as u32 % image.width;
        if column < lit_end {
            (lit, lit_count) = (lit + sum(pixel) - sum(direct), lit_count + 1);
        } else if column >= dark {
            (leaked, dark_count) = (leaked + sum(pixel), dark_count + 1);
            worst = worst.max(sum(pixel));
        }
    }
    let lit = (lit / f64::from(lit_count.max(1))).max(f64::MIN_POSITIVE);
    [leaked / f64::from(dark_count.max(1)) / lit, worst / lit]
}

#[test]
fn a_leak_is_reported() {
    use crate::image::rendering;
    let of = |values: [f32; 6]| rendering(values.map(|v| [v, v, v, 1.0]).to_vec(), 0);
    let without = of([1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(leak(&of([3.0, 3.0, 9.0, 0.0, 0.0, 0.0]), &without, [2, 3]), [0.0, 0.0]);
    assert_eq!(leak(&of([3.0, 3.0, 9.0, 0.0, 3.0, 0.0]), &without, [2, 3]), [0.5, 1.5]);
}
