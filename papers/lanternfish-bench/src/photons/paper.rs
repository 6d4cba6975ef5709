//! Aalund's own figures [Aalund2015, §5].

use crate::table::{Row, fixed};

/// What they were measured on, and where a number is not his.
pub const MACHINE: &str = "NVIDIA GeForce GTX 780 Ti, 800 x 800, 512 layered depth maps. *Frame*: with \"pipeline overhead\" (fig. 10). *Trace*: his \
                           \"photon tracing\" of fig. 10, which leaves 351 and 282 ms for all else, although his §5.2 calls the splatting pass the \
                           bottleneck. The 373 ms are by Archer 2019, §4, of both building and occlusion. Fig. 8 and its times of HBAO are \
                           an image with no number in the text; fig. 11 has no time.";

/// One of his images.
pub struct Figure {
    pub name: &'static str,
    pub resolution: u32,
    /// Whole frame, ms.
    pub frame_ms: Option<u32>,
    /// Photon tracing alone, ms.
    pub trace_ms: Option<u32>,
    /// Memory of his lists, MB.
    pub megabytes: f64,
}

const fn figure(
    name: &'static str,
    resolution: u32,
    frame_ms: Option<u32>,
    trace_ms: Option<u32>,
    megabytes: f64,
) -> Figure {
    Figure { name, resolution, frame_ms, trace_ms, megabytes }
}

/// Occlusion, figs 8 and 9.
pub const OCCLUSION: [Figure; 3] = [
    figure("fig. 8 (a), Crytek Sponza, within 1280 units", 200, None, None, 805.5),
    figure("fig. 9 (a), Crytek Sponza, unattenuated", 50, Some(373), None, 204.1),
    figure("fig. 9 (c), hairball, unattenuated", 50, Some(1174), None, 295.5),
];

/// Indirect light, fig. 10.
pub const INDIRECT: [Figure; 2] = [
    figure("fig. 10 (a), Crytek Sponza", 200, Some(2413), Some(2062), 805.5),
    figure("fig. 10 (c), Crytek Sponza", 200, Some(1716), Some(1434), 805.5),
];

/// Ours beside his: the name of a row, its frame, ms; its tracing, ms; its images, MB.
pub fn ours(name: &str, resolution: u32, frame_ms: f64, trace_ms: Option<f64>, megabytes: Option<f64>) -> Row {
    row(&format!("ours: {name}"), resolution, Some(frame_ms), trace_ms, megabytes)
}

/// His rows.
pub fn his(figures: &[Figure]) -> Vec<Row> {
    let whole = |ms: Option<u32>| ms.map(f64::from);
    let of = |f: &Figure| row(f.name, f.resolution, whole(f.frame_ms), whole(f.trace_ms), Some(f.megabytes));
    figures.iter().map(of).collect()
}

fn row(name: &str, resolution: u32, frame_ms: Option<f64>, trace_ms: Option<f64>, megabytes: Option<f64>) -> Row {
    let rounded = |ms: Option<f64>| ms.map(|ms| ms.round() as u64);
    Row::default()
        .text("name", "", name)
        .number("resolution", "texels", resolution)
        .said_as(format_args!("{resolution}²"))
        .optional("frame_ms", "frame, ms", rounded(frame_ms))
        .optional("trace_ms", "trace", rounded(trace_ms))
        .optional("megabytes", "MB", megabytes.map(|megabytes| fixed(1, megabytes)))
}

#[test]
fn tracing_is_part_of_his_frame() {
    for figure in &INDIRECT {
        assert!(figure.trace_ms < figure.frame_ms, "{}", figure.name);
    }
    let rest: Vec<_> = INDIRECT.iter().map(|f| f.frame_ms.unwrap() - f.trace_ms.unwrap()).collect();
    assert!(rest.iter().all(|rest| MACHINE.contains(&rest.to_string())), "{rest:?}");
    assert_eq!(his(&OCCLUSION)[2].f64("frame_ms"), 1174.0);
    assert_eq!(his(&OCCLUSION)[0].words("trace_ms"), crate::table::DASH);
}
