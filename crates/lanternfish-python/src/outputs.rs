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
        for (kind, all) in self.kinds.iter().zip(&mut self.values) {
            let values = match (NAMES[*kind], image, aovs) {
                ("rgb", Some(image), _) => {
                    Values::Bytes(image.display.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect())
                }
                ("rgba", Some(image), _) => Values::Bytes(image.display.as_flattened().to_vec()),
                ("radiance", Some(image), _) => {
                    Values::Floats(image.radiance.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect())
                }
                ("semantic", _, Some(aovs)) => Values::Numbers(aovs.instance.iter().map(|id| class_of(*id)).collect()),
                ("depth", _, Some(aovs)) => Values::Floats(aovs.depth.clone()),
                ("distance", _, Some(aovs)) => Values::Floats(aovs.distance.clone()),
                ("position", _, Some(aovs)) => Values::Floats(aovs.position.as_flattened().to_vec()),
                ("normal", _, Some(aovs)) => Values::Floats(aovs.normal.as_flattened().to_vec()),
                ("albedo", _, Some(aovs)) => Values::Floats(aovs.albedo.as_flattened().to_vec()),
                ("motion", _, Some(aovs)) => Values::Floats(aovs.motion.as_flattened().to_vec()),
                ("instance", _, Some(aovs)) => Values::Numbers(aovs.instance.clone()),
                ("material", _, Some(aovs)) => Values::Numbers(aovs.material.clone()),
                (name, ..) => unreachable!("{name} was not drawn"),
            };
            all.extend(values);
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
