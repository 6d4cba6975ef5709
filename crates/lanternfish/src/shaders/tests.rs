//! Every variant of every shader that settings can ask for links, is valid, and fits WebGPU's least limits.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, LazyLock},
};

use wgpu::naga::{AddressSpace, Module, TypeInner, proc::Layouter};

use super::*;
use crate::{
    debug_views,
    gpu_scene::{MASKED, TEXTURES},
    lights::AREA_LIGHTS,
    settings::{
        Attenuation, Culling, DebugView, History, Indirect, Occlusion, RayCulling, Samples, Settings, ToneMap, Tracer,
    },
    shading, shadows,
    technique::Technique,
    techniques::{self, Deep, DeepDepth, DeepImageSettings, DeepSearch, Sampled, Tiled},
};

fn folders() -> impl Iterator<Item = &'static Shaders> {
    static FOLDERS: LazyLock<Vec<Shaders>> = LazyLock::new(techniques::shaders);
    FOLDERS.iter()
}

/// Every file with entry points.
fn roots() -> impl Iterator<Item = &'static Root> {
    folders().flat_map(|folder| folder.roots)
}

/// Every variant of a file that can be asked for.
fn variants(root: &Root) -> Vec<Vec<Feature>> {
    static ASKED: LazyLock<BTreeMap<&str, BTreeSet<Vec<Feature>>>> = LazyLock::new(asked_by_settings);
    root.variants().unwrap_or_else(|| ASKED[root.module].iter().cloned().collect())
}

/// `settings`, each with each of the values.
fn with<T: Clone>(settings: &[Settings], values: &[T], set: impl Fn(&mut Settings, T)) -> Vec<Settings> {
    let changed = |settings: &Settings, value: &T| {
        let mut settings = settings.clone();
        set(&mut settings, value.clone());
        settings
    };
    settings.iter().flat_map(|settings| values.iter().map(|value| changed(settings, value))).collect()
}

/// All that finding shadows and shading look at, each with each.
fn all_settings() -> Vec<Settings> {
    let cullings: Vec<_> = [Culling::NONE].into_iter().chain(Culling::all()).collect();
    let all = with(&[Settings::default()], &cullings, |s, v| s.culling = v);
    let all = with(&all, RayCulling::ALL, |s, v| s.ray_culling = v);
    let all = with(&all, &[0.0, 0.1], |s, v| s.light_radius = v);
    let all = with(&all, &[Samples::One, Samples::Four], |s, v| s.samples = v);
    let all = with(&all, &[Indirect::NONE, Indirect::from(Sampled::default())], |s, v| s.indirect = v);
    let all = with(&all, &[Occlusion::NONE, Occlusion::from(Deep { max_distance: None })], |s, v| s.occlusion = v);
    let all = with(&all, DeepDepth::ALL, |s, depth| {
        s.structure = DeepImageSettings { depth, ..DeepImageSettings::of(&s.structure) }.into()
    });
    let all = with(&all, DeepSearch::ALL, |s, search| {
        s.structure = DeepImageSettings { search, ..DeepImageSettings::of(&s.structure) }.into()
    });
    let all =
        with(&all, &[None, Some(DebugView::RayCount), Some(DebugView::Motion), Some(DebugView::Indirect)], |s, v| {
            s.debug_view = v
        });
    // Which rays are traced, and what they are traced through, is nothing to a history.
    let usual = Settings::default();
    let is_usual = |s: &&Settings| {
        (s.ray_culling, DeepImageSettings::of(&s.structure))
            == (usual.ray_culling, DeepImageSettings::of(&usual.structure))
    };
    let with_history = all.iter().filter(is_usual).map(|s| Settings { history: History::On, ..s.clone() });
    with_history.chain(all.iter().cloned()).collect()
}

/// Features by module, of rooms that say which they are; what they refuse is no variant.
fn asked_by_settings() -> BTreeMap<&'static str, BTreeSet<Vec<Feature>>> {
    let mut asked: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for settings in all_settings() {
        asked.entry("debug_views/debug").or_default().insert(debug_views::features(&settings));
        for tracer in [None].into_iter().chain(Tracer::all().into_iter().map(Some)) {
            // What each draw asks for beside.
            for lights in [&[][..], &[AREA_LIGHTS]] {
                let features = [&shading::sums_features(&settings, tracer)[..], lights].concat();
                asked.entry("shading/sums").or_default().insert(features);
            }
            let [opaque, blended] = shading::features(&settings, tracer);
            for (features, draws) in [(opaque, &[&[][..], &[MASKED]][..]), (blended, &[&[]])] {
                let drawn = draws.iter().flat_map(|draw| TEXTURES.iter().map(move |textures| [*draw, *textures]));
                for [draw, textures] in drawn {
                    for lights in [&[][..], &[AREA_LIGHTS]] {
                        let added = [&features[..], draw, lights, textures].concat();
                        asked.entry("shading/forward").or_default().insert(added);
                    }
                }
            }
            let Some(tracer) = tracer else { continue };
            for has_areas in [false, true] {
                if settings.history == History::On && (has_areas || settings.light_radius > 0.0) {
                    let features = shading::open_share_features(&settings, has_areas);
                    asked.entry("shading/open_shares").or_default().insert(features);
                }
                let Ok([plan, trace]) = shadows::features(&settings, tracer, has_areas) else { continue };
                asked.entry("shadows/plan").or_default().insert(plan);
                asked.entry("shadows/trace").or_default().insert(trace);
            }
        }
    }
    asked
}

fn all_variants() -> Vec<Arc<LinkedShader>> {
    let link = |(folder, root): (&'static Shaders, &'static Root)| {
        let linked = variants(root).into_iter().map(|features| folder.link(root.module, &features));
        linked.map(|shader| shader.unwrap_or_else(|error| panic!("{error}")))
    };
    folders().flat_map(|folder| folder.roots.iter().map(move |root| (folder, root))).flat_map(link).collect()
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

fn check_entry_points(shaders: &[Arc<LinkedShader>]) {
    for (path, text) in SHADERS.sources() {
        let declares_entry = ["@compute", "@vertex", "@fragment"].iter().any(|stage| text.contains(stage));
        let roots = roots().filter(|root| root.module == *path).count();
        assert_eq!(usize::from(declares_entry), roots, "{path}: its folder's `DECLARED` names it so many times");
    }
    assert!(shaders.iter().all(|shader| !shader.module.entry_points.is_empty()));
    let labels: BTreeSet<_> = shaders.iter().map(|shader| &shader.label).collect();
    assert_eq!(labels.len(), shaders.len(), "a variant twice");
}

#[test]
#[cfg(debug_assertions)]
#[should_panic(expected = "light_culling/tiled/bounds: its folder does not declare [Feature(\"payload\")]")]
fn a_variant_that_is_not_declared_is_never_linked() {
    let _ = <Tiled as Technique>::SHADERS.link("light_culling/tiled/bounds", &[crate::deep_images::PAYLOAD]);
}

#[test]
fn every_feature_that_a_shader_asks_for_is_declared_and_no_other() {
    let known: BTreeSet<&str> = roots()
        .flat_map(variants)
        .flatten()
        .filter(|feature| !feature.is_choice())
        .map(|feature| feature.name())
        .collect();
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

fn check_floor(shaders: &[Arc<LinkedShader>]) {
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

fn check_shared_structs(shaders: &[Arc<LinkedShader>]) {
    let mut checked = BTreeSet::new();
    for SharedStruct { name, check } in folders().flat_map(|folder| folder.structs) {
        let has_it = |shader: &&Arc<LinkedShader>| {
            shader.module.types.iter().any(|(_, ty)| item_name(ty.name.as_deref()) == *name)
        };
        for shader in shaders.iter().filter(has_it) {
            check(shader).unwrap_or_else(|error| panic!("{error}"));
            checked.insert(name.to_string());
        }
    }

    // None is missing above, and each is in some shader.
    let mut declared = BTreeSet::new();
    declared_structs(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src")), &mut declared);
    assert_eq!(declared, checked);
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
