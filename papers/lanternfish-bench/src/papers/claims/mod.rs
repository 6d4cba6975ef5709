//! What the papers claim, a function for each claim, and rules by which a measured figure confirms or refutes it.

pub mod aalund;
pub mod archer;
pub mod elagabani;
pub mod niessner;
pub mod van_gelderen;

use std::ops::RangeInclusive;

use super::{
    faults::Fault,
    measure::{Basis, Measure},
    rows::{Found, Reports},
};
use crate::table::Row;

/// Placeholder for a missing figure.
pub const NOT_MEASURED: &str = "not measured";

/// Verdict on a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// By counts, memory or errors where there is no basis; else by times, whose whole interval fulfils the rule.
    Confirmed(Option<Basis>),
    /// No part of the interval fulfils the rule.
    Refuted,
    /// The rule is fulfilled by values that the paper does not state and that were chosen to fulfil it.
    Fitted,
    /// The interval of times fulfils the rule in part.
    WithinNoise,
    /// The reason.
    NotTestable(String),
}

impl Verdict {
    /// The names of all, with their keys.
    pub const NAMES: [(&str, &str); 5] = [
        ("confirmed", "confirmed"),
        ("refuted", "refuted"),
        ("fitted", "fitted"),
        ("within_noise", "within noise"),
        ("not_testable", "not testable here"),
    ];

    /// In a few words.
    pub fn name(&self) -> &'static str {
        Self::NAMES[match self {
            Self::Confirmed(_) => 0,
            Self::Refuted => 1,
            Self::Fitted => 2,
            Self::WithinNoise => 3,
            Self::NotTestable(_) => 4,
        }]
        .1
    }
}

/// How a number is shown: a factor, decimal places and what follows it.
#[derive(Clone, Copy, Debug)]
pub struct Unit(f64, usize, &'static str);

pub const PERCENT: Unit = Unit(100.0, 2, " %");
pub const TIMES: Unit = Unit(1.0, 2, " ×");
pub const MS: Unit = Unit(1.0, 1, " ms");
pub const MEGABYTES: Unit = Unit(1e-6, 1, " MB");
pub const MILLION_RAYS: Unit = Unit(1.0, 2, " M rays/s");
pub const FLIP: Unit = Unit(1.0, 5, "");
pub const COUNT: Unit = Unit(1.0, 0, "");

impl Unit {
    fn show(self, number: f64) -> String {
        format!("{:.*}{}", self.1, self.0 * number, self.2)
    }

    /// An interval and what it rests on.
    fn interval(self, ([low, high], basis): ([f64; 2], Basis)) -> String {
        let (low, high) = (self.show(low), self.show(high));
        match basis {
            Basis::Pairs(count) => format!("median of {count} pairs, 95 %: {low} to {high}"),
            Basis::Apart => format!("{low} to {high}"),
        }
    }
}

/// Limits of figures from this one on.
pub fn at_least(least: f64) -> RangeInclusive<f64> {
    least..=f64::INFINITY
}

/// Limits of figures up to this one.
pub fn at_most(most: f64) -> RangeInclusive<f64> {
    f64::NEG_INFINITY..=most
}

/// What was measured for a claim.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    pub measure: Measure,
    /// Explains the figure; stands behind it.
    note: String,
}

impl From<Measure> for Figure {
    fn from(measure: Measure) -> Self {
        Self { measure, note: String::new() }
    }
}

impl Measure {
    /// A figure that a note explains.
    pub fn noted(self, note: impl Into<String>) -> Figure {
        Figure { measure: self, note: note.into() }
    }
}

/// What keeps a figure that fulfils the rule from confirming a claim.
enum Sort {
    Compared,
    /// Of a graphics card's speed: a software adapter cannot test it.
    OfACard,
    /// The values that were chosen.
    Fitted(&'static str),
    /// Why no figure here decides.
    Untestable(&'static str),
}

type Figured = Box<dyn Fn(&Reports) -> Found<Figure>>;

/// A claim: what a paper says, and the figure that is measured for it.
pub struct Claim {
    pub what: String,
    pub source: &'static str,
    paper: &'static str,
    /// What the limits are of.
    quantity: &'static str,
    unit: Unit,
    limits: RangeInclusive<f64>,
    sort: Sort,
    /// With which the claim must not be confirmed.
    pub fault: Option<Fault>,
    figure: Figured,
}

/// A claim without its source, rule and figure.
pub fn claim(what: impl Into<String>) -> Claim {
    let figure = Box::new(|_: &Reports| Err("there is no figure".to_owned()));
    let (what, unit, limits, sort) = (what.into(), COUNT, at_least(0.0), Sort::Compared);
    Claim { what, source: "", paper: "", quantity: "", unit, limits, sort, fault: None, figure }
}

impl Claim {
    /// Where the paper says it, and how much.
    pub fn says(self, source: &'static str, paper: &'static str) -> Self {
        Self { source, paper, ..self }
    }

    /// The claim is confirmed if the figure, the `quantity` in this unit, is within the limits.
    pub fn rule(self, quantity: &'static str, unit: Unit, limits: RangeInclusive<f64>) -> Self {
        Self { quantity, unit, limits, ..self }
    }

    pub fn of_a_card(self) -> Self {
        Self { sort: Sort::OfACard, ..self }
    }

    pub fn fitted(self, values: &'static str) -> Self {
        Self { sort: Sort::Fitted(values), ..self }
    }

    pub fn untestable(self, why: &'static str) -> Self {
        Self { sort: Sort::Untestable(why), ..self }
    }

    pub fn lost_by(self, fault: Fault) -> Self {
        Self { fault: Some(fault), ..self }
    }

    pub fn by(self, figure: impl Fn(&Reports) -> Found<Figure> + 'static) -> Self {
        Self { figure: Box::new(figure), ..self }
    }

    /// False if no figure can confirm it here.
    #[cfg(test)]
    pub fn can_be_confirmed(&self) -> bool {
        matches!(self.sort, Sort::Compared | Sort::OfACard)
    }

    /// The figure of these reports.
    pub fn figure(&self, reports: &Reports) -> Found<Figure> {
        (self.figure)(reports)
    }

    /// Judges the claim by these reports.
    pub fn judged(&self, reports: &Reports) -> Judged<'_> {
        let mut judged = Judged {
            claim: self,
            ours: NOT_MEASURED.to_owned(),
            value: None,
            interval: None,
            verdict: Verdict::NotTestable(String::new()),
        };
        match self.figure(reports) {
            Err(why) => judged.verdict = Verdict::NotTestable(format!("{NOT_MEASURED}, because {why}")),
            Ok(Figure { measure, note }) => {
                judged.verdict = match (self.by_rule(&measure), &self.sort) {
                    (_, Sort::Untestable(why)) => Verdict::NotTestable((*why).to_owned()),
                    (_, Sort::OfACard) if reports.is_software => {
                        Verdict::NotTestable("the speed of a graphics card, and this adapter is software".to_owned())
                    }
                    (Verdict::Confirmed(_), Sort::Fitted(_)) => Verdict::Fitted,
                    (verdict, ..) => verdict,
                };
                let value = measure.decisive();
                let notes = [note, measure.interval().map_or(String::new(), |interval| self.unit.interval(interval))];
                let notes: Vec<String> = notes.into_iter().filter(|note| !note.is_empty()).collect();
                let notes = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
                judged.ours = self.unit.show(value) + &notes;
                (judged.value, judged.interval) = (Some(value), measure.interval().map(|(interval, _)| interval));
            }
        }
        judged
    }

    /// The verdict on a figure, or on the interval of one of times.
    fn by_rule(&self, measure: &Measure) -> Verdict {
        let holds = |figure: &f64| self.limits.contains(figure);
        match measure.interval() {
            None if holds(&measure.value) => Verdict::Confirmed(None),
            None => Verdict::Refuted,
            Some((interval, basis)) if interval.iter().all(holds) => Verdict::Confirmed(Some(basis)),
            // Of a time that is not a number no end is beyond a limit.
            Some(([low, high], _)) => {
                let is_beyond = high < *self.limits.start() || low > *self.limits.end();
                if is_beyond || !measure.value.is_finite() { Verdict::Refuted } else { Verdict::WithinNoise }
            }
        }
    }

    /// The limits in words.
    fn limits(&self) -> String {
        let [least, most] = [*self.limits.start(), *self.limits.end()];
        match (least.is_finite(), most.is_finite()) {
            (true, false) => format!("at least {}", self.unit.show(least)),
            (false, _) => format!("at most {}", self.unit.show(most)),
            _ => format!("from {} to {}", self.unit.show(least), self.unit.show(most)),
        }
    }
}

/// A claim with its verdict.
pub struct Judged<'c> {
    claim: &'c Claim,
    pub ours: String,
    value: Option<f64>,
    interval: Option<[f64; 2]>,
    pub verdict: Verdict,
}

impl Judged<'_> {
    /// The verdict with what it rests on.
    pub fn words(&self) -> String {
        let Claim { quantity, sort, .. } = self.claim;
        let shown = self.value.map_or(String::new(), |value| self.claim.unit.show(value));
        match (&self.verdict, sort) {
            (Verdict::Confirmed(None), _) => "confirmed by counts".to_owned(),
            (Verdict::Confirmed(Some(Basis::Pairs(_))), _) => "confirmed by paired times".to_owned(),
            (Verdict::Confirmed(Some(Basis::Apart)), _) => "confirmed by times apart".to_owned(),
            (Verdict::Refuted, _) => format!("refuted: {quantity} is {shown}, not {}", self.claim.limits()),
            (Verdict::Fitted, Sort::Fitted(values)) => format!("fitted: {values}"),
            (Verdict::NotTestable(reason), _) => format!("{}: {reason}", self.verdict.name()),
            _ => self.verdict.name().to_owned(),
        }
    }

    /// A row of the table of claims of a paper, whose key scripts get.
    pub fn row(&self, paper: &str) -> Row {
        let reason = match &self.verdict {
            Verdict::NotTestable(reason) => Some(reason),
            _ => None,
        };
        let Claim { what, source, paper: theirs, quantity, fault, .. } = self.claim;
        Row::default()
            .data("of", paper)
            .text("claim", "claim", what)
            .text("source", "source", source)
            .text("paper", "paper", theirs)
            .text("ours", "here", &self.ours)
            .data("value", self.value)
            .data("interval", self.interval)
            .text("rule", "rule", format!("confirmed if {quantity} is {}", self.claim.limits()))
            .text("verdict", "verdict", self.verdict.name())
            .said_as(self.words())
            .text("lost_by", "lost by", fault.map_or("", |fault| fault.name))
            .data("reason", reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saving(figure: Figure) -> Claim {
        claim("it saves")
            .says("[A, §1]", "40 %")
            .rule("the saving", PERCENT, at_least(0.2))
            .by(move |_| Ok(figure.clone()))
    }

    fn verdict(claim: &Claim, is_software: bool) -> Verdict {
        claim.judged(&Reports::of(is_software)).verdict
    }

    #[test]
    fn limits_hold_and_fail() {
        for (limits, holds, fails) in [(at_least(2.0), 2.0, 1.9), (at_most(2.0), 2.0, 2.1), (1.5..=6.0, 1.5, 6.1)] {
            let claim = claim("").rule("a", TIMES, limits);
            let verdicts = [holds, fails, f64::NAN].map(|value| claim.by_rule(&Measure::exact(value)));
            assert_eq!(verdicts, [Verdict::Confirmed(None), Verdict::Refuted, Verdict::Refuted]);
        }
    }

    #[test]
    fn a_claim_is_judged_by_its_figure() {
        let figure = |value: f64| Figure::from(Measure::exact(value));
        assert_eq!(verdict(&saving(figure(0.25)), true), Verdict::Confirmed(None));
        assert_eq!(verdict(&saving(figure(0.15)), true), Verdict::Refuted);
        assert_eq!(verdict(&saving(figure(0.25)).of_a_card(), false), Verdict::Confirmed(None));
        let of_a_card = saving(figure(0.25)).of_a_card();
        let software = of_a_card.judged(&Reports::of(true));
        assert!(matches!(&software.verdict, Verdict::NotTestable(reason) if reason.contains("software")));
        assert_eq!((software.ours.as_str(), software.value), ("25.00 %", Some(0.25)), "it is shown all the same");
        let fitted = |value| verdict(&saving(figure(value)).fitted("a spacing of 0.02"), true);
        assert_eq!([0.25, 0.15].map(fitted), [Verdict::Fitted, Verdict::Refuted], "not confirmed, but refuted");
        let missing = saving(figure(0.25)).by(|_| Err("no row deep".to_owned()));
        assert_eq!(verdict(&missing, true), Verdict::NotTestable("not measured, because no row deep".to_owned()));
        let why = "it lists no lights";
        assert_eq!(verdict(&saving(figure(0.25)).untestable(why), true), Verdict::NotTestable(why.to_owned()));
    }

    #[test]
    fn an_interval_of_times_decides_as_a_whole() {
        let judged = |runs: &[f64]| {
            let claim = saving(Measure::time(runs[0], runs.to_vec(), 1.5, Some("rows".to_owned())).into());
            let judged = claim.judged(&Reports::default());
            (judged.words(), judged.ours)
        };
        let (words, ours) = judged(&[0.21, 0.22, 0.23, 0.24, 0.25, 0.26]);
        assert_eq!(words, "confirmed by paired times");
        assert_eq!(ours, "23.50 % (median of 6 pairs, 95 %: 21.00 % to 26.00 %)");
        assert_eq!(judged(&[0.19, 0.22, 0.23, 0.24, 0.25, 0.26]).0, "within noise");
        let refuted = "refuted: the saving is 12.50 %, not at least 20.00 %";
        assert_eq!(judged(&[0.1, 0.11, 0.12, 0.13, 0.14, 0.15]).0, refuted);
        // Few runs have the margin.
        assert_eq!((judged(&[0.21]).0, judged(&[0.4]).0), ("within noise".into(), "confirmed by times apart".into()));
        assert!(judged(&[f64::NAN]).0.starts_with("refuted"));
    }

    #[test]
    fn the_rule_stands_in_the_row() {
        let claim = saving(Measure::exact(0.25).noted("mean of 3"));
        let row = claim.judged(&Reports::default()).row("a");
        assert_eq!(row.words("rule"), "confirmed if the saving is at least 20.00 %");
        assert_eq!((row.words("ours"), row.words("verdict")), ("25.00 % (mean of 3)", "confirmed by counts"));
        assert_eq!(row.words_of("verdict"), "confirmed");
    }
}
