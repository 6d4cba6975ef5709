//! The arrays of an image: what [`RenderedImage`] and [`Aovs`] hold.

use std::ops::Range;

use lanternfish::{Aovs, RenderedImage};
use numpy::PyArray1;
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

/// Their names.
pub const NAMES: [&str; 12] = [
    "rgb", "rgba", "radiance", "depth", "distance", "position", "normal", "albedo", "motion", "instance", "material",
    "semantic",
];

/// The first of [`NAMES`] are display colours, then radiance follows; the rest is drawn without light.
pub const DISPLAY: Range<usize> = 0..2;
pub const LIT: Range<usize> = 0..3;
pub const SURFACES: Range<usize> = LIT.end..NAMES.len();

/// The requested arrays, as indices of [`NAMES`].
pub struct Outputs(Vec<usize>);

impl Outputs {
    pub fn new(names: &[String]) -> PyResult<Self> {
        let index = |name: &String| {
            let (all, near) = (NAMES.join(", "), lanternfish_scene::nearest(name, &NAMES));
            let unknown =
                || PyValueError::new_err(format!("outputs: {name:?}: expected some of {all}; did you mean {near:?}?"));
            NAMES.iter().position(|known| known == name).ok_or_else(unknown)
        };
        Ok(Self(names.iter().map(index).collect::<PyResult<_>>()?))
    }

    pub fn have(&self, some: Range<usize>) -> bool {
        self.0.iter().any(|index| some.contains(index))
    }

    /// The arrays of an image by name: rows, columns, and the values of a pixel if it has several. `classes`: the
    /// semantic class of each instance.
    pub fn arrays(
        &self,
        [width, height]: [u32; 2],
        image: Option<&RenderedImage>,
        surfaces: Option<&Aovs>,
        classes: &[u32],
    ) -> PyResult<Py<PyDict>> {
        let (lit, aovs) = (|| image.expect("it was drawn"), || surfaces.expect("they were drawn"));
        let class = |id: &u32| id.checked_sub(1).and_then(|index| classes.get(index as usize)).copied().unwrap_or(0);
        Python::attach(|py| {
            let bytes = |values| PyArray1::<u8>::from_vec(py, values).into_any();
            let floats = |values| PyArray1::<f32>::from_vec(py, values).into_any();
            let numbers = |values| PyArray1::<u32>::from_vec(py, values).into_any();
            let arrays = PyDict::new(py);
            for name in self.0.iter().map(|index| NAMES[*index]) {
                let array = match name {
                    "rgb" => bytes(lit().display.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()),
                    "rgba" => bytes(lit().display.as_flattened().to_vec()),
                    "radiance" => floats(lit().radiance.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()),
                    "depth" => floats(aovs().depth.clone()),
                    "distance" => floats(aovs().distance.clone()),
                    "position" => floats(aovs().position.as_flattened().to_vec()),
                    "normal" => floats(aovs().normal.as_flattened().to_vec()),
                    "albedo" => floats(aovs().albedo.as_flattened().to_vec()),
                    "motion" => floats(aovs().motion.as_flattened().to_vec()),
                    "instance" => numbers(aovs().instance.clone()),
                    "material" => numbers(aovs().material.clone()),
                    "semantic" => numbers(aovs().instance.iter().map(class).collect()),
                    _ => unreachable!("{name} is no output"),
                };
                let channels = array.len()? / (width as usize * height as usize);
                let shape = [height as usize, width as usize, channels];
                let shape = &shape[..if channels == 1 { 2 } else { 3 }];
                arrays.set_item(name, array.call_method1("reshape", (shape,))?)?;
            }
            Ok(arrays.unbind())
        })
    }
}
