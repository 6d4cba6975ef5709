//! The stored figures.

use std::{collections::BTreeMap, fs, path::PathBuf};

use serde_json::{Value, json};

use super::{
    CARDS,
    figures::{COLUMNS, Card, Change},
    tool,
};
use crate::{command::workspace, files};

/// The figures of one version of Mesa.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    pub mesa: String,
    pub naga: String,
    /// By the name of the card.
    pub cards: BTreeMap<String, Card>,
}

impl Stored {
    /// The figures that `card` makes of each card.
    pub fn of(mesa: &str, card: impl Fn(&str) -> Result<Card, String>) -> Result<Self, String> {
        let lock = files::read(&workspace().join("shader-stats/Cargo.lock"))?;
        let naga = tool::naga(&lock).ok_or("shader-stats/Cargo.lock has no naga")?.to_owned();
        let cards = CARDS.into_iter().map(|name| Ok((name.to_owned(), card(name)?))).collect::<Result<_, String>>()?;
        Ok(Self { mesa: mesa.to_owned(), naga, cards })
    }

    fn path(mesa: &str) -> PathBuf {
        workspace().join(format!("docs/measured/shader-stats-mesa-{mesa}.json"))
    }

    /// The figures of this version of Mesa; `None` if only those of other versions are stored.
    pub fn read(mesa: &str) -> Result<Option<Self>, String> {
        let path = Self::path(mesa);
        let Ok(text) = fs::read_to_string(&path) else { return Ok(None) };
        Self::parse(&text).map(Some).ok_or_else(|| format!("{}: not figures of shaders", path.display()))
    }

    /// Writes the figures.
    pub fn write(&self) -> Result<(), String> {
        let path = Self::path(&self.mesa);
        files::write(&path, self.to_json())?;
        println!("wrote {}", path.display());
        Ok(())
    }

    pub fn parse(text: &str) -> Option<Self> {
        let all: Value = serde_json::from_str(text).ok()?;
        let string = |name: &str| Some(all[name].as_str()?.to_owned());
        let cards = all["cards"].as_object()?.iter().map(|(name, card)| Some((name.clone(), Card::from_json(card)?)));
        (all["columns"] == json!(COLUMNS)).then_some(Self {
            mesa: string("mesa")?,
            naga: string("naga")?,
            cards: cards.collect::<Option<_>>()?,
        })
    }

    pub fn to_json(&self) -> String {
        let cards: Vec<_> =
            self.cards.iter().map(|(name, card)| format!("{}: {}", json!(name), card.to_json())).collect();
        let [mesa, naga, columns] = [json!(self.mesa), json!(self.naga), json!(COLUMNS)];
        let cards = cards.join(",\n");
        format!("{{\n\"mesa\": {mesa},\n\"naga\": {naga},\n\"columns\": {columns},\n\"cards\": {{\n{cards}\n}}\n}}\n")
    }

    /// The changes of each card that `of` finds, with the card's name.
    pub fn changes(&self, stored: &Self, of: fn(&Card, &Card) -> Vec<Change>) -> Vec<Change> {
        let none = Card::default();
        let change = |(name, card): (&String, &Card)| {
            let changes = of(card, stored.cards.get(name).unwrap_or(&none));
            let named = |change: Change| Change { line: format!("{name} {}", change.line), ..change };
            changes.into_iter().map(named).collect::<Vec<_>>()
        };
        self.cards.iter().flat_map(change).collect()
    }
}
