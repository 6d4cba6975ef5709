//! What the papers claim, and rules by which a measured figure confirms a claim or does not.

use super::reports::Found;
use crate::table::Row;

/// Placeholder for a missing figure.
pub const NOT_MEASURED: &str = "not measured";

/// Of a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    Confirmed,
    NotConfirmed,
    /// Why.
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

    fn words(&self) -> String {
        match self {
            Self::NotTestable(reason) => format!("{}: {reason}", self.name()),
            _ => self.name().to_owned(),
        }
    }
}

/// How a number is shown.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    factor: f64,
    digits: usize,
    name: &'static str,
}

impl Unit {
    const fn new(factor: f64, digits: usize, name: &'static str) -> Self {
        Self { factor, digits, name }
    }

    pub const PERCENT: Self = Self::new(100.0, 2, " %");
    pub const TIMES: Self = Self::new(1.0, 2, " ×");
    pub const MS: Self = Self::new(1.0, 1, " ms");
    pub const MEGABYTES: Self = Self::new(1e-6, 1, " MB");
    pub const MILLION_RAYS: Self = Self::new(1.0, 2, " M rays/s");
    pub const FLIP: Self = Self::new(1.0, 5, "");
    pub const COUNT: Self = Self::new(1.0, 0, "");

    pub fn show(self, number: f64) -> String {
        format!("{:.*}{}", self.digits, self.factor * number, self.name)
    }
}

/// When a figure confirms a claim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    AtLeast(f64),
    AtMost(f64),
    Between(f64, f64),
}

impl Rule {
    /// At least half of what the paper gains.
    pub fn half_of(gain: f64) -> Self {
        Self::AtLeast(0.5 * gain)
    }

    /// At most twice the paper's, and at least half of it.
    pub fn within_twice(figure: f64) -> Self {
        Self::Between(0.5 * figure, 2.0 * figure)
    }

    pub fn holds(self, figure: f64) -> bool {
        match self {
            Self::AtLeast(least) => figure >= least,
            Self::AtMost(most) => figure <= most,
            Self::Between(least, most) => (least..=most).contains(&figure),
        }
    }

    fn words(self, unit: Unit) -> String {
        match self {
            Self::AtLeast(least) => format!("at least {}", unit.show(least)),
            Self::AtMost(most) => format!("at most {}", unit.show(most)),
            Self::Between(least, most) => format!("from {} to {}", unit.show(least), unit.show(most)),
        }
    }
}

/// What was measured for a claim.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    value: f64,
    /// Of what it is, behind the figure.
    note: String,
    /// Why it cannot confirm the claim, where it cannot.
    caveat: Option<String>,
}

impl Figure {
    pub fn of(value: f64, note: impl Into<String>) -> Self {
        Self { value, note: note.into(), caveat: None }
    }

    /// Where the rule holds, the claim is not testable all the same.
    pub fn with_caveat(self, caveat: Option<String>) -> Self {
        Self { caveat, ..self }
    }
}

impl From<f64> for Figure {
    fn from(value: f64) -> Self {
        Self::of(value, "")
    }
}

/// A claim that is not yet judged.
#[derive(Clone, Debug)]
pub struct Claim {
    what: String,
    source: &'static str,
    paper: String,
    quantity: &'static str,
    unit: Unit,
    rule: Rule,
    /// Why its figure, a speed or a time, says nothing on this adapter.
    reason: Option<String>,
}

/// A claim: in words, its place in the paper, and the paper's figure.
pub fn claim(what: impl Into<String>, source: &'static str, paper: impl Into<String>) -> Claim {
    let (what, paper) = (what.into(), paper.into());
    Claim { what, source, paper, quantity: "", unit: Unit::COUNT, rule: Rule::AtLeast(0.0), reason: None }
}

impl Claim {
    /// The rule, and what it is a rule of.
    pub fn confirmed_if(self, quantity: &'static str, unit: Unit, rule: Rule) -> Self {
        Self { quantity, unit, rule, ..self }
    }

    /// Of a graphics card's speed: a software adapter cannot test it.
    pub fn of_a_card(self, is_software: bool) -> Self {
        let reason = "the speed of a graphics card, and this adapter is software";
        Self { reason: is_software.then(|| reason.to_owned()), ..self }
    }

    pub fn judged(self, found: Found<impl Into<Figure>>) -> Judged {
        let Self { what, source, paper, quantity, unit, rule, reason } = self;
        let rule_in_words = format!("confirmed if {quantity} is {}", rule.words(unit));
        let (value, ours, verdict) = match found.map(Into::into) {
            Err(why) => (None, NOT_MEASURED.to_owned(), Verdict::NotTestable(format!("{NOT_MEASURED}, because {why}"))),
            Ok(Figure { value, note, caveat }) => {
                let verdict = match (rule.holds(value), reason, caveat) {
                    (_, Some(reason), _) | (true, None, Some(reason)) => Verdict::NotTestable(reason),
                    (true, None, None) => Verdict::Confirmed,
                    (false, None, _) => Verdict::NotConfirmed,
                };
                let note = if note.is_empty() { note } else { format!(" ({note})") };
                (Some(value), unit.show(value) + &note, verdict)
            }
        };
        Judged { what, source, paper, ours, value, rule: rule_in_words, verdict }
    }
}

/// A claim with its verdict.
#[derive(Clone, Debug)]
pub struct Judged {
    pub what: String,
    source: &'static str,
    paper: String,
    ours: String,
    value: Option<f64>,
    rule: String,
    pub verdict: Verdict,
}

impl Judged {
    /// A row of the table of claims of a paper, whose key scripts get.
    pub fn row(&self, paper: &'static str) -> Row {
        let reason = match &self.verdict {
            Verdict::NotTestable(reason) => Some(reason),
            _ => None,
        };
        Row::default()
            .data("of", paper)
            .text("claim", "claim", &self.what)
            .text("source", "source", self.source)
            .text("paper", "paper", &self.paper)
            .text("ours", "here", &self.ours)
            .data("value", self.value)
            .text("rule", "rule", &self.rule)
            .text("verdict", "verdict", self.verdict.name())
            .said_as(self.verdict.words())
            .data("reason", reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saving() -> Claim {
        claim("it saves", "[A, §1]", "40 %").confirmed_if("the saving", Unit::PERCENT, Rule::half_of(0.4))
    }

    #[test]
    fn rules_hold_and_fail() {
        for (rule, holds, fails) in [
            (Rule::AtLeast(2.0), 2.0, 1.9),
            (Rule::AtMost(2.0), 2.0, 2.1),
            (Rule::within_twice(3.0), 1.5, 6.1),
            (Rule::half_of(0.4), 0.2, 0.19),
        ] {
            assert!(rule.holds(holds) && !rule.holds(fails) && !rule.holds(f64::NAN), "{rule:?}");
        }
    }

    #[test]
    fn a_claim_is_judged_by_its_figure() {
        let verdict = |claim: Claim, value: f64| claim.judged(Ok(value)).verdict;
        assert_eq!(verdict(saving(), 0.25), Verdict::Confirmed);
        assert_eq!(verdict(saving(), 0.15), Verdict::NotConfirmed);
        assert_eq!(verdict(saving().of_a_card(false), 0.25), Verdict::Confirmed);
        let software = saving().of_a_card(true).judged(Ok(0.25));
        assert!(matches!(&software.verdict, Verdict::NotTestable(reason) if reason.contains("software")));
        assert_eq!((software.ours.as_str(), software.value), ("25.00 %", Some(0.25)), "it is shown all the same");
        let missing = saving().judged(Err::<f64, _>("no row deep".to_owned()));
        let expected = "not measured, because no row deep".to_owned();
        assert_eq!((missing.ours.as_str(), missing.verdict), (NOT_MEASURED, Verdict::NotTestable(expected)));
    }

    #[test]
    fn a_caveat_keeps_from_confirming_alone() {
        let figure = |value| Figure::of(value, "of two").with_caveat(Some("too few".to_owned()));
        assert_eq!(saving().judged(Ok(figure(0.3))).verdict, Verdict::NotTestable("too few".to_owned()));
        assert_eq!(saving().judged(Ok(figure(0.1))).verdict, Verdict::NotConfirmed);
    }

    #[test]
    fn the_rule_stands_in_the_row() {
        let row = saving().judged(Ok(Figure::of(0.25, "mean of 3"))).row("a");
        assert_eq!(row.words("rule"), "confirmed if the saving is at least 20.00 %");
        assert_eq!((row.words("ours"), row.words("verdict")), ("25.00 % (mean of 3)", "confirmed"));
    }
}
