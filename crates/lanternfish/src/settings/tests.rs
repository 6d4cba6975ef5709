use super::*;
use crate::techniques::{Clustered, Probes, Sampled, SampledLights, TileSize, Tiled};

fn read(text: &str) -> Result<Settings, String> {
    serde_json::from_str(text).map_err(|error| error.to_string())
}

#[test]
fn settings_survive_a_round_trip_as_data() {
    let few = Sampled { diffuse_rays: 3, filter_radius: 0, ..Sampled::default() };
    let mut all: Vec<_> = Preset::ALL.iter().map(|preset| Settings::of_preset(*preset)).collect();
    all.extend(Indirect::all().into_iter().map(|indirect| Settings::direct_light().with_indirect(indirect)));
    all.extend(Direct::all().into_iter().map(|direct| Settings::direct_light().with_direct(direct)));
    all.extend(Culling::all().into_iter().map(|culling| Settings::direct_light().with_culling(culling)));
    all.extend([
        Settings::direct_light()
            .with_culling(Culling::NONE)
            .with_shadows(Shadows::BVH)
            .with_exposure(Exposure::Ev(-1.3)),
        Settings::default().with_indirect(few).with_debug_view(DebugView::Nan).with_light_radius(0.1),
        Settings::default().with_attenuation_coefficients(Coefficients([0.5, 0.0, 2.0])).with_range_threshold(1e-6),
        Settings::default().with_culling(Tiled { tile_size: TileSize::Px8, aabb_test: false }),
    ]);
    for settings in all {
        let text = serde_json::to_string(&settings).unwrap();
        assert_eq!(read(&text).as_ref(), Ok(&settings), "{text}");
    }
}

#[test]
fn missing_groups_keys_and_parameters_have_defaults() {
    assert_eq!(read("{}"), Ok(Settings::default()));
    assert_eq!(read(r#"{ "image": {}, "lights": {}, "shadows": {}, "materials": {} }"#), Ok(Settings::default()));
    let settings = read(
        r#"{ "indirect": "probes", "culling": { "clustered": {} }, "direct": { "sampled": { "denoise": false } } }"#,
    );
    let settings = settings.unwrap();
    assert_eq!(settings.indirect, Probes::default().into());
    assert_eq!(settings.culling, Clustered::default().into());
    let unfiltered = SampledLights { denoise: crate::techniques::Denoise::Off, ..SampledLights::default() };
    assert_eq!(settings.direct, unfiltered.into());
}

#[test]
fn mistakes_name_what_was_meant() {
    for (text, words) in [
        (r#"{ "indirect": "sampeld" }"#, ["no indirect technique \"sampeld\"", "did you mean \"sampled\"?"]),
        (r#"{ "indirect": { "prob": {} } }"#, ["none, sampled, probes", "did you mean \"probes\"?"]),
        (
            r#"{ "culling": { "tiled": { "tile-sise": 8 } } }"#,
            ["tiled has no parameter \"tile-sise\"", "\"tile-size\"?"],
        ),
        (r#"{ "culling": { "tiled": { "tile-size": 9 } } }"#, ["tile-size = 9", "8, 16, 32"]),
        (r#"{ "culling": { "tiled": {}, "clustered": {} } }"#, ["one technique", "found \"tiled\" and \"clustered\""]),
        (r#"{ "culling": {} }"#, ["expected one technique", "culling"]),
        (r#"{ "indirect": { "none": {} } }"#, ["\"none\"", "no parameters"]),
        (r#"{ "indirect": { "sampled": { "indirect-rays": -1 } } }"#, ["indirect-rays = -1", "a whole number from"]),
        (r#"{ "structure": "deep" }"#, ["no structure technique \"deep\"", "none"]),
        (r#"{ "shadows": { "technique": "bhv" } }"#, ["\"bhv\"", "did you mean \"bvh\"?"]),
        (r#"{ "shadows": { "ray": 4 } }"#, ["unknown field", "rays"]),
        (r#"{ "shadow": {} }"#, ["unknown field", "shadows"]),
        (r#"{ "image": { "exposure": "bright" } }"#, ["bright", "expected auto"]),
    ] {
        let error = read(text).unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)), "{text}: {error}");
    }
}

#[test]
fn names_are_parsed_and_others_are_rejected_with_the_list() {
    for attenuation in Attenuation::ALL {
        assert_eq!(lanternfish_scene::Named::name(*attenuation).parse::<Attenuation>(), Ok(*attenuation));
    }
    // Two values of one name could not be told apart.
    for shadows in Shadows::all() {
        assert_eq!(shadows.name().parse::<Shadows>(), Ok(shadows));
    }
    assert!("16px".parse::<TileSize>().unwrap_err().contains("8, 16, 32"));
}

/// Every setting can be read back from its text, and every named value is accepted.
#[test]
fn every_setting_is_written_and_parsed() {
    for parameter in Settings::PARAMETERS {
        let (name, usual) = (parameter.info.name, Settings::default());
        let mut settings = usual.clone();
        if let Some(text) = usual.get(name) {
            settings.set(name, &text).unwrap();
        }
        assert!(settings == usual, "{name}");
        for (value, _) in (parameter.of)(&mut settings.clone()).names() {
            settings.set(name, value).unwrap();
            assert_eq!(settings.get(name).as_deref().unwrap_or("none"), value, "{name}");
        }
        let mistaken = settings.set(name, "no such thing").unwrap_err();
        assert!(mistaken.starts_with("expected"), "{name}: {mistaken}");
    }
    assert!(Settings::default().set("colour", "1").is_err());
}
