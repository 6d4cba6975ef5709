//! The page of stored figures, and the table of a few variants.

use super::{
    figures::{COLUMNS, Card, Compiled, Row},
    hot::HOT,
    stored::Stored,
};

const HEAD: &str = "\
RADV, Mesa's compiler for AMD's graphics cards, compiled every shader with
entry points, without such a card. SPIR-V is what wgpu gives the driver on it, written by naga.

How to read the columns:

- **VGPRs**: vector registers of a lane, 32 bits each. Fewer allow more waves.
- **occupancy**: waves that a processor holds at a time, in percent of the most: those registers and LDS leave room for. A low value hides less of
  the time of memory.
- **scratch**: bytes of a lane in memory, for arrays that registers do not hold.
- **LDS**: bytes of workgroup memory.
- **instructions**: of the program, not of a run.
- **inverse throughput**: the compiler's estimate of cycles, where every loop has one fixed count and every branch is taken. It compares
  variants of one pass, not passes with each other: alpha masks, for one, weigh more in it than in a frame.

What the page does not say: times. No graphics card ran anything. Fixed-function state of raster pipelines follows from the shader: formats from
its outputs, samples from the feature `multisampled`, no blending, a depth test.
";

const HOT_HEAD: &str = "\
`cargo xtask check` compiles these variants, and fails where occupancy falls or scratch grows against this page.
";

const PASSES_HEAD: &str = "\
Each row has the least and greatest value over the variants of a file and entry point, greatest inverse throughput first. All declared variants
are compiled, but: without arrays of textures, where the same variant with them is declared; in `shading/` and `shadows/`, with other culling,
another choice of rays, or another tracer than the default settings have; and files of the library with features of the papers.
";

/// The page of these figures.
pub fn of(stored: &Stored) -> String {
    let names = stored.cards.keys().map(String::as_str).collect::<Vec<_>>().join(" and ");
    let mut page = format!("# Shaders on {names}\n\nMesa {}, naga {}. {HEAD}", stored.mesa, stored.naga);
    page += &format!("\n## Hot passes\n\n{HOT_HEAD}\n| pass | file, entry point and features |\n|---|---|\n");
    for hot in &*HOT {
        let features: String = hot.features.split_whitespace().map(|feature| format!(", {feature}")).collect();
        page += &format!("| {} | `{} {}`{features} |\n", hot.name, hot.file, hot.entry);
    }
    for (name, card) in &stored.cards {
        let rows = HOT.iter().filter_map(|hot| Some((hot.name.to_owned(), card.hot.get(hot.name)?)));
        page += &format!("\n### Hot passes on {name}\n\n{}", table("pass", rows));
    }
    for (name, card) in &stored.cards {
        page += &format!("\n## All passes on {name}\n\n{PASSES_HEAD}\n{}", passes(card));
    }
    page
}

fn passes(card: &Card) -> String {
    let mut rows: Vec<_> = card.passes.iter().collect();
    rows.sort_by_key(|(_, (_, row))| std::cmp::Reverse(row[COLUMNS.len() - 1].most));
    table("file, entry point, variants", rows.into_iter().map(|(name, (count, row))| (format!("{name}, {count}"), row)))
}

fn table<'a>(first: &str, rows: impl Iterator<Item = (String, &'a Row)>) -> String {
    let mut table = format!("| {first} | {} |\n|---|{}\n", COLUMNS.join(" | "), "--:|".repeat(COLUMNS.len()));
    for (name, row) in rows {
        table += &format!("| {name} | {} |\n", row.map(|range| range.to_string()).join(" | "));
    }
    table
}

/// The figures of single variants, for a terminal.
pub fn variants(card: &str, compiled: &[Compiled]) -> String {
    let mut text = format!("{card}\n{}  variant", COLUMNS.map(|name| format!("{name:>12}")).join(" "));
    for Compiled { shader, entry, values } in compiled {
        let values =
            COLUMNS.iter().zip(values).map(|(name, value)| format!("{value:>width$}", width = name.len().max(12)));
        text += &format!("\n{}  {shader} {entry}", values.collect::<Vec<_>>().join(" "));
    }
    text
}
