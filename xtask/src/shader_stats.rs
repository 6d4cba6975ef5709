//! `cargo xtask shader-stats`: what RADV, Mesa's compiler for AMD's graphics cards, makes of the passes that take most of a frame's
//! time, without such a card.
//!
//! The example `shader_stats` of `lanternfish-papers` compiles them. Figures are stored in
//! `docs/measured/shader-stats-mesa-VERSION.json` and compared only with those of the same version of Mesa.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    path::PathBuf,
    process::Command,
};

use serde_json::{Value, json};

use crate::{
    command::{cargo, run as step, workspace},
    files,
};

/// The cards that RADV compiles for: RDNA 2 and RDNA 3.
const CARDS: [&str; 2] = ["navi21", "navi31"];

/// 32-bit registers of a lane, percent of the most waves, bytes of a lane, bytes of a workgroup, instructions, and the compiler's
/// estimate of cycles.
const COLUMNS: [&str; 6] = ["VGPRs", "occupancy", "scratch", "LDS", "instructions", "inverse throughput"];
const OCCUPANCY: usize = 1;
const SCRATCH: usize = 2;

/// Figures in the order of [`COLUMNS`], by card and pass.
type Rows = BTreeMap<String, [u64; COLUMNS.len()]>;

/// Prints the rows that differ from those stored, and with `--write` stores them.
pub fn run(words: &[String]) -> Result<(), String> {
    let is_stored = match words {
        [] => false,
        [flag] if flag == "--write" => true,
        _ => return Err(format!("shader-stats takes --write, not {words:?}")),
    };
    let (mesa, new) = measure()?.map_err(|reason| format!("shader-stats: {reason}"))?;
    let changes = changes(&stored(&mesa).unwrap_or_default(), &new);
    changes.iter().for_each(|(line, _)| println!("{line}"));
    println!("{} rows changed", changes.len());
    if is_stored { files::write(&path(&mesa), to_json(&mesa, &new)) } else { Ok(()) }
}

/// An error if a row became worse than stored. Prints a line if this machine cannot tell.
pub fn check() -> Result<(), String> {
    let compared = measure()?.and_then(|(mesa, new)| {
        let stored = stored(&mesa).ok_or_else(|| format!("no figures of Mesa {mesa} are stored"))?;
        Ok(changes(&stored, &new))
    });
    match compared {
        Ok(changes) => verdict(&changes),
        Err(reason) => {
            eprintln!("LEFT OUT (tool): shader-stats: {reason}");
            Ok(())
        }
    }
}

fn verdict(changes: &[(String, bool)]) -> Result<(), String> {
    let worse: Vec<_> = changes.iter().filter(|(_, is_worse)| *is_worse).map(|(line, _)| line.as_str()).collect();
    if worse.is_empty() {
        return Ok(());
    }
    Err(format!(
        "hot passes lost occupancy or need more scratch:\n  {}\nIf that is worth it, run `cargo xtask shader-stats --write` and \
         commit the new figures, with the reason",
        worse.join("\n  ")
    ))
}

/// Compiles for every card. Returns Mesa's version, such as 25.0.7, and the rows; `Ok(Err(reason))` if this machine cannot.
///
/// The example is built as `cargo xtask test` builds it, so nothing is compiled twice.
fn measure() -> Result<Result<(String, Rows), String>, String> {
    step(&mut cargo(["build", "--quiet", "--workspace", "--example", "shader_stats"]))?;
    let here = env::current_exe().map_err(|error| format!("path of this program: {error}"))?;
    let (mut mesa, mut rows) = (String::new(), Rows::new());
    for card in CARDS {
        let mut example = Command::new(here.with_file_name("examples").join("shader_stats"));
        example.envs([("RADV_FORCE_FAMILY", card), ("RADV_DEBUG", "shaderstats")]);
        // The driver keeps no statistics with the shaders that it keeps.
        example.envs([("VK_LOADER_DRIVERS_SELECT", "*radeon*"), ("MESA_SHADER_CACHE_DISABLE", "1")]);
        let output = example.output().map_err(|error| format!("the example shader_stats: {error}"))?;
        let text = String::from_utf8_lossy(&output.stderr);
        match output.status.code() {
            Some(0) => {}
            Some(2) => return Ok(Err(text.trim().to_owned())),
            _ => return Err(format!("the example shader_stats: {}\n{text}", output.status)),
        }
        mesa = version(&text).ok_or_else(|| format!("no version of Mesa: {text}"))?;
        rows.extend(read(card, &text)?);
    }
    Ok(Ok((mesa, rows)))
}

/// The version in a driver's description: `radv Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)`.
fn version(text: &str) -> Option<String> {
    let version = text.split_once("Mesa ")?.1.split(|c: char| !c.is_ascii_digit() && c != '.').next()?;
    (!version.is_empty()).then(|| version.to_owned())
}

/// The rows in the example's output: after each line `@ LANES NAME`, RADV's statistics of the pass's shaders. The last one's count.
fn read(card: &str, text: &str) -> Result<Rows, String> {
    let row = |pass: &str| {
        let (head, statistics) = pass.split_once('\n')?;
        let (lanes, name) = head.split_once(' ')?;
        let lanes: u64 = lanes.parse().ok()?;
        let number = |name: &str| {
            let mut values = statistics.lines().rev().filter_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
            values.next()?.trim().parse::<u64>().ok()
        };
        // RADV counts a wave of 64 lanes twice: 16 waves of 64 lanes are 32. It states the scratch of a wave.
        let occupancy = number("Subgroups per SIMD")? * 100 / if lanes == 64 { 32 } else { 16 };
        let [scratch, lds] = [number("Scratch size")? / lanes, number("LDS size")?];
        let values =
            [number("VGPRs")?, occupancy, scratch, lds, number("Instructions")?, number("Inverse Throughput")?];
        Some((format!("{card} {name}"), values))
    };
    text.split("\n@ ").skip(1).map(|pass| row(pass).ok_or_else(|| format!("no statistics of {pass}"))).collect()
}

fn path(mesa: &str) -> PathBuf {
    workspace().join(format!("docs/measured/shader-stats-mesa-{mesa}.json"))
}

/// The rows of this version of Mesa; `None` if only those of other versions are stored.
fn stored(mesa: &str) -> Option<Rows> {
    let value: Value = serde_json::from_str(&fs::read_to_string(path(mesa)).ok()?).ok()?;
    serde_json::from_value(value["rows"].clone()).ok()
}

/// One line a row, so that a difference of two files shows rows.
fn to_json(mesa: &str, rows: &Rows) -> String {
    let rows: Vec<_> = rows.iter().map(|(name, values)| format!("{}: {}", json!(name), json!(values))).collect();
    let columns = json!(COLUMNS);
    format!("{{\n\"mesa\": {},\n\"columns\": {columns},\n\"rows\": {{\n{}\n}}\n}}\n", json!(mesa), rows.join(",\n"))
}

/// A line for each row that differs, and whether the pass became worse: occupancy is lower, or scratch is more.
fn changes(stored: &Rows, new: &Rows) -> Vec<(String, bool)> {
    let names: BTreeSet<_> = stored.keys().chain(new.keys()).collect();
    let change = |name: &String| match (stored.get(name), new.get(name)) {
        (Some(before), Some(now)) => {
            let columns = COLUMNS.iter().zip(before.iter().zip(now)).filter(|(_, (before, now))| before != now);
            let columns: Vec<_> =
                columns.map(|(column, (before, now))| format!("{column} {before} -> {now}")).collect();
            let is_worse = now[OCCUPANCY] < before[OCCUPANCY] || now[SCRATCH] > before[SCRATCH];
            (!columns.is_empty()).then(|| (format!("{name}: {}", columns.join(", ")), is_worse))
        }
        // A row that is not stored was never judged.
        (None, now) => Some((format!("{name}: new: {now:?}"), true)),
        (Some(_), None) => Some((format!("{name}: gone"), false)),
    };
    names.into_iter().filter_map(change).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example's output for one pass with this many waves of 64 lanes, counted twice, bytes of scratch a lane, and instructions.
    fn rows(waves: u64, scratch: u64, instructions: u64) -> Rows {
        let text = format!(
            "radv Mesa 25.0.7-2~bpo12+1\n@ 64 rays: soft\n\nVertex Shader:\n*** SHADER STATS ***\nVGPRs: 8\nInstructions: 1\n\n\
             Pixel Shader:\n*** SHADER STATS ***\nVGPRs: 128\nSpilled VGPRs: 3\nLDS size: 512\nScratch size: {}\n\
             Subgroups per SIMD: {waves}\nInstructions: {instructions}\nInverse Throughput: 15509\n****\n",
            64 * scratch
        );
        assert_eq!(version(&text).as_deref(), Some("25.0.7"));
        read("navi21", &text).unwrap()
    }

    #[test]
    fn statistics_are_read_and_stored_as_read() {
        let rows = rows(8, 272, 2495);
        assert_eq!(rows, Rows::from([("navi21 rays: soft".to_owned(), [128, 25, 272, 512, 2495, 15509])]));
        let json: Value = serde_json::from_str(&to_json("25.0.7", &rows)).unwrap();
        assert_eq!(serde_json::from_value::<Rows>(json["rows"].clone()).unwrap(), rows);
        assert!(read("navi21", "Mesa 25\n@ 64 rays\nVGPRs: 8\n").unwrap_err().contains("rays"));
        assert_eq!((version("amdvlk 2025.Q1"), stored("0.0.0")), (None, None));
    }

    #[test]
    fn lower_occupancy_and_more_scratch_fail_and_other_changes_do_not() {
        let now = rows(8, 272, 2495);
        assert!(changes(&now, &now).is_empty());
        for before in [rows(12, 272, 2495), rows(8, 256, 2495), Rows::default()] {
            let error = verdict(&changes(&before, &now)).unwrap_err();
            assert!(error.contains("navi21 rays: soft: ") && error.contains("shader-stats --write"), "{error}");
        }
        assert_eq!(
            changes(&rows(12, 256, 2495), &now)[0].0,
            "navi21 rays: soft: occupancy 37 -> 25, scratch 256 -> 272"
        );
        for before in [rows(4, 272, 2495), rows(8, 300, 2495), rows(8, 272, 2000)] {
            let changes = changes(&before, &now);
            assert!(changes.len() == 1 && verdict(&changes).is_ok(), "{changes:?}");
        }
    }

    /// The stored figures have every hot pass.
    #[test]
    fn every_hot_pass_is_stored() {
        let hot = include_str!("../../papers/lanternfish-papers/examples/shader_stats/hot.txt");
        let names = hot.lines().map(|line| line.split_once(" = ").expect("NAME = FILE").0);
        let expected: BTreeSet<_> = names.flat_map(|name| CARDS.map(|card| format!("{card} {name}"))).collect();
        let stored = stored("25.0.7").expect("its figures are stored");
        assert_eq!(stored.into_keys().collect::<BTreeSet<_>>(), expected);
    }
}
