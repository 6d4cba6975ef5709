//! The most lines that a folder may have: the table in `CONVENTIONS.md`.

use std::{collections::BTreeMap, fs, path::Path};

use crate::{
    command::{run_for_output, workspace},
    files,
};

/// The heading above the table.
const HEADING: &str = "## Budgets";

/// Rows that may only fall, since this commit (the tag `before-cuts`).
const ONLY_FALL: [&str; 2] = [".", "*.md"];
const SINCE: &str = "7733d1a64a055a95612068d63dccd2f63e535e91";

/// A folder, its lines of Rust, WESL and Python, or words of Markdown, and the most that it may have.
#[derive(Debug, PartialEq)]
struct Row {
    folder: String,
    count: usize,
    budget: usize,
}

/// Fails if a folder has more lines of Rust, WESL and Python, or the repository more words of Markdown, than its budget.
pub fn check() -> Result<(), String> {
    let page = files::read(&workspace().join("CONVENTIONS.md"))?;
    // A copy of the files without their repository has no list of what belongs to it.
    let Ok(files) = run_for_output(std::process::Command::new("git").args(["ls-files", "-z"]).current_dir(workspace()))
    else {
        eprintln!("LEFT OUT: budgets: git lists no files here");
        return Ok(());
    };
    let counts = counts(workspace(), files.split('\0'));
    let rows = rows(&page, &counts)?;
    match pages_since(SINCE) {
        Some(pages) => refuse_raised(&rows, &pages)?,
        None => eprintln!("LEFT OUT: budgets that only fall: git has no history since {SINCE} here"),
    }
    let unlisted = unlisted(&rows, &counts);
    if !unlisted.is_empty() {
        return Err(format!("CONVENTIONS.md has no budget for {}", unlisted.join(", ")));
    }
    let over: Vec<String> = over(&rows).map(|row| format!("{}: {} of {}", row.folder, row.count, row.budget)).collect();
    match over.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "over budget: {}\nmake it smaller, or raise the budget in CONVENTIONS.md and say in the commit what that buys",
            over.join("; ")
        )),
    }
}

/// The lines of Rust, WESL and Python of each file, and the words of each page, by path.
fn counts<'a>(root: &Path, files: impl Iterator<Item = &'a str>) -> BTreeMap<String, usize> {
    let count = |file: &str| {
        let text = || fs::read_to_string(root.join(file)).unwrap_or_default();
        match Path::new(file).extension()?.to_str()? {
            "rs" | "wesl" | "py" | "pyi" => Some(text().lines().count()),
            "md" => Some(text().split_whitespace().count()),
            _ => None,
        }
    };
    files.filter_map(|file| Some((file.to_owned(), count(file)?))).collect()
}

/// The rows of the table: `| folder | budget |`. The row `*.md` counts words of all pages; others count lines of a folder's Rust,
/// WESL and Python.
fn rows(page: &str, counts: &BTreeMap<String, usize>) -> Result<Vec<Row>, String> {
    let (_, table) = page.split_once(HEADING).ok_or("CONVENTIONS.md has no budgets")?;
    let cells =
        table.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|')).skip(2);
    let row = |line: &str| {
        let [_, folder, budget, ..] = line.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
            return Err(format!("not a row of budgets: {line}"));
        };
        let folder = folder.trim_matches('`').to_owned();
        let budget = budget.replace(',', "").parse().map_err(|_| format!("no number of lines: {line}"))?;
        let is_counted = |path: &str| match folder.as_str() {
            "*.md" => path.ends_with(".md"),
            "." => !path.ends_with(".md"),
            folder => !path.ends_with(".md") && Path::new(path).starts_with(folder),
        };
        let count = counts.iter().filter(|(path, _)| is_counted(path)).map(|(_, count)| count).sum();
        Ok(Row { folder, count, budget })
    };
    cells.map(row).collect()
}

/// `CONVENTIONS.md` as each commit after this one left it; none if git does not know the commit.
fn pages_since(commit: &str) -> Option<Vec<String>> {
    let git = |words: &[&str]| run_for_output(std::process::Command::new("git").args(words).current_dir(workspace()));
    git(&["merge-base", "--is-ancestor", commit, "HEAD"]).ok()?;
    let commits = git(&["log", "--format=%H", &format!("{commit}..HEAD"), "--", "CONVENTIONS.md"]).ok()?;
    commits.lines().map(|commit| git(&["show", &format!("{commit}:CONVENTIONS.md")]).ok()).collect()
}

/// An error if a row that may only fall is above the least that an earlier page said.
fn refuse_raised(now: &[Row], pages: &[String]) -> Result<(), String> {
    for row in now.iter().filter(|row| ONLY_FALL.contains(&&*row.folder)) {
        let before = pages.iter().filter_map(|page| rows(page, &BTreeMap::new()).ok()).flatten();
        let least = before.filter(|before| before.folder == row.folder).map(|before| before.budget).min();
        if least.is_some_and(|least| row.budget > least) {
            let (folder, budget) = (&row.folder, row.budget);
            return Err(format!(
                "the budget of {folder} was {} and may only fall: {budget}",
                least.unwrap_or_default()
            ));
        }
    }
    Ok(())
}

/// The rows that exceed their budget.
fn over(rows: &[Row]) -> impl Iterator<Item = &Row> {
    rows.iter().filter(|row| row.count > row.budget)
}

/// The folders with code, below the root, `crates` and `papers`, that have no row.
fn unlisted(rows: &[Row], counts: &BTreeMap<String, usize>) -> Vec<String> {
    let folder = |path: &String| {
        let mut parts = path.split('/');
        let first = parts.next()?;
        let folder = match first {
            "crates" | "papers" => format!("{first}/{}", parts.next()?),
            _ => first.to_owned(),
        };
        (!path.ends_with(".md") && path.contains('/')).then_some(folder)
    };
    let mut folders: Vec<String> = counts.keys().filter_map(folder).collect();
    folders.dedup();
    folders.retain(|folder| rows.iter().all(|row| row.folder != *folder));
    folders
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "## Budgets\n\nText.\n\n| folder | most |\n|---|---:|\n| `crates/a` | 1,010 |\n| `xtask` | 9 |\n\
                        | `*.md` | 4 |\n\n| another | table |\n|---|---|\n| `crates/b` | 1 |\n";

    fn counted(files: &[(&str, usize)]) -> BTreeMap<String, usize> {
        files.iter().map(|(file, count)| (file.to_string(), *count)).collect()
    }

    #[test]
    fn folders_over_their_budget_and_without_one_are_found() {
        let counts =
            counted(&[("crates/a/src/x.rs", 1000), ("crates/a/y.wesl", 10), ("crates/a/z.md", 4), ("xtask/b.rs", 9)]);
        let within = rows(PAGE, &counts).unwrap();
        assert_eq!(within.iter().map(|row| row.count).collect::<Vec<_>>(), [1010, 9, 4]);
        assert_eq!(over(&within).count(), 0);
        assert_eq!(unlisted(&within, &counts), [""; 0]);

        let counts = counted(&[("crates/a/src/x.rs", 1011), ("crates/ab/x.rs", 1), ("fuzz/x.rs", 1), ("README.md", 5)]);
        let beyond = rows(PAGE, &counts).unwrap();
        assert_eq!(over(&beyond).map(|row| &*row.folder).collect::<Vec<_>>(), ["crates/a", "*.md"]);
        assert_eq!(unlisted(&beyond, &counts), ["crates/ab", "fuzz"]);
        assert!(
            rows("no table", &counts).is_err() && rows("## Budgets\n| a | b |\n|-|-|\n| a | many |", &counts).is_err()
        );
    }

    #[test]
    fn two_budgets_may_only_fall() {
        let page = |budgets: [usize; 3]| {
            let rows =
                [".", "*.md", "crates"].iter().zip(budgets).map(|(folder, most)| format!("| `{folder}` | {most} |\n"));
            format!("## Budgets\n\n| folder | most |\n|---|---:|\n{}", rows.collect::<String>())
        };
        let check = |now: [usize; 3], before: &[[usize; 3]]| {
            let pages: Vec<_> = before.iter().map(|budgets| page(*budgets)).chain(["no table".to_owned()]).collect();
            refuse_raised(&rows(&page(now), &BTreeMap::new()).unwrap(), &pages)
        };
        let before = [[90, 50, 9], [100, 60, 8]];
        assert_eq!((check([90, 50, 99], &before), check([89, 1, 1], &before)), (Ok(()), Ok(())));
        assert_eq!(check([91, 50, 9], &before).unwrap_err(), "the budget of . was 90 and may only fall: 91");
        assert_eq!(check([90, 51, 9], &before).unwrap_err(), "the budget of *.md was 50 and may only fall: 51");
        assert_eq!(check([1000, 1000, 9], &[]), Ok(()));
    }

    #[test]
    fn lines_and_words_of_files_are_counted() {
        let folder = std::env::temp_dir().join(format!("lanternfish-budgets-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        for (name, text) in [
            ("a.rs", "1\n2\n"),
            ("b.wesl", "1\n2\n3\n"),
            ("b.py", "1\n"),
            ("c.md", "four words are here\n"),
            ("d.txt", "1\n"),
        ] {
            fs::write(folder.join(name), text).unwrap();
        }
        let actual = counts(&folder, ["a.rs", "b.wesl", "b.py", "c.md", "d.txt", ""].into_iter());
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(actual, counted(&[("a.rs", 2), ("b.py", 1), ("b.wesl", 3), ("c.md", 4)]));
    }
}
