//! Settings by name, and light for scenes without.

use std::sync::Arc;

use lanternfish::{
    Settings,
    settings::{GivenSettings, Preset},
};
use lanternfish_scene::{Camera, Scene, Setting as _, nearest, rig};
use pyo3::{
    exceptions::PyValueError,
    prelude::*,
    types::{IntoPyDict as _, PyDict},
};

use crate::log;

/// Settings by name and value, each as text, with the rules of the command line.
pub fn chosen_settings(quality: &str, values: &[(String, String)]) -> PyResult<Settings> {
    let mut preset = Preset::default();
    preset.read(quality).map_err(|what| PyValueError::new_err(format!("quality: {what}")))?;
    let (known, mut given) = (Settings::parameters(), GivenSettings::default());
    let python = |name: &str| name.replace('-', "_");
    for (name, text) in values {
        let parameter = known.iter().find(|parameter| parameter.info.name == *name).ok_or_else(|| {
            let names: Vec<_> = known.iter().map(|parameter| parameter.info.name).collect();
            let (name, near) = (python(name), python(nearest(name, &names)));
            PyValueError::new_err(format!("there is no setting {name:?}; did you mean {near:?}?"))
        })?;
        let value = parameter.read(text).map_err(|what| PyValueError::new_err(format!("{}: {what}", python(name))))?;
        given.give(parameter.info.name, value);
    }
    let settings = given.over(preset);
    for (name, text) in given.texts() {
        if settings.get(name).is_none() && !["none", "auto"].contains(&text.as_str()) {
            let what = format!("{}: belongs to a technique that is not chosen", python(name));
            return Err(PyValueError::new_err(what));
        }
    }
    Ok(settings)
}

/// Every setting of a `Renderer`: its names of values, if it has such, and its meaning.
#[pyfunction]
pub fn settings(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let entry = |parameter: lanternfish::settings::AnyParameter| {
        let names: Vec<_> = parameter.names().iter().map(|(name, _)| *name).collect();
        (parameter.info.name.replace('-', "_"), (names, parameter.info.text()))
    };
    Settings::parameters().into_iter().map(entry).into_py_dict(py)
}

/// Adds the light rig of this name; of `auto`, if nothing lights the scene. Returns it, and the exposure at which it
/// shows white as white.
pub fn add_rig(
    scene: &mut Arc<Scene>,
    camera: &Camera,
    name: &str,
    reaches_surfaces: bool,
) -> PyResult<(Option<rig::LightRig>, Option<f32>)> {
    let mut rig = rig::LightRig::for_dark(reaches_surfaces);
    match name {
        "auto" if scene.bounds().is_empty() || !rig::is_dark(scene) => return Ok((None, None)),
        "auto" => {
            let text =
                format!("the scene has no light of its own: lit by the light rig {rig} (light_rig=studio|sun|none)");
            log::note(log::INFO, text);
        }
        name => rig.read(name).map_err(|what| PyValueError::new_err(format!("light_rig: {what}")))?,
    }
    let exposure = rig.add(Arc::make_mut(scene), camera, 1.0);
    Ok((Some(rig), exposure))
}
