//! Every technique of the renderer, one per row.
//!
//! Each row changes one setting from the renderer's recommended settings of direct light. The rows come from the settings' own lists of
//! values, and [`techniques`] destructures [`Settings`] completely. A new setting without a row therefore does not compile, and a new value
//! without a row fails a test.

use lanternfish::{
    settings::{
        Anisotropy, Culling, Direct, Indirect, Materials, Occlusion, Quality, RayCulling, RayRangeCulling, Samples,
        Settings, Shadows, TextureBinding, Tracer,
    },
    techniques::{
        Assignment, ClusterShape, ClusterTest, Clustered, HitLight, IndirectClamp, IndirectResolution, LightRays,
        Sampled, SampledLights, TileSize, Tiled,
    },
};
use lanternfish_papers::{Deep, DeepImageSettings, DirectionSet, RasterGrid, WITHIN_TEXEL};
use lanternfish_scene::Named;

use crate::{
    ground_truths::{GroundTruth, SOFT_RADIUS},
    technique,
};

/// One configuration of the renderer.
#[derive(Clone, Debug)]
pub struct Technique {
    /// The changed settings, by their names on the command line.
    pub name: String,
    pub settings: Settings,
    /// The ground truth of its image.
    pub ground_truth: GroundTruth,
}

impl Technique {
    /// The name as part of a file name.
    pub fn file_name(&self) -> String {
        self.name.replace(", ", "-").replace([' ', ':'], "-")
    }
}

/// All rows for a shot with the direct-light settings `default`, and a scene with this diagonal, m. The first row is `default`.
pub fn techniques(default: &Settings, diagonal: f32) -> Vec<Technique> {
    let row = |name: String, ground_truth, settings| Technique { name, settings, ground_truth };
    let mut rows = vec![row("default".to_owned(), GroundTruth::Direct, default.clone())];
    let (direct, culling, materials) = (&default.direct, &default.culling, &default.materials.model);
    for other in cullings().into_iter().filter(|other| other != culling) {
        let settings = default.clone().with_culling(other.clone());
        rows.push(row(culling_name(&other), GroundTruth::Direct, settings));
    }
    let of_rays = |rays: &LightRays| SampledLights { rays: *rays, ..SampledLights::default() }.into();
    let others = LightRays::ALL.iter().filter(|rays| **rays != LightRays::default());
    let others = others.map(|rays| (format!("sampled, light-samples {rays}"), of_rays(rays)));
    let techniques = Direct::all().into_iter().map(|other| (other.name().to_owned(), other));
    for (name, other) in techniques.chain(others).filter(|(_, other)| other != direct) {
        let settings = default.clone().with_direct(other);
        rows.push(row(format!("direct {name}"), GroundTruth::Direct, settings));
    }
    let mut each = |name: &str, changed: Vec<(String, Settings)>| {
        let changed = changed.into_iter().filter(|(_, settings)| settings != default);
        rows.extend(changed.map(|(value, settings)| row(format!("{name} {value}"), GroundTruth::Direct, settings)));
    };
    macro_rules! every {
        ($name:literal, $group:ident.$field:ident, $type:ty) => {
            let changed = |value: &$type| {
                let mut settings = default.clone();
                settings.$group.$field = *value;
                (value.to_string(), settings)
            };
            each($name, <$type as Named>::all().iter().map(changed).collect());
        };
    }
    every!("shadows", shadows.technique, Shadows);
    every!("ray-culling", shadows.ray_culling, RayCulling);
    every!("ray-range-culling", shadows.ray_range_culling, RayRangeCulling);
    every!("textures", materials.textures, TextureBinding);
    every!("samples", image.samples, Samples);
    // Four frames: more take longer and show nothing new.
    each("accumulate", vec![("4".to_owned(), default.clone().with_accumulate(4))]);
    every!("anisotropy", materials.anisotropy, Anisotropy);
    for other in Materials::ALL.iter().filter(|other| *other != materials) {
        let ground_truth = match other {
            Materials::File => GroundTruth::Direct,
            Materials::Lambert => GroundTruth::DirectLambert,
        };
        let settings = default.clone().with_materials(*other);
        rows.push(row(format!("materials {other}"), ground_truth, settings));
    }
    // Area lights, rendered as points, and as disks with few or many shadow rays.
    rows.push(row("light-radius 0".to_owned(), GroundTruth::DirectSoft, default.clone()));
    for shadow_rays in [default.shadows.rays, 4, 64] {
        let settings = default.clone().with_light_radius(SOFT_RADIUS).with_shadow_rays(shadow_rays);
        rows.push(row(
            format!("light-radius {SOFT_RADIUS}, shadow-rays {shadow_rays}"),
            GroundTruth::DirectSoft,
            settings,
        ));
    }
    // All light, rendered without indirect light, and with it.
    let without = |accumulate| default.clone().with_indirect(technique::NO_INDIRECT).with_accumulate(accumulate);
    rows.push(row("indirect none".to_owned(), GroundTruth::Full, without(1)));
    rows.push(row(format!("indirect none, {MEAN_FRAMES} frames"), GroundTruth::Full, without(MEAN_FRAMES)));
    for indirect in Indirect::all() {
        let settings = default.clone().with_indirect(indirect.clone()).with_structure(Settings::default().structure);
        rows.push(row(format!("indirect {}", indirect.name()), GroundTruth::Full, settings));
    }
    let sampled = |name: &str, sampled, accumulate| {
        let settings = default.clone().with_indirect(technique::sampled(sampled)).with_accumulate(accumulate);
        row(format!("indirect sampled, {name}"), GroundTruth::Full, settings)
    };
    rows.push(sampled("one bounce", GOOD, 1));
    rows.push(sampled("best", Quality::Best.sampled(), 1));
    rows.push(sampled(&format!("{MEAN_FRAMES} frames"), Quality::Good.sampled(), MEAN_FRAMES));
    rows.extend(bounces(default));
    rows.extend(super::bounces::bounces(default));
    rows.extend(glossy_bounces(default));
    rows.extend(occlusions(default, diagonal));
    rows.extend(environments(default, diagonal));
    rows
}

/// Number of frames of the mean with all bounces.
const MEAN_FRAMES: u32 = 64;

/// Base settings of the rows of one bounce.
const GOOD: Sampled = Quality::Good.sampled().one_bounce();

/// One bounce of diffuse light: with every tracer, with images of several resolutions, from every pixel and from every fourth pixel, and with
/// half the rays.
fn bounces(default: &Settings) -> Vec<Technique> {
    let ground_truth = GroundTruth::OneBounce;
    let usual = DeepImageSettings::of(&default.structure).resolution;
    let of = |name: &str, indirect, resolution| {
        let deep_images = DeepImageSettings { resolution, ..DeepImageSettings::of(&default.structure) };
        let settings =
            default.clone().with_indirect(indirect).with_structure(deep_images).with_materials(Materials::Lambert);
        Technique { name: format!("one-bounce {name}"), settings, ground_truth }
    };
    let mut rows = vec![of("none", technique::NO_INDIRECT, usual)];
    for tracer in Tracer::all().into_iter() {
        let plain = technique::sampled(Sampled { tracer: tracer.into(), ..GOOD });
        if !tracer.is_exact() {
            rows.extend([64, 128].map(|resolution| of(&format!("{tracer} {resolution}"), plain.clone(), resolution)));
        } else {
            rows.push(of(tracer.name(), plain, usual));
        }
    }
    let all = |tracer: Tracer| Sampled { tracer: tracer.into(), ..GOOD };
    let half = |tracer| Sampled { resolution: IndirectResolution::Half, ..all(tracer) };
    let fewer = |tracer| Sampled { diffuse_rays: 4, glossy_rays: 2, ..all(tracer) };
    let not_clamped = Sampled { clamp: IndirectClamp::Off, ..all(Tracer::BVH) };
    let cached = |tracer| Sampled { hit_light: HitLight::Cached, ..all(tracer) };
    let half_cached = |tracer| Sampled { hit_light: HitLight::Cached, ..half(tracer) };
    let more = [
        ("within-texel 64, every fourth pixel", half(WITHIN_TEXEL), 64),
        ("within-texel 128, every fourth pixel", half(WITHIN_TEXEL), 128),
        ("within-texel 256, every fourth pixel", half(WITHIN_TEXEL), 256),
        ("bvh, every fourth pixel", half(Tracer::BVH), usual),
        ("within-texel 128, half the rays", fewer(WITHIN_TEXEL), 128),
        ("bvh, half the rays", fewer(Tracer::BVH), usual),
        ("bvh, not clamped", not_clamped, usual),
        ("bvh, cached", cached(Tracer::BVH), usual),
        ("bvh, every fourth pixel, cached", half_cached(Tracer::BVH), usual),
        ("within-texel 128, cached", cached(WITHIN_TEXEL), 128),
        ("within-texel 128, every fourth pixel, cached", half_cached(WITHIN_TEXEL), 128),
    ];
    rows.extend(more.map(|(name, sampled, resolution)| of(name, technique::sampled(sampled), resolution)));
    rows
}

/// One bounce on the file's materials, with 16 glossy rays.
fn glossy_bounces(default: &Settings) -> Vec<Technique> {
    let of = |name: &str, indirect| {
        let deep_images = DeepImageSettings { resolution: 128, ..DeepImageSettings::of(&default.structure) };
        let settings = default.clone().with_indirect(indirect).with_structure(deep_images);
        Technique { name: format!("one-bounce-file {name}"), settings, ground_truth: GroundTruth::OneBounceFile }
    };
    let sampled = |tracer: Tracer| technique::sampled(Sampled { tracer: tracer.into(), glossy_rays: 16, ..GOOD });
    let traced = Tracer::all().into_iter().map(|tracer| of(tracer.name(), sampled(tracer)));
    std::iter::once(of("none", technique::NO_INDIRECT)).chain(traced).collect()
}

/// Number of directions of an additional row: four times the default.
const MANY_DIRECTIONS: u32 = 676;

/// Every technique of ambient occlusion with this maximum distance, m; `None`: unlimited, or the scene's `diagonal`, m, for techniques that
/// need a limit.
fn occlusion_techniques(max_distance: Option<f32>, diagonal: f32) -> Vec<Occlusion> {
    let distance = "occlusion-distance";
    let limited = |mut occlusion: Occlusion| {
        let technique = occlusion.technique_mut().expect("it is a technique");
        if let Some(limit) = max_distance.or(technique.get(distance).map(|_| diagonal)) {
            technique.set(distance, &limit.to_string()).expect("it is a distance");
        }
        occlusion
    };
    Occlusion::all().into_iter().map(limited).collect()
}

/// Names and deep images of the rows of a technique: three resolutions if it uses deep images.
fn with_images(occlusion: Occlusion, default: &DeepImageSettings) -> Vec<(String, DeepImageSettings)> {
    if !occlusion.is::<Deep>() {
        return vec![(occlusion.name().to_owned(), *default)];
    }
    let of = |resolution| (format!("{} {resolution}", occlusion.name()), DeepImageSettings { resolution, ..*default });
    [64, 128, 256].map(of).to_vec()
}

/// Every technique of ambient occlusion, with near, far and unlimited distance.
fn occlusions(default: &Settings, diagonal: f32) -> Vec<Technique> {
    let mut rows = Vec::new();
    for ground_truth in [GroundTruth::Occlusion, GroundTruth::ObscuranceFar, GroundTruth::ObscuranceNear] {
        let kind = ground_truth.name();
        let max_distance = ground_truth.max_distance(diagonal);
        let mut row = |name: String, occlusion, deep_images: DeepImageSettings| {
            let settings = ground_truth.seen(default).with_occlusion(occlusion).with_structure(deep_images);
            rows.push(Technique { name, settings, ground_truth });
        };
        row(format!("{kind} none"), technique::NO_OCCLUSION, DeepImageSettings::of(&default.structure));
        for occlusion in occlusion_techniques(max_distance, diagonal) {
            for (name, images) in with_images(occlusion.clone(), &DeepImageSettings::of(&default.structure)) {
                row(format!("{kind} {name}"), occlusion.clone(), images);
            }
        }
        if max_distance.is_none() {
            // At this resolution the number of directions limits the quality.
            let directions = DirectionSet::ZonalEqualArea { count: MANY_DIRECTIONS };
            let images = DeepImageSettings { resolution: 128, directions, ..DeepImageSettings::of(&default.structure) };
            row(format!("{kind} deep 128, {MANY_DIRECTIONS} directions"), technique::deep_occlusion(None), images);
        }
    }
    rows
}

/// Light of the environment: without occlusion, with every technique of ambient occlusion, and with rays.
fn environments(default: &Settings, diagonal: f32) -> Vec<Technique> {
    let of = |name: String, settings| Technique {
        name: format!("environment {name}"),
        settings,
        ground_truth: GroundTruth::Environment,
    };
    let occluded = |occlusion| default.clone().with_occlusion(occlusion);
    let mut rows = vec![of("none".to_owned(), occluded(technique::NO_OCCLUSION))];
    for occlusion in occlusion_techniques(None, diagonal) {
        for (name, deep_images) in with_images(occlusion.clone(), &DeepImageSettings::of(&default.structure)) {
            rows.push(of(name, occluded(occlusion.clone()).with_structure(deep_images)));
        }
    }
    let sampled = |tracer: Tracer| technique::sampled(Sampled { tracer: tracer.into(), ..GOOD });
    for tracer in &Tracer::all() {
        let settings = default.clone().with_indirect(sampled(*tracer));
        rows.push(Technique {
            ground_truth: GroundTruth::EnvironmentBounce,
            ..of(format!("sampled {tracer}"), settings)
        });
    }
    rows
}

/// Every scheme of light culling.
fn cullings() -> Vec<Culling> {
    let tiled = TileSize::ALL.iter().flat_map(|tile_size| {
        [true, false].map(|aabb_test| technique::tiled(Tiled { tile_size: *tile_size, aabb_test }))
    });
    let clustered = |change: fn(&mut Clustered)| {
        let mut clustered = Clustered::default();
        change(&mut clustered);
        technique::clustered(clustered)
    };
    // Grouping and depth have no row: a single view has a single grid, and clusters beyond the scene are not visible.
    let clusters = [
        clustered(|_| ()),
        clustered(|c| c.shape = ClusterShape::Orthographic { side: 1.0 }),
        clustered(|c| c.shape = ClusterShape::Displaced { pixels: 64, distance: 8.0 }),
        clustered(|c| c.assignment = Assignment::BruteForce),
        clustered(|c| c.test = ClusterTest::Planes),
    ];
    let mut all: Vec<_> = std::iter::once(technique::NO_CULLING).chain(tiled).chain(clusters).collect();
    let grid = |tile_size: &TileSize| RasterGrid { tile_size: *tile_size, ..RasterGrid::default() };
    let few_layers = RasterGrid { layers: 8, ..RasterGrid::default() };
    all.extend(TileSize::ALL.iter().map(grid).chain([few_layers]).map(technique::raster_grid));
    // All other techniques, with their defaults.
    let is_listed =
        |culling: &Culling| culling.is::<Tiled>() || culling.is::<Clustered>() || culling.is::<RasterGrid>();
    all.extend(Culling::all().into_iter().filter(|culling| !is_listed(culling)));
    all
}

/// Name of a scheme, with its values as on the command line.
fn culling_name(culling: &Culling) -> String {
    let mut name = format!("culling {}", culling.name());
    if let Some(Tiled { tile_size, aabb_test }) = culling.get() {
        name += &format!(" {tile_size}{}", if *aabb_test { "" } else { ", aabb off" });
    }
    if let Some(Clustered { shape, assignment, test, grouping: _, depth: _ }) = culling.get() {
        let usual = Clustered::default();
        name += &format!(" {shape}");
        name += &if *assignment == usual.assignment { String::new() } else { format!(", {assignment}") };
        name += &if *test == usual.test { String::new() } else { format!(", {test}") };
    }
    if let Some(RasterGrid { tile_size, layers }) = culling.get() {
        name += &format!(" {tile_size}, {layers} layers");
    }
    name
}

#[cfg(test)]
mod tests;
