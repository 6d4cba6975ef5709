//! Tables of the papers: rows of the parts' reports, with the papers' own figures beside them.

use super::{
    parts::Paper,
    rows::{Node, Reports},
};
use crate::table::{DASH, Row};

/// A paper in words.
pub struct About {
    pub title: &'static str,
    /// The paper's scenes, sizes and hardware.
    pub theirs: &'static str,
    /// What can be compared with it, and what cannot; `<part>` is what a part showed.
    pub comparable: &'static str,
}

impl About {
    /// What can be compared, with what the parts showed.
    pub fn comparable(&self, reports: &Reports) -> String {
        let mut parts = self.comparable.split('<');
        let first = parts.next().unwrap_or_default().to_owned();
        parts.fold(first, |all, part| match part.split_once('>') {
            Some((name, rest)) => all + &reports.scene_of(name) + rest,
            None => all + "<" + part,
        })
    }
}

/// A table of a paper.
pub struct Table {
    pub paper: Paper,
    /// For scripts.
    pub key: &'static str,
    pub heading: &'static str,
    /// What stands above it.
    pub text: &'static str,
    /// The part, and the table of its report.
    pub of: [&'static str; 2],
    is: fn(&Node<'_>) -> bool,
    /// Keys of the rows.
    columns: &'static str,
    /// The paper's figures of a row; none where the report has them.
    his: Option<fn(&Node<'_>) -> &'static str>,
}

impl Table {
    /// Its rows; none if nothing was measured.
    pub fn rows(&self, reports: &Reports) -> Vec<Row> {
        let rows = reports.rows(self.of[0], self.of[1], self.is).unwrap_or_default();
        let row = |of: &Node<'_>| {
            let cell = |row: Row, key: &'static str| match of.f64(key) {
                Ok(number) => row.number(key, &key.replace('_', " "), number).said_as(shown(number)),
                Err(_) => {
                    row.text(key, &key.replace('_', " "), Some(of.words(key)).filter(|w| !w.is_empty()).unwrap_or(DASH))
                }
            };
            let row = self.columns.split(", ").fold(Row::default(), cell);
            if let Some(his) = self.his { row.text("paper", "paper", his(of)) } else { row }
        };
        rows.iter().map(row).collect()
    }
}

/// Whole numbers as they are, others with three places.
fn shown(number: f64) -> String {
    if number.fract() == 0.0 { format!("{number}") } else { format!("{number:.3}") }
}

fn every(_: &Node<'_>) -> bool {
    true
}

/// All of them.
pub const TABLES: [Table; 6] = [
    Table {
        paper: Paper::Elagabani,
        key: "elagabani_table_5_1",
        heading: "Table 5.1: optimisations, tiles of 8 x 8",
        text: "",
        of: ["forward-plus", "configurations"],
        is: every,
        columns: "name, paper_ms, frame_ms, rays, shadow_part, false_positives",
        his: None,
    },
    Table {
        paper: Paper::Niessner,
        key: "niessner_table_1",
        heading: "Table 1, figs 4, 7 and 9: million rays and frames a second",
        text: "His: Sibenik and Sponza, images of 512 x 512, DirectX 10 on an NVIDIA GTX 285 with 1024 MB: compare only the changes from row to \
               row. Soft shadows, 384 images: 79–103 M rays/s through 512² texels, 283–377 through 128².",
        of: ["indirect", "rows"],
        is: |row| row.is("filter_radius", 8) && row.is("accumulate", 1) && !row.is("tracer", "within-texel"),
        columns: "brdf, tracer, directions, resolution, samples, rate_traced, rate_shaded, frame_ms",
        his: Some(|row| {
            let of = |key: &str| row.f64(key).unwrap_or_default() as u32;
            match (row.words("brdf"), of("directions"), of("resolution"), of("samples")) {
                ("diffuse", 96, 512, 1) => "11–16 M rays/s",
                ("diffuse", 96, 128, 1) => "37–50 M rays/s; 15.5 to 19.0 frames a second",
                ("diffuse", 96, 128, 4) => "16.5 frames a second",
                ("glossy", 150, 512, 1) => "63–71 M rays/s",
                ("glossy", 150, 128, 1) => "151–209 M rays/s; 45.0 frames a second",
                ("glossy", 96, 128, 1) => "52.5 frames a second",
                ("mirror", 150, 512, 1) => "336 frames a second",
                ("mirror", 150, 128, 1) => "600 frames a second",
                _ => "",
            }
        }),
    },
    Table {
        paper: Paper::Aalund,
        key: "aalund_figures_8_9",
        heading: "Figs 8 and 9: ambient occlusion, 512 maps",
        text: "NVIDIA GeForce GTX 780 Ti, 800 x 800. The 373 ms are by Archer 2019, §4, of both building and occlusion. His hairball, 512 maps of \
               50²: 295.5 MB, 1174 ms.",
        of: ["photons", "occlusion"],
        is: every,
        columns: "name, bytes, deep_images_ms, occlusion_ms, flip",
        his: Some(|row| match row.words("name") {
            "as in the paper, 512 x 50²" => "204.1 MB, 373 ms",
            "as in the paper, 512 x 200²" => "805.5 MB",
            _ => "",
        }),
    },
    Table {
        paper: Paper::Archer,
        key: "archer_table_1",
        heading: "Table 1: steps, ms",
        text: "Capture and sort deep images, g-buffer, RSM, VPL buffer, light grid, lighting; all. His, Atrium: 3.5, 2.0, 1.3, 0.5, 0.15, 0.7, 12.0; 20.6. \
               Rungholt: 18.8, 3.3, 8.0, 5.9, 0.4, 0.5, 6.1; 43.5. His totals are printed so; the columns sum to 20.15 and 43.0.",
        of: ["virtual-lights", "rows"],
        is: |row| row.is("has_steps", true),
        columns: "name, steps/0, steps/1, steps/2, steps/3, steps/4, steps/5, steps/6, steps/*",
        his: None,
    },
    Table {
        paper: Paper::Archer,
        key: "archer_table_2",
        heading: "Table 2: building deep images by directions",
        text: "His: one draw, stacks and slices, 64² texels, on a GeForce GTX 1060; 169 directions are in his text (§4).",
        of: ["deep-images", "built"],
        is: |row| row.is("group", "Directions") && row.words("set").starts_with("stacks"),
        columns: "directions, builder, total_ms",
        his: Some(|row| match (row.f64("directions").unwrap_or_default() as u32, row.words("builder")) {
            (8, _) => "1.5 ms (Rungholt 18.0)",
            (16, _) => "1.8 ms (Rungholt 18.4)",
            (32, _) => "2.0 ms (Rungholt 18.6)",
            (64, _) => "3.2 ms (Rungholt 19.7)",
            (128, _) => "4.7 ms (Rungholt 21.3)",
            (169, "per_direction") => "121.3 ms (Rungholt 2295.8)",
            (169, _) => "5.5 ms (Rungholt 22.1)",
            _ => "",
        }),
    },
    Table {
        paper: Paper::Archer,
        key: "archer_table_3",
        heading: "Table 3: rays for ranges and random ranges",
        text: "",
        of: ["virtual-lights", "ranges"],
        is: every,
        columns: "map, deep_images_ms, random_ms, deep_images_rate",
        his: Some(|row| match row.f64("map").unwrap_or_default() as u32 {
            256 => "0.5 ms (Rungholt 0.6), random 0.04",
            512 => "1.8 ms (Rungholt 2.1), random 0.14",
            1024 => "6.0 ms (Rungholt 6.9), random 0.5",
            2048 => "20.2 ms (Rungholt 23.5), random 2.1",
            _ => "",
        }),
    },
];
