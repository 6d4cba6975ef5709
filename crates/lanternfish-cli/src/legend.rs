//! The colour scale of a debug view, drawn below its image.

use lanternfish::{RenderedImage, debug_views::Scale};

use crate::sheet::{GLYPH, INK, Sheet};

/// Width of the margin around everything, pixels.
const MARGIN: usize = 8;
const BAR_HEIGHT: usize = 12;
const TICK_HEIGHT: usize = 3;
/// Gap between two lines, pixels.
const GAP: usize = 4;
const HEIGHT: usize = MARGIN + BAR_HEIGHT + TICK_HEIGHT + GAP + GLYPH + GAP + GLYPH + MARGIN;
/// Least width with a legend, pixels. A narrower image is padded at the right.
const LEAST_WIDTH: usize = 288;
/// The letters double in size at this image width, pixels, triple at twice the width, and so on.
const LETTERS_WIDTH: usize = 1000;

/// Returns the unchanged image with a colour bar, numbers and the quantity's name below it.
pub fn below(rendering: RenderedImage, scale: &Scale) -> RenderedImage {
    let (width, height) = (rendering.width as usize, rendering.height as usize);
    let (wide, high) = size_with(width, height);
    let mut sheet = Sheet::new(wide, high, letters(wide));
    sheet.paste(0, 0, width, &rendering.display);
    draw(&mut sheet, scale, height);
    RenderedImage { width: sheet.width as u32, height: sheet.height as u32, display: sheet.pixels, ..rendering }
}

/// Width and height of an image of this size with its legend, pixels.
pub fn size_with(width: usize, height: usize) -> (usize, usize) {
    let wide = width.max(LEAST_WIDTH);
    (wide, height + letters(wide) * HEIGHT)
}

/// Scale of the letters for a sheet of this width: sheet pixels per glyph pixel.
fn letters(wide: usize) -> usize {
    (wide / LETTERS_WIDTH).max(1)
}

fn draw(sheet: &mut Sheet, scale: &Scale, top: usize) {
    let unit = sheet.letters;
    let (left, length) = (MARGIN * unit, sheet.width - 2 * MARGIN * unit);
    let bar = top + MARGIN * unit;
    for x in 0..length {
        let [red, green, blue] = scale.color(x as f32 / (length - 1) as f32);
        sheet.fill(left + x, bar, 1, BAR_HEIGHT * unit, [red, green, blue, 255]);
    }
    let ticks = bar + BAR_HEIGHT * unit;
    let numbers = ticks + (TICK_HEIGHT + GAP) * unit;
    for (position, text) in marks(scale) {
        let x = left + (position * (length - 1) as f32).round() as usize;
        sheet.fill(x.min(left + length - unit), ticks, unit, TICK_HEIGHT * unit, INK);
        // Centred at the tick, but within the sheet.
        let wide = text.len() * GLYPH * unit;
        let most = sheet.width.saturating_sub(wide + unit);
        sheet.write(x.saturating_sub(wide / 2).min(most), numbers, &text);
    }
    let law = if scale.is_logarithmic() { "logarithmic" } else { "linear" };
    sheet.write(left, numbers + (GLYPH + GAP) * unit, &format!("{} ({law})", scale.what));
}

/// Positions with a number, and the numbers: five steps, one fewer than the heat map has colours.
fn marks(scale: &Scale) -> Vec<(f32, String)> {
    const STEPS: usize = 5;
    let positions = (0..=STEPS).map(|step| step as f32 / STEPS as f32);
    positions.map(|position| (position, number(scale.value(position)))).collect()
}

/// At most three digits; integers without decimals.
fn number(value: f32) -> String {
    match value {
        v if v.fract() == 0.0 => format!("{v}"),
        v if v < 1.0 => format!("{}", (100.0 * v).round() / 100.0),
        v => format!("{}", (10.0 * v).round() / 10.0),
    }
}

#[cfg(test)]
mod tests {
    use lanternfish::{Report, settings::DebugView};

    use super::*;

    fn rendering(width: u32, height: u32) -> RenderedImage {
        let display = (0..width * height).map(|i| [(i % 251) as u8, 7, 9, 255]).collect();
        RenderedImage { width, height, radiance: Vec::new(), display, exposure: None, report: Report::default() }
    }

    #[test]
    fn the_image_is_unchanged_and_the_bar_matches_the_scale() {
        for view in
            [DebugView::LightCount, DebugView::ClusterLights, DebugView::Depth, DebugView::Occlusion, DebugView::Motion]
        {
            for (width, height) in [(1, 1), (320, 50), (1280, 20), (2100, 3)] {
                let scale = Scale::of(view).unwrap();
                let plain = rendering(width, height);
                let with = below(plain.clone(), &scale);
                assert!(with.width >= width && with.display.len() == (with.width * with.height) as usize);
                let row = |rendering: &RenderedImage, y: u32| {
                    let first = (y * rendering.width) as usize;
                    rendering.display[first..first + width as usize].to_vec()
                };
                assert!((0..height).all(|y| row(&with, y) == row(&plain, y)), "{view} {width}");
                // Sample the middle row of the bar.
                let letters = (with.width as usize / LETTERS_WIDTH).max(1);
                let (left, middle) = (MARGIN * letters, height as usize + (MARGIN + BAR_HEIGHT / 2) * letters);
                let length = with.width as usize - 2 * left;
                for position in [0.0, 0.2, 0.5, 0.77, 1.0] {
                    let x = (position * (length - 1) as f32).round() as usize;
                    let [red, green, blue, _] = with.display[middle * with.width as usize + left + x];
                    let expected = scale.color(x as f32 / (length - 1) as f32);
                    assert_eq!([red, green, blue], expected, "{view} {width} {position}");
                }
                assert!(with.display[(height * with.width) as usize..].contains(&INK), "numbers");
            }
        }
    }

    #[test]
    fn numbers_match_the_scale() {
        let of = |view| marks(&Scale::of(view).unwrap()).into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(of(DebugView::LightCount), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(of(DebugView::ClusterLights), ["0", "3", "15", "63", "255", "1023"]);
        assert_eq!(of(DebugView::Depth), ["64", "16", "4", "1", "0.25", "0.06"]);
        assert_eq!(of(DebugView::Visibility), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
    }
}
