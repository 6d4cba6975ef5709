//! `docs/passes.md`: the passes of a frame, from their labels.

use std::{collections::HashSet, env, fs, path::Path};

use lanternfish::{
    Settings,
    settings::{Culling, History, Indirect, Preset, Samples, Shadows},
    techniques::{Probes, Sampled, SampledLights, Tiled},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_papers::{Deep, Hbao, PhotonSplatting, RasterGrid, VirtualLights, WITHIN_TEXEL};
use lanternfish_scene::generate;

use crate::support::render;

/// Writes the page instead of comparing with it.
const WRITE: &str = "LANTERNFISH_WRITE_PASSES";

/// Headings, and settings whose frame the section is of.
fn sections() -> Vec<(&'static str, Settings)> {
    let direct = || Settings::direct_light().with_shadows(Shadows::BVH);
    let indirect = |indirect: Indirect| direct().with_indirect(indirect);
    let tiled = Culling::from(Tiled::default());
    let within = Sampled { tracer: WITHIN_TEXEL.into(), ..Sampled::default() };
    vec![
        ("Direct light: clustered culling, shadows through the BVH", direct()),
        ("Tiled culling", direct().with_culling(tiled)),
        ("Raster grid culling", direct().with_culling(RasterGrid::default())),
        (
            "Sampled direct light, with history",
            direct().with_direct(SampledLights::default()).with_history(History::On),
        ),
        ("The preset for moving views", Settings::of_preset(Preset::Realtime).with_shadows(Shadows::BVH)),
        ("Four samples per pixel", direct().with_samples(Samples::Four)),
        ("Mean of two frames", direct().with_accumulate(2)),
        ("Indirect light: rays and radiance cache (default)", indirect(Sampled::default().into())),
        ("The same with history", indirect(Sampled::default().into()).with_history(History::On)),
        ("Indirect light: screen probes", indirect(Probes::default().into())),
        ("Indirect light: rays through deep images", indirect(within.into())),
        ("Indirect light: virtual lights", indirect(VirtualLights::default().into())),
        ("Indirect light: photon splatting", indirect(PhotonSplatting::default().into())),
        ("Ambient visibility through deep images", direct().with_occlusion(Deep::default())),
        ("Ambient visibility in screen space", direct().with_occlusion(Hbao::default())),
    ]
}

/// Labels of a frame's passes in their order; each is named where it first runs.
fn passes(gpu: &Gpu, settings: Settings) -> Vec<String> {
    let mut scene = generate::demo("cornell").unwrap();
    scene.lights = generate::light_rain(&scene.bounds(), 8, Some(1.0), 1, 0.0);
    let rendering = render(gpu, &scene, &scene.cameras[0], (32, 32), settings);
    let mut named = HashSet::new();
    let labels = rendering.report.passes.into_iter().map(|pass| pass.name.to_string());
    labels.filter(|label| named.insert(label.clone())).collect()
}

#[gpu_test(full, crate::gpu)]
fn gpu_the_page_of_passes_is_of_their_labels(gpu: &Gpu) {
    if gpu.description.kind != wgpu::DeviceType::Cpu {
        testing::left_out("gpu_the_page_of_passes_is_of_their_labels", "the page is of a software adapter");
        return;
    }
    let mut page = format!(
        "# Passes of a frame\n\nThe labels of `--timings`, reports and the window, in the order of the frame, each where it first runs, for the Cornell box. Generated \
         by a test;\ndo not edit. `{WRITE}=1 cargo xtask test page_of_passes` writes it.\n"
    );
    for (heading, settings) in sections() {
        page += &format!("\n## {heading}\n\n");
        for (i, label) in passes(gpu, settings).iter().enumerate() {
            page += &format!("{}. `{label}`\n", i + 1);
        }
    }
    assert!(page.contains("`shading/forward`") && page.contains("`radiance_cache/trace`"), "{page}");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/passes.md");
    if env::var_os(WRITE).is_some() {
        fs::write(&path, &page).unwrap();
    }
    assert!(fs::read_to_string(&path).unwrap_or_default() == page, "docs/passes.md is another: {WRITE}=1 writes it");
}
