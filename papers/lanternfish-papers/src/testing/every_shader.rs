use std::{collections::BTreeSet, path::Path};

use lanternfish::{
    settings::{Occlusion, Settings},
    techniques,
    testing::{
        every_shader::{EveryShader, all_settings, check_floor, with},
        in_browser,
    },
};

use crate::{Deep, DeepImageSettings, DeepSearch, FOLDERS, shaders::SHADERS};

fn every_shader() -> EveryShader {
    crate::register();
    let all = all_settings();
    let all = with(&all, &[Occlusion::NONE, Occlusion::from(Deep::default())], |s, v| s.occlusion = v);
    let usual = Settings::default();
    let (usual, others): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|s| s.shadows.ray_culling == usual.shadows.ray_culling);
    let usual = with(&usual, DeepSearch::ALL, |s, search| {
        s.structure = DeepImageSettings { search, ..DeepImageSettings::of(&s.structure) }.into()
    });
    let settings: Vec<_> = usual.into_iter().chain(others).collect();
    let folders = techniques::shaders().into_iter().chain(FOLDERS.iter().copied()).collect();
    EveryShader::new(vec![&lanternfish::shaders::SHADERS, &SHADERS], folders, &settings)
}

/// Files of this crate, and those of the library that are linked with a feature of it; the library's tests link all
/// others.
#[test]
fn every_variant_validates_and_fits_the_floor_and_shares_its_structs() {
    let every = every_shader();
    let own: BTreeSet<_> = SHADERS.sources().iter().map(|(path, _)| *path).collect();
    const FEATURES: [&str; 5] =
        ["culling_raster_grid", "deep_images", "occlusion", "tracer_across_texels", "tracer_within_texel"];
    let shaders = every.link_pairs(|root, features| {
        own.contains(root.module) || features.iter().any(|feature| FEATURES.contains(&feature.name()))
    });
    println!("{} variants", shaders.len());
    assert!(FEATURES.iter().all(|feature| shaders.iter().any(|shader| shader.label.contains(feature))));
    every.check_entry_points(&shaders);
    check_floor(&shaders);
    every.check_shared_structs(&shaders, &[Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src"))]);
    in_browser::check(&shaders);
}

#[test]
fn exactly_the_features_that_shaders_use_are_declared() {
    every_shader().check_features(&[]);
}
