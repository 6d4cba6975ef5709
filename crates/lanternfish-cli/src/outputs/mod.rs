//! `--outputs`: what the nearest surface at each pixel is, in files beside the image or in the image's file.

mod classes;
mod npz;

use std::path::{Path, PathBuf};

use lanternfish::Aovs;
use lanternfish_metrics::{ColorType, write_exr_channels, write_png};
use lanternfish_scene::{Scene, nearest};
use serde_json::json;

use self::npz::Array;
pub use self::{classes::Classes, npz::holds};
use crate::{
    error::{self, CliError},
    output::write_text,
};

/// A quantity of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    Depth,
    Distance,
    Position,
    Normal,
    Albedo,
    Motion,
    Instance,
    Material,
    Semantic,
}

/// All quantities: their names, and their layers and channels in an EXR file. Blender has the same layers, except for motion, distance and semantic.
const ALL: [(Quantity, &str, &str, &[&str]); 9] = [
    (Quantity::Depth, "depth", "Depth", &["Z"]),
    (Quantity::Distance, "distance", "Distance", &["Z"]),
    (Quantity::Position, "position", "Position", &["X", "Y", "Z"]),
    (Quantity::Normal, "normal", "Normal", &["X", "Y", "Z"]),
    (Quantity::Albedo, "albedo", "DiffCol", &["R", "G", "B"]),
    (Quantity::Motion, "motion", "Motion", &["X", "Y"]),
    (Quantity::Instance, "instance", "IndexOB", &["X"]),
    (Quantity::Material, "material", "IndexMA", &["X"]),
    (Quantity::Semantic, "semantic", "Semantic", &["X"]),
];

/// Those that a flag requests, in the order of the list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Quantities(pub Vec<Quantity>);

/// Parses names separated by commas.
pub fn quantities(text: &str) -> Result<Quantities, String> {
    let names = ALL.map(|(_, name, ..)| name);
    let quantity = |name: &str| {
        let found = ALL.iter().find(|(_, other, ..)| *other == name);
        let all = names.join(", ");
        found.map(|found| found.0).ok_or_else(|| {
            format!("{name:?}: expected some of {all}, separated by commas; did you mean {:?}?", nearest(name, &names))
        })
    };
    let mut quantities = text.split(',').map(|name| quantity(name.trim())).collect::<Result<Vec<_>, _>>()?;
    quantities.sort_by_key(|quantity| *quantity as usize);
    quantities.dedup();
    Ok(Quantities(quantities))
}

impl Quantity {
    /// Its name, which is that of its file beside a PNG image and of its array in an NPZ file.
    pub fn name(self) -> &'static str {
        ALL[self as usize].1
    }

    /// Its layer in an EXR file.
    pub fn layer(self) -> &'static str {
        ALL[self as usize].2
    }

    /// Number of its values for each pixel.
    pub fn channels(self) -> u64 {
        ALL[self as usize].3.len() as u64
    }

    /// True if a PNG file cannot hold it.
    pub fn needs_floats(self) -> bool {
        self == Self::Position
    }

    pub fn is_identity(self) -> bool {
        matches!(self, Self::Instance | Self::Material | Self::Semantic)
    }

    /// Its values, those of a pixel side by side.
    fn values(self, Surfaces { aovs, names, .. }: &Surfaces<'_>) -> Array {
        match self {
            Self::Depth => Array::Floats(aovs.depth.clone()),
            Self::Distance => Array::Floats(aovs.distance.clone()),
            Self::Position => Array::Floats(aovs.position.as_flattened().to_vec()),
            Self::Normal => Array::Floats(aovs.normal.as_flattened().to_vec()),
            Self::Albedo => Array::Floats(aovs.albedo.as_flattened().to_vec()),
            Self::Motion => Array::Floats(aovs.motion.as_flattened().to_vec()),
            Self::Instance => Array::Identities(aovs.instance.clone()),
            Self::Material => Array::Identities(aovs.material.clone()),
            Self::Semantic => Array::Identities(aovs.instance.iter().map(|id| names.class_of(*id)).collect()),
        }
    }
}

/// Names and semantic classes of a scene's instances, and names of its materials.
#[derive(Clone, Debug)]
pub struct Names {
    classes: Vec<u32>,
    /// As JSON.
    text: String,
}

impl Names {
    /// Of a scene. `classes` go before those of the file.
    pub fn of(scene: &Scene, classes: &Classes) -> Self {
        let class = |(index, name)| classes.of(name).or(scene.semantics.get(index).copied()).unwrap_or(0);
        let names = || scene.instances.iter().map(|instance| instance.name.as_str()).enumerate();
        let classes: Vec<u32> = names().map(class).collect();
        let instances: Vec<_> =
            names().map(|(i, name)| json!({ "id": i + 1, "name": name, "semantic": classes[i] })).collect();
        let materials = scene.materials.iter().enumerate();
        let materials: Vec<_> = materials.map(|(i, material)| json!({ "id": i + 1, "name": material.name })).collect();
        Self { classes, text: json!({ "instances": instances, "materials": materials }).to_string() }
    }

    /// The class of an instance by its number from 1 on; 0 for none.
    fn class_of(&self, id: u32) -> u32 {
        id.checked_sub(1).map_or(0, |index| self.classes[index as usize])
    }
}

/// Greatest whole number up to which floats hold all of them.
const MOST_EXACT: u32 = 1 << 24;

/// The requested quantities of an image.
pub struct Surfaces<'a> {
    pub aovs: &'a Aovs,
    pub names: &'a Names,
    pub quantities: &'a [Quantity],
}

impl Surfaces<'_> {
    fn size(&self) -> [u32; 2] {
        [self.aovs.width, self.aovs.height]
    }

    /// The names, if numbers for them are requested.
    fn names(&self) -> Option<&str> {
        self.quantities.iter().any(|quantity| quantity.is_identity()).then_some(&self.names.text)
    }

    /// Writes the channels of an image and the quantities into one EXR file.
    pub fn write_exr(
        &self,
        path: &Path,
        mut channels: Vec<(String, Vec<f32>)>,
        texts: &[(&str, &str)],
    ) -> Result<(), CliError> {
        for quantity in self.quantities {
            let (.., layer, letters) = ALL[*quantity as usize];
            let values = match quantity.values(self) {
                Array::Floats(values) => values,
                Array::Identities(values) => {
                    if let Some(id) = values.iter().find(|id| **id > MOST_EXACT) {
                        let what = format!("--outputs {}: {id} has no exact value in an .exr file", quantity.name());
                        return Err(CliError::new(what, "end the image's name with .npz"));
                    }
                    values.into_iter().map(|id| id as f32).collect()
                }
            };
            let channel = |first: usize| values.iter().skip(first).step_by(letters.len()).copied().collect();
            channels.extend((0..letters.len()).map(|i| (format!("{layer}.{}", letters[i]), channel(i))));
        }
        let names = self.names().map(|names| ("lanternfish.names", names));
        let texts: Vec<_> = texts.iter().copied().chain(names).collect();
        Ok(write_exr_channels(path, self.size().map(|side| side as usize), channels, &texts)?)
    }

    /// Its arrays in an NPZ file.
    fn arrays(&self) -> impl Iterator<Item = (&'static str, Array)> {
        self.quantities.iter().map(|quantity| (quantity.name(), quantity.values(self)))
    }

    /// Writes each quantity into the PNG file that `beside` names, and the names into a JSON file.
    pub fn write_png(&self, beside: impl Fn(&str) -> PathBuf) -> Result<(), CliError> {
        for quantity in self.quantities {
            let values = quantity.values(self);
            let number = |value: f32| value.round().clamp(0.0, 65535.0) as u16;
            let numbers: Vec<u16> = match (quantity, values) {
                // Of the flow that KITTI defines, the third channel tells where there is a surface.
                (Quantity::Motion, Array::Floats(values)) => {
                    let pixels = values.as_chunks::<2>().0.iter().zip(&self.aovs.instance);
                    let flow = |v: &f32| number(64.0 * v + 32768.0);
                    pixels.flat_map(|([x, y], id)| [flow(x), flow(y), u16::from(*id > 0)]).collect()
                }
                (Quantity::Normal, Array::Floats(values)) => {
                    let pixels = values.as_chunks::<3>().0.iter();
                    let unsigned =
                        |n: &[f32; 3]| if *n == [0.0; 3] { [0; 3] } else { n.map(|v| number(32767.5 * (v + 1.0))) };
                    pixels.flat_map(unsigned).collect()
                }
                (Quantity::Albedo, Array::Floats(values)) => values.iter().map(|v| number(65535.0 * v)).collect(),
                (_, Array::Floats(values)) => {
                    if values.iter().any(|metres| 1000.0 * metres > 65535.0) {
                        let name = quantity.name();
                        error::say(&format_args!(
                            "warning: {name}.png ends at 65.535 m, and some surfaces are farther: .exr and .npz hold all"
                        ));
                    }
                    values.iter().map(|metres| number(1000.0 * metres)).collect()
                }
                (_, Array::Identities(ids)) => {
                    let number = |id: &u32| u16::try_from(*id).map_err(|_| too_large(*quantity, *id));
                    ids.iter().map(number).collect::<Result<_, _>>()?
                }
            };
            let color = if numbers.len() == self.aovs.depth.len() { ColorType::Number16 } else { ColorType::Numbers16 };
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_be_bytes()).collect();
            write_png(&beside(&format!("{}.png", quantity.name())), self.size(), color, &bytes)?;
        }
        self.names().map_or(Ok(()), |names| write_text(&beside("names.json"), names))
    }
}

fn too_large(quantity: Quantity, id: u32) -> CliError {
    let what = format!("--outputs {}: {id} is more than the 65,535 that a .png holds", quantity.name());
    CliError::new(what, "end the image's name with .exr or .npz")
}

/// Writes an image's radiance, red, green and blue, its opacity if there is any, and the quantities into one NPZ file. `size`: width and height, pixels.
pub fn write_npz(
    path: &Path,
    size: [u32; 2],
    image: Vec<f32>,
    alpha: Option<Vec<f32>>,
    surfaces: Option<&Surfaces<'_>>,
) -> Result<(), CliError> {
    let arrays = surfaces.into_iter().flat_map(Surfaces::arrays);
    let alpha = alpha.map(|alpha| ("alpha", Array::Floats(alpha)));
    let arrays: Vec<_> = [("image", Array::Floats(image))].into_iter().chain(alpha).chain(arrays).collect();
    npz::write(path, size, &arrays, surfaces.and_then(Surfaces::names))
}

#[cfg(test)]
#[test]
fn quantities_are_in_order_and_known() {
    assert!(ALL.iter().enumerate().all(|(index, (quantity, ..))| *quantity as usize == index));
    assert_eq!(quantities("normal, depth,normal"), Ok(Quantities(vec![Quantity::Depth, Quantity::Normal])));
    let error = quantities("depth,norml").unwrap_err();
    assert!(
        error.contains("depth, distance, position, normal") && error.contains("did you mean \"normal\""),
        "{error}"
    );
}
