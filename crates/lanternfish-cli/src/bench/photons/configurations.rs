//! What is measured: one list.

use lanternfish::{
    indirect::{photon_splatting::PhotonSplatting, virtual_lights::VirtualLights},
    settings::{
        Culling, DeepImageSettings, DirectionSet, Indirect, IndirectResolution, Quality, Sampled, Settings, Tracer,
    },
};

use crate::bench::one_bounce::Configuration;

/// All of them. `look`: what they share; `quick`: few.
pub fn configurations(look: &Settings, quick: bool) -> Vec<Configuration> {
    let mut all = Vec::new();
    let mut add = |name: &str, settings: Settings| {
        all.push(Configuration { name: name.to_owned(), settings, has_steps: false });
    };
    let of = |indirect| Settings { indirect, ..look.clone() };
    let with = |room: PhotonSplatting| of(Indirect::PhotonSplatting(room));
    let usual = PhotonSplatting::default();
    let good = Quality::Good.sampled();
    add("none", of(Indirect::None));
    add("sampled", of(Indirect::Sampled(good)));
    let half = Sampled { resolution: IndirectResolution::Half, ..good };
    add("sampled, indirect-resolution half", of(Indirect::Sampled(half)));
    add("virtual-lights", of(Indirect::VirtualLights(VirtualLights::default())));
    let half = VirtualLights { resolution: IndirectResolution::Half, ..VirtualLights::default() };
    add("virtual-lights, indirect-resolution half", of(Indirect::VirtualLights(half)));
    add("photon-splatting", with(usual));
    add(
        "photon-splatting, indirect-resolution half",
        with(PhotonSplatting { resolution: IndirectResolution::Half, ..usual }),
    );
    if quick {
        return all;
    }
    let rooms = [
        ("photon-count 64", PhotonSplatting { count: 64, ..usual }),
        ("photon-count 256", PhotonSplatting { count: 256, ..usual }),
        ("photon-count 1024", PhotonSplatting { count: 1024, ..usual }),
        ("photon-tracer bvh", PhotonSplatting { tracer: Tracer::Bvh, ..usual }),
        ("photon-tracer ray-query", PhotonSplatting { tracer: Tracer::RayQuery, ..usual }),
        ("photon-tracer across-texels", PhotonSplatting { tracer: Tracer::AcrossTexels, ..usual }),
        ("photon-radius 1", PhotonSplatting { radius: 1.0, ..usual }),
        ("photon-radius 1.5", PhotonSplatting { radius: 1.5, ..usual }),
        ("photon-radius 3", PhotonSplatting { radius: 3.0, ..usual }),
        ("x 1024 .5", PhotonSplatting { count: 1024, radius: 0.5, ..usual }),
        ("x 1024 1", PhotonSplatting { count: 1024, radius: 1.0, ..usual }),
        ("x 4096 .25", PhotonSplatting { count: 4096, radius: 0.25, ..usual }),
        ("x 4096 .5", PhotonSplatting { count: 4096, radius: 0.5, ..usual }),
        ("photon-widened off", PhotonSplatting { widened: false, ..usual }),
    ];
    for (name, room) in rooms {
        add(&format!("photon-splatting, {name}"), with(room));
    }
    for culling in [Culling::All, Culling::Tiled(Default::default()), Culling::RasterGrid(Default::default())] {
        let name = lanternfish::rooms::Family::name(&culling);
        add(&format!("photon-splatting, culling {name}"), Settings { culling, ..with(usual) });
    }
    for count in [64, 512] {
        let images = papers_images(count);
        add(&format!("photon-splatting, {count} directions"), Settings { deep_images: images, ..with(usual) });
    }
    all
}

/// Deep images as in [Aalund2015, §5.2], which has 512 of 200 × 200.
pub fn papers_images(count: u32) -> DeepImageSettings {
    DeepImageSettings {
        directions: DirectionSet::ZonalEqualArea { count },
        resolution: 200,
        ..DeepImageSettings::default()
    }
}

/// What means of frames are taken of.
pub fn converging(look: &Settings) -> Vec<Configuration> {
    let usual = PhotonSplatting::default();
    let rooms = [
        ("sampled", Indirect::Sampled(Quality::Good.sampled())),
        ("virtual-lights", Indirect::VirtualLights(VirtualLights::default())),
        ("photon-splatting", Indirect::PhotonSplatting(usual)),
        (
            "photon-splatting, photon-tracer bvh",
            Indirect::PhotonSplatting(PhotonSplatting { tracer: Tracer::Bvh, ..usual }),
        ),
    ];
    named(look, &rooms)
}

/// What is walked along a track.
pub fn walked(look: &Settings) -> Vec<Configuration> {
    let rooms = [
        ("sampled", Indirect::Sampled(Quality::Good.sampled())),
        ("virtual-lights", Indirect::VirtualLights(VirtualLights::default())),
        ("photon-splatting", Indirect::PhotonSplatting(PhotonSplatting::default())),
    ];
    named(look, &rooms)
}

fn named(look: &Settings, rooms: &[(&str, Indirect)]) -> Vec<Configuration> {
    let of = |(name, indirect): &(&str, Indirect)| Configuration {
        name: (*name).to_owned(),
        settings: Settings { indirect: *indirect, ..look.clone() },
        has_steps: false,
    };
    rooms.iter().map(of).collect()
}
