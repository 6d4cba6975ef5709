//! What rooms say of themselves. A family is a question that several rooms answer, and an enum of settings: one of its rooms, or
//! none. A room says its name, its settings and its shaders once, in its own folder ([`Room`]); flags, keys of shots, help and
//! reports are made from that by whoever asks the family ([`Family`]).

use lanternfish_scene::Setting;

use crate::shaders::Shaders;

/// The settings of a room. `Default`: those that it has where nobody says otherwise.
pub trait Room: Clone + Default + 'static {
    /// What the family's flag calls it.
    const NAME: &'static str;
    /// One line of help.
    const WORDS: &'static str;
    /// Its settings. Two rooms of a family may have one of the same name: a flag for both.
    const KNOBS: &'static [Knob<Self>];
    /// The shaders of its folder.
    const SHADERS: Shaders;
}

/// One setting of a room.
#[derive(Clone, Copy, Debug)]
pub struct Knob<R> {
    /// How front ends call it: a flag, a key of a shot, a row of a report.
    pub words: KnobWords,
    /// Where it is.
    pub of: fn(&mut R) -> &mut dyn Setting,
}

/// What there is to say of a setting.
#[derive(Clone, Copy, Debug)]
pub struct KnobWords {
    /// Its name.
    pub name: &'static str,
    /// What stands for its value in help: `N`, `METRES`.
    pub value: &'static str,
    /// What it may be.
    pub range: Range,
    /// What it is, and what more of it does.
    pub help: &'static str,
    /// Whether help tells its default: not where another flag decides on that.
    pub shows_default: bool,
}

impl KnobWords {
    /// A setting whose default is not told.
    pub const fn new(name: &'static str, value: &'static str, range: Range, help: &'static str) -> Self {
        Self { name, value, range, help, shows_default: false }
    }
}

impl<R> Knob<R> {
    /// A setting whose default is not told.
    pub const fn new(
        name: &'static str,
        value: &'static str,
        range: Range,
        help: &'static str,
        of: fn(&mut R) -> &mut dyn Setting,
    ) -> Self {
        Self { words: KnobWords::new(name, value, range, help), of }
    }

    /// The same, and its default is told.
    pub const fn with_default(self) -> Self {
        Self { words: KnobWords { shows_default: true, ..self.words }, of: self.of }
    }
}

/// What a setting may be.
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

/// A room whose type is not known.
pub trait AnyRoom {
    /// [`Room::NAME`].
    fn name(&self) -> &'static str;
    /// [`Room::WORDS`].
    fn words(&self) -> &'static str;
    /// Its settings, each with the names that its type has, if any, and what they mean.
    fn knobs(&self) -> Vec<(KnobWords, Vec<(&'static str, &'static str)>)>;
    /// A setting as text; none where the room has no such setting, or it is not set.
    fn get(&self, knob: &str) -> Option<String>;
    /// Sets a setting from text, or says what was expected. Without such a setting nothing is done: it is another room's.
    fn set(&mut self, knob: &str, text: &str) -> Result<(), String>;
}

impl<R: Room> AnyRoom for R {
    fn name(&self) -> &'static str {
        R::NAME
    }

    fn words(&self) -> &'static str {
        R::WORDS
    }

    fn knobs(&self) -> Vec<(KnobWords, Vec<(&'static str, &'static str)>)> {
        let mut room = self.clone();
        R::KNOBS.iter().map(|knob| (knob.words, (knob.of)(&mut room).names())).collect()
    }

    fn get(&self, knob: &str) -> Option<String> {
        let found = R::KNOBS.iter().find(|known| known.words.name == knob)?;
        (found.of)(&mut self.clone()).text()
    }

    fn set(&mut self, knob: &str, text: &str) -> Result<(), String> {
        let found = R::KNOBS.iter().find(|known| known.words.name == knob);
        found.map_or(Ok(()), |found| (found.of)(self).read(text))
    }
}

/// A family of rooms: a setting that is one of them, or none.
pub trait Family: Copy + Default + Send + Sync + 'static {
    /// Its flag.
    const FLAG: &'static str;
    /// What its flag chooses: a paragraph, and where help has room for more, others.
    const HELP: &'static str;
    /// Whether its flag is one of every day; else short help leaves it out.
    const IS_EVERYDAY: bool;
    /// No room.
    const NONE: Self;
    /// What its flag calls no room.
    const NONE_NAME: &'static str;
    /// One line of help on no room.
    const NONE_WORDS: &'static str;
    /// Every room, as it is where nobody says otherwise.
    fn rooms() -> Vec<Self>;
    /// The room.
    fn room(&self) -> Option<&dyn AnyRoom>;
    /// The room, to be changed.
    fn room_mut(&mut self) -> Option<&mut dyn AnyRoom>;

    /// The name of the room, or of none.
    fn name(&self) -> &'static str {
        self.room().map_or(Self::NONE_NAME, AnyRoom::name)
    }

    /// The room of this name.
    fn named(name: &str) -> Option<Self> {
        [Self::NONE].into_iter().chain(Self::rooms()).find(|room| room.name() == name)
    }
}

/// Declares a family, one line a room: a variant, and the type of its settings, which is a [`Room`] and of the family's trait. An
/// attribute of a room is one of all that is made of it.
macro_rules! rooms {
    (
        $(#[$meta:meta])*
        $family:ident: dyn $trait:ident, flag $flag:literal, everyday: $everyday:literal, help: $help:literal,
        none: $nothing:ident = $nothing_name:literal, $none:literal { $($(#[$attribute:meta])* $room:ident($settings:ty)),+ $(,)? }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum $family {
            #[doc = $none]
            $nothing,
            $($(#[$attribute])* #[doc = concat!("The room of [`", stringify!($settings), "`].")] $room($settings)),+
        }

        impl $family {
            /// The shaders of the rooms.
            pub(crate) const SHADERS: &[$crate::shaders::Shaders] =
                &[$($(#[$attribute])* <$settings as $crate::rooms::Room>::SHADERS),+];

            /// The room, as its family knows it.
            pub(crate) fn chosen(&self) -> Option<&dyn $trait> {
                match self { Self::$nothing => None, $($(#[$attribute])* Self::$room(room) => Some(room)),+ }
            }

            /// The room, to be changed.
            pub(crate) fn chosen_mut(&mut self) -> Option<&mut dyn $trait> {
                match self { Self::$nothing => None, $($(#[$attribute])* Self::$room(room) => Some(room)),+ }
            }
        }

        impl $crate::rooms::Family for $family {
            const FLAG: &'static str = $flag;
            const HELP: &'static str = $help;
            const IS_EVERYDAY: bool = $everyday;
            const NONE: Self = Self::$nothing;
            const NONE_NAME: &'static str = $nothing_name;
            const NONE_WORDS: &'static str = $none;

            fn rooms() -> Vec<Self> {
                [$($(#[$attribute])* Self::$room(Default::default())),+].to_vec()
            }

            fn room(&self) -> Option<&dyn $crate::rooms::AnyRoom> {
                self.chosen().map(|room| room as _)
            }

            fn room_mut(&mut self) -> Option<&mut dyn $crate::rooms::AnyRoom> {
                self.chosen_mut().map(|room| room as _)
            }
        }
    };
}
pub(crate) use rooms;
