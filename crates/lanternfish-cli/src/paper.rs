//! The papers: their techniques, and `--as PAPER`, the flags that it stands for, and a table of them.
//!
//! Only this file names their crate, which the feature `papers` links. Without it, `no_papers.rs` stands for this file.

use lanternfish::{
    rays::Structure,
    settings::{GivenSettings, Quality, Settings},
};
#[cfg(test)]
pub use lanternfish_papers::{Deep, DirectionSet, Hbao, RasterGrid};
pub use lanternfish_papers::{DeepImageSettings, Paper, register};

use crate::table::{Row, to_text};

/// The structure of inexact tracers at a quality; none is its default.
pub(crate) fn structure(quality: Quality) -> Structure {
    DeepImageSettings::of_quality(quality).chosen()
}

/// The settings that a paper stands for.
pub(crate) fn given(paper: Option<Paper>) -> GivenSettings {
    paper.map(Paper::given).unwrap_or_default()
}

/// The paper's settings for frames that do not wait for the device, in windows and replays: their deep images are
/// arrays.
pub(crate) fn for_moving(paper: Option<Paper>, settings: &mut Settings) {
    let row = paper.and_then(|paper| paper.rows().into_iter().find(|row| row.name == "deep-store"));
    // Another store than the paper's was given beside it.
    if row.is_some_and(|row| settings.get(row.name).as_deref() == Some(row.value)) {
        settings.set("deep-store", "linear_array").expect("the store of the default");
    }
}

/// Every setting of a paper, its value in these settings, and the section that says so.
pub(crate) fn table(paper: Paper, settings: &Settings) -> String {
    let rows = paper.rows().into_iter().map(|row| {
        let now = settings.get(row.name).unwrap_or_else(|| "-".to_owned());
        let changed = if now == row.value { String::new() } else { format!("changed: {} is ", row.value) };
        Row::default().text("", "", row.name).text("", "", now).text("", "", changed + row.source)
    });
    format!("as {paper}\n{}", to_text(&rows.collect::<Vec<_>>()))
}

#[cfg(test)]
mod tests {
    use clap::Command;
    use clap::{Args as _, FromArgMatches as _};

    use lanternfish_scene::Named as _;

    use super::*;
    use crate::{
        args::RenderArgs,
        shot::{self, Shot},
    };

    fn resolved(words: &[&str]) -> Shot {
        let command = RenderArgs::augment_args(Command::new("render")).args_override_self(true);
        let matches = command.no_binary_name(true).try_get_matches_from(words).unwrap();
        shot::resolve(&RenderArgs::from_arg_matches(&matches).unwrap().scene, &matches).unwrap()
    }

    /// The flag gives the library's settings, whatever the preset of quality is.
    #[test]
    fn a_paper_is_the_same_by_flag_and_in_the_library() {
        for paper in Paper::all() {
            for quality in ["draft", "best"] {
                let settings = resolved(&["demo:cornell", "--as", paper.name(), "--quality", quality]).args.settings();
                for row in paper.rows() {
                    assert_eq!(settings.get(row.name).as_deref(), Some(row.value), "{paper}, {quality}: {}", row.name);
                }
                assert!(!table(paper, &settings).contains("changed"), "{paper}");
            }
        }
    }

    /// A flag beside it overrides it wherever it stands, and a paper on the command line overrides a shot's techniques.
    #[test]
    fn flags_override_a_paper_which_overrides_a_shot() {
        let settings = resolved(&["demo:cornell", "--tile-size", "32", "--as", "elagabani"]).args.settings();
        assert_eq!(settings.get("tile-size").as_deref(), Some("32"));
        assert!(table(Paper::Elagabani, &settings).contains("changed: 8 is"));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("shot.toml");
        let get = |text: &str, words: &[&str], name: &str| {
            std::fs::write(&file, text).unwrap();
            resolved(&[&[file.to_str().unwrap()], words].concat()).args.settings().get(name)
        };
        let shot = "scene = \"demo:cornell\"\n[technique]\nculling = \"all\"\n";
        assert_eq!(get(shot, &["--as", "van-gelderen"], "culling").as_deref(), Some("clustered"));
        let shot = "scene = \"demo:cornell\"\n[technique]\nculling = \"all\"\nas = \"archer\"\n";
        assert_eq!(get(shot, &[], "culling").as_deref(), Some("all"), "a shot's own keys stand beside its paper");
        assert_eq!(get(shot, &[], "indirect").as_deref(), Some("virtual-lights"));
    }

    /// A window and a replay have arrays, which need no wait.
    #[test]
    fn moving_frames_have_arrays() {
        let shot = resolved(&["demo:cornell", "--as", "aalund"]);
        let mut settings = shot.args.settings();
        assert_eq!(settings.get("deep-store").as_deref(), Some("sorted_linked_list"));
        for_moving(shot.args.paper, &mut settings);
        assert_eq!(settings.get("deep-store").as_deref(), Some("linear_array"));
        let given = resolved(&["demo:cornell", "--as", "aalund", "--deep-store", "linked_list"]);
        let mut settings = given.args.settings();
        for_moving(given.args.paper, &mut settings);
        assert_eq!(settings.get("deep-store").as_deref(), Some("linked_list"), "what a user gives stays");
    }
}
