//! The arrays of an image: what [`RenderedImage`] and [`Aovs`] hold, of several images one after another.

use lanternfish::{Aovs, RenderedImage};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::{exceptions::PyValueError, prelude::*};

/// Their names.
pub const NAMES: [&str; 12] = [
    "rgb", "rgba", "radiance", "depth", "distance", "position", "normal", "albedo", "motion", "instance", "material",
    "semantic",
];

/// The first of [`NAMES`] that are drawn without light.
const FIRST_OF_SURFACES: usize = 3;

enum Values {
    Bytes(Vec<u8>),
    Floats(Vec<f32>),
    Numbers(Vec<u32>),
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::Bytes(values) => values.len(),
            Self::Floats(values) => values.len(),
            Self::Numbers(values) => values.len(),
        }
    }

    fn extend(&mut self, more: Self) {
        match (self, more) {
            // Without a copy, for a single image.
            (all, more) if all.len() == 0 => *all = more,
            (Self::Bytes(all), Self::Bytes(more)) => all.extend(more),
            (Self::Floats(all), Self::Floats(more)) => all.extend(more),
            (Self::Numbers(all), Self::Numbers(more)) => all.extend(more),
            _ => unreachable!("an output has one type"),
        }
    }
}

/// The requested arrays.
pub struct Outputs {
    /// Indices of names.
    kinds: Vec<usize>,
    values: Vec<Values>,
}

impl Outputs {
    pub fn new(names: &[String]) -> PyResult<Self> {
        let kind = |name: &String| {
            let near = lanternfish_scene::nearest(name, &NAMES);
            let all = NAMES.join(", ");
            let unknown =
                || PyValueError::new_err(format!("outputs: {name:?}: expected some of {all}; did you mean {near:?}?"));
            NAMES.iter().position(|known| known == name).ok_or_else(unknown)
        };
        let kinds = names.iter().map(kind).collect::<PyResult<Vec<_>>>()?;
        let values = kinds.iter().map(|_| Values::Bytes(Vec::new())).collect();
        Ok(Self { kinds, values })
    }

    pub fn have_light(&self) -> bool {
        self.kinds.iter().any(|kind| *kind < FIRST_OF_SURFACES)
    }

    pub fn have_display(&self) -> bool {
        self.kinds.iter().any(|kind| *kind < 2)
    }

    pub fn have_surfaces(&self) -> bool {
        self.kinds.iter().any(|kind| *kind >= FIRST_OF_SURFACES)
    }

    /// Adds an image. `class_of`: the semantic class of an instance by its number from 1 on.
    pub fn add(&mut self, image: Option<&RenderedImage>, aovs: Option<&Aovs>, class_of: impl Fn(u32) -> u32) {
        use Values::{Bytes, Floats, Numbers};
        for (kind, all) in self.kinds.iter().zip(&mut self.values) {
            let (name, aovs) = (NAMES[*kind], || aovs.expect("they were drawn"));
            let image = || image.expect("it was drawn");
            all.extend(match name {
                "rgb" => Bytes(image().display.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()),
                "rgba" => Bytes(image().display.as_flattened().to_vec()),
                "radiance" => Floats(image().radiance.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()),
                "depth" => Floats(aovs().depth.clone()),
                "distance" => Floats(aovs().distance.clone()),
                "position" => Floats(aovs().position.as_flattened().to_vec()),
                "normal" => Floats(aovs().normal.as_flattened().to_vec()),
                "albedo" => Floats(aovs().albedo.as_flattened().to_vec()),
                "motion" => Floats(aovs().motion.as_flattened().to_vec()),
                "instance" => Numbers(aovs().instance.clone()),
                "material" => Numbers(aovs().material.clone()),
                "semantic" => Numbers(aovs().instance.iter().map(|id| class_of(*id)).collect()),
                _ => unreachable!("{name} is no output"),
            });
        }
    }

    /// The arrays by name: `count` images of `height` rows, `width` columns, and the values of a pixel.
    pub fn arrays(
        self,
        py: Python<'_>,
        [count, height, width]: [usize; 3],
    ) -> PyResult<Vec<(&'static str, Bound<'_, PyAny>)>> {
        let array = |(kind, values): (usize, Values)| {
            let channels = values.len() / (count * height * width).max(1);
            let shape = [count, height, width, channels];
            let shape = &shape[..if channels == 1 { 3 } else { 4 }];
            let array = match values {
                Values::Bytes(values) => PyArray1::from_vec(py, values).reshape(shape)?.into_any(),
                Values::Floats(values) => PyArray1::from_vec(py, values).reshape(shape)?.into_any(),
                Values::Numbers(values) => PyArray1::from_vec(py, values).reshape(shape)?.into_any(),
            };
            Ok((NAMES[kind], array))
        };
        self.kinds.into_iter().zip(self.values).map(array).collect()
    }
}
