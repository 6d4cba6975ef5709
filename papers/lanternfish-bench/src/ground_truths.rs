//! Ground truths of the shots: traced once, then read from files.

mod layers;

use std::{fs, path::Path, time::Instant};

use glam::Vec3;
use lanternfish::settings::{Exposure, Materials, Settings, ToneMap};
use lanternfish_cli::{
    error::CliError,
    fingerprint,
    images::{energy_of, hdr_flip},
    parse::Size,
};
use lanternfish_metrics::{Pair, RgbImage};
use lanternfish_reference::{
    Settings as TracerSettings, Tracer,
    settings::{Integrator, UNLIMITED},
};
use lanternfish_scene::{AlphaMode, Camera, Environment, Scene, named_enum};
use serde::Serialize;

use self::layers::Layers;

/// Version of the stored ground truths. Raised when the path tracer's result for the same scene and settings changes, which makes stored
/// ground truths obsolete.
const FORMAT: u32 = 4;

/// Radius of the lights of [`GroundTruth::DirectSoft`], m.
pub const SOFT_RADIUS: f32 = 0.1;

named_enum! {
    /// Ground truths that techniques are compared with, and parts of them.
    GroundTruth {
        /// Direct light of punctual lights: one reflection. Nothing is emissive.
        Direct = "direct",
        /// As `Direct`, on diffuse surfaces.
        DirectLambert = "direct-lambert",
        /// As `Direct`, from area lights.
        DirectSoft = "direct-soft",
        /// Directly visible emission: emissive surfaces and environment.
        Emitted = "emitted",
        /// All light: emissive surfaces and environment included, any number of reflections.
        Full = "full",
        /// Light of punctual lights after one or two reflections, on diffuse surfaces.
        OneBounce = "one-bounce",
        /// As `OneBounce`, on the file's materials: glossy surfaces reflect lit surfaces.
        OneBounceFile = "one-bounce-file",
        /// Light of an environment map after one reflection. There is no other light.
        Environment = "environment",
        /// As `Environment`, after one or two reflections.
        EnvironmentBounce = "environment-bounce",
        /// Ambient visibility of surfaces, with occluders at any distance [Aalund2015, eq. 1].
        Occlusion = "occlusion",
        /// Ambient visibility with attenuated occluders up to a large distance.
        ObscuranceFar = "obscurance-far",
        /// Ambient visibility with attenuated occluders up to a small distance.
        ObscuranceNear = "obscurance-near",
    }
}

/// Light sources of a ground truth.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Light {
    /// The scene's lights only. Emissive surfaces are black: they light nothing in the renderer's direct light, but would in the path
    /// tracer.
    Lights,
    Environment,
    All,
    /// White surfaces under a white sky. Surfaces beyond this distance, a ratio to the scene's diagonal, do not occlude; `None`: no limit.
    White(Option<f32>),
}

/// Definition of a ground truth.
struct Making {
    /// One-line description for the report.
    meaning: &'static str,
    light: Light,
    /// Most segments of a path.
    segments: u32,
    materials: Materials,
    /// Factor on the samples per pixel of the command line. Short paths are cheap, and the ground truths of most techniques should be the
    /// least noisy.
    samples: u64,
    /// Ground truths whose sum is this one without indirect light: emission, and direct light of punctual lights. Empty if this one has no
    /// indirect light, or if no technique renders it without.
    without_indirect: &'static [GroundTruth],
}

impl GroundTruth {
    fn making(self) -> Making {
        let of = |meaning, light, segments, samples| {
            let (materials, without_indirect): (_, &[Self]) = (Materials::File, &[]);
            Making { meaning, light, segments, materials, samples, without_indirect }
        };
        let lambert = |making| Making { materials: Materials::Lambert, ..making };
        let beyond = |without_indirect, making| Making { without_indirect, ..making };
        match self {
            Self::Direct => of(
                "paths of 2 segments, from punctual lights; emission and environment are black in both images",
                Light::Lights,
                2,
                8,
            ),
            Self::DirectLambert => lambert(of("the same, base colours as diffuse albedos", Light::Lights, 2, 2)),
            Self::DirectSoft => {
                of("as direct, from disks of 0.1 m radius that face the lit point", Light::Lights, 2, 2)
            }
            Self::Emitted => of("paths of 1 segment, emission and environment", Light::All, 1, 1),
            Self::Full => beyond(
                &[Self::Emitted, Self::Direct],
                of("paths of any length, emission and environment included", Light::All, UNLIMITED, 1),
            ),
            Self::OneBounce => {
                let text = "paths of 2 or 3 segments, from punctual lights, base colours as diffuse albedos";
                beyond(&[Self::DirectLambert], lambert(of(text, Light::Lights, 3, 2)))
            }
            Self::OneBounceFile => {
                beyond(&[Self::Direct], of("paths of 2 or 3 segments, from punctual lights", Light::Lights, 3, 2))
            }
            Self::Environment => of(
                "paths of 2 segments, from an environment map alone, which is visible too: kloppenheim_05_1k.hdr, or a built-in sky if that \
                 file is missing",
                Light::Environment,
                2,
                8,
            ),
            Self::EnvironmentBounce => of("the same, paths of 2 or 3 segments", Light::Environment, 3, 2),
            Self::Occlusion => of(
                "ambient visibility, cosine-weighted: white surfaces under a white sky, at 0 EV without a tone map",
                Light::White(None),
                UNLIMITED,
                8,
            ),
            // Equals 1280 units in the hall of [Aalund2015, fig. 8].
            Self::ObscuranceFar => of(
                "the same, with occluders at distance d weighted by 1 - (d / m)², where m is 28 % of the scene's diagonal",
                Light::White(Some(0.28)),
                UNLIMITED,
                8,
            ),
            Self::ObscuranceNear => {
                of("the same, where m is 1/64 of the scene's diagonal", Light::White(Some(1.0 / 64.0)), UNLIMITED, 8)
            }
        }
    }

    /// The scene of both the ground truth and the compared image. `environment_light` is its environment if the ground truth is light of
    /// an environment map.
    pub fn scene(self, scene: &Scene, environment_light: &Environment) -> Scene {
        let mut scene = scene.clone();
        match self.making().light {
            Light::Lights => scene = of_lights_alone(scene),
            Light::Environment => {
                (scene.sky, scene.environment) = (Vec3::ZERO, Some(environment_light.clone()));
                scene.lights.clear();
                darken(&mut scene);
            }
            Light::All => {}
            Light::White(_) => make_white(&mut scene),
        }
        scene
    }

    /// True if techniques are compared with it. False if it is only a part of others.
    pub fn is_compared(self) -> bool {
        self != Self::Emitted
    }

    /// Ground truths whose sum is this one without indirect light.
    pub fn without_indirect(self) -> &'static [Self] {
        self.making().without_indirect
    }

    /// Distance beyond which surfaces do not occlude, m, in a scene with this diagonal, m.
    pub fn max_distance(self, diagonal: f32) -> Option<f32> {
        match self.making().light {
            Light::White(ratio) => ratio.map(|ratio| ratio * diagonal),
            _ => None,
        }
    }

    /// The shot's settings, at 0 EV and without a tone map for ground truths of ambient visibility.
    pub fn seen(self, shot: &Settings) -> Settings {
        match self.making().light {
            Light::White(_) => shot.clone().with_exposure(Exposure::Ev(0.0)).with_tone_map(ToneMap::None),
            _ => shot.clone(),
        }
    }

    /// Samples per pixel for `spp` of the command line.
    fn samples(self, spp: u64) -> u64 {
        self.making().samples * spp
    }

    fn settings(self, shot: &Settings, diagonal: f32) -> TracerSettings {
        let Making { light, segments, materials, .. } = self.making();
        let integrator = match (light, self.max_distance(diagonal)) {
            (Light::White(_), Some(max_distance)) => Integrator::Obscurance { max_distance },
            (Light::White(_), None) => Integrator::Occlusion,
            _ => Integrator::Path,
        };
        TracerSettings {
            integrator,
            max_depth: segments,
            materials,
            attenuation: shot.lights.attenuation,
            range_threshold: shot.lights.range_threshold,
            light_radius: if self == Self::DirectSoft { SOFT_RADIUS } else { shot.lights.radius },
            sun_diameter: shot.lights.sun_diameter,
            ..TracerSettings::default()
        }
    }
}

/// The scene without sky, environment and emission: its lights are the only light.
pub fn of_lights_alone(mut scene: Scene) -> Scene {
    (scene.sky, scene.environment) = (Vec3::ZERO, None);
    darken(&mut scene);
    scene
}

/// The scene with white diffuse surfaces under a white sky, without other light.
pub fn white(mut scene: Scene) -> Scene {
    make_white(&mut scene);
    scene
}

/// Removes the emission of all surfaces.
fn darken(scene: &mut Scene) {
    for material in &mut scene.materials {
        material.emissive = Vec3::ZERO;
        if material.unlit {
            material.base_color = Vec3::ZERO.extend(material.base_color.w);
        }
    }
}

/// Makes all surfaces white and diffuse under a white sky, without other light: their radiance is their ambient visibility. Transparent
/// surfaces are removed, because their occlusion has no common definition.
fn make_white(scene: &mut Scene) {
    scene.lights.clear();
    (scene.sky, scene.environment) = (Vec3::ONE, None);
    for material in &mut scene.materials {
        let mut alpha = material.base_color.w;
        if material.is_transparent() {
            (material.alpha_mode, material.transmission, alpha) = (AlphaMode::Blend, 0.0, 0.0);
        }
        // Only the alpha channel of a texture is kept: it holds cut-outs.
        if let Some(texture) = material.base_color_texture {
            let image = &mut scene.images[scene.textures[texture.texture].image];
            image.rgba.chunks_exact_mut(4).for_each(|texel| texel[..3].fill(255));
        }
        material.base_color = Vec3::ONE.extend(alpha);
        (material.metallic, material.metallic_roughness_texture) = (0.0, None);
        (material.specular, material.emissive, material.unlit) = (0.0, Vec3::ZERO, false);
    }
    for color in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives).flat_map(|p| &mut p.colors) {
        *color = Vec3::ONE.extend(color.w);
    }
}

/// A ground truth with its noise figures.
pub struct Traced {
    pub mean: RgbImage,
    pub figures: GroundTruthFigures,
}

/// Report entry of a ground truth. Errors below the ground truth's noise are not significant.
#[derive(Clone, Debug, Default, Serialize)]
pub struct GroundTruthFigures {
    pub name: &'static str,
    pub meaning: &'static str,
    /// Path of the file, relative to the report's folder.
    pub file: String,
    /// Path of the displayable image, relative to the report's folder.
    pub rendering: String,
    pub spp: u64,
    /// True if an earlier run traced it.
    pub reused: bool,
    /// Tracing time, s; 0 if the ground truth was reused.
    pub seconds: f64,
    /// Number of samples that were not finite and count as black. Any but zero indicates a fault.
    pub dropped: u64,
    /// [`lanternfish_reference::Noise::relative`].
    pub noise: f64,
    /// Expected relMSE from the noise of the ground truth alone.
    pub noise_relative_mse: f64,
    /// Upper bound on the standard deviation of an energy ratio from this noise.
    pub noise_energy: f64,
    /// Mean LDR-FLIP between the means of the first and the second half of the samples. Each half has twice the variance.
    pub noise_flip: f64,
    /// Mean HDR-FLIP between the two halves. The HDR-FLIP of an exact image against the ground truth is about half of it.
    pub noise_hdr_flip: f64,
    /// Energy of [`GroundTruth::without_indirect`], as a fraction of this one's. `None` if that is empty.
    pub energy_without_indirect: Option<f64>,
}

/// A view of a scene, to trace ground truths of.
pub struct Subject<'s> {
    pub name: &'s str,
    /// The scene as [`GroundTruth::scene`] prepared it.
    pub scene: &'s Scene,
    pub camera: &'s Camera,
    pub size: Size,
    pub settings: &'s Settings,
    /// Samples per pixel of the command line. [`GroundTruth::samples`] scales them for each ground truth.
    pub spp: u64,
}

/// Reads the ground truth from `folder`/ground_truths, or traces it and stores it there.
pub fn obtain(folder: &Path, ground_truth: GroundTruth, subject: &Subject<'_>) -> Result<Traced, CliError> {
    let Subject { name, scene, camera, size, settings, spp } = *subject;
    let spp = ground_truth.samples(spp);
    let tracer_settings = ground_truth.settings(settings, scene.bounds().size().length());
    let fingerprint = fingerprint::of(scene, camera, size, &tracer_settings);
    let file = format!("ground_truths/{name}-{ground_truth}-{spp}spp-{fingerprint}-{FORMAT}.exr");
    let path = folder.join(&file);
    let started = Instant::now();
    let (layers, seconds, reused) = match path.is_file().then(|| Layers::read(&path)) {
        Some(Ok(layers)) if layers.is_of(size) => {
            eprintln!("  ground truth {ground_truth}: reused, {file}");
            (layers, 0.0, true)
        }
        // A missing or unreadable file is traced again.
        _ => {
            eprintln!("  ground truth {ground_truth}: tracing {spp} samples per pixel");
            let tracer = Tracer::new(scene, tracer_settings)?;
            let layers = Layers::trace(&tracer, camera, size, spp)?;
            fs::create_dir_all(folder.join("ground_truths"))
                .map_err(|error| CliError::new(format_args!("{file}: {error}"), "choose a writable folder"))?;
            layers.write(&path)?;
            (layers, started.elapsed().as_secs_f64(), false)
        }
    };
    let second_half = layers.second_half(spp);
    let figures = GroundTruthFigures {
        name: lanternfish_scene::Named::name(ground_truth),
        meaning: ground_truth.making().meaning,
        file,
        rendering: format!("renderings/{name}-ground_truth-{ground_truth}.png"),
        spp,
        reused,
        seconds,
        dropped: layers.dropped,
        noise: layers.noise(spp)?,
        noise_relative_mse: layers.relative_mse(),
        noise_energy: layers.energy_deviation(),
        noise_flip: layers.flip_of_halves(&second_half, settings.image.exposure, settings.image.tone_map)?,
        noise_hdr_flip: hdr_flip(&Pair::new(layers.first_half.clone(), second_half)?)?,
        energy_without_indirect: None,
    };
    Ok(Traced { mean: layers.mean, figures })
}

/// Fraction of a ground truth's energy that is not indirect light: the energy of [`GroundTruth::without_indirect`].
///
/// `complete` is the image of the ground truth, `scene` makes the scene of each part, `subject` is the view of the ground truth. Parts have
/// as many samples as the ground truth, so that their random numbers, and much of their noise, are the same.
pub fn energy_without_indirect(
    folder: &Path,
    ground_truth: GroundTruth,
    complete: &RgbImage,
    scene: impl Fn(GroundTruth) -> Scene,
    subject: &Subject<'_>,
) -> Result<Option<f64>, CliError> {
    let parts = ground_truth.without_indirect();
    let mut energy = 0.0;
    for part in parts {
        // At least two samples: one for each half.
        let spp = (ground_truth.samples(subject.spp) / part.samples(1)).max(2);
        let traced = obtain(folder, *part, &Subject { scene: &scene(*part), spp, ..*subject })?;
        energy += energy_of(&traced.mean);
    }
    Ok((!parts.is_empty()).then(|| energy / energy_of(complete)))
}
