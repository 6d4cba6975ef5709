//! The runs of other benches from which the page is made, declared in `parts.toml`.

use std::path::Path;

use clap::ValueEnum;
use lanternfish_cli::scene::SceneName;
use serde::Deserialize;

use crate::view;

/// A paper, as `parts.toml` names it too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Paper {
    /// Elagabani 2025, hybrid Forward+
    Elagabani,
    /// Van Gelderen 2020, clustered shading for two eyes
    VanGelderen,
    /// Niessner 2010, indirect light through layered depth images
    Niessner,
    /// Aalund 2015, occlusion and photons through layered depth maps
    Aalund,
    /// Archer 2019, virtual lights with ranges through deep images
    Archer,
}

/// All papers, in the order of the page.
pub const PAPERS: [Paper; 5] = [Paper::Elagabani, Paper::VanGelderen, Paper::Niessner, Paper::Aalund, Paper::Archer];

/// A run of another bench.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Name of its folder.
    pub name: String,
    pub papers: Vec<Paper>,
    bench: String,
    shot: String,
    stand_in: String,
    full: String,
    card: Option<String>,
    /// Most seconds of the form `card`.
    pub card_seconds: Option<f64>,
    #[serde(default)]
    quick_scene: String,
    quick: Option<String>,
    #[serde(default)]
    quick_shot: bool,
}

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The papers' sizes.
    Full,
    /// Small images, for a processor.
    Quick,
    /// What nine minutes on a graphics card are enough for.
    Card,
}

/// A track of a scene that every program has, which is written into the part's folder.
pub const TRACK: (&str, &str) = ("atrium.toml", include_str!("../../../../docs/tracks/atrium.toml"));

/// All of them.
///
/// Panics if the declaration is wrong: a bug, which a test finds.
pub fn parts() -> Vec<Part> {
    #[derive(Deserialize)]
    struct Declared {
        parts: Vec<Part>,
    }
    let declared: Declared =
        toml::from_str(include_str!("parts.toml")).unwrap_or_else(|error| panic!("parts: {error}"));
    declared.parts
}

impl Part {
    /// The file that it writes into its folder.
    pub fn product(&self) -> &'static str {
        if self.measures() { "report.json" } else { "attenuation.svg" }
    }

    /// True if its bench takes `--adapter` and `--seconds`.
    pub fn measures(&self) -> bool {
        self.bench != "attenuation"
    }

    /// Arguments of the program in this form; none where it has no such form. `docs`: the folder of shots and tracks. `folder`: where it
    /// writes to.
    pub fn arguments(&self, form: Form, docs: &Path, folder: &Path, adapter: Option<&str>) -> Option<Vec<String>> {
        let shown = |path: &Path| path.display().to_string();
        let split = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let shot = docs.join(&self.shot);
        let mut words = vec![self.bench.clone()];
        let (stand_in, others) = match form {
            Form::Quick => (&self.quick_scene, self.quick.as_ref()?),
            Form::Card => (&self.stand_in, self.card.as_ref()?),
            Form::Full => (&self.stand_in, &self.full),
        };
        let has_shot = (form != Form::Quick || self.quick_shot) && is_there(&shot);
        if has_shot {
            words.push(shown(&shot));
        } else {
            words.extend(split(stand_in));
        }
        words.extend(split(others));
        if let Some(track) = words.iter_mut().find(|word| *word == TRACK.0) {
            *track = shown(&folder.join(TRACK.0));
        }
        if !self.measures() {
            words.extend(["-o".to_owned(), shown(&folder.join(self.product()))]);
            return Some(words);
        }
        words.extend(["-o".to_owned(), shown(folder)]);
        if let Some(adapter) = adapter {
            words.extend(["--adapter".to_owned(), adapter.to_owned()]);
        }
        Some(words)
    }
}

/// Whether a shot can be read and its scene is there.
fn is_there(shot: &Path) -> bool {
    let read = || view::shot_of(&SceneName::from(shot)).ok()?;
    shot.is_file() && read().is_some_and(|shot| shot.args.scene.demo().is_some() || shot.args.scene.path().is_file())
}
