//! `cargo xtask images`: makes the images of the gallery and of "any file" again, with the commands that their pages show.
//!
//! They are those that a block of commands follows, which names them. It runs as it stands in the image's folder.
//! `docs/images/made.txt` holds for each its name, the day on which it was made, and hashes of the file and of the block.

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{command, command::workspace, files, program};

/// Pages with images and their commands.
const PAGES: [&str; 2] = ["docs/gallery.md", "docs/any-file.md"];
/// When and from what they were made.
const MADE: &str = "docs/images/made.txt";

/// An image that a page's commands make.
struct Image {
    /// Its path.
    path: PathBuf,
    commands: String,
}

/// The images of a page in this folder: an image, and before the next image a block of commands that names its file.
fn images_of<'a>(page: &'a str, folder: &'a Path) -> impl Iterator<Item = Image> + 'a {
    page.split("\n![").skip(1).filter_map(move |part| {
        let (link, rest) = part.split_once("](")?.1.split_once(')')?;
        let commands = rest.split_once("```sh\n")?.1.split_once("```")?.0;
        let path = folder.join(link);
        commands.contains(path.file_name()?.to_str()?).then(|| Image { path, commands: commands.to_owned() })
    })
}

/// The images of all pages.
fn images() -> Result<Vec<Image>, String> {
    let mut all = Vec::new();
    for page in PAGES {
        let path = workspace().join(page);
        all.extend(images_of(&files::read(&path)?, path.parent().expect("a page lies in a folder")));
    }
    Ok(all)
}

impl Image {
    fn name(&self) -> String {
        self.path.file_stem().expect("images are files").to_string_lossy().into_owned()
    }

    /// What `made.txt` holds of it if it was made on this day.
    fn line(&self, day: &str) -> Result<String, String> {
        let file = files::at(&self.path, fs::read(&self.path))?;
        Ok(format!(
            "{} {day} {:016x} {:016x}",
            self.name(),
            files::hash([&file[..]]),
            files::hash([self.commands.as_bytes()])
        ))
    }
}

/// Makes the images of these names, or all.
pub fn run(names: &[String], may_install: bool) -> Result<(), String> {
    program::ready_for_release(may_install)?;
    let images = images()?;
    if let Some(name) = names.iter().find(|name| images.iter().all(|image| image.name() != **name)) {
        let known: Vec<_> = images.iter().map(Image::name).collect();
        return Err(format!("no image {name:?}: {}", known.join(", ")));
    }
    let made_path = workspace().join(MADE);
    let mut made = files::read(&made_path).unwrap_or_default();
    let path =
        format!("{}:{}", workspace().join("target/release").display(), std::env::var("PATH").unwrap_or_default());
    for image in images.iter().filter(|image| names.is_empty() || names.contains(&image.name())) {
        println!("{}", image.path.display());
        let mut shell = Command::new("sh");
        shell.args(["-ec", &image.commands]).env("PATH", &path);
        command::run(shell.current_dir(image.path.parent().expect("an image lies in a folder")))?;
        let today = command::run_for_output(Command::new("date").args(["-u", "+%F"]))?;
        let others = made.lines().filter(|line| line.split(' ').next() != Some(&image.name()));
        let mut lines: Vec<String> = others.map(str::to_owned).collect();
        lines.push(image.line(today.trim())?);
        lines.sort();
        made = lines.iter().fold(String::new(), |mut text, line| {
            writeln!(text, "{line}").expect("text takes lines");
            text
        });
        files::write(&made_path, &made)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Days that an image may be older than the last commit.
    const OLDEST: i64 = 60;

    /// Days since the year 0 of a date YYYY-MM-DD, each month of 31 days.
    fn days(date: &str) -> Option<i64> {
        let [year, month, day] = date.trim().splitn(3, '-').collect::<Vec<_>>().try_into().ok()?;
        Some((year.parse::<i64>().ok()? * 12 + month.parse::<i64>().ok()?) * 31 + day.parse::<i64>().ok()?)
    }

    /// What is wrong with an image by what `made.txt` has of it.
    fn fault(image: &Image, made: &str, last_commit: Option<&str>) -> Option<String> {
        let name = image.name();
        let Some(line) = made.lines().find(|line| line.split(' ').next() == Some(&name)) else {
            return Some(format!("{name} was never made"));
        };
        let day = line.split(' ').nth(1)?;
        if image.line(day).as_deref() != Ok(line) {
            return Some(format!("{name}: the file or its commands changed since it was made"));
        }
        let age = days(last_commit?)? - days(day)?;
        (age > OLDEST).then(|| format!("{name} is {age} days older than the last commit"))
    }

    #[test]
    fn images_are_made_by_their_pages_commands_and_not_old() {
        let made = files::read(&workspace().join(MADE)).unwrap();
        // Without Git, in a package, no date is known.
        let log = Command::new("git").current_dir(workspace()).args(["log", "-1", "--format=%cs"]).output();
        let last = log.ok().filter(|log| log.status.success()).map(|log| String::from_utf8(log.stdout).unwrap());
        let images = images().unwrap();
        assert!(images.len() >= 6, "{} images", images.len());
        let faults: Vec<_> = images.iter().filter_map(|image| fault(image, &made, last.as_deref())).collect();
        assert!(faults.is_empty(), "cargo xtask images: {faults:#?}");
    }

    #[test]
    fn old_and_changed_images_are_told() {
        let folder = workspace().join("docs");
        let page =
            "# A\n\n![x](images/walk.gif)\n\n```sh\nlanternfish render a.glb -o walk.gif\n```\n\n![y](images/y.png)\n";
        let [image] = images_of(page, &folder).collect::<Vec<_>>().try_into().ok().unwrap();
        let made = image.line("2026-01-31").unwrap();
        assert_eq!(fault(&image, &made, Some("2026-02-20\n")), None);
        assert!(fault(&image, &made, Some("2026-06-01")).unwrap().contains("older"));
        assert!(fault(&image, "", None).unwrap().contains("never"));
        let other = Image { commands: "lanternfish render b.glb -o walk.gif\n".into(), ..image };
        assert!(fault(&other, &made, None).unwrap().contains("changed"));
    }
}
