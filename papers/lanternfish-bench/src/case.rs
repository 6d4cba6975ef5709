//! A measured configuration, declared by the names of settings on the command line.

use lanternfish::{
    settings::Settings,
    technique::{AnyTechnique, Choice, Kind},
};
use lanternfish_papers::{DeepImageSettings, DirectionSet};
use lanternfish_scene::Setting;

/// One configuration.
#[derive(Clone, Debug)]
pub struct Case {
    pub name: String,
    pub settings: Settings,
    /// True if the scene's main light alone shines, as in [Archer2019].
    pub has_one_light: bool,
}

impl Case {
    /// A case with these settings.
    pub fn new(name: impl Into<String>, settings: Settings) -> Self {
        Self { name: name.into(), settings, has_one_light: false }
    }

    /// The same under the main light alone.
    pub fn under_one_light(self) -> Self {
        Self { has_one_light: true, ..self }
    }

    /// `look` with changes, as [`changed`] reads them.
    pub fn of(look: &Settings, name: &str, changes: &str) -> Self {
        Self::new(name, changed(look, changes))
    }

    /// A technique of indirect light with one bounce; the name is its parameters: `virtual-lights, vpl-stride 4`. Or a name that begins with the
    /// technique, and its parameters after `=`: `sampled, half the rays = indirect-rays 4`.
    pub fn one_bounce(look: &Settings, declared: &str) -> Self {
        let (name, changes) =
            declared.split_once(" = ").map_or((declared, None), |(name, changes)| (name, Some(changes)));
        let (technique, parameters) = name.split_once(", ").unwrap_or((name, ""));
        let technique = if technique == "sampled" { ONE_BOUNCE.to_owned() } else { format!("indirect {technique}") };
        Self::of(look, name, &format!("{technique}, {}", changes.unwrap_or(parameters)))
    }
}

/// Rays from every pixel with one bounce.
pub const ONE_BOUNCE: &str = "indirect sampled, first-rays 1, hit-light shaded, bounces 1";

/// `settings` with changes by their names on the command line, separated by commas: `indirect virtual-lights, vpl-stride 4`. A technique stands
/// before its parameters.
///
/// Panics if a name or a value is unknown: a bug in a list of cases.
pub fn changed(settings: &Settings, changes: &str) -> Settings {
    let mut settings = settings.clone();
    for change in changes.split(", ").filter(|change| !change.is_empty()) {
        let (name, value) = change.split_once(' ').unwrap_or((change, "on"));
        let result = set(&mut settings, name, value);
        assert!(result.is_ok(), "{change}: {result:?}");
    }
    settings
}

fn set(settings: &mut Settings, name: &str, value: &str) -> Result<(), String> {
    match name {
        "direct" => return choose(&mut settings.direct, value),
        "culling" => return choose(&mut settings.culling, value),
        "indirect" => return choose(&mut settings.indirect, value),
        "caustics" => return choose(&mut settings.caustics, value),
        "occlusion" => return choose(&mut settings.occlusion, value),
        "accumulate" => return settings.image.accumulate.read(value),
        "textures" => return settings.materials.textures.read(value),
        "light-radius" => return settings.lights.radius.read(value),
        "images" => return images(settings, value, |images, texels| images.resolution = texels),
        "zonal" => {
            let directions = |count| DirectionSet::ZonalEqualArea { count };
            return images(settings, value, |images, count| images.directions = directions(count));
        }
        _ => {}
    }
    // Of deep images.
    if name.starts_with("deep-") {
        return settings.set(name, value);
    }
    if let Some(parameter) = Settings::PARAMETERS.iter().find(|parameter| parameter.info.name == name) {
        return (parameter.of)(settings).read(value);
    }
    let techniques: [Option<&mut dyn AnyTechnique>; 5] = [
        settings.direct.technique_mut().map(|technique| technique as _),
        settings.culling.technique_mut().map(|technique| technique as _),
        settings.indirect.technique_mut().map(|technique| technique as _),
        settings.caustics.technique_mut().map(|technique| technique as _),
        settings.occlusion.technique_mut().map(|technique| technique as _),
    ];
    let has = |technique: &&mut dyn AnyTechnique| technique.parameters().iter().any(|(info, _)| info.name == name);
    techniques.into_iter().flatten().find(has).ok_or("no such parameter")?.set(name, value)
}

/// Changes the deep images: their texels (`images`), or their number of directions (`zonal`).
fn images(settings: &mut Settings, value: &str, set: impl Fn(&mut DeepImageSettings, u32)) -> Result<(), String> {
    let mut images = DeepImageSettings::of(&settings.structure);
    set(&mut images, value.parse().map_err(|_| "expected a number")?);
    settings.structure = images.into();
    Ok(())
}

fn choose<K: Kind + ?Sized>(choice: &mut Choice<K>, name: &str) -> Result<(), String> {
    *choice = Choice::named(name).ok_or_else(|| format!("no {} {name}", K::FLAG))?;
    Ok(())
}

#[test]
fn changes_are_those_of_the_command_line() {
    use lanternfish::techniques::Sampled;
    let look = Settings::direct_light();
    let case = Case::one_bounce(&look, "sampled, half = indirect-rays 4, history on, culling tiled");
    let sampled = case.settings.indirect.get::<Sampled>().copied();
    assert_eq!(case.name, "sampled, half");
    assert_eq!(sampled, Some(Sampled { diffuse_rays: 4, ..Sampled::default().one_bounce() }));
    assert_eq!((case.settings.culling.name(), case.settings.history.to_string()), ("tiled", "on".to_owned()));
    assert_eq!(changed(&case.settings, "indirect none, history off, culling clustered"), look);
    let mut other = look.clone();
    let refused =
        [set(&mut other, "vpl-stride", "4"), set(&mut other, "culling", "beauty"), set(&mut other, "samples", "3")];
    assert!(refused.iter().all(Result::is_err) && other == look, "{refused:?}");
}
