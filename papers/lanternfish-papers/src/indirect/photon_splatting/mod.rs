//! Photon differentials, split and splatted [Aalund2015, §3.4, §4.2].
//!
//! 1. Emit: photons are traced from the lights to the first surface, with their differentials (`emit.wesl`).
//! 2. Split: each continues in every direction of the deep images (`prepare.wesl`, `split.wesl`, `trace.wesl`).
//! 3. Photons that may light a visible surface are compacted in order (`tiles.wesl`, `keep.wesl`, `scatter.wesl`).
//! 4. Light culling assigns photons to pixels, which add up their light (`gather.wesl`); or they are rasterized (`splat.wesl`, `add.wesl`).
//! 5. One of the photons that a photon was split into may be split again (`next.wesl`): steps 2 to 4 again.
//! 6. The sums are smoothed and added to the image (`denoise/smoothing/` of the library).

mod directions;
mod parameters;
mod passes;
mod raster;
mod settings;
#[cfg(test)]
mod tests;

use lanternfish::{
    light_culling::LightCulling,
    rays,
    shaders::{Root, Shaders},
};
use lanternfish_gpu::SharedStruct;

use self::parameters::{PhotonHit, PhotonParameters, PrimaryPhoton};
pub(crate) use self::passes::{PhotonPasses, Photons};
pub use self::settings::{PhotonSplatting, Splat};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::of(
    &crate::shaders::SHADERS,
    &[
        Root::computed("indirect/photon_splatting/emit", rays::exact_tracers),
        Root::new("indirect/photon_splatting/prepare"),
        Root::new("indirect/photon_splatting/split"),
        Root::computed("indirect/photon_splatting/trace", || rays::every_tracer(true)),
        Root::new("indirect/photon_splatting/tiles"),
        Root::new("indirect/photon_splatting/keep"),
        Root::new("indirect/photon_splatting/scatter"),
        Root::computed("indirect/photon_splatting/land", || rays::every_tracer(true)),
        Root::computed("indirect/photon_splatting/gather", || {
            LightCulling::every_feature().into_iter().map(|scheme| vec![scheme]).collect()
        }),
        Root::new("indirect/photon_splatting/splat"),
        Root::new("indirect/photon_splatting/add"),
        Root::new("indirect/photon_splatting/next"),
    ],
    &[SharedStruct::of::<PhotonParameters>(), SharedStruct::of::<PrimaryPhoton>(), SharedStruct::of::<PhotonHit>()],
);
