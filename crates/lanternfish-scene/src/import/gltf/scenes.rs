//! Selection of one of a file's scenes.

use super::fault::{Fault, Result, item};
use super::schema::Root;

/// The index of the scene with the name `requested`, else with that index. If `requested` is `None`: the default scene, else the first.
/// `None` for a file without scenes: all of its nodes form one.
pub(super) fn select(root: &Root, requested: Option<&str>) -> Result<Option<usize>> {
    let Some(requested) = requested else {
        if let Some(scene) = root.scene {
            item(&root.scenes, scene, "scenes")?;
        }
        return Ok(root.scene.or((!root.scenes.is_empty()).then_some(0)));
    };
    let named = root.scenes.iter().position(|scene| !requested.is_empty() && scene.name == requested);
    let numbered = || requested.parse().ok().filter(|index| *index < root.scenes.len());
    match named.or_else(numbered) {
        Some(scene) => Ok(Some(scene)),
        None => Err(Fault::NoSuchScene { scene: requested.to_owned(), known: list(root) }),
    }
}

/// The file's scenes for messages: indices, with names if they have any.
fn list(root: &Root) -> String {
    let entry = |(i, scene): (usize, &super::schema::Scene)| match scene.name.as_str() {
        "" => i.to_string(),
        name => format!("{i} {name:?}"),
    };
    let entries: Vec<_> = root.scenes.iter().enumerate().map(entry).collect();
    if entries.is_empty() { "only one, which has neither name nor index".to_owned() } else { entries.join(", ") }
}
