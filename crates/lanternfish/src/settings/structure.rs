//! The structures of the known tracers, as data.

use serde::{Deserializer, Serializer};

use crate::{
    rays::{Structure, Tracer},
    technique::data::{Read, write},
};

const NONE: &str = "none";

pub fn serialize<S: Serializer>(structure: &Structure, serializer: S) -> Result<S::Ok, S::Error> {
    write(structure, NONE, all(), serializer)
}

pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Structure, D::Error> {
    deserializer.deserialize_any(Read { kind: "structure", none: NONE, all: all() })
}

/// Every known structure, with default parameters.
pub fn all() -> Vec<Structure> {
    Tracer::all().into_iter().map(|tracer| tracer.structure(&Structure::NONE)).collect()
}
