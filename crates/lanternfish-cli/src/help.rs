//! `lanternfish help`: what every day needs, or everything.
//!
//! A flag that only research asks for says so where it is declared, by `hide_short_help`: `--help` and `help COMMAND` leave
//! it out, `help COMMAND --all` has every flag with the meaning of every value.

use std::io::{self, IsTerminal as _};

use clap::{Arg, ArgAction, Args, CommandFactory};

use crate::{error::CliError, output};

/// Flags of `help`.
#[derive(Debug, Args)]
pub struct HelpArgs {
    /// The command. Without it: the commands there are.
    #[arg(value_name = "COMMAND")]
    pub command: Vec<String>,
    /// Every flag, and what each value means; without it: the flags of every day.
    #[arg(long)]
    pub all: bool,
}

/// `--help` of every command of a program: clap's own would tell everything.
pub fn flag(program: &str) -> Arg {
    Arg::new("help")
        .short('h')
        .long("help")
        .global(true)
        .action(ArgAction::HelpShort)
        .help_heading(None)
        .help(format!("Prints this; `{program} help COMMAND --all` prints all there is"))
}

/// Prints the help of a program that was requested.
pub fn run<C: CommandFactory>(args: &HelpArgs) -> Result<(), CliError> {
    let mut root = C::command();
    root.build();
    let mut command = &mut root;
    for name in &args.command {
        let known = command.get_subcommands().filter(|known| !known.is_hide_set());
        let known: Vec<_> = known.map(|known| known.get_name().to_owned()).collect();
        let whole = command.get_bin_name().unwrap_or_else(|| command.get_name()).to_owned();
        command = command.find_subcommand_mut(name).ok_or_else(|| {
            let hint = match known.is_empty() {
                true => format!("{whole} has no commands of its own"),
                false => format!("there are: {}", known.join(", ")),
            };
            CliError::new(format_args!("{whole} {name}: no such command"), hint)
        })?;
    }
    let text = if args.all { command.render_long_help() } else { command.render_help() };
    let is_styled = io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    output::print(&if is_styled { text.ansi().to_string() } else { text.to_string() })
}

#[cfg(test)]
mod tests {
    use clap::Command;

    use super::*;
    use crate::cli::Cli;

    /// Lines of a terminal that is as high as a usual screen, and columns that text is wrapped at.
    const SCREEN: (usize, usize) = (60, 100);

    /// The command of this name as the program has it, and its short and its long help.
    fn help_of(name: &str) -> (Command, String, String) {
        let mut root = Cli::command().term_width(SCREEN.1);
        root.build();
        let command = root.find_subcommand_mut(name).unwrap();
        let (short, long) = (command.render_help().to_string(), command.render_long_help().to_string());
        (command.clone(), short, long)
    }

    /// True if a flag is in the list, not just spoken of.
    fn lists(help: &str, flag: &str) -> bool {
        let is_flag = |line: &str| {
            let line = line.trim_start();
            let line = line.split_once(", ").filter(|(short, _)| short.len() == 2).map_or(line, |(_, long)| long);
            line.split_whitespace().next() == Some(&format!("--{flag}"))
        };
        help.lines().any(is_flag)
    }

    #[test]
    fn what_every_day_needs_fits_a_screen_and_all_is_there_for_who_asks() {
        let (render, short, long) = help_of("render");
        let lines = short.lines().count();
        assert!(lines <= SCREEN.0, "{lines} lines:\n{short}");
        assert!(
            short.contains("`lanternfish help render --all`") && short.contains("Options:\n  -h, --help"),
            "{short}"
        );
        let (mut everyday, mut research) = (0, 0);
        for flag in render.get_arguments().filter_map(|flag| Some((flag.get_long()?, flag.is_hide_short_help_set()))) {
            let (name, is_research) = flag;
            assert!(lists(&long, name), "--{name} is not in:\n{long}");
            assert_eq!(lists(&short, name), !is_research, "--{name}:\n{short}");
            *if is_research { &mut research } else { &mut everyday } += 1;
        }
        assert!(everyday >= 15 && research >= 15, "{everyday} and {research}: the division is gone");
        for name in ["output", "size", "eye", "sun", "lights", "exposure", "quality"] {
            assert!(lists(&short, name), "--{name}:\n{short}");
        }
        for name in ["cluster-test", "ray-culling", "tile-size", "textures", "deep-directions"] {
            assert!(!lists(&short, name), "--{name}:\n{short}");
        }
        // What values mean is told with all.
        assert!(!short.contains("Fewest lights a pixel") && long.contains("Fewest lights a pixel"));
    }

    #[test]
    fn no_flag_of_any_command_is_untold() {
        // Whose flags are those of `render`.
        let tells_of_render = |command: &&clap::Command| ["shot", "view"].contains(&command.get_name());
        for command in Cli::command().get_subcommands().filter(|command| !tells_of_render(command)) {
            let (command, _, long) = help_of(command.get_name());
            for flag in command.get_arguments().filter_map(|flag| flag.get_long()) {
                assert!(lists(&long, flag), "{}: --{flag} is not in:\n{long}", command.get_name());
            }
        }
    }

    #[test]
    fn the_help_of_a_shot_is_of_shots() {
        let (_, short, long) = help_of("shot");
        for help in [&short, &long] {
            for flag in ["size", "sun", "cluster-test", "exposure"] {
                assert!(!lists(help, flag), "--{flag}:\n{help}");
            }
            for word in ["[track]", "keyframes", "`lanternfish help render --all`"] {
                assert!(help.contains(word), "{word:?} is not in:\n{help}");
            }
        }
        assert!(long.lines().count() <= SCREEN.0, "{long}");
    }
}
