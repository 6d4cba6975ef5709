//! Flags of `render` that other commands have, too.

use std::marker::PhantomData;

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};

use super::RenderArgs;

/// Which flags of `render` a command has.
pub trait Selection {
    /// The flag of the command for this flag of `render`; `None`: it has none.
    fn flag(flag: &Arg) -> Option<Arg>;
}

/// These flags. The shot parses their values again.
#[derive(Debug)]
pub struct SharedFlags<S>(PhantomData<S>);

impl<S: Selection> Args for SharedFlags<S> {
    fn augment_args(command: Command) -> Command {
        command.args(RenderArgs::augment_args(Command::new("render")).get_arguments().filter_map(S::flag))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<S> FromArgMatches for SharedFlags<S> {
    fn from_arg_matches(_: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self(PhantomData))
    }

    fn update_from_arg_matches(&mut self, _: &ArgMatches) -> Result<(), clap::Error> {
        Ok(())
    }
}
