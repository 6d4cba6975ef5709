//! What the papers claim, and rules by which a measured figure confirms a claim or does not.

use serde::Deserialize;

use super::query::Found;
use crate::table::Row;

/// Placeholder for a missing figure.
pub const NOT_MEASURED: &str = "not measured";

/// Verdict on a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    Confirmed,
    NotConfirmed,
    /// The reason.
    NotTestable(String),
}

impl Verdict {
    /// In one or two words.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::NotConfirmed => "not confirmed",
            Self::NotTestable(_) => "not testable here",
        }
    }
}

/// How a number is shown: its name in a rule, a factor, decimal places and what follows it.
#[derive(Clone, Copy, Debug)]
struct Unit(&'static str, f64, usize, &'static str);

const UNITS: [Unit; 7] = [
    Unit("percent", 100.0, 2, " %"),
    Unit("times", 1.0, 2, " ×"),
    Unit("ms", 1.0, 1, " ms"),
    Unit("megabytes", 1e-6, 1, " MB"),
    Unit("million_rays", 1.0, 2, " M rays/s"),
    Unit("flip", 1.0, 5, ""),
    Unit("count", 1.0, 0, ""),
];

impl Unit {
    fn show(self, number: f64) -> String {
        format!("{:.*}{}", self.2, self.1 * number, self.3)
    }
}

/// When a figure confirms a claim: `quantity: unit at least X`, `at most X` or `from X to Y`.
#[derive(Clone, Debug)]
struct Rule<'a> {
    quantity: &'a str,
    unit: Unit,
    least: Option<f64>,
    most: Option<f64>,
}

impl<'a> Rule<'a> {
    fn read(text: &'a str) -> Option<Self> {
        let (quantity, rule) = text.rsplit_once(": ")?;
        let (unit, rule) = rule.split_once(' ')?;
        let unit = *UNITS.iter().find(|known| known.0 == unit)?;
        let number = |text: &str| text.parse::<f64>().ok();
        let (least, most) =
            match (rule.strip_prefix("at least "), rule.strip_prefix("at most "), rule.strip_prefix("from ")) {
                (Some(least), ..) => (Some(number(least)?), None),
                (_, Some(most), _) => (None, Some(number(most)?)),
                (.., both) => {
                    let (least, most) = both?.split_once(" to ")?;
                    (Some(number(least)?), Some(number(most)?))
                }
            };
        Some(Self { quantity, unit, least, most })
    }

    fn holds(&self, figure: f64) -> bool {
        self.least.is_none_or(|least| figure >= least) && self.most.is_none_or(|most| figure <= most)
    }

    fn words(&self) -> String {
        let show = |limit: f64| self.unit.show(limit);
        let limits = match (self.least, self.most) {
            (Some(least), None) => format!("at least {}", show(least)),
            (None, Some(most)) => format!("at most {}", show(most)),
            (least, most) => format!("from {} to {}", show(least.unwrap_or_default()), show(most.unwrap_or_default())),
        };
        format!("confirmed if {} is {limits}", self.quantity)
    }
}

/// What was measured for a claim.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    pub value: f64,
    /// Explains the figure; stands behind it.
    pub note: String,
    /// Why it cannot confirm the claim, where it cannot.
    pub caveat: Option<String>,
}

impl Figure {
    pub fn of(value: f64, note: impl Into<String>) -> Self {
        Self { value, note: note.into(), caveat: None }
    }
}

/// A claim as it is declared.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    pub what: String,
    source: String,
    paper: String,
    rule: String,
    /// Of a graphics card's speed: a software adapter cannot test it.
    #[serde(default)]
    is_of_a_card: bool,
    /// The expression of its figure.
    #[serde(default)]
    pub figure: String,
    /// Explains the figure; an expression and a number of decimal places between `<` and `>` are shown as a number.
    #[serde(default)]
    pub note: String,
    /// A figure that no expression gives, and its arguments.
    #[serde(default)]
    pub special: String,
}

/// A claim with its verdict.
#[derive(Clone, Debug)]
pub struct Judged {
    pub claim: Claim,
    ours: String,
    value: Option<f64>,
    rule: String,
    pub verdict: Verdict,
}

impl Claim {
    /// Judges the claim by its figure.
    ///
    /// Panics if its rule cannot be read: a bug in the declaration.
    pub fn judged(&self, found: Found<Figure>, is_software: bool) -> Judged {
        let rule = Rule::read(&self.rule).unwrap_or_else(|| panic!("{}: {}", self.what, self.rule));
        let is_speed = (self.is_of_a_card && is_software)
            .then(|| "the speed of a graphics card, and this adapter is software".to_owned());
        let (value, ours, verdict) = match found {
            Err(why) => (None, NOT_MEASURED.to_owned(), Verdict::NotTestable(format!("{NOT_MEASURED}, because {why}"))),
            Ok(Figure { value, note, caveat }) => {
                let verdict = match (rule.holds(value), is_speed, caveat) {
                    (_, Some(reason), _) | (true, None, Some(reason)) => Verdict::NotTestable(reason),
                    (true, None, None) => Verdict::Confirmed,
                    (false, None, _) => Verdict::NotConfirmed,
                };
                let note = if note.is_empty() { note } else { format!(" ({note})") };
                (Some(value), rule.unit.show(value) + &note, verdict)
            }
        };
        Judged { claim: self.clone(), ours, value, rule: rule.words(), verdict }
    }
}

impl Judged {
    /// A row of the table of claims of a paper, whose key scripts get.
    pub fn row(&self, paper: &str) -> Row {
        let reason = match &self.verdict {
            Verdict::NotTestable(reason) => Some(reason),
            _ => None,
        };
        let verdict = self.verdict.name();
        Row::default()
            .data("of", paper)
            .text("claim", "claim", &self.claim.what)
            .text("source", "source", &self.claim.source)
            .text("paper", "paper", &self.claim.paper)
            .text("ours", "here", &self.ours)
            .data("value", self.value)
            .text("rule", "rule", &self.rule)
            .text("verdict", "verdict", verdict)
            .said_as(reason.map_or(verdict.to_owned(), |reason| format!("{verdict}: {reason}")))
            .data("reason", reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saving(is_of_a_card: bool) -> Claim {
        let [what, source, paper] = ["it saves", "[A, §1]", "40 %"].map(str::to_owned);
        let rule = "the saving: percent at least 0.2".to_owned();
        let [figure, note, special] = Default::default();
        Claim { what, source, paper, rule, is_of_a_card, figure, note, special }
    }

    #[test]
    fn rules_hold_and_fail() {
        for (rule, holds, fails) in [
            ("a: times at least 2", 2.0, 1.9),
            ("a: of b: times at most 2", 2.0, 2.1),
            ("a: times from 1.5 to 6", 1.5, 6.1),
        ] {
            let rule = Rule::read(rule).unwrap();
            assert!(rule.holds(holds) && !rule.holds(fails) && !rule.holds(f64::NAN), "{rule:?}");
        }
        assert!(["a: times about 2", "a: feet at least 2", "at least 2"].iter().all(|rule| Rule::read(rule).is_none()));
    }

    #[test]
    fn a_claim_is_judged_by_its_figure() {
        let verdict = |value: f64| saving(false).judged(Ok(Figure::of(value, "")), true).verdict;
        assert_eq!((verdict(0.25), verdict(0.15)), (Verdict::Confirmed, Verdict::NotConfirmed));
        assert_eq!(saving(true).judged(Ok(Figure::of(0.25, "")), false).verdict, Verdict::Confirmed);
        let software = saving(true).judged(Ok(Figure::of(0.25, "")), true);
        assert!(matches!(&software.verdict, Verdict::NotTestable(reason) if reason.contains("software")));
        assert_eq!((software.ours.as_str(), software.value), ("25.00 %", Some(0.25)), "it is shown all the same");
        let missing = saving(false).judged(Err("no row deep".to_owned()), false);
        let expected = "not measured, because no row deep".to_owned();
        assert_eq!((missing.ours.as_str(), missing.verdict), (NOT_MEASURED, Verdict::NotTestable(expected)));
    }

    #[test]
    fn a_caveat_keeps_from_confirming_alone() {
        let figure = |value| Figure { caveat: Some("too few".to_owned()), ..Figure::of(value, "of two") };
        let verdict = |value| saving(false).judged(Ok(figure(value)), false).verdict;
        assert_eq!(verdict(0.3), Verdict::NotTestable("too few".to_owned()));
        assert_eq!(verdict(0.1), Verdict::NotConfirmed);
    }

    #[test]
    fn the_rule_stands_in_the_row() {
        let row = saving(false).judged(Ok(Figure::of(0.25, "mean of 3")), false).row("a");
        assert_eq!(row.words("rule"), "confirmed if the saving is at least 20.00 %");
        assert_eq!((row.words("ours"), row.words("verdict")), ("25.00 % (mean of 3)", "confirmed"));
    }
}
