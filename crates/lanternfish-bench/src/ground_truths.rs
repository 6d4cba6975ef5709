//! Ground truths of the shots: traced once, then read from the disk.

mod layers;

use std::{fs, path::Path, time::Instant};

use glam::Vec3;
use lanternfish::settings::{Exposure, Materials, Settings, ToneMap};
use lanternfish_cli::{error::CliError, fingerprint, parse::Size};
use lanternfish_metrics::{Pair, RgbImage};
use lanternfish_reference::{
    Settings as TracerSettings, Tracer,
    settings::{Integrator, UNLIMITED},
};
use lanternfish_scene::{AlphaMode, Camera, Environment, Scene, named_enum};
use serde::Serialize;

use self::layers::Layers;
use crate::image::{energy_of, hdr_flip};

/// Raised when what the path tracer makes of the same scene and settings changes: ground truths that were kept are then old.
const FORMAT: u32 = 4;

/// Radius of the lights of [`GroundTruth::DirectSoft`], m.
pub const SOFT_RADIUS: f32 = 0.1;

named_enum! {
    /// Ground truths that techniques are judged by, and parts of them.
    GroundTruth {
        /// Light that comes from a punctual light by one reflection: nothing else shines.
        Direct = "direct",
        /// The same on diffuse surfaces.
        DirectLambert = "direct-lambert",
        /// The same as the first, from lights that have a size.
        DirectSoft = "direct-soft",
        /// What shines by itself, seen straight: emissive surfaces and environment.
        Emitted = "emitted",
        /// All light by all ways: emissive surfaces and environment, any number of reflections.
        Full = "full",
        /// Light from punctual lights by one or two reflections, on diffuse surfaces.
        OneBounce = "one-bounce",
        /// The same on the file's materials: what shines shows what is lit.
        OneBounceFile = "one-bounce-file",
        /// Light from an image of the environment by one reflection: nothing else shines.
        Environment = "environment",
        /// The same by one or two reflections.
        EnvironmentBounce = "environment-bounce",
        /// How open surfaces are to their environment, whatever the distance of what closes them [Aalund2015, eq. 1].
        Occlusion = "occlusion",
        /// The same up to a large distance, attenuated.
        ObscuranceFar = "obscurance-far",
        /// The same up to a small one.
        ObscuranceNear = "obscurance-near",
    }
}

/// Which light there is in the images of a ground truth.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Light {
    /// Emissive surfaces are black: they light nothing in the renderer, and what lights nothing cannot be told from what does.
    Lights,
    Environment,
    All,
    /// White surfaces under a white sky. Nothing occludes from this distance on, a ratio to the scene's diagonal; none: wherever it is.
    White(Option<f32>),
}

/// What a ground truth is.
struct Making {
    /// One line for the report.
    meaning: &'static str,
    light: Light,
    /// Segments of paths at most.
    segments: u32,
    materials: Materials,
    /// Factor on the samples a pixel of the command line: short paths are cheap, and what most techniques are judged by should be the least
    /// noisy.
    samples: u64,
    /// Ground truths that are together what this one has without indirect light, as an image has it without: what is emissive, and what punctual
    /// lights send by one reflection. None where this one has no indirect light, or no technique's image goes without.
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
                of("as direct, from disks of 0.1 m radius that face what they light", Light::Lights, 2, 2)
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
                "paths of 2 segments, from an image of the environment alone, which is seen as well: kloppenheim_05_1k.hdr, or a sky built \
                 in where that is not there",
                Light::Environment,
                2,
                8,
            ),
            Self::EnvironmentBounce => of("the same, paths of 2 or 3 segments", Light::Environment, 3, 2),
            Self::Occlusion => of(
                "open share of the cosine-weighted hemisphere: white surfaces under a white sky, at 0 EV without a tone map",
                Light::White(None),
                UNLIMITED,
                8,
            ),
            // What 1280 units are of the hall of [Aalund2015, fig. 8].
            Self::ObscuranceFar => of(
                "the same, closed by what is at distance d by 1 - (d / m)², m 28 % of the scene's diagonal",
                Light::White(Some(0.28)),
                UNLIMITED,
                8,
            ),
            Self::ObscuranceNear => {
                of("the same, m 1/64 of the scene's diagonal", Light::White(Some(1.0 / 64.0)), UNLIMITED, 8)
            }
        }
    }

    /// The scene both images are made of. `environment_light` stand around it where the ground truth is light from such.
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

    /// Whether techniques are judged by it; else it is but a part of others.
    pub fn judges(self) -> bool {
        self != Self::Emitted
    }

    /// Ground truths that are together what this one has without indirect light.
    pub fn without_indirect(self) -> &'static [Self] {
        self.making().without_indirect
    }

    /// Distance from which on nothing occludes, m, in a scene of this diagonal.
    pub fn max_distance(self, diagonal: f32) -> Option<f32> {
        match self.making().light {
            Light::White(ratio) => ratio.map(|ratio| ratio * diagonal),
            _ => None,
        }
    }

    /// The shot's settings; for ground truths that are ratios of light, without exposure and tone map.
    pub fn seen(self, shot: &Settings) -> Settings {
        match self.making().light {
            Light::White(_) => Settings { exposure: Exposure::Ev(0.0), tone_map: ToneMap::None, ..shot.clone() },
            _ => shot.clone(),
        }
    }

    /// Samples a pixel at `spp` of the command line.
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
            attenuation: shot.attenuation,
            range_threshold: shot.range_threshold,
            light_radius: if self == Self::DirectSoft { SOFT_RADIUS } else { shot.light_radius },
            ..TracerSettings::default()
        }
    }
}

/// The scene without light but that of its lights.
pub fn of_lights_alone(mut scene: Scene) -> Scene {
    (scene.sky, scene.environment) = (Vec3::ZERO, None);
    darken(&mut scene);
    scene
}

/// The scene white and diffuse under a white sky, without other light.
pub fn white(mut scene: Scene) -> Scene {
    make_white(&mut scene);
    scene
}

/// Makes all surfaces send no light of their own.
fn darken(scene: &mut Scene) {
    for material in &mut scene.materials {
        material.emissive = Vec3::ZERO;
        if material.unlit {
            material.base_color = Vec3::ZERO.extend(material.base_color.w);
        }
    }
}

/// Makes all surfaces white and diffuse under a white sky, without other light: what they send is how open they are. Transparent
/// surfaces go: what they close is a matter of taste.
fn make_white(scene: &mut Scene) {
    scene.lights.clear();
    (scene.sky, scene.environment) = (Vec3::ONE, None);
    for material in &mut scene.materials {
        let mut alpha = material.base_color.w;
        if material.is_transparent() {
            (material.alpha_mode, material.transmission, alpha) = (AlphaMode::Blend, 0.0, 0.0);
        }
        // A texture keeps its alpha alone: holes are there.
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

/// A ground truth and how far it can be trusted.
pub struct Traced {
    pub mean: RgbImage,
    pub figures: GroundTruthFigures,
}

/// What the report says about a ground truth. Errors below the ground truth's noise say nothing.
#[derive(Clone, Debug, Serialize)]
pub struct GroundTruthFigures {
    pub name: &'static str,
    pub meaning: &'static str,
    /// The file, below the report's folder.
    pub file: String,
    /// Its image, below the report's folder.
    pub rendering: String,
    pub spp: u64,
    /// True if an earlier run traced it.
    pub reused: bool,
    /// Seconds that tracing took; 0 where the ground truth was reused.
    pub seconds: f64,
    /// Samples that were not finite and count as black: not zero is a fault.
    pub dropped: u64,
    /// [`lanternfish_reference::Noise::relative`].
    pub noise: f64,
    /// relMSE that its own noise alone is expected to cause.
    pub noise_relative_mse: f64,
    /// Standard deviation of an energy ratio by its own noise, at most.
    pub noise_energy: f64,
    /// Mean LDR-FLIP between the images of its first and its second half of samples, each twice as noisy in variance.
    pub noise_flip: f64,
    /// Mean HDR-FLIP between its two halves. An exact image is about half as far from the ground truth as they are from one another.
    pub noise_hdr_flip: f64,
    /// Energy of [`GroundTruth::without_indirect`], as a share of its own; `None` where that names no ground truths.
    pub energy_without_indirect: Option<f64>,
}

/// The view of a scene that ground truths are traced of.
pub struct Subject<'s> {
    pub name: &'s str,
    /// The scene as [`GroundTruth::scene`] prepared it.
    pub scene: &'s Scene,
    pub camera: &'s Camera,
    pub size: Size,
    pub settings: &'s Settings,
    /// Samples a pixel that the command line asks for; [`GroundTruth::samples`] makes the ground truth's number from it.
    pub spp: u64,
}

/// Reads the ground truth from `folder`/truths, or traces it and leaves it there.
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
        // What cannot be read is made again, whatever the reason.
        _ => {
            eprintln!("  ground truth {ground_truth}: tracing {spp} samples a pixel");
            let tracer = Tracer::new(scene, tracer_settings)?;
            let layers = Layers::trace(&tracer, camera, size, spp)?;
            fs::create_dir_all(folder.join("ground_truths"))
                .map_err(|error| CliError::new(format_args!("{file}: {error}"), "choose a folder that is yours"))?;
            layers.write(&path)?;
            (layers, started.elapsed().as_secs_f64(), false)
        }
    };
    let second_half = layers.second_half(spp);
    let figures = GroundTruthFigures {
        name: ground_truth.name(),
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
        noise_flip: layers.flip_of_halves(&second_half, settings.exposure, settings.tone_map)?,
        noise_hdr_flip: hdr_flip(&Pair::new(layers.first_half.clone(), second_half)?)?,
        energy_without_indirect: None,
    };
    Ok(Traced { mean: layers.mean, figures })
}

/// Share of a ground truth's energy that is not indirect light: that of [`GroundTruth::without_indirect`]. `whole`: the ground truth's image; `scene`: makes the scene of
/// each part; `subject`: the ground truth's. Parts have as many samples as the ground truth: their random numbers, and so much of their noise, are the same.
pub fn energy_without_indirect(
    folder: &Path,
    ground_truth: GroundTruth,
    whole: &RgbImage,
    scene: impl Fn(GroundTruth) -> Scene,
    subject: &Subject<'_>,
) -> Result<Option<f64>, CliError> {
    let parts = ground_truth.without_indirect();
    let mut energy = 0.0;
    for part in parts {
        // Two at least: one for each half.
        let spp = (ground_truth.samples(subject.spp) / part.samples(1)).max(2);
        let traced = obtain(folder, *part, &Subject { scene: &scene(*part), spp, ..*subject })?;
        energy += energy_of(&traced.mean);
    }
    Ok((!parts.is_empty()).then(|| energy / energy_of(whole)))
}
