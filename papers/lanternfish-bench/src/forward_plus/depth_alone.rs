//! Shadow rays by depth alone [Elagabani2025, ch. 6]: what a frame without a surface target saves, and which pixels
//! change.

use lanternfish::RenderedImage;
use lanternfish_cli::{
    error::CliError,
    images::{differing, energy},
    timed::Timed,
    times::{counter, frame_time, ms_of},
};

use super::{ForwardPlus, declared};
use crate::{case::Case, table::Row};

/// What the table means.
pub const TEXT: &str = "The thesis has no surface target: positions and normals are rebuilt from depth, and rays hit nothing within 1 mm of their \
                        start. *Differ*: pixels unlike those with surface normals; *darker* of them have lost light, *brighter* have gained some. \
                        *Light*: the sum of the image. *Frame MB*: all that frames of the renderer keep on the device.";

/// Names and settings of the rows; the first is the reference.
const ROWS: [(&str, &str); 3] = [
    ("surface target, surface normals", "AABB, ray-culling surface"),
    ("surface target, improved normals", "AABB, ray-culling improved"),
    ("depth alone", "AABB, ray-culling depth"),
];

/// Frames until the memory is that of one configuration.
const WARM_UP: u32 = 5;

impl ForwardPlus {
    /// Renders with and without a surface target, and writes the image without one.
    pub fn depth_alone(&self) -> Result<Vec<Row>, CliError> {
        let mut reference = None;
        let mut rows = Vec::new();
        for (name, changes) in ROWS {
            let case = Case::of(&self.view.look, name, &declared(changes, "off"));
            rows.push(self.bench.step("rows", name, || self.by_depth(&case, &mut reference))?);
        }
        Ok(rows)
    }

    fn by_depth(
        &self,
        Case { name, settings, .. }: &Case,
        reference: &mut Option<RenderedImage>,
    ) -> Result<Row, CliError> {
        let mut stage = self.bench.stage(&self.view.scene, settings)?;
        let image = stage.frame(&self.view)?;
        let times = Timed::each(self.bench.runs.max(WARM_UP), || {
            let (ms, image) = frame_time(|| stage.frame(&self.view))?;
            let of = |pass| ms_of(&image.report.passes, pass);
            Ok::<_, CliError>([ms, of("prepass"), of("shadows/trace")])
        })?;
        let [frame_ms, prepass_ms, shadow_ms] = times.map(|times| times.median());
        self.bench.write(&format!("depth alone, {name}"), &image)?;
        let reference = reference.get_or_insert_with(|| image.clone());
        let [darker, brighter] = lost_and_gained(reference, &image);
        Ok(Row::default()
            .text("name", "", name)
            .count("rays", "rays", counter(&image.report, "shadows/rays"))
            .count("differing_pixels", "differ", differing(reference, &image) as u64)
            .count("darker_pixels", "darker", darker)
            .count("brighter_pixels", "brighter", brighter)
            .percent("light", "light", 3, energy(&image) / energy(reference))
            .megabytes("frame_bytes", "frame MB", stage.renderer.memory().bytes)
            .fixed("prepass_ms", "prepass ms", 2, prepass_ms)
            .fixed("shadow_ms", "shadow rays ms", 2, shadow_ms)
            .fixed("frame_ms", "frame ms", 2, frame_ms))
    }
}

/// Pixels with less and with more light than in the reference.
fn lost_and_gained(reference: &RenderedImage, image: &RenderedImage) -> [u64; 2] {
    let sum = |texel: &[f32; 4]| texel[..3].iter().sum::<f32>();
    let pairs = || reference.radiance.iter().zip(&image.radiance).map(|(was, is)| (sum(was), sum(is)));
    [pairs().filter(|(was, is)| is < was).count() as u64, pairs().filter(|(was, is)| is > was).count() as u64]
}
