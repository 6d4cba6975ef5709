use lanternfish::{
    settings::{Anisotropy, RayCulling, RayRangeCulling, Samples, Shadows},
    techniques::{
        Assignment, ClusterShape, Clustered, IndirectClamp, IndirectResolution, SampledLights, TileSize, Tiled,
    },
};
use lanternfish_papers::RasterGrid;

use super::*;
use crate::bench::file_name;

fn rows() -> Vec<Technique> {
    lanternfish_papers::register();
    techniques(&Settings::direct_light(), 10.0)
}

#[track_caller]
fn assert_every<T: PartialEq + std::fmt::Debug>(all: &[T], of: impl Fn(&Settings) -> T) {
    for value in all {
        assert!(rows().iter().any(|row| of(&row.case.settings) == *value), "no row for {value:?}");
    }
}

#[test]
fn every_value_of_every_setting_has_a_row() {
    assert_every(&Shadows::all(), |settings| settings.shadows.technique);
    assert_every(RayCulling::ALL, |settings| settings.shadows.ray_culling);
    assert_every(RayRangeCulling::ALL, |settings| settings.shadows.ray_range_culling);
    assert_every(Materials::ALL, |settings| settings.materials.model);
    assert_every(TextureBinding::ALL, |settings| settings.materials.textures);

    assert_every(Samples::ALL, |settings| settings.image.samples);
    assert_every(Anisotropy::ALL, |settings| settings.materials.anisotropy);
    assert_every(&[false, true], |settings| settings.image.accumulate > 1);
    assert_every(&[false, true], |settings| settings.lights.radius > 0.0);

    let direct = |settings: &Settings| settings.direct.name();
    assert_every(&Direct::all().iter().map(Direct::name).collect::<Vec<_>>(), direct);
    for rays in LightSamples::ALL {
        assert_every(&[Some(*rays)], |settings| {
            settings.direct.get::<SampledLights>().map(|lights| lights.light_samples)
        });
    }

    // Every value of every culling scheme.
    let clustered = |culling: &Culling| culling.get::<Clustered>().copied();
    let tiled = |culling: &Culling| culling.get::<Tiled>().map(|tiled| (tiled.tile_size, tiled.aabb_test));
    let shape = |shape| match shape {
        ClusterShape::Perspective { .. } => 0,
        ClusterShape::Orthographic { .. } => 1,
        ClusterShape::Displaced { .. } => 2,
    };
    assert_every(&[Culling::NONE], |settings| settings.culling.clone());
    let names: Vec<_> = Culling::all().iter().map(Culling::name).collect();
    assert_every(&names, |settings| settings.culling.name());
    for size in TileSize::ALL {
        assert_every(&[Some((*size, true)), Some((*size, false))], |settings| tiled(&settings.culling));
    }
    let grid = |culling: &Culling| culling.get::<RasterGrid>().map(|grid| (grid.tile_size, grid.layers > 8));
    for size in TileSize::ALL {
        assert_every(&[Some((*size, true))], |settings| grid(&settings.culling));
    }
    assert_every(&[Some(false)], |settings| grid(&settings.culling).map(|(_, is_deep)| is_deep));
    assert_every(&[Some(0), Some(1), Some(2)], |settings| clustered(&settings.culling).map(|c| shape(c.shape)));
    for assignment in Assignment::ALL {
        assert_every(&[Some(*assignment)], |settings| clustered(&settings.culling).map(|c| c.assignment));
    }
}

#[test]
fn every_occlusion_technique_and_none_has_a_row_for_each_ground_truth() {
    for ground_truth in
        [GroundTruth::Occlusion, GroundTruth::ObscuranceFar, GroundTruth::ObscuranceNear, GroundTruth::Environment]
    {
        let mut rows = rows();
        rows.retain(|row| row.ground_truth == ground_truth);
        for technique in std::iter::once(Occlusion::NONE).chain(Occlusion::all()) {
            assert!(rows.iter().any(|row| row.case.settings.occlusion.name() == technique.name()), "{ground_truth}");
        }
    }
}

#[test]
fn one_bounce_has_a_row_for_every_tracer_and_resolution() {
    let sampled = |settings: &Settings| settings.indirect.get::<Sampled>().copied();
    for tracer in &Tracer::in_one_level() {
        assert_every(&[Some(*tracer)], |settings| sampled(settings).map(|sampled| sampled.tracer.fixed()));
    }
    for resolution in IndirectResolution::ALL {
        assert_every(&[Some(*resolution)], |settings| sampled(settings).map(|sampled| sampled.resolution));
    }
    for clamp in IndirectClamp::ALL {
        assert_every(&[Some(*clamp)], |settings| sampled(settings).map(|sampled| sampled.clamp));
    }
    assert_every(&[Indirect::NONE], |settings| settings.indirect.clone());
    assert_every(&Indirect::all(), |settings| settings.indirect.clone());
}

#[test]
fn a_row_changes_one_setting_and_has_a_unique_name() {
    let default = Settings::direct_light();
    let rows = rows();
    for (i, row) in rows.iter().enumerate() {
        let s = &row.case.settings;
        let changes = [
            s.direct != default.direct,
            s.culling != default.culling,
            s.shadows.technique != default.shadows.technique,
            s.shadows.ray_culling != default.shadows.ray_culling,
            s.shadows.ray_range_culling != default.shadows.ray_range_culling,
            s.materials.model != default.materials.model && row.ground_truth != GroundTruth::OneBounce,
            s.materials.textures != default.materials.textures,
            s.image.samples != default.image.samples,
            s.materials.anisotropy != default.materials.anisotropy,
            s.image.accumulate != default.image.accumulate && row.ground_truth == GroundTruth::Direct,
            row.ground_truth == GroundTruth::DirectSoft,
            row.ground_truth == GroundTruth::Full,
            matches!(row.ground_truth, GroundTruth::OneBounce | GroundTruth::OneBounceFile),
            matches!(row.ground_truth, GroundTruth::Environment | GroundTruth::EnvironmentBounce),
            matches!(
                row.ground_truth,
                GroundTruth::Occlusion | GroundTruth::ObscuranceFar | GroundTruth::ObscuranceNear
            ),
        ];
        let count = changes.iter().filter(|changed| **changed).count();
        assert_eq!(count, usize::from(i > 0), "{}", row.case.name);
        assert!(
            rows[..i].iter().all(|other| file_name(&other.case.name) != file_name(&row.case.name)),
            "{}",
            row.case.name
        );
    }
}

#[test]
fn a_mean_with_all_bounces_has_the_settings_of_the_single_frame() {
    let row = |name: &str| rows().into_iter().find(|row| row.case.name == name).unwrap().case.settings;
    let mean = row(&format!("indirect sampled, {MEAN_FRAMES} frames"));
    assert_eq!((mean.indirect.clone(), mean.image.accumulate), (row("indirect sampled").indirect, MEAN_FRAMES));
    assert_ne!(row("indirect sampled, best").indirect, mean.indirect);
}

#[test]
fn every_ground_truth_has_techniques_or_is_part_of_one() {
    for ground_truth in GroundTruth::ALL {
        assert_eq!(
            ground_truth.is_compared(),
            rows().iter().any(|row| row.ground_truth == *ground_truth),
            "{ground_truth}"
        );
        let is_part = GroundTruth::ALL.iter().any(|complete| complete.without_indirect().contains(ground_truth));
        assert!(ground_truth.is_compared() || is_part, "{ground_truth}");
    }
}

/// Every setting has rows above, or a reason for none.
#[test]
fn every_setting_has_rows_or_a_reason() {
    let with_rows = [
        "direct",
        "culling",
        "shadows.technique",
        "shadows.ray-culling",
        "shadows.ray-range-culling",
        "shadows.rays",
        "lights.radius",
        "materials.model",
        "materials.textures",
        "materials.anisotropy",
        "image.samples",
        "image.accumulate",
        // With separate ground truths.
        "indirect",
        "caustics",
        "occlusion",
        "structure",
    ];
    let without = [
        // Does not change a single image; measured by `lanternfish-bench walks`.
        "history",
        // Set by the shot, for the ground truth too.
        "lights.attenuation",
        "lights.near-radius",
        "lights.coefficients",
        "lights.range-threshold",
        "lights.sun-diameter",
        // Change the display of an image, not its light.
        "image.exposure",
        "image.tone-map",
        "image.background",
        "image.debug-view",
        // Antialiasing of frames of a moving view; the rows are single images.
        "image.antialiasing",
    ];
    let groups = ["lights", "shadows", "materials", "image"];
    let settings = serde_json::to_value(Settings::default()).unwrap();
    let mut names = Vec::new();
    for (name, value) in settings.as_object().unwrap() {
        match value.as_object().filter(|_| groups.contains(&name.as_str())) {
            Some(group) => names.extend(group.keys().map(|key| format!("{name}.{key}"))),
            None => names.push(name.clone()),
        }
    }
    let mut known = [&with_rows[..], &without].concat();
    names.sort();
    known.sort();
    assert_eq!(names, known);
}
