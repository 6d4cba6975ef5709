//! Techniques: interchangeable algorithms for one task, selected by the settings.
//!
//! A kind of technique is a task with a trait: [`CullingTechnique`](crate::light_culling::CullingTechnique),
//! [`IndirectTechnique`](crate::indirect::IndirectTechnique),
//! [`OcclusionTechnique`](crate::occlusion::OcclusionTechnique). A technique is a type that holds its parameters and
//! implements the trait of its kind. It declares its name, its parameters and its shaders once ([`Technique`]). Flags,
//! shot keys, panels, help and reports are generated from that. A [`Choice`] is a technique of a kind, or none.
//!
//! A technique may belong to another crate: any type that implements the traits can be selected. [`Choice::register`]
//! adds it to the names that flags, shots and panels accept and list.

pub(crate) mod data;
mod declared;

use std::{
    any::Any,
    fmt,
    sync::{PoisonError, RwLock},
};

use lanternfish_scene::{Setting, Value};

use crate::shaders::Shaders;

/// A technique with its parameters. `Default` gives their default values.
pub trait Technique: Clone + Default + PartialEq + fmt::Debug + Send + Sync + 'static {
    /// The name: a value of the kind's flag.
    const NAME: &'static str;
    /// One line of help.
    const SUMMARY: &'static str;
    /// The parameters. Techniques of a kind may have a parameter of the same name; one flag then sets it in both.
    const PARAMETERS: &'static [Parameter<Self>];
    /// The shaders of the technique's folder.
    const SHADERS: Shaders;
}

/// One parameter of a technique, or one setting of a renderer.
#[derive(Clone, Copy, Debug)]
pub struct Parameter<T> {
    /// The name, values and help.
    pub info: ParameterInfo,
    /// Access to the value.
    pub of: fn(&mut T) -> &mut dyn Setting,
}

/// The name, values and help of a parameter: for a flag, a shot key, a panel row or a report row.
#[derive(Clone, Copy, Debug)]
pub struct ParameterInfo {
    /// The name.
    pub name: &'static str,
    /// The placeholder for the value in help: `N`, `METRES`.
    pub value: &'static str,
    /// The valid values.
    pub range: Range,
    /// The meaning, and the effect of a higher value: a summary, then paragraphs for long help. It may be that of a doc
    /// comment: front ends show [`Self::text`].
    pub help: &'static str,
    /// True if help states the default. False if the default depends on another flag.
    pub shows_default: bool,
    /// True if short help lists its flag.
    pub is_everyday: bool,
    /// True if panels show it.
    pub has_panel: bool,
}

impl ParameterInfo {
    /// A parameter without a default in help, in long help and in panels.
    #[doc(hidden)]
    pub const fn new(name: &'static str, value: &'static str, range: Range, help: &'static str) -> Self {
        Self { name, value, range, help, shows_default: false, is_everyday: false, has_panel: true }
    }

    /// The help, each paragraph in one line.
    #[doc(hidden)]
    pub fn text(&self) -> String {
        let words = |paragraph: &str| paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
        self.help.trim().split("\n\n").map(words).collect::<Vec<_>>().join("\n\n")
    }

    /// A value from text, of the type of a value of the parameter; the error says what was expected.
    #[doc(hidden)]
    pub fn read(&self, any: &Value, text: &str) -> Result<Value, String> {
        self.range.check(text)?;
        any.read(text)
    }
}

impl<T> Parameter<T> {
    /// A parameter without a default in help.
    pub const fn new(
        name: &'static str,
        value: &'static str,
        range: Range,
        help: &'static str,
        of: fn(&mut T) -> &mut dyn Setting,
    ) -> Self {
        Self { info: ParameterInfo::new(name, value, range, help), of }
    }

    /// The parameter with its default in help.
    pub const fn with_default(self) -> Self {
        Self { info: ParameterInfo { shows_default: true, ..self.info }, of: self.of }
    }

    /// The parameter in short help too.
    #[doc(hidden)]
    pub const fn everyday(self) -> Self {
        Self { info: ParameterInfo { is_everyday: true, ..self.info }, of: self.of }
    }

    /// The parameter without a row in panels.
    #[doc(hidden)]
    pub const fn without_panel(self) -> Self {
        Self { info: ParameterInfo { has_panel: false, ..self.info }, of: self.of }
    }
}

/// The valid values of a parameter.
#[derive(Clone, Copy, Debug)]
pub enum Range {
    /// An integer from the first to the second value.
    Count(u32, u32),
    /// A number above 0.
    Positive,
    /// A number from the first to the second value, which may be infinite.
    Number(f32, f32),
    /// One of the names of the parameter's type.
    Names,
    /// One of the names of the parameter's type, which are integers.
    Numbers,
    /// A switch, with the meanings of on and off.
    Switch(&'static str, &'static str),
    /// Text that the parameter's type parses.
    Text,
}

impl Range {
    /// An error with the expected values if a number is not one of them.
    #[doc(hidden)]
    pub fn check(self, text: &str) -> Result<(), String> {
        let text = text.trim();
        match self {
            Self::Count(least, most) if !text.parse().is_ok_and(|number| (least..=most).contains(&number)) => {
                Err(format!("expected a whole number from {least} to {most}"))
            }
            Self::Positive if !text.parse().is_ok_and(|number: f32| number > 0.0 && number.is_finite()) => {
                Err("expected a number above 0".to_owned())
            }
            Self::Number(least, most)
                if !text.parse().is_ok_and(|number: f32| number.is_finite() && (least..=most).contains(&number)) =>
            {
                let most = if most.is_finite() { format!("to {most}") } else { "or above".to_owned() };
                Err(format!("expected a number, {least} {most}"))
            }
            _ => Ok(()),
        }
    }
}

/// A technique behind `dyn`. Every [`Technique`] implements it.
pub trait AnyTechnique: fmt::Debug + Send + Sync + 'static {
    /// [`Technique::NAME`].
    fn name(&self) -> &'static str;
    /// [`Technique::SUMMARY`].
    fn summary(&self) -> &'static str;
    /// [`Technique::SHADERS`].
    #[doc(hidden)]
    fn shaders(&self) -> Shaders;
    /// The parameters and their values.
    fn parameters(&self) -> Vec<(ParameterInfo, Value)>;
    /// Sets a parameter to a value that was read for this name. Does nothing if the technique has no such parameter.
    #[doc(hidden)]
    fn take(&mut self, parameter: &str, value: &Value);
    /// The value of a parameter; none if the technique has no such parameter.
    #[doc(hidden)]
    fn value(&self, parameter: &str) -> Option<Value>;
    /// A parameter as text; none if the technique has no such parameter or it is unset.
    fn get(&self, parameter: &str) -> Option<String> {
        self.value(parameter)?.text()
    }
    /// Sets a parameter from text, or returns the expected values. Does nothing if the technique has no such parameter.
    fn set(&mut self, parameter: &str, text: &str) -> Result<(), String> {
        if let Some((info, value)) = self.parameters().into_iter().find(|(info, _)| info.name == parameter) {
            self.take(parameter, &info.read(&value, text)?);
        }
        Ok(())
    }
    /// True if the other is the same technique with the same parameters.
    #[doc(hidden)]
    fn is_same(&self, other: &dyn Any) -> bool;
    /// Access for downcasts.
    #[doc(hidden)]
    fn as_any(&self) -> &dyn Any;
    /// Mutable access for downcasts.
    #[doc(hidden)]
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

impl<T: Technique> AnyTechnique for T {
    fn name(&self) -> &'static str {
        T::NAME
    }

    fn summary(&self) -> &'static str {
        T::SUMMARY
    }

    fn shaders(&self) -> Shaders {
        T::SHADERS
    }

    fn parameters(&self) -> Vec<(ParameterInfo, Value)> {
        let mut technique = self.clone();
        T::PARAMETERS.iter().map(|entry| (entry.info, Value::of((entry.of)(&mut technique)))).collect()
    }

    fn value(&self, parameter: &str) -> Option<Value> {
        let entry = T::PARAMETERS.iter().find(|entry| entry.info.name == parameter)?;
        Some(Value::of((entry.of)(&mut self.clone())))
    }

    fn take(&mut self, parameter: &str, value: &Value) {
        if let Some(entry) = T::PARAMETERS.iter().find(|entry| entry.info.name == parameter) {
            (entry.of)(self).assign(&**value);
        }
    }

    fn is_same(&self, other: &dyn Any) -> bool {
        other.downcast_ref::<T>().is_some_and(|other| self == other)
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

/// A kind of technique: implemented for `dyn` of its trait.
#[doc(hidden)]
pub trait Kind: AnyTechnique {
    /// The flag.
    const FLAG: &'static str;
    /// The purpose of the flag: a summary, then paragraphs for long help.
    const HELP: &'static str;
    /// True if short help lists its flag.
    const IS_EVERYDAY: bool;
    /// The name of no technique.
    const NONE_NAME: &'static str;
    /// One line of help on no technique.
    const NONE_SUMMARY: &'static str;
    /// True if the default technique does not depend on other settings.
    const HAS_ONE_DEFAULT: bool = true;
    /// The default technique.
    fn default_choice() -> Choice<Self>;
    /// The registered techniques of this kind.
    fn registry() -> &'static Registry<Self>;
}

/// The registered techniques of a kind.
#[doc(hidden)]
pub struct Registry<K: ?Sized> {
    own: fn() -> Vec<Choice<K>>,
    added: RwLock<Vec<Choice<K>>>,
}

impl<K: ?Sized> Registry<K> {
    /// A registry of the library's own techniques, with their default parameters.
    pub(crate) const fn new(own: fn() -> Vec<Choice<K>>) -> Self {
        Self { own, added: RwLock::new(Vec::new()) }
    }
}

/// A technique of a kind with its parameters, or none.
pub struct Choice<K: ?Sized>(Option<Chosen<K>>);

struct Chosen<K: ?Sized> {
    technique: Box<K>,
    clone: fn(&K) -> Box<K>,
}

impl<K: ?Sized> Choice<K> {
    /// No technique.
    pub const NONE: Self = Self(None);

    /// Wraps a technique. `clone` clones techniques of its type.
    pub(crate) fn new(technique: Box<K>, clone: fn(&K) -> Box<K>) -> Self {
        Self(Some(Chosen { technique, clone }))
    }

    /// True if it is no technique.
    pub const fn is_none(&self) -> bool {
        self.0.is_none()
    }

    /// True if it is a technique.
    pub const fn is_some(&self) -> bool {
        self.0.is_some()
    }

    /// The technique.
    pub fn technique(&self) -> Option<&K> {
        self.0.as_ref().map(|chosen| &*chosen.technique)
    }

    /// Mutable access to the technique.
    pub fn technique_mut(&mut self) -> Option<&mut K> {
        self.0.as_mut().map(|chosen| &mut *chosen.technique)
    }
}

impl<K: AnyTechnique + ?Sized> Choice<K> {
    /// The technique, if it is of this type.
    pub fn get<T: Technique>(&self) -> Option<&T> {
        self.technique()?.as_any().downcast_ref()
    }

    /// True if the technique is of this type.
    pub fn is<T: Technique>(&self) -> bool {
        self.get::<T>().is_some()
    }

    /// Mutable access to the technique, if it is of this type.
    pub fn get_mut<T: Technique>(&mut self) -> Option<&mut T> {
        self.technique_mut()?.as_any_mut().downcast_mut()
    }
}

impl<K: Kind + ?Sized> Choice<K> {
    /// [`Kind::FLAG`].
    #[doc(hidden)]
    pub const FLAG: &'static str = K::FLAG;

    /// The name of the technique, or the kind's name for none.
    pub fn name(&self) -> &'static str {
        self.technique().map_or(K::NONE_NAME, AnyTechnique::name)
    }

    /// Every registered technique of the kind, with default parameters.
    pub fn all() -> Vec<Self> {
        let registry = K::registry();
        let added = registry.added.read().unwrap_or_else(PoisonError::into_inner);
        (registry.own)().into_iter().chain(added.iter().cloned()).collect()
    }

    /// The technique of this name, or none for the kind's name for none.
    pub fn named(name: &str) -> Option<Self> {
        std::iter::once(Self::NONE).chain(Self::all()).find(|choice| choice.name() == name)
    }

    /// Registers a technique with these parameters as its defaults: [`Self::all`] and [`Self::named`] include it
    /// afterwards, and with them every flag, panel, shot and report. Programs register techniques before they parse
    /// names. Light culling techniques and tracers ([`Tracer::register`](crate::rays::Tracer::register)) must be
    /// registered before a renderer uses them, because shaders of other folders are linked with their features.
    ///
    /// Panics if another technique of the kind has the same name: a bug.
    pub fn register(self) {
        let (existing, registry) = (Self::named(self.name()), K::registry());
        assert!(existing.is_none(), "{}: two techniques are called {}", K::FLAG, self.name());
        registry.added.write().unwrap_or_else(PoisonError::into_inner).push(self);
    }
}

/// The technique by name, with default parameters.
impl<K: Kind + ?Sized> Setting for Choice<K> {
    fn text(&self) -> Option<String> {
        Some(self.name().to_owned())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = data::find(text, K::NONE_NAME, Self::all())?;
        Ok(())
    }

    fn names(&self) -> Vec<(&'static str, &'static str)> {
        let all = Self::all();
        let summaries = all.iter().filter_map(|choice| Some((choice.name(), choice.technique()?.summary())));
        [(K::NONE_NAME, K::NONE_SUMMARY)].into_iter().chain(summaries).collect()
    }
}

impl<K: Kind + ?Sized> Default for Choice<K> {
    fn default() -> Self {
        K::default_choice()
    }
}

impl<K: ?Sized> Clone for Choice<K> {
    fn clone(&self) -> Self {
        Self(self.0.as_ref().map(|Chosen { technique, clone }| Chosen { technique: clone(technique), clone: *clone }))
    }
}

impl<K: AnyTechnique + ?Sized> PartialEq for Choice<K> {
    fn eq(&self, other: &Self) -> bool {
        match (self.technique(), other.technique()) {
            (Some(a), Some(b)) => a.is_same(b.as_any()),
            (a, b) => a.is_none() && b.is_none(),
        }
    }
}

impl<K: AnyTechnique + ?Sized> fmt::Debug for Choice<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.technique() {
            Some(technique) => technique.fmt(f),
            None => f.write_str("None"),
        }
    }
}

/// Clones a technique of type `T`, for [`Choice::new`].
///
/// Panics if the technique is of another type: a bug.
pub(crate) fn clone_of<T: Technique>(technique: &(impl AnyTechnique + ?Sized)) -> Box<T> {
    Box::new(technique.as_any().downcast_ref::<T>().expect("a choice keeps its technique's type").clone())
}
