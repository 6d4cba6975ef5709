use std::{collections::BTreeSet, fs};

use super::{
    figures::{Card, Change, Compiled},
    hot::{HOT, Hot},
    page,
    stored::Stored,
    verdict,
};
use crate::command::workspace;

const RAYS: Hot = Hot { name: "rays: soft", file: "rays", entry: "trace", features: "soft bvh" };

/// A card with two variants of a file, the hot one with this many waves of 64 lanes, counted twice, and bytes of scratch a lane.
fn card(waves: u32, scratch: u32, instructions: u32) -> Card {
    let scratch = 64 * scratch;
    let table = format!(
        "shader\tentry\twave\tVGPRs\tScratch size\tLDS size\tSubgroups per SIMD\tInstructions\tInverse Throughput\n\
         rays+bvh+soft\ttrace\t64\t128\t{scratch}\t512\t{waves}\t{instructions}\t15509\n\
         rays+bvh\ttrace\t32\t64\t0\t0\t16\t900\t7000\n"
    );
    Card::of(&Compiled::read(&table).unwrap(), &[RAYS]).unwrap()
}

fn stored(card: &Card) -> Stored {
    Stored::of("25.0.7", |_| Ok(card.clone())).unwrap()
}

fn changes(before: &Card, now: &Card) -> Vec<Change> {
    stored(now).changes(&stored(before), Card::hot_changes)
}

#[test]
fn lower_occupancy_and_more_scratch_of_a_hot_pass_fail() {
    let now = card(8, 272, 2495);
    assert!(verdict(&changes(&now, &now)).is_ok());
    for doctored in [card(12, 272, 2495), card(8, 256, 2495), Card::default()] {
        let error = verdict(&changes(&doctored, &now)).unwrap_err();
        assert!(error.contains("navi21 rays: soft: ") && error.contains("navi31 rays: soft: "), "{error}");
        assert!(error.contains("shader-stats --write"), "{error}");
    }
    let error = verdict(&changes(&card(12, 256, 2495), &now)).unwrap_err();
    assert!(error.contains("occupancy 37 -> 25, scratch 256 -> 272"), "{error}");
}

#[test]
fn other_changes_are_told_and_do_not_fail() {
    let now = card(8, 272, 2495);
    for before in [card(4, 272, 2495), card(8, 300, 2495), card(8, 272, 2000)] {
        assert_eq!(changes(&before, &now).len(), 2);
        assert!(verdict(&changes(&before, &now)).is_ok());
    }
    let passes = stored(&now).changes(&stored(&card(8, 272, 2000)), Card::pass_changes);
    assert_eq!(passes[0].line, "navi21 rays trace, 2 variants: instructions 900–2000 -> 900–2495");
    assert!(verdict(&passes).is_ok());
}

#[test]
fn stored_figures_are_read_as_written_and_those_of_another_mesa_not_compared() {
    let figures = stored(&card(8, 272, 2495));
    assert_eq!(Stored::parse(&figures.to_json()), Some(figures));
    assert_eq!((Stored::parse("{}"), Stored::read("0.0.0")), (None, Ok(None)));
}

#[test]
fn a_hot_pass_that_is_not_compiled_is_an_error() {
    let gone = Hot { entry: "gone", ..RAYS };
    assert!(Card::of(&[], &[gone]).unwrap_err().contains("no entry point gone of rays+bvh+soft"));
}

/// Every hot pass is in the stored figures, and every figure on their page.
#[test]
fn pages_have_all_stored_figures() {
    let hot: BTreeSet<_> = HOT.iter().map(|hot| hot.name.to_owned()).collect();
    assert_eq!(hot.len(), HOT.len(), "a name twice");
    let mut count = 0;
    for entry in fs::read_dir(workspace().join("docs/measured")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let Some(mesa) = name.strip_prefix("shader-stats-mesa-").and_then(|name| name.strip_suffix(".json")) else {
            continue;
        };
        let stored = Stored::read(mesa).unwrap().unwrap();
        assert_eq!(stored.mesa, mesa);
        for (card, figures) in &stored.cards {
            assert_eq!(figures.hot.keys().cloned().collect::<BTreeSet<_>>(), hot, "{name}: {card}");
        }
        let page = page::of(&stored);
        let passes = stored.cards.values().flat_map(|card| card.passes.keys());
        assert!(passes.into_iter().all(|pass| page.contains(&format!("| {pass}, "))), "{name}");
        count += 1;
    }
    assert!(count > 0);
}
