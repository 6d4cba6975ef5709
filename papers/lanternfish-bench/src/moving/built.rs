//! Times of rebuilding deep images after a motion, and of adding an instance.

use glam::Mat3A;
use lanternfish::settings::{Quality, Settings, Shadows};
use lanternfish_cli::{
    error::CliError,
    times::{leasts, ms_of},
};
use lanternfish_papers::{DeepImageSettings, WITHIN_TEXEL, deep_images::directions::Directions};
use lanternfish_scene::Scene;

use super::{Motion, moved};
use crate::table::{DASH, Row};

/// Image size of the frame that builds deep images, pixels. Small, so that building takes most of the frame time.
const SIZE: [u32; 2] = [64, 36];

impl Motion {
    /// Device time of building deep images, and total time of adding an instance, ms; least of all runs.
    pub fn built(&self) -> Result<Row, CliError> {
        Ok(self.images()?.and(self.instances()?))
    }

    /// Passes that build deep images, in the frame after one part has moved, and in the next frame, without motion.
    fn images(&self) -> Result<Row, CliError> {
        let (scene, mut sampled) = (&self.scene, Quality::Good.sampled().one_bounce());
        sampled.tracer = WITHIN_TEXEL.into();
        let settings = Settings::default().with_indirect(sampled).with_shadows(Shadows::BVH);
        let row = Row::default()
            .data(
                "directions",
                Directions::new(DeepImageSettings::of(&settings.structure).directions).map_or(0, |all| all.len()),
            )
            .data("resolution", DeepImageSettings::of(&settings.structure).resolution);
        let mut renderer = self.bench.renderer(&settings)?;
        let mut uploaded = renderer.upload(scene)?;
        let camera = scene.default_camera(SIZE[0] as f32 / SIZE[1] as f32);
        let (mut image_passes, mut kept_passes, mut ms) = (0, 0, f64::INFINITY);
        // Emissive parts cannot move without an update.
        if let Some(part) = dark_part(scene) {
            let mut transforms =
                [moved(scene, 0.01), scene.clone()].map(|scene| scene.instances[part].world_from_object);
            [ms] = leasts(self.bench.runs, || {
                renderer.move_instances(&mut uploaded, &[(part, transforms[0])])?;
                transforms.swap(0, 1);
                let mut of_images = || {
                    let rendering = renderer.render(&uploaded, &camera, SIZE)?;
                    let count =
                        rendering.report.passes.iter().filter(|pass| pass.name.starts_with("deep_images/")).count();
                    Ok::<_, CliError>((count, ms_of(&rendering.report.passes, "deep_images/")))
                };
                let ((moved, ms), (kept, _)) = (of_images()?, of_images()?);
                (image_passes, kept_passes) = (moved, kept);
                // Adapters without timestamps report no passes.
                Ok::<_, CliError>([if moved > 0 { ms } else { f64::INFINITY }])
            })?;
        }
        let shown = if ms.is_finite() { format!("{ms:.1} ms") } else { DASH.to_owned() };
        let row = row.fixed("images_ms", "", 1, ms).said_as(shown);
        Ok(row.data("image_passes", image_passes).data("kept_passes", kept_passes))
    }

    /// Times of adding an instance: by an update, and by moving a spare instance that was uploaded with zero scale.
    fn instances(&self) -> Result<Row, CliError> {
        let (renderer, scene) = (self.renderer(Shadows::BVH)?, &self.scene);
        let part = scene.instances.len() / 2;
        let mut more = scene.clone();
        more.instances.push(moved(scene, 0.01).instances[part].clone());
        let last = more.instances.len() - 1;
        let there = more.instances[last].world_from_object;
        let mut spare = more.clone();
        spare.instances[last].world_from_object.matrix3 = Mat3A::ZERO;
        let [inserted, moved_in] = leasts(self.bench.runs, || {
            let mut uploaded = renderer.upload(scene)?;
            let inserted = self.timed(|| Ok(renderer.update(&mut uploaded, &more)?))?;
            let mut uploaded = renderer.upload(&spare)?;
            // The first move after an upload creates resources.
            renderer.move_instances(&mut uploaded, &[(0, moved(scene, 0.001).instances[0].world_from_object)])?;
            let moved_in =
                self.timed(|| Ok(renderer.move_instances(&mut uploaded, &[(last, there)]).map(|_| ())?))?;
            Ok::<_, CliError>([inserted, moved_in])
        })?;
        Ok(Row::default().fixed("inserted_ms", "", 1, inserted).fixed("moved_in_ms", "", 1, moved_in))
    }
}

/// The middle part of those that are not emissive.
fn dark_part(scene: &Scene) -> Option<usize> {
    let is_emissive = |part: &usize| {
        let primitives = &scene.meshes[scene.instances[*part].mesh].primitives;
        primitives.iter().any(|primitive| scene.materials[primitive.material].emissive.max_element() > 0.0)
    };
    let dark: Vec<usize> = (0..scene.instances.len()).filter(|part| !is_emissive(part)).collect();
    dark.get(dark.len() / 2).copied()
}

/// Describes the times in text.
pub fn in_words(built: &Row) -> String {
    let [directions, resolution, passes, kept] =
        ["directions", "resolution", "image_passes", "kept_passes"].map(|key| built.get(key));
    format!(
        "Deep images, {directions} of {resolution}² texels: {} of device time in the frame after one part has moved, in {passes} passes; {kept} \
         passes in the next frame.\n\nAdding an instance: {} ms by an update, {} ms by moving a spare instance with zero scale.",
        built.words("images_ms"),
        built.words("inserted_ms"),
        built.words("moved_in_ms")
    )
}
