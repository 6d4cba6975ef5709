//! Settings, which have a type and a text, and enums whose variants are selected by name.

use std::{any::Any, fmt::Debug, ops::Deref, sync::Arc};

/// An enum whose variants are selected by name, as declared by [`named_enum!`](crate::named_enum!).
pub trait Named: Copy + Debug + Send + Sync + 'static {
    /// Every variant, in the order in which help lists them.
    fn all() -> Vec<Self>;
    /// The name of a variant, in flags, files and reports.
    fn name(self) -> &'static str;
    /// One line of help text on a variant; empty if no front end offers it.
    fn help(self) -> &'static str;
}

/// A setting that front ends write and read as text, in flags, shots and reports.
pub trait Setting: AnySetting {
    /// The value as text; `None` if it is not set.
    fn text(&self) -> Option<String>;
    /// Parses the value from `text`; the error says what was expected.
    fn read(&mut self, text: &str) -> Result<(), String>;
    /// Every name and its help text, for settings that are selected by name; otherwise empty.
    fn names(&self) -> Vec<(&'static str, &'static str)> {
        Vec::new()
    }
}

/// Settings behind `dyn`. Every [`Setting`] that can be cloned implements it.
#[doc(hidden)]
pub trait AnySetting: Any + Debug + Send + Sync {
    /// A copy.
    fn boxed(&self) -> Box<dyn Setting>;
    /// Takes the value of another setting. A value of another type counts by its text: techniques may share a
    /// parameter's name.
    ///
    /// Panics if that text is no value of this setting: a bug.
    fn assign(&mut self, value: &dyn Setting);
}

impl<T: Setting + Clone> AnySetting for T {
    fn boxed(&self) -> Box<dyn Setting> {
        Box::new(self.clone())
    }

    fn assign(&mut self, value: &dyn Setting) {
        match (value as &dyn Any).downcast_ref::<Self>() {
            Some(value) => *self = value.clone(),
            None if self.read(&value.text().unwrap_or_default()).is_ok() => {}
            None => panic!("{value:?} is no value for {self:?}"),
        }
    }
}

/// A value of a setting, of the setting's own type: read once, by a flag, a key of a shot or a panel.
#[derive(Clone, Debug)]
pub struct Value(Arc<dyn Setting>);

impl Value {
    /// The value of a setting.
    pub fn of(setting: &dyn Setting) -> Self {
        Self(setting.boxed().into())
    }

    /// A value of the same type, from text; the error says what was expected.
    pub fn read(&self, text: &str) -> Result<Self, String> {
        let mut value = self.0.boxed();
        value.read(text)?;
        Ok(Self(value.into()))
    }

    /// The value, if it is of this type.
    pub fn get<T: 'static>(&self) -> Option<&T> {
        (&*self.0 as &dyn Any).downcast_ref()
    }
}

impl Deref for Value {
    type Target = dyn Setting;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

/// The name that is closest to `name` in spelling; empty without names.
pub fn nearest<'n>(name: &str, names: &[&'n str]) -> &'n str {
    names.iter().min_by_key(|other| strsim::damerau_levenshtein(name, other)).copied().unwrap_or_default()
}

macro_rules! number_settings {
    ($($number:ty: $what:literal),+) => { $(
        impl Setting for $number {
            fn text(&self) -> Option<String> {
                Some(self.to_string())
            }
            fn read(&mut self, text: &str) -> Result<(), String> {
                *self = text.trim().parse().map_err(|_| concat!("expected ", $what).to_owned())?;
                Ok(())
            }
        }
    )+ };
}
number_settings! { u32: "a whole number", f32: "a number" }

impl Setting for bool {
    fn text(&self) -> Option<String> {
        Some(if *self { "on" } else { "off" }.to_owned())
    }
    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = match text {
            "on" => true,
            "off" => false,
            _ => return Err("expected on or off".to_owned()),
        };
        Ok(())
    }
}

impl Setting for Option<f32> {
    fn text(&self) -> Option<String> {
        self.as_ref().and_then(Setting::text)
    }
    fn read(&mut self, text: &str) -> Result<(), String> {
        self.insert(0.0).read(text)
    }
}

/// The text `none` means that the setting is not set.
impl<T: Named> Setting for Option<T> {
    fn text(&self) -> Option<String> {
        self.map(|value| value.name().to_owned())
    }
    fn read(&mut self, text: &str) -> Result<(), String> {
        let named = || T::all().into_iter().find(|value| value.name() == text);
        let names: Vec<_> = std::iter::once("none").chain(T::all().into_iter().map(T::name)).collect();
        let wrong = || format!("expected one of {}; did you mean {:?}?", names.join(", "), nearest(text, &names));
        *self = if text == "none" { None } else { Some(named().ok_or_else(wrong)?) };
        Ok(())
    }
    fn names(&self) -> Vec<(&'static str, &'static str)> {
        let all = T::all().into_iter().map(|value| (value.name(), value.help()));
        std::iter::once(("none", "Not set")).chain(all).collect()
    }
}

/// Declares an enum whose variants each have a name and a line of help text.
#[doc(hidden)]
#[macro_export]
macro_rules! named_enum {
    ($(#[$meta:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $text:literal $(: $meaning:literal)?),+ $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$doc])* $variant),+ }

        impl $name {
            /// Every variant, in the order in which help lists them.
            #[doc(hidden)]
            pub const ALL: &[Self] = &[$(Self::$variant),+];
        }

        impl $crate::Named for $name {
            fn all() -> Vec<Self> {
                Self::ALL.to_vec()
            }
            fn name(self) -> &'static str {
                match self { $(Self::$variant => $text),+ }
            }
            fn help(self) -> &'static str {
                match self { $(Self::$variant => concat!($($meaning)?)),+ }
            }
        }

        $crate::named_enum_impls!($name);
    };
}

/// Implements [`Named`](crate::Named) for a type that has its own `all`, `name` and `words`: the values are only known
/// at run time.
#[doc(hidden)]
#[macro_export]
macro_rules! named_type_impls {
    ($name:ident) => {
        impl $crate::Named for $name {
            fn all() -> Vec<Self> {
                Self::all()
            }
            fn name(self) -> &'static str {
                self.name()
            }
            fn help(self) -> &'static str {
                self.words()
            }
        }

        $crate::named_enum_impls!($name);
    };
}

/// Implements reading, writing and listing of names for a type that is [`Named`](crate::Named).
#[doc(hidden)]
#[macro_export]
macro_rules! named_enum_impls {
    ($name:ident) => {
        impl $crate::Setting for $name {
            fn text(&self) -> Option<String> {
                Some($crate::Named::name(*self).to_owned())
            }
            fn read(&mut self, text: &str) -> Result<(), String> {
                *self = text.parse()?;
                Ok(())
            }
            fn names(&self) -> Vec<(&'static str, &'static str)> {
                <Self as $crate::Named>::all()
                    .into_iter()
                    .map(|v| ($crate::Named::name(v), $crate::Named::help(v)))
                    .collect()
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str($crate::Named::name(*self))
            }
        }

        impl std::str::FromStr for $name {
            type Err = String;
            fn from_str(text: &str) -> Result<Self, String> {
                <Self as $crate::Named>::all().into_iter().find(|v| $crate::Named::name(*v) == text).ok_or_else(|| {
                    let names: Vec<_> = <Self as $crate::Named>::all().into_iter().map($crate::Named::name).collect();
                    format!("expected one of {}; did you mean {:?}?", names.join(", "), $crate::nearest(text, &names))
                })
            }
        }

        /// As its name.
        impl $crate::__serde::Serialize for $name {
            fn serialize<S: $crate::__serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str($crate::Named::name(*self))
            }
        }

        impl<'de> $crate::__serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::__serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let name = <String as $crate::__serde::Deserialize>::deserialize(deserializer)?;
                let wrong = |why| <D::Error as $crate::__serde::de::Error>::custom(format!("{name:?}: {why}"));
                name.parse().map_err(wrong)
            }
        }
    };
}
