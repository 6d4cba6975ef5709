//! Checks that every shader variant that settings can request links, is valid, and fits WebGPU's default limits.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
    sync::Arc,
};

use lanternfish_gpu::{Feature, LinkedShader, SharedStruct, testing};
use wgpu::naga::{AddressSpace, ImageClass, Module, TypeInner, proc::Layouter};

use crate::{
    debug_views,
    gpu_scene::{LAYERED, MASKED, PANES, TEXTURES},
    lights::AREA_LIGHTS,
    prepass::FROM_BEHIND,
    settings::{
        Background, Culling, DebugView, History, Indirect, RayCulling, RayRangeCulling, Samples, Settings, Tracer,
    },
    shaders::{Package, Root, Shaders},
    shading, shadows,
    techniques::Sampled,
};

/// Every shader of some packages, in every variant that can be requested.
#[derive(Debug)]
pub struct EveryShader {
    packages: Vec<&'static Package>,
    folders: Vec<Shaders>,
    requested: BTreeMap<&'static str, BTreeSet<Vec<Feature>>>,
}

/// All combinations of `settings` with these values.
pub fn with<T: Clone>(settings: &[Settings], values: &[T], set: impl Fn(&mut Settings, T)) -> Vec<Settings> {
    let changed = |settings: &Settings, value: &T| {
        let mut settings = settings.clone();
        set(&mut settings, value.clone());
        settings
    };
    settings.iter().flat_map(|settings| values.iter().map(|value| changed(settings, value))).collect()
}

/// All combinations of the settings that shadows and shading depend on.
pub fn all_settings() -> Vec<Settings> {
    let cullings: Vec<_> = [Culling::NONE].into_iter().chain(Culling::all()).collect();
    let all = with(&[Settings::default()], &cullings, |s, v| s.culling = v);
    let all = with(&all, RayCulling::ALL, |s, v| s.shadows.ray_culling = v);
    let all = with(&all, &[0.0, 0.1], |s, v| s.lights.radius = v);
    let all = with(&all, &[Samples::One, Samples::Four], |s, v| s.image.samples = v);
    let all = with(&all, &[Indirect::NONE, Indirect::from(Sampled::default())], |s, v| s.indirect = v);
    let views = [None, Some(DebugView::RayCount), Some(DebugView::Motion), Some(DebugView::Indirect)];
    let all = with(&all, &views, |s, v| s.image.debug_view = v);
    // The choice of traced rays does not affect a history.
    let usual = Settings::default();
    let is_usual = |s: &&Settings| s.shadows.ray_culling == usual.shadows.ray_culling;
    let with_history = all.iter().filter(is_usual).map(|s| s.clone().with_history(History::On));
    let any_range = all.iter().map(|s| s.clone().with_ray_range_culling(RayRangeCulling::Off));
    let any_range = any_range
        .filter(|s| s.indirect == Indirect::NONE && s.image.samples == Samples::One && s.image.debug_view.is_none());
    let hidden = all.iter().filter(|s| s.culling == usual.culling && s.image.debug_view.is_none()).filter(is_usual);
    let hidden = hidden.map(|s| s.clone().with_background(Background::Transparent));
    with_history.chain(any_range).chain(hidden).chain(all.iter().cloned()).collect()
}

/// Features by module, of folders whose features depend on settings. Rejected settings give no variant.
fn requested_by(all_settings: &[Settings]) -> BTreeMap<&'static str, BTreeSet<Vec<Feature>>> {
    let mut requested: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for settings in all_settings {
        requested.entry("debug_views/debug").or_default().insert(debug_views::features(settings));
        for tracer in [None].into_iter().chain(Tracer::all().into_iter().map(Some)) {
            // Features that draws add.
            let sees_panes = tracer.is_some_and(|tracer| shadows::sees_panes(settings, tracer));
            let (no_panes, both) = (&[&[][..]][..], &[&[][..], &[PANES]][..]);
            let lit = |panes: &[&'static [Feature]]| -> Vec<Vec<Feature>> {
                let lights = [&[][..], &[AREA_LIGHTS]];
                lights.iter().flat_map(|lights| panes.iter().map(move |panes| [*lights, *panes].concat())).collect()
            };
            let lit_opaque = lit(if sees_panes { both } else { no_panes });
            let lit_by_own_rays = lit(if tracer.is_some() { both } else { no_panes });
            for lights in &lit_opaque {
                let features = [&shading::demodulated_features(settings, tracer, false)[..], lights].concat();
                requested.entry("shading/demodulated").or_default().insert(features);
            }
            let features = shading::demodulated_features(settings, tracer, true);
            requested.entry("shading/demodulated").or_default().insert(features);
            let [opaque, transparent] = shading::features(settings, tracer, false);
            let [opaque_sampled, transparent_sampled] = shading::features(settings, tracer, true);
            let (solid, blended) =
                (&[&[][..], &[MASKED], &[LAYERED], &[MASKED, LAYERED]][..], &[&[][..], &[LAYERED]][..]);
            let from_behind = |transparent: &Vec<Feature>| [&transparent[..], &[FROM_BEHIND]].concat();
            let [behind, behind_sampled] = [&transparent, &transparent_sampled].map(from_behind);
            for (features, draws) in
                [(opaque_sampled, solid), (transparent_sampled, blended), (behind_sampled, blended)]
            {
                for draw in draws {
                    let added = TEXTURES.iter().map(|textures| [&features[..], draw, textures].concat());
                    requested.entry("shading/forward").or_default().extend(added);
                }
            }
            for (features, draws, lit) in [
                (opaque, solid, &lit_opaque),
                (transparent, blended, &lit_by_own_rays),
                (behind, blended, &lit_by_own_rays),
            ] {
                let drawn = draws.iter().flat_map(|draw| TEXTURES.iter().map(move |textures| [*draw, *textures]));
                for [draw, textures] in drawn {
                    for lights in lit {
                        let added = [&features[..], draw, lights, textures].concat();
                        requested.entry("shading/forward").or_default().insert(added);
                    }
                }
            }
            let Some(tracer) = tracer else { continue };
            for has_areas in [false, true] {
                if settings.history == History::On && (has_areas || settings.lights.radius > 0.0) {
                    let features = shading::visibility_ratio_features(settings, has_areas);
                    requested.entry("shading/visibility_ratios").or_default().insert(features);
                }
                for has_panes in [false, true].into_iter().take(1 + usize::from(sees_panes)) {
                    let Ok(features) = shadows::features(settings, tracer, has_areas, has_panes) else { continue };
                    requested.entry("shadows/plan").or_default().insert(features.plan);
                    requested.entry("shadows/trace").or_default().insert(features.trace);
                    requested.entry("shadows/trace_edges").or_default().extend(features.trace_edges);
                }
            }
        }
    }
    requested
}

/// Variants, those of most features first, in which each two features are together, alone, or both missing, wherever any variant has that.
fn in_pairs(mut variants: Vec<Vec<Feature>>) -> Vec<Vec<Feature>> {
    let features: BTreeSet<Feature> = variants.iter().flatten().copied().collect();
    let mut seen = BTreeSet::new();
    variants.sort_by_key(|variant| Reverse(variant.len()));
    variants.retain(|variant| {
        let states: Vec<bool> = features.iter().map(|feature| variant.contains(feature)).collect();
        let pairs = (0..states.len()).flat_map(|i| (0..=i).map(move |j| (i, j)));
        pairs.filter(|(i, j)| seen.insert((*i, *j, states[*i], states[*j]))).count() > 0 || features.is_empty()
    });
    variants
}

impl EveryShader {
    /// The shaders of these packages with these folders, under these settings.
    pub fn new(packages: Vec<&'static Package>, folders: Vec<Shaders>, settings: &[Settings]) -> Self {
        Self { packages, folders, requested: requested_by(settings) }
    }

    /// Every file with entry points, and the folder that declares it.
    fn roots(&self) -> impl Iterator<Item = (&Shaders, &'static Root)> {
        self.folders.iter().flat_map(|folder| folder.roots.iter().map(move |root| (folder, root)))
    }

    /// Every variant of a file that can be requested.
    fn variants(&self, root: &Root) -> Vec<Vec<Feature>> {
        root.variants().unwrap_or_else(|| self.requested[root.module].iter().cloned().collect())
    }

    /// Links every variant that `is_wanted` selects by its file and features.
    ///
    /// Panics if a variant is not valid.
    pub fn link(&self, is_wanted: impl Fn(&Root, &[Feature]) -> bool) -> Vec<Arc<LinkedShader>> {
        self.linked(|variants| variants, is_wanted)
    }

    /// The same under `--full`. Otherwise links some, in which each pair of features occurs as in all.
    pub fn link_pairs(&self, is_wanted: impl Fn(&Root, &[Feature]) -> bool) -> Vec<Arc<LinkedShader>> {
        self.linked(|variants| if testing::is_full() { variants } else { in_pairs(variants) }, is_wanted)
    }

    fn linked(
        &self,
        of: impl Fn(Vec<Vec<Feature>>) -> Vec<Vec<Feature>>,
        is_wanted: impl Fn(&Root, &[Feature]) -> bool,
    ) -> Vec<Arc<LinkedShader>> {
        let mut linked = Vec::new();
        for (folder, root) in self.roots() {
            let wanted = of(self.variants(root)).into_iter().filter(|features| is_wanted(root, features));
            linked.extend(
                wanted.map(|features| folder.link(root.module, &features).unwrap_or_else(|error| panic!("{error}"))),
            );
        }
        linked
    }

    /// Panics unless the folders declare each file with entry points once, without duplicate variants.
    pub fn check_entry_points(&self, shaders: &[Arc<LinkedShader>]) {
        for (path, text) in self.packages.iter().flat_map(|package| package.sources()) {
            let declares_entry = ["@compute", "@vertex", "@fragment"].iter().any(|stage| text.contains(stage));
            let roots = self.roots().filter(|(_, root)| root.module == *path).count();
            assert_eq!(usize::from(declares_entry), roots, "{path}: its folder's `DECLARED` must name it once");
        }
        assert!(shaders.iter().all(|shader| !shader.module.entry_points.is_empty()));
        let labels: BTreeSet<_> = shaders.iter().map(|shader| &shader.label).collect();
        assert_eq!(labels.len(), shaders.len(), "a variant twice");
    }

    /// Panics unless the shaders use every feature of their variants and those in `open`, and no other.
    pub fn check_features(&self, open: &[Feature]) {
        let declared: BTreeSet<&str> = self
            .roots()
            .flat_map(|(_, root)| self.variants(root))
            .flatten()
            .chain(open.iter().copied())
            .filter(|feature| !feature.is_choice())
            .map(|feature| feature.name())
            .collect();
        let mut requested = BTreeSet::new();
        for (_, text) in self.packages.iter().flat_map(|package| package.sources()) {
            for condition in text.split("@if(").skip(1).filter_map(|rest| rest.split(')').next()) {
                let names = condition.split(|c: char| !c.is_alphanumeric() && c != '_');
                requested.extend(names.filter(|name| !name.is_empty()));
            }
        }
        assert_eq!(requested, declared);
    }

    /// Panics unless each struct that these crates share with the host has the same layout in each shader that contains it. `sources`: the
    /// source folders of the crates.
    pub fn check_shared_structs(&self, shaders: &[Arc<LinkedShader>], sources: &[&Path]) {
        let mut declared = BTreeSet::new();
        sources.iter().for_each(|folder| declared_structs(folder, &mut declared));
        let mut checked = BTreeSet::new();
        for SharedStruct { name, check } in self.folders.iter().flat_map(|folder| folder.structs) {
            let has_it = |shader: &&Arc<LinkedShader>| {
                shader.module.types.iter().any(|(_, ty)| item_name(ty.name.as_deref()) == *name)
            };
            for shader in shaders.iter().filter(has_it) {
                check(shader).unwrap_or_else(|error| panic!("{error}"));
                checked.insert(name.to_string());
            }
        }
        // None may be missing above, and each must be in a shader.
        let missing: Vec<_> = declared.difference(&checked).collect();
        assert!(!declared.is_empty() && missing.is_empty(), "not in the folders' lists, or in no shader: {missing:?}");
    }
}

/// The name of an item in its own file.
fn item_name(linked_name: Option<&str>) -> &str {
    linked_name.and_then(|name| name.split("__").next()).unwrap_or_default()
}

/// Resources of one entry point that WebGPU limits.
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
    let mut used = Use::default();
    for (handle, variable) in module.global_variables.iter() {
        if shader.info.get_entry_point(entry)[handle].is_empty() {
            continue;
        }
        if let Some(binding) = variable.binding {
            used.groups = used.groups.max(binding.group + 1);
        }
        match (variable.space, &module.types[variable.ty].inner) {
            (AddressSpace::Storage { .. }, _) => used.storage_buffers += 1,
            (AddressSpace::Uniform, _) => used.uniform_buffers += 1,
            (AddressSpace::WorkGroup, _) => used.workgroup_bytes += layouter[variable.ty].size,
            (_, TypeInner::Image { class: ImageClass::Storage { .. }, .. }) => {
                used.storage_textures += 1;
            }
            (_, TypeInner::Image { .. }) => used.textures += 1,
            (_, TypeInner::Sampler { .. }) => used.samplers += 1,
            // Bound to nothing.
            (AddressSpace::Private, _) => {}
            // An acceleration structure, or an array of textures or samplers, which the variant's feature requires.
            _ => assert!(shader.label.contains("ray_query") || shader.label.contains("binding_arrays")),
        }
    }
    used
}

/// Panics unless every entry point is within WebGPU's default limits, <https://www.w3.org/TR/webgpu/#limits>.
pub fn check_floor(shaders: &[Arc<LinkedShader>]) {
    let floor = wgpu::Limits::default();
    let mut most_storage_buffers = 0;
    for shader in shaders {
        for (i, entry) in shader.module.entry_points.iter().enumerate() {
            let used = resources(shader, i);
            let name = format!("{} {}", shader.label, entry.name);
            let fits = |what: &str, count: usize, limit: u32| {
                assert!(count <= limit as usize, "{name}: {count} {what}, the default limit is {limit}");
            };
            fits("storage buffers", used.storage_buffers, floor.max_storage_buffers_per_shader_stage);
            fits("uniform buffers", used.uniform_buffers, floor.max_uniform_buffers_per_shader_stage);
            fits("textures", used.textures, floor.max_sampled_textures_per_shader_stage);
            fits("storage textures", used.storage_textures, floor.max_storage_textures_per_shader_stage);
            fits("samplers", used.samplers, floor.max_samplers_per_shader_stage);
            fits("bind groups", used.groups as usize, floor.max_bind_groups);
            let invocations: u32 = entry.workgroup_size.iter().product();
            fits("invocations", invocations as usize, floor.max_compute_invocations_per_workgroup);
            let bytes = used.workgroup_bytes as usize;
            fits("workgroup bytes", bytes, floor.max_compute_workgroup_storage_size);
            most_storage_buffers = most_storage_buffers.max(used.storage_buffers);
        }
    }
    // The count is effective: tracing alone reads the lists, the lights, the tree, the masks and the bits.
    assert!(most_storage_buffers >= 7, "{most_storage_buffers} storage buffers found at most");
}

/// Names declared with `gpu_struct!` below a folder.
fn declared_structs(folder: &Path, names: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("src can be read") {
        let path = entry.expect("src can be read").path();
        if path.is_dir() {
            declared_structs(&path, names);
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("testing/every_shader.rs") {
            let text = fs::read_to_string(&path).expect("sources are UTF-8");
            let declarations = text.split("gpu_struct! {").skip(1);
            names.extend(declarations.filter_map(|d| {
                let name = d.split("struct ").nth(1)?.split_whitespace().next()?;
                Some(name.to_owned())
            }));
        }
    }
}

#[test]
fn pairs_of_features_are_kept_and_few_variants() {
    let features = ["a", "b", "c", "d", "e", "f", "g", "h"].map(Feature::new);
    let variant =
        |bits: usize| features.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, f)| *f).collect();
    // `a` and `b` are never together.
    let all: Vec<Vec<Feature>> = (0..256).filter(|bits| bits & 3 != 3).map(variant).collect();
    let kept = in_pairs(all.clone());
    let has = |variants: &[Vec<Feature>], pair: [Feature; 2], states: [bool; 2]| {
        variants.iter().any(|variant| pair.map(|feature| variant.contains(&feature)) == states)
    };
    for (a, b) in features.iter().flat_map(|a| features.iter().map(move |b| (*a, *b))) {
        for states in [[false, false], [false, true], [true, false], [true, true]] {
            assert_eq!(has(&kept, [a, b], states), has(&all, [a, b], states), "{a:?} {b:?} {states:?}");
        }
    }
    assert!(kept.len() < all.len() / 4 && in_pairs(vec![vec![]]).len() == 1, "{}", kept.len());
}
