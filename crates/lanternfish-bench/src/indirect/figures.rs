//! The parts of an image with diffuse and glossy indirect light, as Nießner adds them [Niessner2010, fig. 5, fig. 1], and frames a second
//! beside those of his figures.

use lanternfish::{RenderedImage, Renderer, settings::Settings, techniques::Sampled};
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress};
use lanternfish_metrics::{ColorType, RgbImage, write_png};
use lanternfish_papers::ACROSS_TEXELS;

use super::{
    cases::{Brdf, Case, ImageSet},
    gaussian::RADIUS,
    measure::{Bench, sized},
    paper::{FIGURES, Figure},
};
use crate::{
    image,
    run::{frame_ms, least},
    table::{DASH, Row, fixed},
    technique,
};

/// Diffuse and glossy rays of a pixel [Niessner2010, §7].
const RAYS: (u32, u32) = (8, 16);

/// What the table says.
pub const TEXT: &str = "Frames a second of this page's scene, which stands in for his, across texels as he traces: his are of other scenes, of \
                        images of 512 x 512, on other hardware. Images: `across-texels-BRDF-DIRECTIONSxTEXELS.png` (figs 4, 7 and 9), and \
                        `parts-*.png`: direct light, filtered diffuse light, glossy light, and all (figs 1 and 5; half metal, of roughness 0.3). \
                        The glossy part is what the image loses without glossy rays. His mirrors and glossy light have no filter: its time \
                        is taken off our frames of one of them alone. The filter of the parts has his radius, but stops at edges and takes glossy \
                        light too.";

impl Bench<'_> {
    /// Writes the parts of fig. 5, and gives the milliseconds of the frame with all of them; or why there are none.
    pub fn parts(&self, set: ImageSet, built: &[Row], progress: &mut Progress) -> Result<f64, CliError> {
        progress
            .step("figures", &format!("Diffuse and glossy light, {}", set.in_words()), || self.write_parts(set, built))
    }

    fn write_parts(&self, set: ImageSet, built: &[Row]) -> Result<f64, CliError> {
        let structure = sized(set.settings(), built)
            .map_err(|reason| CliError::new(reason, "choose a smaller number of texels"))?;
        let case = Case { images: Some((set, ACROSS_TEXELS)), filter_radius: RADIUS, ..Case::plain(Brdf::Glossy) };
        let with = |glossy_rays| {
            let mut settings = case.settings(self.look, Some(structure.fragments_a_texel));
            if let Some(sampled) = settings.indirect.get_mut::<Sampled>() {
                *sampled = Sampled { diffuse_rays: RAYS.0, glossy_rays, ..*sampled };
            }
            settings
        };
        let direct = self.frame_of(with(0).with_indirect(technique::NO_INDIRECT), 1)?;
        let without_glossy = self.frame_of(with(0), 1)?;
        let all = self.frame_of(with(RAYS.1), self.run.runs)?;
        let [direct, without_glossy, with_glossy] = [&direct, &without_glossy, &all].map(image::linear);
        let (direct, without_glossy, with_glossy) = (direct?, without_glossy?, with_glossy?);
        self.write_linear(difference(&without_glossy, &direct), "parts-diffuse.png")?;
        self.write_linear(difference(&with_glossy, &without_glossy), "parts-glossy.png")?;
        self.write_linear(direct, "parts-direct.png")?;
        self.write_linear(with_glossy, "parts-all.png")?;
        Ok(frame_ms(&all.report.passes))
    }

    /// The frame that took least.
    fn frame_of(&self, settings: Settings, runs: u32) -> Result<RenderedImage, CliError> {
        let Size { width, height } = self.size;
        let mut renderer = Renderer::with_engine(&self.run.engine, settings)?;
        let mut frame = || renderer.render(self.scene(Brdf::Glossy), self.camera, width, height);
        Ok(least(runs, &mut frame, |frame| frame_ms(&frame.report.passes))?.1)
    }

    /// What a display shows of linear radiance, 0..=1; it also goes to a file.
    pub fn write_linear(&self, linear: RgbImage, file: &str) -> Result<RgbImage, CliError> {
        let (bytes, displayed) = image::shown(&linear, self.look.image.exposure, self.look.image.tone_map);
        let Size { width, height } = self.size;
        write_png(&self.run.folder.join(file), width, height, ColorType::Rgb, &bytes)?;
        Ok(displayed)
    }
}

/// What one image has beyond another.
fn difference(image: &RgbImage, less: &RgbImage) -> RgbImage {
    let pixels = image.pixels.iter().zip(&less.pixels);
    RgbImage { pixels: pixels.map(|(a, b)| std::array::from_fn(|channel| a[channel] - b[channel])).collect(), ..*image }
}

/// His figures, and ours across texels: of `rows`, or of all parts together. `parts`: that image's images, and milliseconds.
pub fn beside_his(rows: &[Row], parts: Option<(ImageSet, f64)>) -> Vec<Row> {
    let ours = |figure: &Figure| {
        let Some(brdf) = figure.brdf else {
            let is_his = |set: ImageSet| (set.directions(), set.resolution) == (figure.directions, figure.resolution);
            return parts.filter(|(set, _)| is_his(*set)).map(|(_, ms)| ms);
        };
        let is_his = |row: &&Row| {
            *row.get("brdf") == brdf.name()
                && *row.get("tracer") == "across-texels"
                && *row.get("directions") == figure.directions
                && *row.get("resolution") == figure.resolution
                && *row.get("samples") == figure.samples
                && *row.get("accumulate") == 1
                && *row.get("filter_radius") == Sampled::default().filter_radius
        };
        let filter_ms = |row: &Row| if brdf == Brdf::Diffuse { 0.0 } else { row.f64("filter_ms") };
        rows.iter().find(is_his).map(|row| row.f64("frame_ms") - filter_ms(row))
    };
    let row = |figure: &Figure| {
        let Figure { name, shows, directions, resolution, frames_a_second, .. } = figure;
        Row::default()
            .text("figure", "figure", name)
            .text("shows", "his scene", shows)
            .shown("directions", directions)
            .shown("texels", format_args!("{resolution}²"))
            .optional("ours", "ours, frames a second", ours(figure).map(|ms| 1e3 / ms))
            .said_as(ours(figure).map_or(DASH.to_owned(), |ms| fixed(2, 1e3 / ms)))
            .shown("Nießner", frames_a_second)
    };
    FIGURES.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(brdf: Brdf, directions: u32, samples: u32, frame_ms: f64) -> Row {
        Row::default()
            .data("brdf", brdf.name())
            .data("tracer", "across-texels")
            .data("directions", directions)
            .data("resolution", 128)
            .data("samples", samples)
            .data("accumulate", 1)
            .data("filter_radius", Sampled::default().filter_radius)
            .data("filter_ms", 10.0)
            .data("frame_ms", frame_ms)
    }

    #[test]
    fn ours_stand_beside_his_where_the_images_are_his() {
        let rows = [
            row(Brdf::Diffuse, 384, 1, 1.0),
            row(Brdf::Diffuse, 96, 1, 50.0),
            row(Brdf::Diffuse, 96, 4, 100.0),
            row(Brdf::Glossy, 150, 1, 30.0),
        ];
        let set = ImageSet { k: 5, resolution: 128 };
        let ours = |parts| {
            let rows = beside_his(&rows, parts);
            rows.iter().map(|row| (row.words("figure").to_owned(), row.words("ours").to_owned())).collect::<Vec<_>>()
        };
        // Glossy light without its filter's time; of mirrors and of 96 directions there are no rows.
        let expected = ["40.00", "20.00", "10.00", "–", "–", "50.00", "–", "20.00", "20.00"];
        let found = ours(Some((set, 25.0)));
        assert_eq!(found.iter().map(|(_, ours)| ours.as_str()).collect::<Vec<_>>(), expected, "{found:?}");
        // Parts through other images than his are not his figure 1.
        assert_eq!(ours(Some((ImageSet { k: 2, ..set }, 25.0)))[0], ("1".to_owned(), "–".to_owned()));
    }

    #[test]
    fn parts_add_up() {
        let image = |value: f32| RgbImage { width: 2, height: 1, pixels: vec![[value, 2.0 * value, 0.0]; 2] };
        assert_eq!(difference(&image(3.0), &image(1.0)), image(2.0));
    }
}
