//! Light in a dark closed room beside a lit one, both in one view.

use lanternfish::{
    RenderedImage,
    settings::{Exposure, Settings},
};
use lanternfish_cli::{error::CliError, images::linear, parse::Size};

use super::{InMotion, rooms};
use crate::{
    case::{Case, changed},
    table::Row,
    view::View,
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

impl InMotion<'_> {
    /// Adds the table of leaks.
    pub fn leaks(&self) -> Result<(), CliError> {
        let usual = if self.args.quick { [128, 72] } else { [480, 270] };
        let size = self.args.size.unwrap_or(Size { width: usual[0], height: usual[1] });
        let mut rows = Vec::new();
        for (name, thickness, gap) in WALLS {
            let scene = rooms::rooms(thickness, gap);
            let (camera, look) = (scene.cameras[0].clone(), Settings::direct_light());
            let view = View { name: name.to_owned(), scene, camera, look, size };
            let without = self.bench.first_frame(&view, &changed(&view.look, "indirect none"))?;
            let row = |case: &Case| {
                let image = self.at_rest(&view, &case.settings, 1)?.remove(0);
                for (words, ev) in EXPOSURES {
                    let settings = view.look.clone().with_exposure(Exposure::Ev(ev));
                    self.bench.write_linear(
                        &format!("leaks-{name}-{}-{words}", case.name),
                        &linear(&image)?,
                        &settings,
                    )?;
                }
                let [leak, worst] = leak(&image, &without, rooms::columns(thickness, size.width));
                let row = Row::default().text("scene", "", name).text("technique", "", &case.name);
                Ok::<_, CliError>(row.percent("leak", "leak", 3, leak).percent("worst", "worst", 2, worst))
            };
            rows.extend(self.bench.rows("leaks", self.cases(&view), |case| format!("{name}, {}", case.name), row)?);
        }
        self.bench.section("Leaks", TEXT, "leaks", rows);
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
    use crate::testing::rendering;
    let of = |values: [f32; 6]| rendering(values.map(|v| [v, v, v, 1.0]).to_vec(), 0);
    let without = of([1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(leak(&of([3.0, 3.0, 9.0, 0.0, 0.0, 0.0]), &without, [2, 3]), [0.0, 0.0]);
    assert_eq!(leak(&of([3.0, 3.0, 9.0, 0.0, 3.0, 0.0]), &without, [2, 3]), [0.5, 1.5]);
}
