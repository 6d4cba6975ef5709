//! `cargo xtask shader-stats`: what RADV, Mesa's compiler for AMD's graphics cards, makes of every shader, without such a card.
//!
//! The figures are stored in `docs/measured/shader-stats-mesa-VERSION.json`, of which `--page` prints a page. They are compared only with those of the same
//! version of Mesa.

mod figures;
mod hot;
mod page;
mod stored;
#[cfg(test)]
mod tests;
mod tool;

use figures::{Card, Change};
use hot::HOT;
use stored::Stored;
use tool::{Tool, Wanted};

/// The cards that RADV compiles for: RDNA 2 and RDNA 3.
const CARDS: [&str; 2] = ["navi21", "navi31"];

/// Compiles every variant and prints the rows that changed, or, given a text, the rows of the variants whose names contain it.
pub fn run(words: &[String]) -> Result<(), String> {
    let (is_stored, text) = match words {
        [] => (false, None),
        [flag, mesa] if flag == "--page" => {
            let stored = Stored::read(mesa)?.ok_or_else(|| format!("no figures of Mesa {mesa} are stored"))?;
            print!("{}", page::of(&stored));
            return Ok(());
        }
        [flag] if flag == "--write" => (true, None),
        [text] if !text.starts_with('-') => (false, Some(text)),
        _ => {
            return Err(format!("shader-stats takes --write, --page MESA or a part of a shader's name, not {words:?}"));
        }
    };
    let tool = Tool::ready()?.map_err(|reason| format!("shader-stats: {reason}"))?;
    if let Some(text) = text {
        let shaders = tool::link(&Wanted::Containing(text.clone()))?;
        for card in CARDS {
            println!("{}", page::variants(card, &tool.compile(card, &shaders)?));
        }
        return Ok(());
    }
    let shaders = tool::link(&Wanted::Usual)?;
    let new = Stored::of(&tool.mesa, |card| Card::of(&tool.compile(card, &shaders)?, &HOT))?;
    match Stored::read(&tool.mesa)? {
        Some(stored) => {
            let changes = [Card::hot_changes, Card::pass_changes].map(|of| new.changes(&stored, of)).concat();
            changes.iter().for_each(|change| println!("{}", change.line));
            println!("{} rows changed", changes.len());
        }
        None => println!("no figures of Mesa {} are stored", tool.mesa),
    }
    if is_stored { new.write() } else { Ok(()) }
}

/// Compares the hot passes with the stored figures. Prints a line if this machine cannot.
pub fn check() -> Result<(), String> {
    let left_out = |reason: String| {
        eprintln!("LEFT OUT (tool): shader-stats: {reason}");
        Ok(())
    };
    let tool = match Tool::ready()? {
        Ok(tool) => tool,
        Err(reason) => return left_out(reason),
    };
    let Some(stored) = Stored::read(&tool.mesa)? else {
        return left_out(format!("no figures of Mesa {} are stored", tool.mesa));
    };
    let shaders = tool::link(&Wanted::Named(HOT.iter().map(|hot| hot.shader()).collect()))?;
    let new = Stored::of(&tool.mesa, |card| Card::of(&tool.compile(card, &shaders)?, &HOT))?;
    verdict(&new.changes(&stored, Card::hot_changes))
}

/// An error if a hot pass became worse.
fn verdict(changes: &[Change]) -> Result<(), String> {
    let worse: Vec<_> = changes.iter().filter(|change| change.is_worse).map(|change| change.line.as_str()).collect();
    if worse.is_empty() {
        return Ok(());
    }
    Err(format!(
        "hot passes lost occupancy or need more scratch:\n  {}\nIf that is worth it, run `cargo xtask shader-stats --write` and \
         commit the new figures, with the reason",
        worse.join("\n  ")
    ))
}
