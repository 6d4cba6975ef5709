//! Normals rebuilt from depth against the triangles' own [Elagabani2025, fig. 5.3].

use lanternfish::{
    Picture,
    settings::{DebugView, Shadows},
};
use lanternfish_metrics::{PIXELS_PER_DEGREE, RgbImage, flip_ldr};
use serde::Serialize;

use super::forward_plus::{Bench, rgb};
use lanternfish_cli::error::CliError;

/// How far one reconstruction is from the triangles' own normals.
#[derive(Debug, Serialize)]
pub struct NormalErrors {
    pub name: &'static str,
    /// Mean FLIP error of the pictures (n + 1) / 2.
    pub mean_flip: f32,
    /// Mean angle over pixels that show a surface, degrees.
    pub mean_degrees: f64,
    /// Share of those pixels that are more than ten degrees off.
    pub share_over_ten_degrees: f64,
    /// The mean FLIP error that the thesis gives for its own view.
    pub paper_flip: f64,
}

/// Renders the normals three ways, writes the pictures and their differences, and compares.
pub fn measure(bench: &Bench<'_>) -> Result<Vec<NormalErrors>, CliError> {
    let reference = bench.view(DebugView::GeometricNormal, Shadows::None)?;
    let truth = rgb(&reference);
    bench.write("normals-reference.png", reference.width, reference.height, &truth)?;
    let ways = [
        ("naive", DebugView::NormalNaive, "normals-naive.png", "normals-naive-error.png", 0.07975),
        ("improved", DebugView::NormalImproved, "normals-improved.png", "normals-improved-error.png", 0.02264),
    ];
    let mut all = Vec::new();
    for (name, view, file, error_file, paper_flip) in ways {
        let picture = bench.view(view, Shadows::None)?;
        let found = rgb(&picture);
        bench.write(file, picture.width, picture.height, &found)?;
        let error = flip_ldr(&encoded(&reference)?, &encoded(&picture)?, PIXELS_PER_DEGREE)?;
        bench.write(error_file, picture.width, picture.height, &error.magma())?;
        all.push(NormalErrors { mean_flip: error.mean(), ..compare(name, &truth, &found, paper_flip) });
    }
    Ok(all)
}

/// The picture's encoded values, 0..1.
fn encoded(picture: &Picture) -> Result<RgbImage, CliError> {
    let pixels = picture.display.iter().map(|[r, g, b, _]| [*r, *g, *b].map(|v| f32::from(v) / 255.0)).collect();
    Ok(RgbImage::new(picture.width as usize, picture.height as usize, pixels)?)
}

/// Angles alone.
fn compare(name: &'static str, truth: &[u8], found: &[u8], paper_flip: f64) -> NormalErrors {
    let pixels = || truth.as_chunks::<3>().0.iter().zip(found.as_chunks::<3>().0);
    // Black is where nothing is: no normal is packed so.
    let angles: Vec<f64> = pixels().filter(|(truth, _)| **truth != [0; 3]).map(|(a, b)| degrees(a, b)).collect();
    let count = angles.len().max(1) as f64;
    NormalErrors {
        name,
        mean_flip: 0.0,
        mean_degrees: angles.iter().sum::<f64>() / count,
        share_over_ten_degrees: angles.iter().filter(|angle| **angle > 10.0).count() as f64 / count,
        paper_flip,
    }
}

/// Angle between two normals packed as (n + 1) / 2, degrees.
fn degrees(a: &[u8; 3], b: &[u8; 3]) -> f64 {
    let unpack = |n: &[u8; 3]| glam::DVec3::from(n.map(|v| f64::from(v) / 127.5 - 1.0)).normalize_or_zero();
    unpack(a).angle_between(unpack(b)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_have_no_error_and_a_turned_normal_has_its_angle() {
        let truth = [255, 128, 128, 128, 255, 128, 0, 0, 0];
        let same = compare("", &truth, &truth, 0.0);
        assert!(same.mean_degrees < 1e-3 && same.share_over_ten_degrees == 0.0);
        let turned = compare("", &truth, &[128, 255, 128, 128, 255, 128, 9, 9, 9], 0.0);
        assert!((turned.mean_degrees - 45.0).abs() < 0.5 && turned.share_over_ten_degrees == 0.5);
    }
}
