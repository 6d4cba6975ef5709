//! Every variant of every shader that settings can ask for links, is valid, and fits WebGPU's least limits.

mod roots;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::LazyLock,
};

use lanternfish_gpu::{GpuStruct, LinkedShader, check_layout};
use wgpu::naga::{AddressSpace, Module, TypeInner, proc::Layouter};

use self::roots::{ROOTS, Root, TEXTURES};
use super::*;
use crate::{
    debug_views::DebugParameters,
    deep_images::{
        DeepFrame, DeepGrid, PeeledFragment, SurfaceSample,
        view::{PointRange, TexelQuery, TexelScale},
    },
    environment_light::{EnvironmentLightParameters, LevelParameters},
    gpu_scene::{BvhTriangle, DrawInstance, HitMaterial, HitTriangle, MaskHeader, MaskRecord, Material, TextureSlot},
    indirect::sampled::{LightRay, SampledHit, SampledParameters},
    light_culling::{
        Volume,
        clustered::{
            ClusterGrid,
            tree::{LevelToJoin, LightTree},
        },
        tiled::TileGrid,
    },
    lights::{
        Light,
        tree::{LightNode, LightTrees},
    },
    occlusion::{DirectionRun, HbaoParameters},
    output::OutputParameters,
    rays::{TracedRay, Tracer},
    settings::{
        Attenuation, Culling, DebugView, DeepDepth, Indirect, Occlusion, RayCulling, Sampled, Samples, Settings, Tiled,
        ToneMap,
    },
    shading,
    shadows::{self, VisibilityGrid},
    view::View,
};

impl Root {
    /// Every combination of choices.
    fn variants(&self) -> Vec<Vec<&'static str>> {
        static ASKED: LazyLock<BTreeMap<&str, BTreeSet<Vec<&str>>>> = LazyLock::new(asked_by_settings);
        if let Some(asked) = ASKED.get(self.module) {
            return asked.iter().cloned().collect();
        }
        self.choices.iter().fold(vec![Vec::new()], |variants, choices| {
            let extended = |v: &Vec<&'static str>, c: &'static str| {
                v.iter().copied().chain(c.split('+').filter(|feature| !feature.is_empty())).collect()
            };
            variants.iter().flat_map(|v| choices.iter().map(move |c| extended(v, c))).collect()
        })
    }
}

/// `settings`, each with each of the values.
fn with<T: Copy>(settings: &[Settings], values: &[T], set: impl Fn(&mut Settings, T)) -> Vec<Settings> {
    let changed = |settings: &Settings, value| {
        let mut settings = settings.clone();
        set(&mut settings, value);
        settings
    };
    settings.iter().flat_map(|settings| values.iter().map(|value| changed(settings, *value))).collect()
}

/// All that finding shadows and shading look at, each with each.
fn all_settings() -> Vec<Settings> {
    let tiled = Culling::Tiled(Tiled::default());
    let all = with(&[Settings::default()], &[Culling::All, tiled, Culling::default()], |s, v| s.culling = v);
    let all = with(&all, RayCulling::ALL, |s, v| s.ray_culling = v);
    let all = with(&all, &[0.0, 0.1], |s, v| s.light_radius = v);
    let all = with(&all, &[Samples::One, Samples::Four], |s, v| s.samples = v);
    let all = with(&all, &[Indirect::None, Indirect::Sampled(Sampled::default())], |s, v| s.indirect = v);
    let all = with(&all, &[Occlusion::None, Occlusion::Deep { max_distance: None }], |s, v| s.occlusion = v);
    let all = with(&all, DeepDepth::ALL, |s, v| s.deep_images.depth = v);
    with(&all, &[None, Some(DebugView::RayCount)], |s, v| s.debug_view = v)
}

/// Features by module, of rooms that say which they are; what they refuse is no variant.
fn asked_by_settings() -> BTreeMap<&'static str, BTreeSet<Vec<&'static str>>> {
    let mut asked: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for settings in all_settings() {
        for tracer in [Tracer::None, Tracer::Bvh, Tracer::RayQuery, Tracer::AcrossTexels] {
            // What each draw asks for beside.
            let [opaque, blended] = shading::features(&settings, tracer);
            for (features, draws) in [(opaque, &["", "masked"][..]), (blended, &[""])] {
                let drawn = draws.iter().flat_map(|draw| TEXTURES.iter().map(move |textures| [*draw, *textures]));
                let added = drawn.map(|more| [&features[..], &more].concat());
                asked
                    .entry("shading/forward")
                    .or_default()
                    .extend(added.map(|all| all.into_iter().filter(|feature| !feature.is_empty()).collect::<Vec<_>>()));
            }
            if tracer == Tracer::None {
                continue;
            }
            if let Ok([plan, trace]) = shadows::features(&settings, tracer) {
                asked.entry("shadows/plan").or_default().insert(plan);
                asked.entry("shadows/trace").or_default().insert(trace);
            }
        }
    }
    asked
}

fn all_variants() -> Vec<LinkedShader> {
    let link = |root: &'static Root| {
        let linked = root.variants().into_iter().map(|features| SHADERS.link(root.module, &features));
        linked.map(|shader| shader.unwrap_or_else(|error| panic!("{error}")))
    };
    ROOTS.iter().flat_map(link).collect()
}

/// What an item was called in its own file.
fn item_name(linked_name: Option<&str>) -> &str {
    linked_name.and_then(|name| name.split("__").next()).unwrap_or_default()
}

/// One test, so that all are linked once.
#[test]
fn every_variant_validates_and_fits_the_floor_and_shares_its_structs() {
    let shaders = all_variants();
    println!("{} variants", shaders.len());
    check_entry_points(&shaders);
    check_floor(&shaders);
    check_shared_structs(&shaders);
}

fn check_entry_points(shaders: &[LinkedShader]) {
    for (path, text) in SHADERS.sources() {
        let declares_entry = ["@compute", "@vertex", "@fragment"].iter().any(|stage| text.contains(stage));
        assert_eq!(declares_entry, ROOTS.iter().any(|root| root.module == *path), "{path} and the table differ");
    }
    for root in ROOTS {
        let any = shaders.iter().find(|shader| shader.label.split('+').next() == Some(root.module));
        let any = any.expect("linked above");
        let entries: Vec<_> = any.module.entry_points.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(entries, root.entries, "{}", root.module);
    }
    let labels: BTreeSet<_> = shaders.iter().map(|shader| &shader.label).collect();
    assert_eq!(labels.len(), shaders.len(), "a variant twice");
}

/// Rows of workgroups are as wide wherever `deep_images::workgroups` dispatches them.
#[test]
fn rows_of_workgroups_are_the_hosts() {
    let sources = SHADERS.sources().iter().filter(|(_, text)| text.contains("const WIDTH ="));
    let modules: Vec<&str> = sources.map(|(path, _)| *path).collect();
    assert!(modules.len() > 5, "{modules:?}");
    for module in modules {
        assert_eq!(constant(module, "WIDTH"), f64::from(crate::deep_images::WIDTH), "{module}");
    }
}

#[test]
fn every_feature_that_a_shader_asks_for_is_in_the_table() {
    let known: BTreeSet<&str> = ROOTS.iter().flat_map(Root::variants).flatten().collect();
    let mut asked = BTreeSet::new();
    for (_, text) in SHADERS.sources() {
        for condition in text.split("@if(").skip(1).filter_map(|rest| rest.split(')').next()) {
            let names = condition.split(|c: char| !c.is_alphanumeric() && c != '_');
            asked.extend(names.filter(|name| !name.is_empty()));
        }
    }
    assert_eq!(asked, known);
}

/// Resources of one entry point that WebGPU counts.
#[derive(Default)]
struct Use {
    storage_buffers: usize,
    uniform_buffers: usize,
    textures: usize,
    storage_textures: usize,
    samplers: usize,
    groups: u32,
    workgroup_bytes: u32,
}

fn resources(shader: &LinkedShader, entry: usize) -> Use {
    let module: &Module = &shader.module;
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).expect("the shader is valid");
    let mut found = Use::default();
    for (handle, variable) in module.global_variables.iter() {
        if shader.info.get_entry_point(entry)[handle].is_empty() {
            continue;
        }
        if let Some(binding) = variable.binding {
            found.groups = found.groups.max(binding.group + 1);
        }
        match (variable.space, &module.types[variable.ty].inner) {
            (AddressSpace::Storage { .. }, _) => found.storage_buffers += 1,
            (AddressSpace::Uniform, _) => found.uniform_buffers += 1,
            (AddressSpace::WorkGroup, _) => found.workgroup_bytes += layouter[variable.ty].size,
            (_, TypeInner::Image { class: wgpu::naga::ImageClass::Storage { .. }, .. }) => {
                found.storage_textures += 1;
            }
            (_, TypeInner::Image { .. }) => found.textures += 1,
            (_, TypeInner::Sampler { .. }) => found.samplers += 1,
            // An acceleration structure, or an array of textures or samplers: what the variant's feature is for.
            _ => assert!(shader.label.contains("ray_query") || shader.label.contains("binding_arrays")),
        }
    }
    found
}

fn check_floor(shaders: &[LinkedShader]) {
    // WebGPU's default limits, https://www.w3.org/TR/webgpu/#limits.
    let floor = wgpu::Limits::default();
    let mut most_storage_buffers = 0;
    for shader in shaders {
        for (i, entry) in shader.module.entry_points.iter().enumerate() {
            let found = resources(shader, i);
            let name = format!("{} {}", shader.label, entry.name);
            let fits = |what: &str, count: usize, limit: u32| {
                assert!(count <= limit as usize, "{name}: {count} {what}, the floor has {limit}");
            };
            fits("storage buffers", found.storage_buffers, floor.max_storage_buffers_per_shader_stage);
            fits("uniform buffers", found.uniform_buffers, floor.max_uniform_buffers_per_shader_stage);
            fits("textures", found.textures, floor.max_sampled_textures_per_shader_stage);
            fits("storage textures", found.storage_textures, floor.max_storage_textures_per_shader_stage);
            fits("samplers", found.samplers, floor.max_samplers_per_shader_stage);
            fits("bind groups", found.groups as usize, floor.max_bind_groups);
            let invocations: u32 = entry.workgroup_size.iter().product();
            fits("invocations", invocations as usize, floor.max_compute_invocations_per_workgroup);
            let bytes = found.workgroup_bytes as usize;
            fits("workgroup bytes", bytes, floor.max_compute_workgroup_storage_size);
            most_storage_buffers = most_storage_buffers.max(found.storage_buffers);
        }
    }
    // The count sees buffers at all: tracing alone reads the lists, the lights, the tree, the masks and the bits.
    assert!(most_storage_buffers >= 7, "{most_storage_buffers} storage buffers found at most");
}

fn check_shared_structs(shaders: &[LinkedShader]) {
    let mut checked: BTreeMap<&str, usize> = BTreeMap::new();
    fn check<T: GpuStruct>(shaders: &[LinkedShader], checked: &mut BTreeMap<&str, usize>) {
        let has_it =
            |shader: &&LinkedShader| shader.module.types.iter().any(|(_, ty)| item_name(ty.name.as_deref()) == T::NAME);
        for shader in shaders.iter().filter(has_it) {
            check_layout::<T>(shader).unwrap_or_else(|error| panic!("{error}"));
            *checked.entry(T::NAME).or_default() += 1;
        }
    }
    check::<View>(shaders, &mut checked);
    check::<Light>(shaders, &mut checked);
    check::<DrawInstance>(shaders, &mut checked);
    check::<Material>(shaders, &mut checked);
    check::<TextureSlot>(shaders, &mut checked);
    check::<BvhTriangle>(shaders, &mut checked);
    check::<MaskRecord>(shaders, &mut checked);
    check::<MaskHeader>(shaders, &mut checked);
    check::<TileGrid>(shaders, &mut checked);
    check::<DeepGrid>(shaders, &mut checked);
    check::<DeepFrame>(shaders, &mut checked);
    check::<PeeledFragment>(shaders, &mut checked);
    check::<SurfaceSample>(shaders, &mut checked);
    check::<TracedRay>(shaders, &mut checked);
    check::<HitTriangle>(shaders, &mut checked);
    check::<HitMaterial>(shaders, &mut checked);
    check::<SampledParameters>(shaders, &mut checked);
    check::<LightRay>(shaders, &mut checked);
    check::<LightNode>(shaders, &mut checked);
    check::<LightTrees>(shaders, &mut checked);
    check::<SampledHit>(shaders, &mut checked);
    check::<PointRange>(shaders, &mut checked);
    check::<TexelQuery>(shaders, &mut checked);
    check::<TexelScale>(shaders, &mut checked);
    check::<Volume>(shaders, &mut checked);
    check::<ClusterGrid>(shaders, &mut checked);
    check::<LightTree>(shaders, &mut checked);
    check::<LevelToJoin>(shaders, &mut checked);
    check::<VisibilityGrid>(shaders, &mut checked);
    check::<crate::gpu_scene::SoftShadows>(shaders, &mut checked);
    check::<crate::gpu_scene::EnvironmentParameters>(shaders, &mut checked);
    check::<EnvironmentLightParameters>(shaders, &mut checked);
    check::<LevelParameters>(shaders, &mut checked);
    check::<DirectionRun>(shaders, &mut checked);
    check::<HbaoParameters>(shaders, &mut checked);
    check::<OutputParameters>(shaders, &mut checked);
    check::<DebugParameters>(shaders, &mut checked);

    // None is missing above, and each is in some shader.
    let mut declared = BTreeSet::new();
    declared_structs(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src")), &mut declared);
    assert_eq!(declared, checked.keys().map(|name| name.to_string()).collect());
}

/// Names declared with `gpu_struct!` below a folder.
fn declared_structs(folder: &std::path::Path, names: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).expect("src can be read") {
        let path = entry.expect("src can be read").path();
        if path.is_dir() {
            declared_structs(&path, names);
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("shaders/tests.rs") {
            let text = std::fs::read_to_string(&path).expect("sources are UTF-8");
            let declarations = text.split("gpu_struct! {").skip(1);
            names.extend(declarations.filter_map(|d| {
                let name = d.split("struct ").nth(1)?.split_whitespace().next()?;
                Some(name.to_owned())
            }));
        }
    }
}

#[test]
fn the_numbers_of_named_choices_are_the_shaders() {
    for (i, attenuation) in Attenuation::ALL.iter().enumerate() {
        assert_eq!(*attenuation as usize, i);
        assert_eq!(constant("lights/attenuation", &attenuation.name().to_uppercase()), i as f64, "{attenuation}");
    }
    for (i, tone_map) in ToneMap::ALL.iter().enumerate() {
        assert_eq!(*tone_map as usize, i);
        assert_eq!(constant("output/tone_map", &tone_map.name().to_uppercase()), i as f64, "{tone_map}");
    }
}
