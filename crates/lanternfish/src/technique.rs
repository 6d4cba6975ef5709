//! Techniques: several answers to one question, of which the settings choose one.
//!
//! A kind of technique is a question, and a trait: [`CullingTechnique`](crate::light_culling::CullingTechnique),
//! [`IndirectTechnique`](crate::indirect::IndirectTechnique), [`OcclusionTechnique`](crate::occlusion::OcclusionTechnique). A technique is
//! a type that holds its parameters and implements the trait of its kind. It states its name, its parameters and its shaders once
//! ([`Technique`]); flags, keys of shots, panels, help and reports are made from that. A [`Choice`] is a technique of a kind, or none.
//!
//! A technique need not be of this crate: any type that implements the traits can be chosen. [`Choice::register`] makes it known by
//! name, to whatever reads or lists names.

use std::{
    any::Any,
    fmt,
    sync::{PoisonError, RwLock},
};

use lanternfish_scene::Setting;

use crate::shaders::Shaders;

/// The parameters of a technique. `Default`: the values it has where nothing else is stated.
pub trait Technique: Clone + Default + PartialEq + fmt::Debug + Send + Sync + 'static {
    /// Its name: a value of the kind's flag.
    const NAME: &'static str;
    /// One line of help.
    const SUMMARY: &'static str;
    /// Its parameters. Two techniques of a kind may share one by name: one flag sets both.
    const PARAMETERS: &'static [Parameter<Self>];
    /// The shaders of its folder.
    const SHADERS: Shaders;
}

/// One parameter of a technique, or one setting of a renderer.
#[derive(Clone, Copy, Debug)]
pub struct Parameter<T> {
    /// Its name, values and help.
    pub info: ParameterInfo,
    /// Where it is.
    pub of: fn(&mut T) -> &mut dyn Setting,
}

/// The name, values and help of a parameter: for a flag, a key of a shot, a row of a panel or report.
#[derive(Clone, Copy, Debug)]
pub struct ParameterInfo {
    /// Its name.
    pub name: &'static str,
    /// What stands for its value in help: `N`, `METRES`.
    pub value: &'static str,
    /// The values it can have.
    pub range: Range,
    /// What it is, and what a higher value does.
    pub help: &'static str,
    /// Whether help states its default. It does not where the default depends on another flag.
    pub shows_default: bool,
}

impl ParameterInfo {
    /// A parameter whose default is not stated in help.
    pub const fn new(name: &'static str, value: &'static str, range: Range, help: &'static str) -> Self {
        Self { name, value, range, help, shows_default: false }
    }
}

impl<T> Parameter<T> {
    /// A parameter whose default is not stated in help.
    pub const fn new(
        name: &'static str,
        value: &'static str,
        range: Range,
        help: &'static str,
        of: fn(&mut T) -> &mut dyn Setting,
    ) -> Self {
        Self { info: ParameterInfo::new(name, value, range, help), of }
    }

    /// The same, with its default stated in help.
    pub const fn with_default(self) -> Self {
        Self { info: ParameterInfo { shows_default: true, ..self.info }, of: self.of }
    }
}

/// The values that a parameter can have.
#[derive(Clone, Copy, Debug)]
pub enum Range {
    /// A whole number: the least, and the greatest.
    Count(u32, u32),
    /// A number above 0.
    Positive,
    /// One of the names that its type has.
    Names,
    /// One of the names that its type has, which are whole numbers.
    Numbers,
    /// On or off: what each means.
    Switch(&'static str, &'static str),
    /// What its type reads.
    Text,
}

/// A technique whose type is not known at compile time. Every [`Technique`] is one.
pub trait AnyTechnique: fmt::Debug + Send + Sync + 'static {
    /// [`Technique::NAME`].
    fn name(&self) -> &'static str;
    /// [`Technique::SUMMARY`].
    fn summary(&self) -> &'static str;
    /// [`Technique::SHADERS`].
    fn shaders(&self) -> Shaders;
    /// Its parameters, each with the names that its type has, if any, and what they mean.
    fn parameters(&self) -> Vec<(ParameterInfo, Vec<(&'static str, &'static str)>)>;
    /// A parameter as text; none where the technique has no such parameter, or it is not set.
    fn get(&self, parameter: &str) -> Option<String>;
    /// Sets a parameter from text, or says what was expected. Does nothing where the technique has no such parameter.
    fn set(&mut self, parameter: &str, text: &str) -> Result<(), String>;
    /// True if the other is the same technique with the same parameters.
    fn is_same(&self, other: &dyn Any) -> bool;
    /// For its type.
    fn as_any(&self) -> &dyn Any;
    /// For its type.
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

    fn parameters(&self) -> Vec<(ParameterInfo, Vec<(&'static str, &'static str)>)> {
        let mut technique = self.clone();
        T::PARAMETERS.iter().map(|parameter| (parameter.info, (parameter.of)(&mut technique).names())).collect()
    }

    fn get(&self, parameter: &str) -> Option<String> {
        let found = T::PARAMETERS.iter().find(|known| known.info.name == parameter)?;
        (found.of)(&mut self.clone()).text()
    }

    fn set(&mut self, parameter: &str, text: &str) -> Result<(), String> {
        let found = T::PARAMETERS.iter().find(|known| known.info.name == parameter);
        found.map_or(Ok(()), |found| (found.of)(self).read(text))
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

/// A kind of technique: `dyn` of its trait.
pub trait Kind: AnyTechnique {
    /// Its flag.
    const FLAG: &'static str;
    /// What its flag chooses: a summary, and further paragraphs for long help.
    const HELP: &'static str;
    /// True if short help lists its flag.
    const IS_EVERYDAY: bool;
    /// What its flag calls no technique.
    const NONE_NAME: &'static str;
    /// One line of help on no technique.
    const NONE_SUMMARY: &'static str;
    /// What is chosen where nothing else is stated.
    fn usual() -> Choice<Self>;
    /// The techniques of this kind that are known by name.
    fn registry() -> &'static Registry<Self>;
}

/// The techniques of a kind that are known by name.
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

    /// A technique. `clone` clones techniques of its type.
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

    /// The technique, to be changed.
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

    /// The technique, if it is of this type, to be changed.
    pub fn get_mut<T: Technique>(&mut self) -> Option<&mut T> {
        self.technique_mut()?.as_any_mut().downcast_mut()
    }
}

impl<K: Kind + ?Sized> Choice<K> {
    /// [`Kind::FLAG`].
    pub const FLAG: &'static str = K::FLAG;

    /// The name of the technique, or of none.
    pub fn name(&self) -> &'static str {
        self.technique().map_or(K::NONE_NAME, AnyTechnique::name)
    }

    /// Every technique of the kind that is known by name, with its default parameters.
    pub fn all() -> Vec<Self> {
        let registry = K::registry();
        let added = registry.added.read().unwrap_or_else(PoisonError::into_inner);
        (registry.own)().into_iter().chain(added.iter().cloned()).collect()
    }

    /// The technique of this name, or none by the name of none.
    pub fn named(name: &str) -> Option<Self> {
        std::iter::once(Self::NONE).chain(Self::all()).find(|choice| choice.name() == name)
    }

    /// Makes a technique known by name, with these parameters as its default: [`Self::all`] and [`Self::named`] have it from now on, and
    /// with them every flag, panel, shot and report. Programs call it before they read names. Techniques of light culling, and tracers
    /// ([`Tracer::register`](crate::rays::Tracer::register)), are registered before a renderer takes them: shaders of other folders are linked
    /// with their features.
    ///
    /// Panics where another technique of the kind has the name: a bug.
    pub fn register(self) {
        let (known, registry) = (Self::named(self.name()), K::registry());
        assert!(known.is_none(), "{}: two techniques are called {}", K::FLAG, self.name());
        registry.added.write().unwrap_or_else(PoisonError::into_inner).push(self);
    }
}

impl<K: Kind + ?Sized> Default for Choice<K> {
    fn default() -> Self {
        K::usual()
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

/// A copy of a technique of type `T`: for [`Choice::new`].
///
/// Panics where it is of another type: a bug.
pub(crate) fn clone_of<T: Technique>(technique: &(impl AnyTechnique + ?Sized)) -> Box<T> {
    Box::new(technique.as_any().downcast_ref::<T>().expect("a choice keeps its technique's type").clone())
}
