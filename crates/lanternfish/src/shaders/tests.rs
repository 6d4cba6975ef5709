use std::path::Path;

use super::*;
use crate::{
    settings::{Attenuation, ToneMap},
    technique::Technique,
    techniques::{self, Tiled},
    testing::{
        every_shader::{EveryShader, all_settings, check_floor},
        in_browser,
    },
};

fn every_shader() -> EveryShader {
    EveryShader::new(vec![&SHADERS], techniques::shaders(), &all_settings())
}

/// One test, so that all are linked once.
#[test]
fn every_variant_validates_and_fits_the_floor_and_shares_its_structs() {
    let every = every_shader();
    let shaders = every.link_pairs(|_, _| true);
    println!("{} variants", shaders.len());
    every.check_entry_points(&shaders);
    check_floor(&shaders);
    every.check_shared_structs(&shaders, &[Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src"))]);
    in_browser::check(&shaders);
}

/// Naga lets fragments take derivatives where only some of a quad are, and WGSL does not.
#[test]
fn a_shader_that_only_a_browser_refuses_is_reported() {
    static LIBRARY: ShaderLibrary = ShaderLibrary::new(&[(
        "uneven",
        "@fragment fn main(@location(0) x: f32) -> @location(0) vec4f {\n\
             var y = x;\n\
             if x > 0.0 { y = dpdx(x); }\n\
             return vec4f(y); }",
    )]);
    let shader = LIBRARY.link("uneven", &[]).unwrap();
    let Some(messages) = in_browser::compile(&[&shader.source, "@compute @workgroup_size(1) fn main() {}"]) else {
        return;
    };
    assert!(
        matches!(&messages[..], [message] if message.starts_with("0 error: ") && message.contains("dpdx")),
        "{messages:?}"
    );
}

#[test]
#[cfg(debug_assertions)]
#[should_panic(expected = "light_culling/tiled/bounds: its folder does not declare [Feature(\"payload\")]")]
fn a_variant_that_is_not_declared_is_never_linked() {
    let _ = <Tiled as Technique>::SHADERS.link("light_culling/tiled/bounds", &[Feature::new("payload")]);
}

#[test]
fn every_feature_that_a_shader_asks_for_is_declared_and_no_other() {
    // Those that only techniques of other crates turn on.
    every_shader().check_features(&[crate::rays::IN_CHUNKS, crate::occlusion::OCCLUSION]);
}

#[test]
fn the_numbers_of_named_choices_are_the_shaders() {
    for (i, attenuation) in Attenuation::ALL.iter().enumerate() {
        assert_eq!(*attenuation as usize, i);
        assert_eq!(constant("lights/attenuation", &attenuation.to_string().to_uppercase()), i as f64, "{attenuation}");
    }
    for (i, tone_map) in ToneMap::ALL.iter().enumerate() {
        assert_eq!(*tone_map as usize, i);
        assert_eq!(constant("output/tone_map", &tone_map.to_string().to_uppercase()), i as f64, "{tone_map}");
    }
}
