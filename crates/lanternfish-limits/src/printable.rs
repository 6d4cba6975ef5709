//! Texts from files, for a terminal.

/// Characters of a line that are kept; the rest is counted.
const MOST: usize = 1000;

/// A text that may hold names from files, as it can be printed: control characters, which could move a terminal's cursor or set its title,
/// are escaped (`\u{1b}`), except for line breaks; lines of more than 1,000 characters are cut.
pub fn printable(text: &str) -> String {
    let lines = text.split('\n').map(|line| escaped(line, MOST));
    lines.collect::<Vec<_>>().join("\n")
}

/// A name from a file in one line: control characters, line breaks too, are escaped, and a name of more than 300 characters is cut.
pub fn printable_name(name: &str) -> String {
    escaped(name, 300)
}

fn escaped(line: &str, most: usize) -> String {
    let mut text = String::with_capacity(line.len().min(2 * most));
    for character in line.chars().take(most) {
        match character {
            '\t' => text.push('\t'),
            // Line and paragraph separators, marks that reverse the direction of text, and characters without a width.
            '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}' => {
                text.extend(character.escape_unicode())
            }
            _ if character.is_control() => text.extend(character.escape_default()),
            _ => text.push(character),
        }
    }
    match line.chars().skip(most).count() {
        0 => text,
        more => format!("{text}… ({more} more characters)"),
    }
}

#[cfg(test)]
#[test]
fn texts_from_files_cannot_control_a_terminal() {
    let name = "\u{1b}]0;title\u{7}\nerror: none";
    assert_eq!(printable_name(name), "\\u{1b}]0;title\\u{7}\\nerror: none");
    assert_eq!(printable(name), "\\u{1b}]0;title\\u{7}\nerror: none");
    assert_eq!(printable("\u{9b}31m\u{202e}"), "\\u{9b}31m\\u{202e}");
    assert_eq!(printable("a\u{200b}b\u{feff}"), "a\\u{200b}b\\u{feff}");
    assert_eq!(printable("Größe ×\t木"), "Größe ×\t木");
}

#[cfg(test)]
#[test]
fn long_texts_are_cut() {
    let name = printable_name(&"é".repeat(1 << 20));
    assert!(name.chars().count() < 350 && name.ends_with("… (1048276 more characters)"), "{name}");
    assert_eq!(printable(&format!("{}\nend", "a".repeat(2000))).lines().last(), Some("end"));
}
