//! Tables of the indirect benchmark, compared with the paper's.

use lanternfish::techniques::Sampled;

use super::{
    measure::{Measured, is_plain, trace_alike},
    soft_shadows,
};
use crate::{
    document::Document,
    papers::{self, Paper},
    table::Row,
};

const RATES: &str = "Ray rates count the rays of the BRDF only; the diffuse ray that is traced besides glossy rays is in the times, not in the \
                     rate. *With shading* includes shading of hits: one light sampled from all, with a shadow ray through the BVH. Rays into \
                     their own surface are counted but not traced. *Images*: building deep images within these frames, ms; *frame*: all other \
                     passes, ms.";

const FILTERS: &str = "Eight diffuse rays a pixel across texels. *His Gaussian* is plain and stops at no edge [Niessner2010, §5, §7]; its standard \
                       deviation, which he does not give, is half its radius here. It filters the light with the surfaces' colours, on the \
                       processor; ours filter irradiance, on the device. *FLIP*: HDR-FLIP to the mean of many frames through the BVH.";

/// Adds everything to a report.
pub fn report(report: &mut Document, measured: Measured, converged_frames: u32) {
    let Measured { images, rows, soft, filters, parts } = measured;
    report.paragraph(RATES);
    report.paragraph(format!(
        "*Energy* and *FLIP to BVH* are against the image with the same rays, filter and antialiasing through the BVH: the error of deep \
         images. *Of indirect*: energy of indirect light alone. *To many frames*: FLIP against the mean of {converged_frames} frames through \
         the BVH without filter, with little noise and aliasing: `diffuse.png`, `glossy.png`, `mirror.png`."
    ));
    report.list(rows.iter().filter(|row| is_plain(row)).filter_map(|row| ratio(row, &rows)));
    report.section("Soft shadows (table 1, fig. 8)", &soft_shadows::text(converged_frames), "soft_shadows", soft);
    report.section("Diffuse light through his filter", FILTERS, "filters", filters);
    let parts = parts.map(|(set, ms)| {
        let row = Row::default().data("directions", set.directions()).data("resolution", set.resolution);
        row.data("frame_ms", ms)
    });
    report.heading("Images");
    report.paragraph("A chunk fits one buffer binding. Each chunk adds a tracing pass.");
    report.show(images.iter().map(image_row));
    report.heading("Rays through images and through the BVH");
    report.show(rows.iter().filter(|row| is_plain(row)).cloned());
    report.heading("Filter: pixels to each side, 0 is off");
    report.paragraph(
        "5 is as wide as his, 11 x 11. His is a plain Gaussian of diffuse light [Niessner2010, §5]; ours stops at edges, follows the noise, \
         and takes glossy light too.",
    );
    report.show(varied(&rows, |row| *row.get("filter_radius") != Sampled::default().filter_radius));
    report.heading("Antialiasing: samples at edges, and the mean of frames, each with images of its own");
    report.show(varied(&rows, |row| row.f64("samples") > 1.0 || row.f64("accumulate") > 1.0));
    report.keep("images", images);
    report.keep("rows", rows);
    report.keep("parts", parts.into_iter().collect());
    papers::beside(Paper::Niessner, "indirect", report);
}

/// Ray rates relative to those through the BVH.
fn ratio(row: &Row, rows: &[Row]) -> Option<String> {
    let is_bvh = |bvh: &&Row| bvh.get("directions").is_null() && bvh.get("brdf") == row.get("brdf") && is_plain(bvh);
    let bvh = rows.iter().find(is_bvh).filter(|_| !row.get("directions").is_null())?;
    let [traced, shaded] = ["rate_traced", "rate_shaded"].map(|key| row.f64(key) / bvh.f64(key));
    let [brdf, tracer, directions, texels, flip] =
        ["brdf", "tracer", "directions", "resolution", "flip"].map(|key| row.words(key));
    Some(format!(
        "{brdf} {tracer} / BVH, {directions} x {texels}: ray rate {traced:.2} traced, {shaded:.2} with shading; FLIP {flip}"
    ))
}

fn image_row(built: &Row) -> Row {
    Row::default()
        .shown("directions", 2.0 * built.f64("directions"))
        .shown("images", built.words("directions"))
        .shown("texels", built.words("resolution"))
        .shown("chunks", built.get("chunks"))
        .shown("built, ms", built.words("total_ms"))
        .shown("fragments drawn", built.words("drawn"))
        .shown("kept", built.words("kept"))
        .shown("MB", built.words("bytes"))
}

/// Each plain row that has variations, followed by those.
fn varied(rows: &[Row], is_varied: impl Fn(&Row) -> bool) -> Vec<Row> {
    let of_plain = |plain: &Row| {
        let others: Vec<&Row> = rows.iter().filter(|row| trace_alike(row, plain) && is_varied(row)).collect();
        let plain = (!others.is_empty()).then_some(plain);
        plain.into_iter().chain(others).cloned().collect::<Vec<_>>()
    };
    rows.iter().filter(|row| is_plain(row)).flat_map(of_plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(tracer: &'static str, resolution: Option<u32>, filter_radius: u32, rate: f64) -> Row {
        let row = Row::default().text("brdf", "BRDF", "diffuse").text("tracer", "tracer", tracer);
        row.optional("directions", "directions", resolution.map(|_| 96))
            .optional("resolution", "texels", resolution)
            .number("filter_radius", "filter", filter_radius)
            .number("samples", "samples", 1)
            .number("accumulate", "frames", 1)
            .fixed("rate_traced", "traced, M/s", 2, 2.0 * rate)
            .fixed("rate_shaded", "with shading, M/s", 2, rate)
            .fixed("flip", "FLIP", 4, 0.0123)
            .data("frame_ms", 50.0)
    }

    fn rows() -> [Row; 4] {
        [
            row("bvh", None, 8, 1.0),
            row("across-texels", Some(128), 8, 3.0),
            row("across-texels", Some(128), 0, 4.0),
            row("across-texels", Some(512), 8, 2.0),
        ]
    }

    #[test]
    fn the_papers_rates_are_beside_ours() {
        let mut report = Document::titled("", Row::default());
        report.keep("rows", rows().to_vec());
        papers::beside(Paper::Niessner, "indirect", &mut report);
        let page = report.to_markdown();
        assert!(page.contains("| diffuse | across-texels | 96 | 128 | 1 | 6 | 3 | 50 | 37–50 M rays/s"), "{page}");
        assert!(page.contains("| diffuse | bvh | – | – | 1 | 2 | 1 | 50 |  |"), "{page}");
        let said = "diffuse across-texels / BVH, 96 x 512: ray rate 2.00 traced, 2.00 with shading; FLIP 0.0123";
        assert_eq!(ratio(&rows()[3], &rows()), Some(said.to_owned()));
        assert_eq!(ratio(&rows()[0], &rows()), None);
    }

    #[test]
    fn variations_follow_their_plain_row() {
        let filters = varied(&rows(), |row| *row.get("filter_radius") == 0);
        let filters: Vec<_> = filters.iter().map(|row| (row.words("resolution"), row.words("filter_radius"))).collect();
        assert_eq!(filters, [("128", "8"), ("128", "0")]);
        assert!(varied(&rows(), |row| row.f64("samples") > 1.0).is_empty());
    }
}
