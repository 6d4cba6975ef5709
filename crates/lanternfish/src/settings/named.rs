//! All that front ends offer, by name: settings, choices of techniques, and their parameters.

use super::{Settings, Structure, structure};
use crate::technique::{AnyTechnique, Choice, Kind, ParameterInfo, Range, data};

/// A setting, a choice of a technique, or a parameter of one: a flag, a key of a shot, a row of a report.
#[derive(Clone, Debug)]
pub struct AnyParameter {
    /// The flag of the kind of technique that it chooses or belongs to; `structure` for parameters of structures; empty for others.
    pub kind: &'static str,
    /// The name, values and help.
    pub info: ParameterInfo,
    /// The names of its values, with help, if it has names.
    pub names: Vec<(&'static str, &'static str)>,
    /// The default, if there is one.
    pub default: Option<String>,
}

/// A choice of any kind. The outer `None`: the kind has no such parameter.
trait AnyChoice {
    fn parameters(&self) -> Vec<AnyParameter>;
    fn value(&self, name: &str) -> Option<Option<String>>;
    /// Ignores parameters of other techniques of the kind.
    fn set(&mut self, name: &str, text: &str) -> Option<Result<(), String>>;
    /// As `set` on a technique that has the parameter.
    fn check(&self, name: &str, text: &str) -> Option<Result<(), String>>;
}

fn has<K: AnyTechnique + ?Sized>(choice: &Choice<K>, name: &str) -> bool {
    choice.technique().is_some_and(|technique| technique.parameters().iter().any(|(info, _)| info.name == name))
}

/// The parameters of these techniques, without duplicates.
fn of_techniques<K: AnyTechnique + ?Sized>(kind: &'static str, all: &[Choice<K>]) -> Vec<AnyParameter> {
    let mut found: Vec<AnyParameter> = Vec::new();
    for technique in all.iter().filter_map(Choice::technique) {
        for (info, names) in technique.parameters() {
            if found.iter().all(|other| other.info.name != info.name) {
                found.push(AnyParameter { kind, info, names, default: technique.get(info.name) });
            }
        }
    }
    found
}

impl<K: Kind + ?Sized> AnyChoice for Choice<K> {
    fn parameters(&self) -> Vec<AnyParameter> {
        let all = Self::all();
        let summaries = all.iter().filter_map(|choice| Some((choice.name(), choice.technique()?.summary())));
        let names = [(K::NONE_NAME, K::NONE_SUMMARY)].into_iter().chain(summaries).collect();
        let info = ParameterInfo {
            shows_default: K::HAS_ONE_DEFAULT,
            is_everyday: K::IS_EVERYDAY,
            ..ParameterInfo::new(K::FLAG, "NAME", Range::Names, K::HELP)
        };
        let choice = AnyParameter { kind: K::FLAG, info, names, default: Some(Self::default().name().to_owned()) };
        [vec![choice], of_techniques(K::FLAG, &all)].concat()
    }

    fn value(&self, name: &str) -> Option<Option<String>> {
        if name == K::FLAG {
            return Some(Some(self.name().to_owned()));
        }
        let own = || self.technique().and_then(|technique| technique.get(name));
        Self::all().iter().any(|other| has(other, name)).then(own)
    }

    fn set(&mut self, name: &str, text: &str) -> Option<Result<(), String>> {
        if name == K::FLAG {
            return Some(data::find(text, K::NONE_NAME, Self::all()).map(|chosen| *self = chosen));
        }
        self.value(name)?;
        Some(self.technique_mut().map_or(Ok(()), |technique| technique.set(name, text)))
    }

    fn check(&self, name: &str, text: &str) -> Option<Result<(), String>> {
        let first = Self::all().into_iter().find(|other| has(other, name));
        first.unwrap_or_else(|| self.clone()).set(name, text)
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

    fn value(&self, name: &str) -> Option<Option<String>> {
        let usual = structure_with(name)?;
        let chosen = if has(self, name) { self } else { &usual };
        chosen.technique().map(|technique| technique.get(name))
    }

    fn set(&mut self, name: &str, text: &str) -> Option<Result<(), String>> {
        let usual = structure_with(name)?;
        let mut chosen = if has(self, name) { self.clone() } else { usual.clone() };
        let result = chosen.technique_mut()?.set(name, text);
        *self = if chosen == usual { Self::NONE } else { chosen };
        Some(result)
    }

    fn check(&self, name: &str, text: &str) -> Option<Result<(), String>> {
        self.clone().set(name, text)
    }
}

impl Settings {
    fn choices(&mut self) -> [&mut dyn AnyChoice; 5] {
        [&mut self.direct, &mut self.culling, &mut self.indirect, &mut self.occlusion, &mut self.structure]
    }

    /// Everything that front ends offer. Names are unique.
    pub fn parameters() -> Vec<AnyParameter> {
        let mut usual = Self::default();
        let own = Self::PARAMETERS.iter().map(|parameter| {
            let (info, value) = (parameter.info, (parameter.of)(&mut usual));
            AnyParameter { kind: "", info, names: value.names(), default: value.text() }
        });
        let own: Vec<_> = own.collect();
        usual.choices().into_iter().flat_map(|choice| choice.parameters()).chain(own).collect()
    }

    /// The value of [`Self::PARAMETERS`], of a choice of technique or of a parameter, as text. The outer `None`: there is none of this
    /// name; the inner one: it is not set, or belongs to another technique than the chosen one.
    #[doc(hidden)]
    pub fn value(&self, name: &str) -> Option<Option<String>> {
        let mut settings = self.clone();
        if let Some(entry) = Self::PARAMETERS.iter().find(|entry| entry.info.name == name) {
            return Some((entry.of)(&mut settings).text());
        }
        settings.choices().into_iter().find_map(|choice| choice.value(name))
    }

    /// [`Self::value`], without the difference between its two `None`.
    pub fn get(&self, name: &str) -> Option<String> {
        self.value(name).flatten()
    }

    /// Sets one of [`Self::parameters`] from text, or returns the expected values. A parameter of a technique that is not chosen changes
    /// nothing.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), String> {
        if let Some(entry) = Self::PARAMETERS.iter().find(|entry| entry.info.name == name) {
            return entry.read(self, text);
        }
        let done = self.choices().into_iter().find_map(|choice| choice.set(name, text));
        done.unwrap_or_else(|| Err(format!("there is no setting {name}")))
    }

    /// The error of [`Self::set`] with this value if the technique is chosen that has the parameter.
    #[doc(hidden)]
    pub fn check(name: &str, text: &str) -> Result<(), String> {
        let mut settings = Self::default();
        let checked = settings.choices().into_iter().find_map(|choice| choice.check(name, text));
        checked.unwrap_or_else(|| settings.set(name, text))
    }
}
