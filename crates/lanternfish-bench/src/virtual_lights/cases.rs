//! The measured configurations.

use lanternfish::{
    settings::{Attenuation, Indirect, Quality, Settings, Shadows, Tracer},
    techniques::{IndirectResolution, Sampled},
};
use lanternfish_papers::{
    ACROSS_TEXELS, DeepImageSettings, WITHIN_TEXEL,
    indirect::virtual_lights::{Emission, MapSize, MapSource, RangeAxis, Ranges, Residual, VirtualLights},
};

use crate::{
    one_bounce::{Case, named},
    technique,
};

/// Deep images as in [Archer2019, §4]; ranges need no triangles.
pub fn papers_images() -> DeepImageSettings {
    DeepImageSettings { payload: false, ..DeepImageSettings::ARCHER }
}

/// As many deep images of the same size by our builder, sort and search, in our directions.
fn our_images() -> DeepImageSettings {
    DeepImageSettings { payload: false, ..DeepImageSettings::default() }
}

/// Ranges as in the paper: no shadows, no compensation of lost light, most lights with large ranges left out. The paper does not state its
/// thresholds.
pub fn papers_lights() -> VirtualLights {
    VirtualLights {
        map: MapSize::Texels256,
        source: MapSource::Raster,
        count: 0,
        stride: 1,
        most_range: 0.15,
        large_kept: 10,
        residual: Residual::Lost,
        shadows: Shadows::None,
        ..VirtualLights::default()
    }
}

/// [VanGelderen2020, app. B]: lights that shine by the root of the cosine, each with the range √(I / I0) of §A.1, no shadows. No light is
/// dropped. His are drawn in pseudo-random directions; ours are an even sample of all by flux.
pub fn appendix_b(count: u32) -> VirtualLights {
    VirtualLights {
        unique: false,
        count,
        stride: 1,
        ranges: Ranges::ThresholdEach,
        least_range: f32::MIN_POSITIVE,
        falloff: Attenuation::PhysicalReduced2,
        emission: Emission::Root,
        least_distance: Some(1.0),
        residual: Residual::Lost,
        shadows: Shadows::None,
        ..VirtualLights::default()
    }
}

/// Names of those whose steps stand beside the paper's.
pub const WITH_STEPS: [&str; 3] = ["virtual-lights", "as in the paper", "as in the paper, our deep images"];

/// All configurations, with the common settings `look`; few if `quick`.
pub fn cases(look: &Settings, quick: bool) -> Vec<Case> {
    let mut all = Vec::new();
    let mut add = |name: &str, settings: Settings| all.push(Case { name: name.to_owned(), settings });
    let of = |indirect| look.clone().with_indirect(indirect);
    let with = |lights: VirtualLights| of(technique::virtual_lights(lights));
    let usual = VirtualLights::default();
    let grid = technique::raster_grid(Default::default());
    let paper = || with(papers_lights()).with_structure(papers_images()).with_culling(grid.clone());
    add("none", of(technique::NO_INDIRECT));
    let good = Quality::Good.sampled().one_bounce();
    add("sampled", of(technique::sampled(good)));
    let half = Sampled { resolution: IndirectResolution::Half, ..good };
    add("sampled, indirect-resolution half", of(technique::sampled(half)));
    add("virtual-lights", with(usual));
    add("as in the paper", paper());
    add("as in the paper, our deep images", paper().with_structure(our_images()));
    if quick {
        return all;
    }
    let fewer = Sampled { diffuse_rays: 4, glossy_rays: 2, ..good };
    add("sampled, half the rays", of(technique::sampled(fewer)));
    let techniques = [
        ("indirect-resolution half", VirtualLights { resolution: IndirectResolution::Half, ..usual }),
        ("vpl-shadow-rays 1", VirtualLights { shadow_rays: 1, ..usual }),
        ("vpl-shadow-rays 16", VirtualLights { shadow_rays: 16, ..usual }),
        ("vpl-shadows none", VirtualLights { shadows: Shadows::None, ..usual }),
        ("vpl-shadows within-texel", VirtualLights { shadows: Shadows::Traced(WITHIN_TEXEL), ..usual }),
        ("vpl-shadows across-texels", VirtualLights { shadows: Shadows::Traced(ACROSS_TEXELS), ..usual }),
        ("vpl-residual lost", VirtualLights { residual: Residual::Lost, ..usual }),
        (
            "vpl-residual lost, vpl-shadows none",
            VirtualLights { residual: Residual::Lost, shadows: Shadows::None, ..usual },
        ),
        ("vpl-residual scaled", VirtualLights { residual: Residual::Scaled, ..usual }),
        ("vpl-far-lights 64", VirtualLights { far_lights: 64, ..usual }),
        ("vpl-ranges maximum", VirtualLights { ranges: Ranges::Maximum, ..usual }),
        ("vpl-ranges random", VirtualLights { ranges: Ranges::Random, ..usual }),
        ("vpl-ranges unlimited", VirtualLights { ranges: Ranges::Unlimited, residual: Residual::Lost, ..usual }),
        ("vpl-axis reflection", VirtualLights { axis: RangeAxis::Reflection, ..usual }),
        ("vpl-range-tracer bvh", VirtualLights { range_tracer: Tracer::BVH, ..usual }),
        ("vpl-unique off", VirtualLights { unique: false, ..usual }),
        ("vpl-count 1024, vpl-stride 1", VirtualLights { count: 1024, stride: 1, far_lights: 64, ..usual }),
        ("vpl-count 1024, vpl-stride 4", VirtualLights { count: 1024, stride: 4, ..usual }),
        ("vpl-stride 4", VirtualLights { stride: 4, ..usual }),
        ("vpl-count 16384, vpl-stride 32", VirtualLights { count: 16384, stride: 32, far_lights: 2048, ..usual }),
        (
            "vpl-count 16384, vpl-stride 32, half",
            VirtualLights { count: 16384, stride: 32, far_lights: 2048, resolution: IndirectResolution::Half, ..usual },
        ),
        ("vpl-source raster", VirtualLights { source: MapSource::Raster, ..usual }),
        ("vpl-least-distance 1", VirtualLights { least_distance: Some(1.0), ..usual }),
        ("vpl-emission root", VirtualLights { emission: Emission::Root, ..usual }),
    ];
    for (name, lights) in techniques {
        add(&format!("virtual-lights, {name}"), with(lights));
    }
    add("as in the paper, vpl-weight 32", paper().with_indirect(weighed()));
    add("as in the paper, vpl-shadows bvh", paper().with_indirect(shadowed()));
    for culling in
        [technique::NO_CULLING, technique::tiled(Default::default()), technique::raster_grid(Default::default())]
    {
        let name = culling.name();
        add(&format!("virtual-lights, culling {name}"), with(usual).with_culling(culling.clone()));
        if culling != grid {
            add(&format!("as in the paper, culling {name}"), paper().with_culling(culling));
        }
    }
    add("as in the paper, culling clustered", paper().with_culling(look.culling.clone()));
    for count in [1000, 5000] {
        add(&format!("app. B, vpl-count {count}"), with(appendix_b(count)));
        let shared = VirtualLights { ranges: Ranges::Threshold, ..appendix_b(count) };
        add(&format!("app. B, vpl-count {count}, vpl-ranges threshold"), with(shared));
    }
    all
}

fn weighed() -> Indirect {
    technique::virtual_lights(VirtualLights { weight_count: 32, ..papers_lights() })
}

fn shadowed() -> Indirect {
    technique::virtual_lights(VirtualLights { shadows: Shadows::BVH, ..papers_lights() })
}

/// Configurations whose flicker along a track is measured: rays from every pixel, virtual lights, one light per texel, and no shadows.
pub fn walked(look: &Settings) -> Vec<Case> {
    let usual = VirtualLights::default();
    let plain = VirtualLights { unique: false, ..usual };
    let unshadowed = VirtualLights { shadows: Shadows::None, ..usual };
    let techniques = [
        ("sampled", technique::sampled(Quality::Good.sampled().one_bounce())),
        ("virtual-lights", technique::virtual_lights(usual)),
        ("virtual-lights, vpl-unique off", technique::virtual_lights(plain)),
        ("virtual-lights, vpl-shadows none", technique::virtual_lights(unshadowed)),
    ];
    named(look, &techniques)
}

/// Settings that compute ranges only: every texel of the map is a light, and no light is listed, so that the map can be large.
pub fn ranges_alone(look: &Settings, map: MapSize, ranges: Ranges, tracer: Tracer) -> Settings {
    let lights = VirtualLights {
        map,
        unique: false,
        count: 0,
        ranges,
        range_tracer: tracer,
        most_range: f32::MIN_POSITIVE,
        large_kept: 0,
        residual: Residual::Lost,
        shadows: Shadows::None,
        ..VirtualLights::default()
    };
    look.clone().with_indirect(technique::virtual_lights(lights)).with_structure(papers_images())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_list_is_the_beginning_of_the_complete_list() {
        let look = Settings::direct_light();
        let names = |quick| cases(&look, quick).into_iter().map(|c| c.name).collect::<Vec<_>>();
        let (quick, all) = (names(true), names(false));
        assert!(all.starts_with(&quick) && all.len() > 20, "{all:?}");
        let mut unique = all.clone();
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), all.len());
        assert!(WITH_STEPS.iter().all(|name| quick.contains(&(*name).to_owned())), "{quick:?}");
    }
}
