//! Techniques as data: a name, or a table of parameters under the name, as the technique declares them.
//!
//! `"sampled"`, or `{ "sampled": { "indirect-rays": 8 } }`; missing parameters have the technique's defaults.

use std::fmt;

use lanternfish_scene::nearest;
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, DeserializeSeed, Error as _, MapAccess, SeqAccess, Visitor},
    ser::{Error as _, SerializeMap},
};

use super::{AnyTechnique, Choice, Kind, Range};

impl<K: Kind + ?Sized> Serialize for Choice<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        write(self, K::NONE_NAME, Choice::all(), serializer)
    }
}

impl<'de, K: Kind + ?Sized> Deserialize<'de> for Choice<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Read { kind: K::FLAG, none: K::NONE_NAME, all: Choice::all() })
    }
}

/// Writes a choice. Values that no parameter holds are an error: they would be lost.
pub(crate) fn write<K: AnyTechnique + ?Sized, S: Serializer>(
    choice: &Choice<K>,
    none: &str,
    all: Vec<Choice<K>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let Some(technique) = choice.technique() else { return serializer.serialize_str(none) };
    let mut read = all.into_iter().find(|other| name_of(other) == Some(technique.name())).unwrap_or(choice.clone());
    for (info, _) in technique.parameters() {
        if let (Some(text), Some(read)) = (technique.get(info.name), read.technique_mut()) {
            read.set(info.name, &text).map_err(S::Error::custom)?;
        }
    }
    if read != *choice {
        return Err(S::Error::custom(format!("{technique:?} has values without a parameter, which data cannot hold")));
    }
    let mut map = serializer.serialize_map(Some(1))?;
    map.serialize_entry(technique.name(), &Parameters(technique))?;
    map.end()
}

/// The set parameters of a technique, by name.
struct Parameters<'t, K: ?Sized>(&'t K);

impl<K: AnyTechnique + ?Sized> Serialize for Parameters<'_, K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (info, _) in self.0.parameters() {
            let Some(text) = self.0.get(info.name) else { continue };
            match info.range {
                Range::Switch(..) => map.serialize_entry(info.name, &(text == "on"))?,
                _ => match (text.parse::<u32>(), text.parse::<f32>()) {
                    (Ok(number), _) => map.serialize_entry(info.name, &number)?,
                    (_, Ok(number)) => map.serialize_entry(info.name, &number)?,
                    _ => map.serialize_entry(info.name, &text)?,
                },
            }
        }
        map.end()
    }
}

/// Reads one of the techniques of a kind, or the name of none.
pub(crate) struct Read<K: ?Sized> {
    pub kind: &'static str,
    pub none: &'static str,
    pub all: Vec<Choice<K>>,
}

impl<K: AnyTechnique + ?Sized> Read<K> {
    fn named<E: de::Error>(self, name: &str) -> Result<Choice<K>, E> {
        let wrong = |why| E::custom(format!("no {} technique {name:?}: {why}", self.kind));
        find(name, self.none, self.all).map_err(wrong)
    }
}

/// The choice of this name. The error names all, and the nearest.
pub(crate) fn find<K: AnyTechnique + ?Sized>(
    name: &str,
    none: &'static str,
    all: Vec<Choice<K>>,
) -> Result<Choice<K>, String> {
    let names: Vec<_> = [none].into_iter().chain(all.iter().filter_map(name_of)).collect();
    if name == none {
        return Ok(Choice::NONE);
    }
    let (known, near) = (names.join(", "), nearest(name, &names));
    let found = all.into_iter().find(|choice| name_of(choice) == Some(name));
    found.ok_or_else(|| format!("expected one of {known}; did you mean {near:?}?"))
}

fn name_of<K: AnyTechnique + ?Sized>(choice: &Choice<K>) -> Option<&'static str> {
    choice.technique().map(AnyTechnique::name)
}

impl<'de, K: AnyTechnique + ?Sized> Visitor<'de> for Read<K> {
    type Value = Choice<K>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the name of a technique for `{}`, or one table of parameters under its name", self.kind)
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<Choice<K>, E> {
        self.named(name)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Choice<K>, A::Error> {
        let expected = format!("expected one technique for `{}`", self.kind);
        let name: String = map.next_key()?.ok_or_else(|| A::Error::custom(&expected))?;
        let mut choice = self.named(&name)?;
        match choice.technique_mut() {
            Some(technique) => map.next_value_seed(ReadParameters(technique))?,
            None => return Err(A::Error::custom(format!("{name:?} has no parameters: write the name alone"))),
        }
        match map.next_key::<String>()? {
            Some(second) => Err(A::Error::custom(format!("{expected}, found {name:?} and {second:?}"))),
            None => Ok(choice),
        }
    }
}

/// Sets parameters of a technique.
struct ReadParameters<'t, K: ?Sized>(&'t mut K);

impl<'de, K: AnyTechnique + ?Sized> DeserializeSeed<'de> for ReadParameters<'_, K> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de, K: AnyTechnique + ?Sized> Visitor<'de> for ReadParameters<'_, K> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a table of the parameters of {}", self.0.name())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let known: Vec<_> = self.0.parameters().iter().map(|(info, _)| info.name).collect();
        while let Some(name) = map.next_key::<String>()? {
            if !known.contains(&name.as_str()) {
                let near = nearest(&name, &known);
                let what = format!("{} has no parameter {name:?}; did you mean {near:?}?", self.0.name());
                return Err(A::Error::custom(what));
            }
            let Scalar(text) = map.next_value()?;
            self.0.set(&name, &text).map_err(|why| A::Error::custom(format!("{name} = {text}: {why}")))?;
        }
        Ok(())
    }
}

/// A number, a switch, a string or a list of numbers, as the text that [`Setting`](lanternfish_scene::Setting) reads.
struct Scalar(String);

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ReadScalar)
    }
}

struct ReadScalar;

impl<'de> Visitor<'de> for ReadScalar {
    type Value = Scalar;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, true or false, a string or a list of numbers")
    }

    fn visit_bool<E: de::Error>(self, is_on: bool) -> Result<Scalar, E> {
        Ok(Scalar(if is_on { "on" } else { "off" }.to_owned()))
    }

    fn visit_i64<E: de::Error>(self, number: i64) -> Result<Scalar, E> {
        Ok(Scalar(number.to_string()))
    }

    fn visit_u64<E: de::Error>(self, number: u64) -> Result<Scalar, E> {
        Ok(Scalar(number.to_string()))
    }

    fn visit_f64<E: de::Error>(self, number: f64) -> Result<Scalar, E> {
        Ok(Scalar(number.to_string()))
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Scalar, E> {
        Ok(Scalar(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Scalar, A::Error> {
        let mut texts = Vec::new();
        while let Some(Scalar(text)) = list.next_element()? {
            texts.push(text);
        }
        Ok(Scalar(texts.join(",")))
    }
}

/// Values that are numbers, lists of numbers or words, as [`Setting`](lanternfish_scene::Setting) writes and reads them.
pub(crate) mod text {
    use lanternfish_scene::Setting;

    use super::*;

    pub fn serialize<T: Setting, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
        let text = value.text().unwrap_or_default();
        let numbers: Option<Vec<f32>> = text.split(',').map(|number| number.parse().ok()).collect();
        match numbers.as_deref() {
            Some([number]) => serializer.serialize_f32(*number),
            Some(numbers) => numbers.serialize(serializer),
            None => serializer.serialize_str(&text),
        }
    }

    pub fn deserialize<'de, T: Setting + Default, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
        let (Scalar(text), mut value) = (Scalar::deserialize(deserializer)?, T::default());
        value.read(&text).map_err(|why| D::Error::custom(format!("{text}: {why}")))?;
        Ok(value)
    }
}
