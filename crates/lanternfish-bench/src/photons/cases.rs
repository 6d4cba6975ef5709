//! The measured configurations.

use lanternfish::{
    settings::{Quality, Settings, Tracer},
    techniques::{IndirectResolution, Sampled},
};
use lanternfish_papers::{
    ACROSS_TEXELS, DeepImageSettings, DirectionSet, WITHIN_TEXEL,
    indirect::{
        photon_splatting::{PhotonSplatting, Splat},
        virtual_lights::VirtualLights,
    },
};

use crate::{
    one_bounce::{Case, named},
    technique,
};

/// The case of [`papers_photons`].
pub const PAPER: &str = "as in the paper";
/// Texels along an edge of its images.
pub const PAPERS_RESOLUTION: u32 = 200;

/// All of them. `look`: what they share; `quick`: few.
pub fn cases(look: &Settings, quick: bool) -> Vec<Case> {
    let mut all = Vec::new();
    let mut add = |name: &str, settings: Settings| all.push(Case { name: name.to_owned(), settings });
    let of = |indirect| look.clone().with_indirect(indirect);
    let with = |photons: PhotonSplatting| of(technique::photons(photons));
    let usual = PhotonSplatting::default();
    let good = Quality::Good.sampled().one_bounce();
    add("none", of(technique::NO_INDIRECT));
    add("sampled", of(technique::sampled(good)));
    let half = Sampled { resolution: IndirectResolution::Half, ..good };
    add("sampled, indirect-resolution half", of(technique::sampled(half)));
    add("virtual-lights", of(technique::virtual_lights(VirtualLights::default())));
    let half = VirtualLights { resolution: IndirectResolution::Half, ..VirtualLights::default() };
    add("virtual-lights, indirect-resolution half", of(technique::virtual_lights(half)));
    add("photon-splatting", with(usual));
    add(
        "photon-splatting, indirect-resolution half",
        with(PhotonSplatting { resolution: IndirectResolution::Half, ..usual }),
    );
    if quick {
        return all;
    }
    let techniques = [
        ("photon-count 1024, photon-radius 0.5", PhotonSplatting { count: 1024, radius: 0.5, ..usual }),
        ("photon-count 1024, photon-radius 2", PhotonSplatting { count: 1024, radius: 2.0, ..usual }),
        ("photon-count 256, photon-radius 0.5", PhotonSplatting { count: 256, radius: 0.5, ..usual }),
        (
            "photon-count 256, photon-radius 0.5, photon-splat raster",
            PhotonSplatting { count: 256, radius: 0.5, splat: Splat::Raster, ..usual },
        ),
        ("photon-count 16384", PhotonSplatting { count: 16384, ..usual }),
        ("photon-radius 0.25", PhotonSplatting { radius: 0.25, ..usual }),
        ("photon-radius 0.5", PhotonSplatting { radius: 0.5, ..usual }),
        ("photon-tracer ray-query", PhotonSplatting { tracer: Tracer::RAY_QUERY.into(), ..usual }),
        ("photon-tracer within-texel", PhotonSplatting { tracer: WITHIN_TEXEL.into(), ..usual }),
        ("photon-tracer across-texels", PhotonSplatting { tracer: ACROSS_TEXELS.into(), ..usual }),
        ("photon-widened off", PhotonSplatting { widened: false, ..usual }),
        ("photon-conserve on", PhotonSplatting { conserved: true, ..usual }),
        ("indirect-filter 0", PhotonSplatting { filter_radius: 0, ..usual }),
    ];
    for (name, photons) in techniques {
        add(&format!("photon-splatting, {name}"), with(photons));
    }
    for culling in [technique::tiled(Default::default()), technique::raster_grid(Default::default())] {
        let name = culling.name();
        add(&format!("photon-splatting, culling {name}"), with(usual).with_culling(culling));
    }
    add(PAPER, with(papers_photons()).with_structure(papers_images(PAPERS_RESOLUTION)));
    all
}

/// 512 deep images of this resolution, texels: 200 in [Aalund2015, §5.2], 50 in fig. 9.
pub fn papers_images(resolution: u32) -> DeepImageSettings {
    let directions = DirectionSet::ZonalEqualArea { count: 512 };
    DeepImageSettings { directions, resolution, ..DeepImageSettings::default() }
}

/// Photons as in the paper, which states neither how many there are nor how large they are: nothing is widened, nothing made up for,
/// nothing filtered; they are drawn with additive blending. They are kept by their footprints, not by their positions (his step 4b).
pub fn papers_photons() -> PhotonSplatting {
    PhotonSplatting {
        count: 1024,
        tracer: WITHIN_TEXEL.into(),
        radius: 1.0,
        widened: false,
        conserved: false,
        splat: Splat::Raster,
        filter_radius: 0,
        ..PhotonSplatting::default()
    }
}

/// Configurations whose means of frames are measured; without the one with 16,384 photons if `quick`.
pub fn converging(look: &Settings, quick: bool) -> Vec<Case> {
    let usual = PhotonSplatting::default();
    let techniques = [
        ("sampled", technique::sampled(Quality::Good.sampled().one_bounce())),
        ("virtual-lights", technique::virtual_lights(VirtualLights::default())),
        ("photon-splatting", technique::photons(usual)),
        ("photon-splatting, photon-count 16384", technique::photons(PhotonSplatting { count: 16384, ..usual })),
        (
            "photon-splatting, photon-tracer within-texel",
            technique::photons(PhotonSplatting { tracer: WITHIN_TEXEL.into(), ..usual }),
        ),
    ];
    let mut all = named(look, &techniques);
    all.retain(|case| !quick || !case.name.contains("16384"));
    all
}

/// Configurations whose flicker along a track is measured.
pub fn walked(look: &Settings) -> Vec<Case> {
    let techniques = [
        ("sampled", technique::sampled(Quality::Good.sampled().one_bounce())),
        ("virtual-lights", technique::virtual_lights(VirtualLights::default())),
        ("photon-splatting", technique::photons(PhotonSplatting::default())),
    ];
    named(look, &techniques)
}
