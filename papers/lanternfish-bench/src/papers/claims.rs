//! What the papers claim, and rules by which a measured figure confirms a claim or does not.

use serde::Deserialize;

use super::{
    measure::{Basis, Measure},
    query::Found,
};
use crate::table::Row;

/// Placeholder for a missing figure.
pub const NOT_MEASURED: &str = "not measured";

/// Verdict on a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// By counts, memory or errors where there is no basis; else by times, whose whole interval fulfils the rule.
    Confirmed(Option<Basis>),
    /// The interval of times fulfils the rule in part.
    WithinNoise,
    NotConfirmed,
    /// The reason.
    NotTestable(String),
}

impl Verdict {
    /// The names of all, with their keys.
    pub const NAMES: [(&str, &str); 6] = [
        ("by_counts", "confirmed by counts"),
        ("by_pairs", "confirmed by paired times"),
        ("by_times_apart", "confirmed by times apart"),
        ("within_noise", "within noise"),
        ("not_confirmed", "not confirmed"),
        ("not_testable", "not testable here"),
    ];

    /// In a few words.
    pub fn name(&self) -> &'static str {
        Self::NAMES[match self {
            Self::Confirmed(None) => 0,
            Self::Confirmed(Some(Basis::Pairs(_))) => 1,
            Self::Confirmed(Some(Basis::Apart)) => 2,
            Self::WithinNoise => 3,
            Self::NotConfirmed => 4,
            Self::NotTestable(_) => 5,
        }]
        .1
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

    /// The verdict on a figure, or on the interval of one of times.
    fn verdict(&self, measure: &Measure) -> Verdict {
        match measure.interval() {
            None if self.holds(measure.value) => Verdict::Confirmed(None),
            None => Verdict::NotConfirmed,
            Some((interval, basis)) if interval.iter().all(|end| self.holds(*end)) => Verdict::Confirmed(Some(basis)),
            // Of a time that is not a number no end is beyond a limit.
            Some(([low, high], _)) => {
                let is_beyond =
                    self.least.is_some_and(|least| high < least) || self.most.is_some_and(|most| low > most);
                if is_beyond || !measure.value.is_finite() { Verdict::NotConfirmed } else { Verdict::WithinNoise }
            }
        }
    }

    /// An interval and what it rests on.
    fn interval_words(&self, ([low, high], basis): ([f64; 2], Basis)) -> String {
        let (low, high) = (self.unit.show(low), self.unit.show(high));
        match basis {
            Basis::Pairs(count) => format!("median of {count} pairs, 95 %: {low} to {high}"),
            Basis::Apart => format!("{low} to {high}"),
        }
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
    pub measure: Measure,
    /// Explains the figure; stands behind it.
    pub note: String,
    /// Why it cannot confirm the claim, where it cannot.
    pub caveat: Option<String>,
}

impl Figure {
    pub fn of(measure: Measure, note: impl Into<String>) -> Self {
        Self { measure, note: note.into(), caveat: None }
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
    /// Values that the paper does not state and that are chosen here, on which the figure rests.
    #[serde(default)]
    fitted: String,
}

/// A claim with its verdict.
#[derive(Clone, Debug)]
pub struct Judged {
    pub claim: Claim,
    ours: String,
    value: Option<f64>,
    interval: Option<[f64; 2]>,
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
        let mut judged = Judged {
            claim: self.clone(),
            ours: NOT_MEASURED.to_owned(),
            value: None,
            interval: None,
            rule: rule.words(),
            verdict: Verdict::NotTestable(String::new()),
        };
        if !self.fitted.is_empty() {
            judged.rule += &format!("; fitted: {}", self.fitted);
        }
        match found {
            Err(why) => judged.verdict = Verdict::NotTestable(format!("{NOT_MEASURED}, because {why}")),
            Ok(Figure { measure, note, caveat }) => {
                judged.verdict = match (rule.verdict(&measure), is_speed, caveat) {
                    (_, Some(reason), _) | (Verdict::Confirmed(_), None, Some(reason)) => Verdict::NotTestable(reason),
                    (verdict, ..) => verdict,
                };
                let value = measure.decisive();
                let notes = [note, measure.interval().map_or(String::new(), |interval| rule.interval_words(interval))];
                let notes: Vec<String> = notes.into_iter().filter(|note| !note.is_empty()).collect();
                let notes = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
                judged.ours = rule.unit.show(value) + &notes;
                (judged.value, judged.interval) = (Some(value), measure.interval().map(|(interval, _)| interval));
            }
        }
        judged
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
        let fitted = if self.claim.fitted.is_empty() { "" } else { ", fitted" };
        Row::default()
            .data("of", paper)
            .text("claim", "claim", &self.claim.what)
            .text("source", "source", &self.claim.source)
            .text("paper", "paper", &self.claim.paper)
            .text("ours", "here", &self.ours)
            .data("value", self.value)
            .data("interval", self.interval)
            .data("fitted", !self.claim.fitted.is_empty())
            .text("rule", "rule", &self.rule)
            .text("verdict", "verdict", verdict)
            .said_as(reason.map_or(verdict.to_owned() + fitted, |reason| format!("{verdict}: {reason}")))
            .data("reason", reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(value: f64) -> Figure {
        Figure::of(Measure::exact(value), "")
    }

    fn saving(is_of_a_card: bool) -> Claim {
        let [what, source, paper] = ["it saves", "[A, §1]", "40 %"].map(str::to_owned);
        let rule = "the saving: percent at least 0.2".to_owned();
        let [figure, note, special, fitted] = Default::default();
        Claim { what, source, paper, rule, is_of_a_card, figure, note, special, fitted }
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
        let verdict = |value: f64| saving(false).judged(Ok(figure(value)), true).verdict;
        assert_eq!((verdict(0.25), verdict(0.15)), (Verdict::Confirmed(None), Verdict::NotConfirmed));
        assert_eq!(saving(true).judged(Ok(figure(0.25)), false).verdict, Verdict::Confirmed(None));
        let software = saving(true).judged(Ok(figure(0.25)), true);
        assert!(matches!(&software.verdict, Verdict::NotTestable(reason) if reason.contains("software")));
        assert_eq!((software.ours.as_str(), software.value), ("25.00 %", Some(0.25)), "it is shown all the same");
        let missing = saving(false).judged(Err("no row deep".to_owned()), false);
        let expected = "not measured, because no row deep".to_owned();
        assert_eq!((missing.ours.as_str(), missing.verdict), (NOT_MEASURED, Verdict::NotTestable(expected)));
    }

    #[test]
    fn a_caveat_keeps_from_confirming_alone() {
        let figure = |value| Figure { caveat: Some("too few".to_owned()), ..figure(value) };
        let verdict = |value| saving(false).judged(Ok(figure(value)), false).verdict;
        assert_eq!(verdict(0.3), Verdict::NotTestable("too few".to_owned()));
        assert_eq!(verdict(0.1), Verdict::NotConfirmed);
    }

    #[test]
    fn an_interval_of_times_decides_as_a_whole() {
        let verdict = |runs: &[f64]| {
            let measure = Measure::time(runs[0], runs.to_vec(), 1.5, Some("rows".to_owned()));
            saving(false).judged(Ok(Figure::of(measure, "")), true)
        };
        let judged = verdict(&[0.21, 0.22, 0.23, 0.24, 0.25, 0.26]);
        assert_eq!(judged.verdict, Verdict::Confirmed(Some(Basis::Pairs(6))));
        assert_eq!(judged.ours, "23.50 % (median of 6 pairs, 95 %: 21.00 % to 26.00 %)");
        assert_eq!(verdict(&[0.19, 0.22, 0.23, 0.24, 0.25, 0.26]).verdict, Verdict::WithinNoise);
        assert_eq!(verdict(&[0.1, 0.11, 0.12, 0.13, 0.14, 0.15]).verdict, Verdict::NotConfirmed);
        // Few runs have the margin.
        assert_eq!(verdict(&[0.21]).verdict, Verdict::WithinNoise);
        assert_eq!(verdict(&[0.4]).verdict, Verdict::Confirmed(Some(Basis::Apart)));
        assert_eq!(verdict(&[f64::NAN]).verdict, Verdict::NotConfirmed);
    }

    #[test]
    fn the_rule_stands_in_the_row() {
        let fitted = Claim { fitted: "a spacing of 0.02".to_owned(), ..saving(false) };
        let row = fitted.judged(Ok(Figure { note: "mean of 3".to_owned(), ..figure(0.25) }), false).row("a");
        assert_eq!(row.words("rule"), "confirmed if the saving is at least 20.00 %; fitted: a spacing of 0.02");
        assert_eq!((row.words("ours"), row.words("verdict")), ("25.00 % (mean of 3)", "confirmed by counts, fitted"));
    }
}
