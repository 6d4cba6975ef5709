//! Scenes made by code, the same on every machine.

use crate::{Scene, SceneError};

/// Names that [`demo`] knows.
pub const DEMOS: &[&str] = &[];

/// The generated scene of that name.
pub fn demo(name: &str) -> Result<Scene, SceneError> {
    Err(SceneError::UnknownDemo { name: name.to_owned(), known: DEMOS.join(", ") })
}
