//! `lanternfish merge`: adds the parts of one ground truth.
//!
//! Each part stores its sums as integers (`lanternfish_reference::Film`), so addition is exact: the image equals that of a
//! single run to the bit, for any division. Fingerprint and seed must be equal in all parts.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use clap::Args;
use lanternfish_metrics::{MetricsError, read_exr_attributes};
use lanternfish_reference::{Film, settings::Integrator};

use super::{
    file::{self, DROPPED, FINGERPRINT, Look, Making, NOISE, PART, ROW_SAMPLES, SAMPLES, SEED, Target},
    sums,
};
use crate::{
    error::{CliError, say},
    output,
    parse::{self, Span},
};

pub const HELP: &str = "\
Examples:
  A ground truth of 1024 samples per pixel, traced on two machines:
    lanternfish reference shot.toml --samples 1-512 -o a.exr
    lanternfish reference shot.toml --samples 513-1024 -o b.exr
    lanternfish merge a.exr b.exr -o reference.exr
  gives the same file as
    lanternfish reference shot.toml --spp 1024 -o reference.exr

Parts may be cut anywhere and given in any order, but without gaps between them. Parts that
do not begin with sample 1 make a larger part, which can be merged again.
The last line of standard output is the image's path.";

#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Parts that `lanternfish reference --samples` wrote.
    #[arg(required = true, value_name = "PART.exr")]
    pub parts: Vec<PathBuf>,
    /// The merged image.
    #[arg(short, long, value_name = "FILE.exr")]
    pub output: PathBuf,
}

/// A part whose sums are not read yet.
struct Part<'a> {
    path: &'a Path,
    attributes: BTreeMap<String, String>,
    range: Span<u64>,
}

pub fn run(args: &MergeArgs) -> Result<(), CliError> {
    let target = Target::choose(args.output.clone(), None, false)?;
    if target.is_png() {
        let what = format!("{}: a ground truth is written as EXR", target.path.display());
        return Err(CliError::new(what, "end the name with .exr"));
    }
    let parts: Vec<_> = args.parts.iter().map(|part| (part.as_path(), "a part")).collect();
    output::refuse_same(&[(&target.path, "the merged image")], &parts)?;
    let mut parts = args.parts.iter().map(|path| Part::open(path)).collect::<Result<Vec<_>, _>>()?;
    parts.sort_by_key(|part| part.range.first);
    for (part, next) in parts.iter().zip(&parts[1..]) {
        parts[0].check_same(next)?;
        part.check_follows(next)?;
    }

    let (first, last) = (&parts[0], &parts[parts.len() - 1]);
    let mut film = first.film()?;
    for part in &parts[1..] {
        film.add_next(&part.film()?)?;
    }
    let range = Span { first: first.range.first, last: last.range.last };
    let making = Making {
        fingerprint: first.attributes[FINGERPRINT].clone(),
        seed: first.number(SEED)?,
        part: (range.first > 1).then_some(range),
        facts: first.facts(),
    };
    let dropped = parts.iter().map(|part| part.number(DROPPED)).sum::<Result<u64, _>>()?;
    let look = Look::plain(Integrator::Path);
    target.write(&film, &making, dropped, &look)?;
    let (path, error) = (target.path.display(), 100.0 * film.noise().relative);
    say(&format_args!("{path}: samples {range} of a pixel, of {} parts, expected error {error:.2} %", parts.len()));
    if making.part.is_some() {
        say(&format_args!("note: the result is a part: samples 1-{} are missing before it", range.first - 1));
    }
    output::print(&format!("{path}\n"))
}

impl<'a> Part<'a> {
    fn open(path: &'a Path) -> Result<Self, CliError> {
        let attributes = read_exr_attributes(path).map_err(unreadable)?;
        let range = attributes.get(PART).and_then(|text| parse::samples(text).ok());
        let Some(range) = range.filter(|_| attributes.contains_key(FINGERPRINT)) else {
            let what = format!("{}: not a part of a ground truth", path.display());
            return Err(CliError::new(what, "name files that `lanternfish reference --samples A-B` wrote"));
        };
        let part = Self { path, attributes, range };
        let (has, wanted) = (part.number(SAMPLES)?, range.last - range.first + 1);
        if has != wanted || part.attributes.contains_key(ROW_SAMPLES) {
            let what = format!("{}: it has {has} of its {wanted} samples, {range}", path.display());
            return Err(CliError::new(what, "continue it: repeat its command with --resume"));
        }
        Ok(part)
    }

    fn number(&self, name: &str) -> Result<u64, CliError> {
        self.attributes.get(name).and_then(|text| text.parse().ok()).ok_or_else(|| {
            CliError::new(format_args!("{}: no number in {name}", self.path.display()), "trace this part again")
        })
    }

    /// Its other settings, as text attributes.
    fn facts(&self) -> Vec<(String, String)> {
        let own = [SAMPLES, SEED, DROPPED, NOISE, FINGERPRINT, PART];
        let facts = self
            .attributes
            .iter()
            .filter(|(name, _)| name.starts_with("lanternfish.") && !own.contains(&name.as_str()));
        facts.map(|(name, value)| (name.clone(), value.clone())).collect()
    }

    fn check_same(&self, other: &Self) -> Result<(), CliError> {
        let failed = |why: &str| {
            let what =
                format!("{}: not of the same ground truth as {}: {why}", other.path.display(), self.path.display());
            Err(CliError::new(what, "trace the parts with the same command, except for --samples and -o"))
        };
        if self.attributes[FINGERPRINT] != other.attributes[FINGERPRINT] {
            return failed(&file::differences(&other.attributes, &self.facts(), "in the other"));
        }
        let (seed, its) = (self.number(SEED)?, other.number(SEED)?);
        if seed != its {
            return failed(&format!("its seed is {its}, not {seed}"));
        }
        Ok(())
    }

    fn check_follows(&self, next: &Self) -> Result<(), CliError> {
        let (end, first) = (self.range.last, next.range.first);
        if first <= end {
            let what = format!(
                "{} and {}: both have samples {}",
                self.path.display(),
                next.path.display(),
                Span { first, last: end.min(next.range.last) }
            );
            return Err(CliError::new(what, "leave one of them out, or trace it again with other --samples"));
        }
        if first > end + 1 {
            let missing = Span { first: end + 1, last: first - 1 };
            let what = format!("samples {missing} are in none of the parts");
            return Err(CliError::new(what, format!("trace them: lanternfish reference … --samples {missing}")));
        }
        Ok(())
    }

    fn film(&self) -> Result<Film, CliError> {
        let sums = sums::read(self.path).map_err(unreadable)?;
        let unsized_ = || CliError::new(format_args!("{}: no size", self.path.display()), "trace this part again");
        let size =
            self.attributes.get("lanternfish.size").and_then(|size| parse::size(size).ok()).ok_or_else(unsized_)?;
        let rows = vec![self.number(SAMPLES)?; size.height as usize];
        Ok(Film::resume_part(size.width as usize, &rows, self.range.first - 1, sums.into_iter())?)
    }
}

fn unreadable(error: MetricsError) -> CliError {
    CliError::new(error, "trace this part again")
}
