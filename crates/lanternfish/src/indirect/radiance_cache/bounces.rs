//! Number of bounces, and the sweeps that propagate them.

use lanternfish_gpu::gpu_constants;
use std::{fmt, str::FromStr};

use lanternfish_scene::Setting;

use super::parameters::CacheSweep;

/// How often light is reflected on its way to a surface from which it goes straight to the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounces {
    /// So many times at most, 1 to [`Bounces::MOST`]: paths of two more segments than that. More than 1: by way of the radiance cache, whose
    /// entries keep what they send of light of each number of bounces.
    UpTo(u32),
    /// As often as it is: entries of the radiance cache send what other entries have sent them.
    All,
}

impl Bounces {
    /// Once: from a light to a surface, and from there to the one that is seen.
    pub const ONE: Self = Self::UpTo(1);
    /// Most bounces that are counted.
    pub const MOST: u32 = 8;

    /// True if entries look for what other entries send.
    pub(super) fn needs_rays(self) -> bool {
        self != Self::ONE
    }

    /// Levels of radiance that entries keep beside all that is requested (`level_at` of `table.wesl`): numbers of bounces below it, or two of every bounce.
    pub(super) fn levels(self) -> u32 {
        match self {
            Self::UpTo(bounces) => bounces.saturating_sub(1),
            Self::All => 2,
        }
    }

    /// The level that entries read of each other first.
    pub(super) fn first_level(self) -> u32 {
        u32::from(matches!(self, Self::UpTo(2..)))
    }

    /// The sweeps by which all that is requested comes by way of the entries' hits. `sweeps`, where every bounce is requested: each half of the entries
    /// reads in so many.
    pub(super) fn steps(self, sweeps: u32) -> Vec<CacheSweep> {
        match self {
            Self::UpTo(bounces) => (1..bounces)
                .map(|k| CacheSweep { read_level: k, written_level: (k + 1) % bounces, step: k - 1, turn: ALL_ENTRIES })
                .collect(),
            Self::All => {
                let there = CacheSweep { read_level: 0, written_level: 2, step: 0, turn: 0 };
                let back = CacheSweep { read_level: 2, written_level: 0, step: 0, turn: 1 };
                [there, back].repeat(sweeps as usize)
            }
        }
    }

    /// The same for some of the entries, while the others stay as they are. Where every bounce is requested, the result is then copied back.
    pub(super) fn steps_of_some(self, sweeps: u32) -> Vec<CacheSweep> {
        match self {
            Self::UpTo(_) => self.steps(1),
            Self::All => vec![ALL_READ; sweeps as usize],
        }
    }

    /// Means of what earlier hits have brought: one of each level that is read, or of every bounce together.
    pub(super) fn earlier_steps(self) -> u32 {
        match self {
            Self::UpTo(bounces) => bounces.saturating_sub(1),
            Self::All => 1,
        }
    }
}

gpu_constants! {
    /// Every entry reads in each sweep.
    const ALL_ENTRIES: u32 = 2;
}

/// The sweep over some of the entries, where every bounce is requested.
const ALL_READ: CacheSweep = CacheSweep { read_level: 0, written_level: 2, step: 0, turn: ALL_ENTRIES };

impl fmt::Display for Bounces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UpTo(bounces) => write!(f, "{bounces}"),
            Self::All => f.write_str("all"),
        }
    }
}

impl FromStr for Bounces {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = || text.parse().ok().filter(|bounces| (1..=Self::MOST).contains(bounces)).map(Self::UpTo);
        let expected = || format!("expected a whole number from 1 to {}, or all", Self::MOST);
        if text == "all" { Ok(Self::All) } else { number().ok_or_else(expected) }
    }
}

impl Setting for Bounces {
    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = text.trim().parse()?;
        Ok(())
    }

    fn names(&self) -> Vec<(&'static str, &'static str)> {
        vec![
            ("1", "Once"),
            ("2", "At most two, through the radiance cache"),
            ("3", "Three times at most"),
            ("4", "Four times at most"),
            ("5", "Five times at most"),
            ("6", "Six times at most"),
            ("7", "Seven times at most"),
            ("8", "Eight times at most"),
            ("all", "All, through the radiance cache"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_as_they_are_written() {
        for bounces in [Bounces::ONE, Bounces::UpTo(2), Bounces::UpTo(Bounces::MOST), Bounces::All] {
            assert_eq!(bounces.to_string().parse(), Ok(bounces));
        }
        let names = Bounces::All.names();
        let known: Vec<Bounces> = names.iter().map(|(name, _)| name.parse().unwrap()).collect();
        let counted = (1..=Bounces::MOST).map(Bounces::UpTo);
        assert_eq!(known, counted.chain([Bounces::All]).collect::<Vec<_>>());
        for text in ["0", "9", "-1", "every", "", "1.5"] {
            assert!(text.parse::<Bounces>().is_err_and(|error| error.contains("1 to 8")), "{text}");
        }
    }

    /// Entries start from what lights send them, or from all that they sent before, and end in all that is requested.
    #[test]
    fn steps_lead_from_part_to_part() {
        for bounces in (1..=Bounces::MOST).map(Bounces::UpTo).chain([Bounces::All]) {
            for sweeps in [1, 3] {
                let steps = bounces.steps(sweeps);
                assert!(
                    steps.windows(2).all(|pair| pair[0].written_level == pair[1].read_level),
                    "{bounces}: {steps:?}"
                );
                assert!(
                    steps
                        .iter()
                        .all(|step| step.read_level <= bounces.levels() && step.written_level <= bounces.levels())
                );
                // What lights send is nobody's to write.
                assert!(steps.iter().all(|step| step.written_level != 1 && step.step < bounces.earlier_steps()));
                assert_eq!(steps.last().map_or(0, |step| step.written_level), 0, "{bounces}");
                assert_eq!(steps.first().map_or(0, |step| step.read_level), bounces.first_level(), "{bounces}");
                let of_some = bounces.steps_of_some(sweeps);
                match bounces {
                    Bounces::UpTo(n) => {
                        assert_eq!(of_some, steps);
                        assert_eq!(steps.len(), n as usize - 1);
                        assert!(steps.iter().all(|step| step.turn == ALL_ENTRIES));
                    }
                    // Each entry takes as many, in whichever half it is.
                    Bounces::All => {
                        // The result is copied back to where it is read.
                        assert_eq!(of_some, vec![ALL_READ; sweeps as usize]);
                        let taken = |turn| steps.iter().filter(|step| step.turn == turn).count();
                        assert_eq!([0, 1, ALL_ENTRIES].map(taken), [sweeps as usize, sweeps as usize, 0]);
                    }
                }
            }
        }
    }
}
