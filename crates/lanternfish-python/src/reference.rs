//! The path tracer, and comparisons of images.

use std::sync::Arc;

use lanternfish::settings::Preset;
use lanternfish_metrics::{HdrFlip, PIXELS_PER_DEGREE, Pair, RgbImage};
use lanternfish_reference::{Film, Settings, Tracer};
use lanternfish_scene::{Named as _, near_plane};
use numpy::{PyArray1, PyArrayMethods as _, PyReadonlyArray3, PyUntypedArrayMethods as _};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{
    check_process, failed, log,
    objects::CameraObject,
    scene::SceneData,
    settings::{add_rig, chosen_settings},
    step,
};

/// Path-traced radiance, and what the surface at each pixel's centre is. `values`: settings of lights and materials.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "Python calls it by position, from one place")]
pub fn reference<'py>(
    py: Python<'py>,
    scene: &SceneData,
    camera: CameraObject,
    size: [u32; 2],
    samples: u64,
    seed: u64,
    max_depth: u32,
    light_rig: &str,
    values: Vec<(String, String)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    check_process()?;
    let mut scene = Arc::clone(&scene.scene);
    let camera = camera.camera(near_plane(&scene.bounds()));
    camera.validate().map_err(|what| PyValueError::new_err(format!("camera: {what}")))?;
    let rendered = chosen_settings(Preset::default().name(), &values)?;
    let settings = Settings {
        max_depth,
        materials: rendered.materials.model,
        attenuation: rendered.lights.attenuation,
        attenuation_near_radius: rendered.lights.near_radius,
        attenuation_coefficients: rendered.lights.coefficients,
        range_threshold: rendered.lights.range_threshold,
        light_radius: rendered.lights.radius,
        sun_diameter: rendered.lights.sun_diameter,
        seed,
        ..Settings::default()
    };
    let [width, height] = size.map(|side| side as usize);
    let traced = py.detach(|| {
        add_rig(&mut scene, &camera, light_rig, true)?;
        let tracer = Tracer::new(&scene, settings).map_err(failed)?;
        let mut film = Film::new(size).map_err(failed)?;
        for sample in 0..samples {
            tracer.render(&camera, &mut film, 1);
            step(progress.as_ref(), sample as usize + 1, samples as usize)?;
        }
        Ok::<_, PyErr>((film.mean(), tracer.first_hits(&camera, width, height, [0.5; 2])))
    });
    log::tell(py)?;
    let (radiance, hits) = traced?;
    let arrays = PyDict::new(py);
    arrays.set_item("radiance", PyArray1::from_vec(py, radiance.into_flattened()).reshape([height, width, 3])?)?;
    let instances = hits.iter().map(|hit| hit.map_or(0, |hit| hit.0 + 1)).collect();
    let materials = hits.iter().map(|hit| hit.map_or(0, |hit| hit.1 + 1)).collect();
    for (name, ids) in [("instance", instances), ("material", materials)] {
        arrays.set_item(name, PyArray1::<u32>::from_vec(py, ids).reshape([height, width])?)?;
    }
    let distances: Vec<f32> = hits.iter().map(|hit| hit.map_or(0.0, |hit| hit.2)).collect();
    arrays.set_item("distance", PyArray1::from_vec(py, distances).reshape([height, width])?)?;
    Ok(arrays)
}

/// Errors of an image against a reference: both linear, or both display values from 0 to 1.
#[pyfunction]
pub fn compare<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    reference: PyReadonlyArray3<'py, f32>,
    is_display: bool,
) -> PyResult<Bound<'py, PyDict>> {
    check_process()?;
    let rgb = |array: &PyReadonlyArray3<'py, f32>| {
        let pixels = array.as_slice()?.as_chunks::<3>().0.to_vec();
        RgbImage::new(array.shape()[1], array.shape()[0], pixels).map_err(failed)
    };
    let invalid = |error: lanternfish_metrics::MetricsError| PyValueError::new_err(error.to_string());
    let pair = Pair::new(rgb(&image)?, rgb(&reference)?).map_err(invalid)?;
    let measures = PyDict::new(py);
    let flip = py.detach(|| match is_display {
        true => pair.flip_ldr(PIXELS_PER_DEGREE).map(|map| pair.mean_of(&map)),
        false => pair.flip_hdr(&HdrFlip::default()).map(|hdr| pair.mean_of(&hdr.map)),
    });
    measures.set_item("flip", flip.map_err(invalid)?)?;
    let errors = pair.errors();
    measures.set_item("relmse", errors.relative_mse)?;
    measures.set_item("mse", errors.mse)?;
    measures.set_item("energy", errors.energy_ratio)?;
    if is_display {
        measures.set_item("psnr", pair.psnr())?;
        measures.set_item("ssim", pair.ssim().ok())?;
    }
    Ok(measures)
}
