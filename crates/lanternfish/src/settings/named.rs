//! All that front ends offer, by name: settings, choices of techniques, and their parameters.

use lanternfish_scene::Value;

use super::{Settings, Structure, structure};
use crate::technique::{AnyTechnique, Choice, Kind, ParameterInfo, Range};

/// A setting, a choice of a technique, or a parameter of one: a flag, a key of a shot, a row of a report.
#[derive(Clone, Debug)]
pub struct AnyParameter {
    /// The flag of the kind of technique that it chooses or belongs to; `structure` for parameters of structures; empty
    /// for others.
    pub kind: &'static str,
    /// The name, values and help.
    pub info: ParameterInfo,
    /// The default.
    pub value: Value,
}

impl AnyParameter {
    /// The names of its values, with help, if it has names.
    #[doc(hidden)]
    pub fn names(&self) -> Vec<(&'static str, &'static str)> {
        self.value.names()
    }

    /// A value from text; the error says what was expected.
    #[doc(hidden)]
    pub fn read(&self, text: &str) -> Result<Value, String> {
        self.info.read(&self.value, text)
    }
}

/// A choice of any kind. `None`: the kind has no such parameter; the inner one: the chosen technique has not.
trait AnyChoice {
    fn parameters(&self) -> Vec<AnyParameter>;
    fn value(&self, name: &str) -> Option<Option<Value>>;
    /// Ignores parameters of other techniques of the kind.
    fn take(&mut self, name: &str, value: &Value) -> Option<()>;
}

fn has<K: AnyTechnique + ?Sized>(choice: &Choice<K>, name: &str) -> bool {
    choice.technique().is_some_and(|technique| technique.value(name).is_some())
}

/// The parameters of these techniques, without duplicates.
fn of_techniques<K: AnyTechnique + ?Sized>(kind: &'static str, all: &[Choice<K>]) -> Vec<AnyParameter> {
    let mut found: Vec<AnyParameter> = Vec::new();
    for (info, value) in all.iter().filter_map(Choice::technique).flat_map(AnyTechnique::parameters) {
        if found.iter().all(|other| other.info.name != info.name) {
            found.push(AnyParameter { kind, info, value });
        }
    }
    found
}

impl<K: Kind + ?Sized> AnyChoice for Choice<K> {
    fn parameters(&self) -> Vec<AnyParameter> {
        let info = ParameterInfo {
            shows_default: K::HAS_ONE_DEFAULT,
            is_everyday: K::IS_EVERYDAY,
            ..ParameterInfo::new(K::FLAG, "NAME", Range::Names, K::HELP)
        };
        let choice = AnyParameter { kind: K::FLAG, info, value: Value::of(&Self::default()) };
        [vec![choice], of_techniques(K::FLAG, &Self::all())].concat()
    }

    fn value(&self, name: &str) -> Option<Option<Value>> {
        if name == K::FLAG {
            // With default parameters, which have values of their own.
            let named = Self::named(self.name());
            return Some(Some(Value::of(named.as_ref().unwrap_or(self))));
        }
        let own = || self.technique().and_then(|technique| technique.value(name));
        Self::all().iter().any(|other| has(other, name)).then(own)
    }

    fn take(&mut self, name: &str, value: &Value) -> Option<()> {
        if name == K::FLAG {
            self.clone_from(value.get()?);
            return Some(());
        }
        AnyChoice::value(self, name)?;
        if let Some(technique) = self.technique_mut() {
            technique.take(name, value);
        }
        Some(())
    }
}

/// The first structure that has a parameter of this name.
fn structure_with(name: &str) -> Option<Structure> {
    structure::all().into_iter().find(|structure| has(structure, name))
}

/// No structure means the default parameters of each.
impl AnyChoice for Structure {
    fn parameters(&self) -> Vec<AnyParameter> {
        of_techniques("structure", &structure::all())
    }

    fn value(&self, name: &str) -> Option<Option<Value>> {
        let usual = structure_with(name)?;
        let chosen = if has(self, name) { self } else { &usual };
        chosen.technique().map(|technique| technique.value(name))
    }

    fn take(&mut self, name: &str, value: &Value) -> Option<()> {
        let usual = structure_with(name)?;
        let mut chosen = if has(self, name) { self.clone() } else { usual.clone() };
        chosen.technique_mut()?.take(name, value);
        *self = if chosen == usual { Self::NONE } else { chosen };
        Some(())
    }
}

impl Settings {
    fn choices(&mut self) -> [&mut dyn AnyChoice; 6] {
        let Self { direct, culling, indirect, caustics, occlusion, structure, .. } = self;
        [direct, culling, indirect, caustics, occlusion, structure]
    }

    /// Everything that front ends offer. Names are unique.
    pub fn parameters() -> Vec<AnyParameter> {
        let mut usual = Self::default();
        let own = Self::PARAMETERS.iter().map(|entry| {
            let value = Value::of((entry.of)(&mut usual));
            AnyParameter { kind: "", info: entry.info, value }
        });
        let own: Vec<_> = own.collect();
        usual.choices().into_iter().flat_map(|choice| choice.parameters()).chain(own).collect()
    }

    /// The value of one of [`Self::parameters`]. `None`: there is none of this name; the inner one: it belongs to
    /// another technique than the chosen one.
    #[doc(hidden)]
    pub fn value(&self, name: &str) -> Option<Option<Value>> {
        let mut settings = self.clone();
        if let Some(entry) = Self::PARAMETERS.iter().find(|entry| entry.info.name == name) {
            return Some(Some(Value::of((entry.of)(&mut settings))));
        }
        settings.choices().into_iter().find_map(|choice| choice.value(name))
    }

    /// The value of one of [`Self::parameters`] as text, if it is set and belongs to a chosen technique.
    pub fn get(&self, name: &str) -> Option<String> {
        self.value(name)??.text()
    }

    /// Sets one of [`Self::parameters`] from text, or returns the expected values. A parameter of a technique that is
    /// not chosen changes nothing.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), String> {
        let named = Self::parameters().into_iter().find(|entry| entry.info.name == name);
        let value = named.ok_or_else(|| format!("there is no setting {name}"))?.read(text)?;
        self.take(name, &value);
        Ok(())
    }

    /// Sets one of [`Self::parameters`] to a value that was read for this name, as [`Self::set`].
    pub(super) fn take(&mut self, name: &str, value: &Value) {
        if let Some(entry) = Self::PARAMETERS.iter().find(|entry| entry.info.name == name) {
            return (entry.of)(self).assign(&**value);
        }
        let taken = self.choices().into_iter().find_map(|choice| choice.take(name, value));
        assert!(taken.is_some(), "{name}: no setting takes {value:?}");
    }
}
