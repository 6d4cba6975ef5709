//! `lanternfish help`: the common flags of a command, or all flags.
//!
//! A flag that only research needs is declared with `hide_short_help`. `--help` and `help COMMAND` omit it; `help
//! COMMAND --all` lists every flag and the meaning of every value.

use std::io::{self, IsTerminal as _};

use clap::{Arg, ArgAction, Args, CommandFactory};

use crate::{error::CliError, output};

/// Flags of `help`.
#[derive(Debug, Args)]
pub struct HelpArgs {
    /// The command. Without it: lists the commands.
    #[arg(value_name = "COMMAND")]
    pub command: Vec<String>,
    /// Lists every flag and the meaning of every value. Without it: the common flags.
    #[arg(long)]
    pub all: bool,
}

/// The `--help` flag of every command of a program. It replaces clap's own, which would print every flag.
pub fn flag(program: &str) -> Arg {
    Arg::new("help")
        .short('h')
        .long("help")
        .global(true)
        .action(ArgAction::HelpShort)
        .help_heading(None)
        .help(format!("Prints help; `{program} help COMMAND --all` prints all flags"))
}

/// A flag of a command whose help refers to that of `render`, which has the flags with other headings.
pub(crate) fn hidden(flag: Arg) -> Arg {
    let is_of_render = flag.get_help_heading().is_some_and(|heading| heading != "Window");
    if is_of_render { flag.hide(true) } else { flag }
}

/// Prints the help of a command of the program.
pub fn run<C: CommandFactory>(args: &HelpArgs) -> Result<(), CliError> {
    let mut root = C::command();
    root.build();
    let mut command = &mut root;
    for name in &args.command {
        let commands = command.get_subcommands().filter(|command| !command.is_hide_set());
        let names: Vec<_> = commands.map(|command| command.get_name().to_owned()).collect();
        let path = command.get_bin_name().unwrap_or_else(|| command.get_name()).to_owned();
        command = command.find_subcommand_mut(name).ok_or_else(|| {
            let hint = match names.is_empty() {
                true => format!("{path} has no subcommands"),
                false => format!("there are: {}", names.join(", ")),
            };
            CliError::new(format_args!("{path} {name}: no such command"), hint)
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

    /// Height of a usual terminal, lines, and the column at which text is wrapped.
    const SCREEN: (usize, usize) = (60, 100);

    /// The command of this name in the program, and its short and long help.
    fn help_of(name: &str) -> (Command, String, String) {
        let mut root = Cli::command().term_width(SCREEN.1);
        root.build();
        let command = root.find_subcommand_mut(name).unwrap();
        let (short, long) = (command.render_help().to_string(), command.render_long_help().to_string());
        (command.clone(), short, long)
    }

    /// True if a flag is listed, not only mentioned.
    fn lists(help: &str, flag: &str) -> bool {
        let is_flag = |line: &str| {
            let line = line.trim_start();
            let line = line.split_once(", ").filter(|(short, _)| short.len() == 2).map_or(line, |(_, long)| long);
            line.split_whitespace().next() == Some(&format!("--{flag}"))
        };
        help.lines().any(is_flag)
    }

    #[test]
    fn common_flags_fit_a_screen_and_all_lists_every_flag() {
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
        assert!(everyday >= 15 && research >= 15, "{everyday} and {research}: the division is lost");
        for name in ["output", "size", "eye", "sun", "lights", "exposure", "quality"] {
            assert!(lists(&short, name), "--{name}:\n{short}");
        }
        for name in ["cluster-depth", "ray-culling", "tile-size", "textures", "deep-directions"] {
            assert!(!lists(&short, name), "--{name}:\n{short}");
        }
        // Only `--all` prints the meaning of values.
        assert!(!short.contains("Fewest lights a pixel") && long.contains("Fewest lights a pixel"));
        for word in ["Examples:", "rain:N", "1280x720", "demo:atrium", "demo:cornell", "demo:street", ".toml"] {
            assert!(short.contains(word) && long.contains(word), "{word:?} is not in:\n{short}");
        }
        for word in ["x,y,z,cd[,r,g,b[,range]]", "rain:N:radius", "ray-query"] {
            assert!(long.contains(word), "{word:?} is not in:\n{long}");
        }
    }

    /// `help render`, `render --help` and `render -h` print the same; the list of commands has no benches.
    #[test]
    fn all_ways_to_ask_for_help_are_one() {
        let text = |words: &[&str]| {
            let error = Cli::command().try_get_matches_from(words).unwrap_err();
            assert_eq!(error.exit_code(), 0);
            error.to_string()
        };
        let mut root = Cli::command();
        root.build();
        let help = root.find_subcommand_mut("render").unwrap().render_help().to_string();
        assert_eq!(
            [["lanternfish", "render", "--help"], ["lanternfish", "render", "-h"]].map(|words| text(&words)),
            [help.clone(), help]
        );
        let commands = text(&["lanternfish", "--help"]);
        assert!(commands.contains("papers") && !commands.contains("bench"), "{commands}");
    }

    #[test]
    fn every_flag_of_every_command_is_documented() {
        // `shot` and `view` refer to the flags of `render`.
        let refers_to_render = |command: &&clap::Command| ["shot", "view"].contains(&command.get_name());
        for command in Cli::command().get_subcommands().filter(|command| !refers_to_render(command)) {
            let (command, _, long) = help_of(command.get_name());
            for flag in command.get_arguments().filter_map(|flag| flag.get_long()) {
                assert!(lists(&long, flag), "{}: --{flag} is not in:\n{long}", command.get_name());
            }
        }
    }

    #[test]
    fn the_help_of_shot_describes_shots() {
        let (_, short, long) = help_of("shot");
        let view = help_of("view").1;
        assert!(lists(&view, "record") && lists(&view, "shaders") && !lists(&view, "size"), "{view}");
        for help in [&short, &long] {
            for flag in ["size", "sun", "cluster-depth", "exposure"] {
                assert!(!lists(help, flag), "--{flag}:\n{help}");
            }
            for word in ["[track]", "keyframes", "`lanternfish help render --all`"] {
                assert!(help.contains(word), "{word:?} is not in:\n{help}");
            }
        }
        assert!(long.lines().count() <= SCREEN.0, "{long}");
    }
}
