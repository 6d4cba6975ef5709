//! The runs of other benches from which the page is made: one list.

use std::path::Path;

use lanternfish_cli::scene::SceneName;

use super::Paper;
use crate::view;

/// A run of another bench.
#[derive(Debug)]
pub struct Part {
    /// Of its folder.
    pub name: &'static str,
    pub papers: &'static [Paper],
    bench: &'static str,
    /// The quick run: its scene where the full run's is missing or too large, and the other arguments; none where it is left out.
    quick: Option<Quick>,
    /// What the full run shows: a shot, by its path below the folder of documentation, and what stands for it where it, or its scene,
    /// is missing.
    scene: (&'static str, &'static str),
    full: &'static str,
}

/// A quick run.
#[derive(Debug)]
enum Quick {
    /// Of this scene.
    Of(&'static str, &'static str),
    /// Of the full run's shot, or of this scene.
    OfShotOr(&'static str, &'static str),
}

/// A track of a scene that every program has, which is written into the part's folder.
pub const TRACK: (&str, &str) = ("atrium.toml", include_str!("../../../../docs/tracks/atrium.toml"));

/// All of them.
pub const PARTS: [Part; 11] = [
    Part {
        name: "forward-plus",
        papers: &[Paper::Elagabani],
        bench: "forward-plus",
        quick: Some(Quick::OfShotOr("demo:atrium --lights rain:10", "--size 240x136 --runs 3")),
        scene: ("shots/sponza-ten.toml", "demo:atrium --lights rain:10"),
        full: "--size 1920x1080 --runs 10",
    },
    Part {
        name: "clustered",
        papers: &[Paper::VanGelderen],
        bench: "clustered",
        quick: Some(Quick::Of("demo:atrium", "--quick --size 160x90 --runs 1")),
        scene: ("shots/sponza-ten.toml", "demo:atrium"),
        full: "--runs 5",
    },
    Part {
        name: "clustered-track",
        papers: &[Paper::VanGelderen],
        bench: "clustered",
        quick: Some(Quick::Of(TRACK.0, "--quick --frames 4 --size 160x90 --runs 1")),
        scene: ("tracks/bistro.toml", "atrium.toml"),
        full: "--frames 170 --runs 3",
    },
    Part {
        name: "attenuation",
        papers: &[Paper::VanGelderen],
        bench: "attenuation",
        quick: Some(Quick::Of("", "")),
        scene: ("", ""),
        full: "",
    },
    Part {
        name: "deep-images",
        papers: &[Paper::Niessner, Paper::Archer],
        bench: "deep-images",
        quick: Some(Quick::OfShotOr("demo:cornell", "--tables directions,builders --rays 16384 --runs 1")),
        scene: ("shots/deep-images-sponza.toml", "demo:atrium"),
        full: "--runs 5",
    },
    Part {
        name: "deep-images-many-triangles",
        papers: &[Paper::Niessner, Paper::Archer],
        bench: "deep-images",
        quick: Some(Quick::Of("demo:street", "--tables directions --rays 16384 --runs 1")),
        scene: ("shots/deep-images-bistro.toml", "demo:street"),
        full: "--tables directions --runs 5",
    },
    // Of every table, small.
    Part {
        name: "crossings",
        papers: &[Paper::Niessner],
        bench: "deep-images",
        quick: Some(Quick::Of("demo:cornell", "--quick --rays 4096 --runs 1")),
        scene: ("", "demo:atrium"),
        full: "--quick --rays 16384 --runs 1",
    },
    Part {
        name: "indirect",
        papers: &[Paper::Niessner],
        bench: "indirect",
        quick: Some(Quick::Of("demo:cornell", "--quick --resolution 128,512 --size 40x30 --runs 1")),
        scene: ("shots/indirect-sponza.toml", "demo:atrium --lights rain:10"),
        full: "--size 512x512 --runs 5",
    },
    Part {
        name: "virtual-lights",
        papers: &[Paper::VanGelderen, Paper::Archer],
        bench: "virtual-lights",
        quick: Some(Quick::OfShotOr(
            "demo:cornell",
            "--size 64x36 --spp 16 --runs 1 --only paper --only ranges --only app.",
        )),
        scene: ("shots/virtual-lights-walk.toml", "demo:atrium --lights rain:10"),
        full: "--size 1920x1080 --spp 8 --runs 5 --only paper --only ranges --only app.",
    },
    Part {
        name: "virtual-lights-many-triangles",
        papers: &[Paper::Archer],
        bench: "virtual-lights",
        quick: None,
        scene: ("", "demo:street"),
        full: "--size 1920x1080 --spp 8 --runs 5 --only paper --only ranges",
    },
    Part {
        name: "photons",
        papers: &[Paper::Aalund],
        bench: "photons",
        quick: Some(Quick::OfShotOr("demo:cornell", "--size 48x36 --spp 16 --runs 1 --only paper --only occlusion")),
        scene: ("shots/virtual-lights-walk.toml", "demo:atrium --lights rain:10"),
        full: "--size 800x800 --spp 32 --runs 3 --only paper --only occlusion",
    },
];

impl Part {
    /// The file that it writes into its folder.
    pub fn product(&self) -> &'static str {
        if self.bench == "attenuation" { "attenuation.svg" } else { "report.json" }
    }

    /// Arguments of the program in the form `quick`, or full; none where it has no such form. `docs`: the folder of shots and tracks.
    /// `folder`: where it writes to.
    pub fn arguments(&self, quick: bool, docs: &Path, folder: &Path, adapter: Option<&str>) -> Option<Vec<String>> {
        let shown = |path: &Path| path.display().to_string();
        let split = |text: &'static str| text.split_whitespace().map(str::to_owned);
        let (shot, stand_in) = self.scene;
        let shot = docs.join(shot);
        let mut words = vec![self.bench.to_owned()];
        let (has_shot, stand_in, others) = match self.quick.as_ref().filter(|_| quick) {
            Some(Quick::Of(scene, others)) => (false, *scene, *others),
            Some(Quick::OfShotOr(scene, others)) => (is_there(&shot), *scene, *others),
            None if quick => return None,
            None => (is_there(&shot), stand_in, self.full),
        };
        if has_shot {
            words.push(shown(&shot));
        } else {
            words.extend(split(stand_in));
        }
        words.extend(split(others));
        if let Some(track) = words.iter_mut().find(|word| *word == TRACK.0) {
            *track = shown(&folder.join(TRACK.0));
        }
        if self.bench == "attenuation" {
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
