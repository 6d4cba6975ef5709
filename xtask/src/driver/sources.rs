//! Parses apt's sources, as far as needed to add another suite of the same mirror.

use std::{collections::HashMap, fs, path::Path};

/// An enabled source of binary packages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// Mirrors, separated by spaces.
    pub uris: String,
    /// Releases of the distribution, e.g. `bookworm`, `bookworm-updates`.
    pub suites: Vec<String>,
    /// Components of a release, separated by spaces.
    pub components: String,
    /// The trusted keys, as in a stanza after the colon: files, or an inline key over several lines.
    pub signed_by: String,
    /// Further options for all releases of a mirror, from [`OPTIONS`]: names and values of a stanza.
    pub options: Vec<(&'static str, String)>,
}

/// Supported options: their names in lines and in stanzas.
const OPTIONS: [(&str, &str); 2] = [("arch", "Architectures"), ("trusted", "Trusted")];

impl Source {
    /// True if it offers this release.
    pub fn offers(&self, suite: &str) -> bool {
        self.suites.iter().any(|other| other == suite)
    }

    /// A score that is lower the more likely the source is Debian or a mirror of it. Third parties use Debian's suite names
    /// too.
    pub fn strangeness(&self) -> u32 {
        let has_main = self.components.split_whitespace().any(|component| component == "main");
        let is_debian = self.uris.split_whitespace().any(|uri| uri.trim_end_matches('/').ends_with("/debian"));
        match (self.signed_by.contains("debian-archive"), has_main, is_debian) {
            (true, _, _) => 0,
            (_, true, true) => 1,
            (_, true, false) => 2,
            _ => 3,
        }
    }

    /// A stanza for another release of the same mirrors, components, key and options.
    pub fn stanza(&self, suite: &str) -> String {
        let mut text = format!(
            "Types: deb\nURIs: {}\nSuites: {suite}\nComponents: {}\n",
            self.uris.replace('\n', " "),
            self.components
        );
        if !self.signed_by.is_empty() {
            let space = if self.signed_by.starts_with('\n') { "" } else { " " };
            text += &format!("Signed-By:{space}{}\n", self.signed_by);
        }
        text.extend(self.options.iter().map(|(name, value)| format!("{name}: {value}\n")));
        text
    }
}

/// Reads all sources in apt's folder, `/etc/apt`, file by file in apt's order.
pub fn read(folder: &Path) -> Vec<Source> {
    let mut files = vec![folder.join("sources.list")];
    let more = fs::read_dir(folder.join("sources.list.d")).into_iter().flatten().flatten();
    files.extend(more.map(|entry| entry.path()));
    files[1..].sort();
    let parsed = files.iter().filter_map(|file| {
        let text = fs::read_to_string(file).ok()?;
        match file.extension()?.to_str()? {
            "list" => Some(from_lines(&text)),
            "sources" => Some(from_stanzas(&text)),
            _ => None,
        }
    });
    parsed.flatten().collect()
}

/// Parses the one-line style: `deb [option=value …] URI SUITE COMPONENT…`.
fn from_lines(text: &str) -> Vec<Source> {
    let source = |line: &str| {
        let line = line.split('#').next()?.trim();
        let rest = line.strip_prefix("deb")?.strip_prefix([' ', '\t'])?.trim_start();
        let (options, rest) = match rest.strip_prefix('[') {
            Some(rest) => rest.split_once(']')?,
            None => ("", rest),
        };
        let mut words = rest.split_whitespace();
        let (uri, suite) = (words.next()?, words.next()?);
        let option = |name: &str| {
            let value = options.split_whitespace().find_map(|option| option.strip_prefix(name)?.strip_prefix('='));
            value.map(|value| value.replace(',', " "))
        };
        // A disc has no other release.
        (!uri.starts_with("cdrom:")).then(|| Source {
            uris: uri.to_owned(),
            suites: vec![suite.to_owned()],
            components: words.collect::<Vec<_>>().join(" "),
            signed_by: option("signed-by").unwrap_or_default(),
            options: OPTIONS.iter().filter_map(|(name, field)| Some((*field, option(name)?))).collect(),
        })
    };
    text.lines().filter_map(source).collect()
}

/// Parses the deb822 style: stanzas of fields. Values continue on lines that start with a space.
fn from_stanzas(text: &str) -> Vec<Source> {
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let stanzas = lines.split(|line| line.trim().is_empty());
    stanzas.filter_map(|stanza| from_fields(&fields(stanza))).collect()
}

/// Values by lower-case name.
fn fields(stanza: &[&str]) -> HashMap<String, String> {
    let mut fields: HashMap<String, String> = HashMap::new();
    let mut last = String::new();
    for line in stanza {
        if line.starts_with([' ', '\t']) {
            let value = fields.entry(last.clone()).or_default();
            *value += &format!("\n{}", line.trim_end());
        } else if let Some((name, value)) = line.split_once(':') {
            last = name.trim().to_lowercase();
            fields.insert(last.clone(), value.trim().to_owned());
        }
    }
    fields
}

fn from_fields(fields: &HashMap<String, String>) -> Option<Source> {
    let field = |name: &str| fields.get(name).map_or("", String::as_str);
    let words = |name: &str| field(name).split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let disabled = ["no", "false", "without", "off", "disable", "0"].contains(&&*field("enabled").to_lowercase());
    let usable = !disabled && words("types").iter().any(|kind| kind == "deb") && !field("uris").is_empty();
    usable.then(|| Source {
        uris: words("uris").join(" "),
        suites: words("suites"),
        components: words("components").join(" "),
        signed_by: field("signed-by").to_owned(),
        options: OPTIONS
            .iter()
            .filter_map(|(_, name)| Some((*name, fields.get(&name.to_lowercase())?.clone())))
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_sources_are_read() {
        let sources = from_lines(
            "# deb http://off.example/debian bookworm main\n\
             deb cdrom:[Debian GNU/Linux 12]/ bookworm main\n\
             deb-src http://a.example/debian bookworm main\n\
             deb\thttp://a.example/debian  bookworm main contrib # ours\n\
             deb [ arch=amd64,i386 trusted=yes signed-by=/k/a.gpg,/k/b.gpg ] https://b.example/d bookworm-updates main\n\
             deb\n",
        );
        let expected = [
            ("http://a.example/debian", "bookworm", "main contrib", "", vec![]),
            (
                "https://b.example/d",
                "bookworm-updates",
                "main",
                "/k/a.gpg /k/b.gpg",
                vec![("Architectures", "amd64 i386".to_owned()), ("Trusted", "yes".to_owned())],
            ),
        ];
        let expected = expected.map(|(uris, suite, components, signed_by, options)| Source {
            uris: uris.to_owned(),
            suites: vec![suite.to_owned()],
            components: components.to_owned(),
            signed_by: signed_by.to_owned(),
            options,
        });
        assert_eq!(sources, expected);
        assert!(sources[0].offers("bookworm") && !sources[0].offers("bookworm-updates"));
    }

    #[test]
    fn stanzas_are_read() {
        let sources = from_stanzas(
            "# Debian's own\nTypes: deb deb-src\nuris: http://a.example/debian\n http://b.example/debian\n\
             Suites: bookworm bookworm-updates\n# between\nComponents: main\nSigned-By: /k/a.gpg\n\
             trusted: yes\nArchitectures: amd64\n\n\n\
             Types: deb-src\nURIs: http://c.example\nSuites: bookworm\nComponents: main\n\n\
             Types: deb\nEnabled: no\nURIs: http://d.example\nSuites: bookworm\nComponents: main\n\n\
             Types: deb\nEnabled: 0\nURIs: http://e.example\nSuites: bookworm\nComponents: main\n",
        );
        assert_eq!(sources.len(), 1, "{sources:?}");
        assert!(sources[0].offers("bookworm-updates"));
        let stanza = "Types: deb\nURIs: http://a.example/debian http://b.example/debian\nSuites: bookworm-backports\n\
                      Components: main\nSigned-By: /k/a.gpg\nArchitectures: amd64\nTrusted: yes\n";
        assert_eq!(sources[0].stanza("bookworm-backports"), stanza);
        // The written stanza can be parsed.
        assert!(from_stanzas(stanza)[0].offers("bookworm-backports"));
    }

    #[test]
    fn an_inline_key_is_kept_completely() {
        let key =
            "Signed-By:\n -----BEGIN PGP PUBLIC KEY BLOCK-----\n .\n mQINBF\n -----END PGP PUBLIC KEY BLOCK-----\n";
        let sources =
            from_stanzas(&format!("Types: deb\nURIs: http://a.example\nSuites: bookworm\nComponents: main\n{key}"));
        assert!(sources[0].stanza("x").ends_with(key), "{}", sources[0].stanza("x"));
    }

    #[test]
    fn files_of_both_styles_are_read() {
        let folder = std::env::temp_dir().join(format!("lanternfish-sources-{}", std::process::id()));
        fs::create_dir_all(folder.join("sources.list.d")).unwrap();
        let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
        write("sources.list", "deb http://a.example one main\n");
        write("sources.list.d/b.sources", "Types: deb\nURIs: http://b.example\nSuites: two\nComponents: main\n");
        write("sources.list.d/a.list", "deb http://c.example three main\n");
        write("sources.list.d/d.list.save", "deb http://d.example four main\n");
        let suites: Vec<_> = read(&folder).into_iter().flat_map(|source| source.suites).collect();
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(suites, ["one", "three", "two"]);
        assert_eq!(read(&folder), []);
    }
}
