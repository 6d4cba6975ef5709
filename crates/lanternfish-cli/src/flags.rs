//! Converts settings in the library's texts to flags. The texts name settings in backticks, by name and value:
//! `shadows bvh`.

/// Replaces settings in a text of the library with flags: `--shadows bvh`.
pub fn as_flags(text: &str) -> String {
    let mut parts = text.split('`');
    let mut words = parts.next().unwrap_or_default().to_owned();
    while let Some(quoted) = parts.next() {
        // Without a second backtick the text ends here.
        let after = parts.next();
        match after {
            Some(_) if is_setting(quoted) => words += &format!("--{quoted}"),
            Some(_) => words += &format!("`{quoted}`"),
            None => words += &format!("`{quoted}"),
        }
        words += after.unwrap_or_default();
    }
    words
}

/// True for a setting's name, alone or with a value.
fn is_setting(quoted: &str) -> bool {
    let mut words = quoted.split(' ');
    let name = words.next().unwrap_or_default();
    let is_name =
        name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(|c| c.is_ascii_lowercase() || c == '-');
    is_name && words.count() <= 1
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use clap::CommandFactory as _;
    use lanternfish::settings::{AnyParameter, Settings};

    use super::*;
    use crate::cli::Cli;

    #[test]
    fn settings_become_flags_and_other_text_is_unchanged() {
        for (text, expected) in [
            (
                "`shadows ray-query` needs ray queries; use `shadows bvh`",
                "--shadows ray-query needs ray queries; use --shadows bvh",
            ),
            ("larger ones (`clusters ortho:4`)", "larger ones (--clusters ortho:4)"),
            ("ask `Scene::validate`", "ask `Scene::validate`"),
            ("`lanternfish info --adapters` lists them", "`lanternfish info --adapters` lists them"),
            ("nothing here", "nothing here"),
            ("one ` alone", "one ` alone"),
            ("", ""),
        ] {
            assert_eq!(as_flags(text), expected);
        }
    }

    /// The string literals of a source file, without comments. A literal over several lines counts as one.
    fn literals(source: &str) -> Vec<String> {
        let code = source.lines().filter(|line| !line.trim_start().starts_with("//"));
        let joined = code.fold(String::new(), |text, line| match text.strip_suffix('\\') {
            Some(begun) => format!("{begun}{}", line.trim_start()),
            None => format!("{text}\n{line}"),
        });
        joined.lines().flat_map(|line| line.split('"').skip(1).step_by(2)).map(str::to_owned).collect()
    }

    #[test]
    fn literals_may_span_several_lines() {
        let source = "let a = \"use `shadows \\\n             bvh` or\";\n// \"a comment\"\nlet b = \"--flag\";";
        assert_eq!(literals(source), ["use `shadows bvh` or", "--flag"]);
    }

    fn sources(folder: &Path, files: &mut Vec<(String, String)>) {
        for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
            let path = entry.path();
            if path.is_dir() {
                sources(&path, files);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                files.push((path.display().to_string(), fs::read_to_string(&path).unwrap()));
            }
        }
    }

    /// Every setting that the library's texts name is a flag of `render`, and the texts name no flags.
    #[test]
    fn every_setting_that_the_library_names_is_a_flag() {
        let mut root = Cli::command();
        root.build();
        let render = root.find_subcommand("render").unwrap();
        let flags: Vec<&str> = render.get_arguments().filter_map(|flag| flag.get_long()).collect();
        let mut files = Vec::new();
        for folder in ["../lanternfish/src", "../../papers/lanternfish-papers/src"] {
            sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut files);
        }
        let mut named = 0;
        for (path, source) in &files {
            for literal in literals(source) {
                assert!(!literal.contains("--"), "{path}: a flag in {literal:?}");
                for quoted in literal.split('`').skip(1).step_by(2).filter(|quoted| is_setting(quoted)) {
                    let name = quoted.split(' ').next().unwrap();
                    assert!(flags.contains(&name), "{path}: {name} is no flag, in {literal:?}");
                    named += 1;
                }
            }
        }
        for AnyParameter { info, .. } in Settings::parameters() {
            for quoted in info.help.split('`').skip(1).step_by(2).filter(|quoted| is_setting(quoted)) {
                assert!(flags.contains(&quoted.split(' ').next().unwrap()), "{}: {quoted} is no flag", info.name);
                named += 1;
            }
        }
        assert!(named > 30, "{named} settings are named");
    }
}
