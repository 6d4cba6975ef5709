//! Flags of the command itself, each declared once: a field that clap fills, and a key of a shot.

use std::ffi::{OsStr, OsString};

use clap::ArgMatches;

use super::spelling::{Form, Spelling};

/// A group of flags. A flag's id is the name of its field.
pub(crate) trait Flags {
    /// How a shot states the values of a flag; `None` if there is no such flag.
    fn form(&self, id: &str) -> Option<Form>;
    /// Reads a value of a flag, or says what is expected.
    fn read(&mut self, id: &str, text: &OsStr) -> Result<(), String>;
    /// Takes the values of a flag on a command line that has it.
    fn take(&mut self, id: &str, matches: &ArgMatches);
    /// Takes the values of a flag of another group.
    fn copy(&mut self, id: &str, other: &Self);
    /// The values of a flag, as the command line spells them.
    fn texts(&self, id: &str) -> Vec<OsString>;
}

/// What holds the values of a flag: one value, at most one, or a list.
pub(crate) trait Held<S: Spelling> {
    /// Replaces the value, or adds to the list.
    fn put(&mut self, value: S::Value);
    /// All values.
    fn values(&self) -> &[S::Value];

    fn read(&mut self, text: &OsStr) -> Result<(), String> {
        S::read(text).map(|value| self.put(value))
    }

    fn take(&mut self, id: &str, matches: &ArgMatches) {
        matches.get_many::<S::Value>(id).into_iter().flatten().for_each(|value| self.put(value.clone()));
    }

    fn copy(&mut self, other: &Self) {
        other.values().iter().for_each(|value| self.put(value.clone()));
    }

    fn texts(&self) -> Vec<OsString> {
        self.values().iter().map(S::text).collect()
    }
}

impl<S: Spelling> Held<S> for Option<S::Value> {
    fn put(&mut self, value: S::Value) {
        *self = Some(value);
    }

    fn values(&self) -> &[S::Value] {
        self.as_slice()
    }
}

impl<S: Spelling> Held<S> for Vec<S::Value> {
    fn put(&mut self, value: S::Value) {
        self.push(value);
    }

    fn values(&self) -> &[S::Value] {
        self
    }
}

/// Types of flags that always have a value.
macro_rules! always_held {
    ($($Type:ty),+) => { $(
        impl<S: Spelling<Value = $Type>> Held<S> for $Type {
            fn put(&mut self, value: $Type) {
                *self = value;
            }

            fn values(&self) -> &[$Type] {
                std::slice::from_ref(self)
            }
        }
    )+ };
}
always_held! {
    bool, f32, u32, crate::parse::Size, crate::parse::PoseConvention, crate::stereo::StereoLayout,
    lanternfish::settings::Preset
}

/// Declares a group of flags: a struct for clap, whose fields with a [`Spelling`] are [`Flags`], as are the flags of
/// its `groups`.
macro_rules! flags {
    (
        $(#[$meta:meta])*
        pub struct $Args:ident { $($(#[$attr:meta])* $field:ident: $Type:ty $(as $Spelling:ty)?,)+ }
        $(groups { $($group:ident),+ })?
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, clap::Args)]
        pub struct $Args { $(
            $(#[$attr])*
            $(#[arg(value_parser = <$Spelling as $crate::args::spelling::Spelling>::parser())])?
            pub $field: $Type,
        )+ }

        const _: () = {
            use $crate::args::{flags::{Flags, Held}, spelling::{Form, Spelling}};

            impl Flags for $Args {
                fn form(&self, id: &str) -> Option<Form> {
                    match id {
                        $($(stringify!($field) => Some(<$Spelling>::FORM),)?)+
                        _ => None$($(.or_else(|| self.$group.form(id)))+)?,
                    }
                }

                fn read(&mut self, id: &str, text: &std::ffi::OsStr) -> Result<(), String> {
                    match id {
                        $($(stringify!($field) => Held::<$Spelling>::read(&mut self.$field, text),)?)+
                        $($(_ if self.$group.form(id).is_some() => self.$group.read(id, text),)+)?
                        _ => Ok(()),
                    }
                }

                fn take(&mut self, id: &str, matches: &clap::ArgMatches) {
                    match id {
                        $($(stringify!($field) => Held::<$Spelling>::take(&mut self.$field, id, matches),)?)+
                        _ => { $($(self.$group.take(id, matches);)+)? }
                    }
                }

                fn copy(&mut self, id: &str, other: &Self) {
                    match id {
                        $($(stringify!($field) => Held::<$Spelling>::copy(&mut self.$field, &other.$field),)?)+
                        _ => { $($(self.$group.copy(id, &other.$group);)+)? }
                    }
                }

                fn texts(&self, id: &str) -> Vec<std::ffi::OsString> {
                    match id {
                        $($(stringify!($field) => Held::<$Spelling>::texts(&self.$field),)?)+
                        $($(_ if self.$group.form(id).is_some() => self.$group.texts(id),)+)?
                        _ => Vec::new(),
                    }
                }
            }
        };
    };
}
pub(crate) use flags;
