//! Number of bounces, and the sweeps that propagate them.

use lanternfish_gpu::gpu_constants;
use std::{fmt, str::FromStr};

use lanternfish_scene::Setting;

use super::parameters::CacheSweep;

/// Number of reflections of light before it reaches the visible surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounces {
    /// At most this many, 1 to [`Bounces::MOST`]: paths of up to two more segments. More than 1 needs the radiance
    /// cache, whose entries store outgoing radiance for each number of bounces.
    UpTo(u32),
    /// All bounces: entries of the radiance cache reflect the outgoing radiance of other entries.
    All,
}

impl Bounces {
    /// One bounce: from a light to a surface, and from there to the visible surface.
    pub const ONE: Self = Self::UpTo(1);
    /// Largest number of bounces for [`Bounces::UpTo`].
    pub const MOST: u32 = 8;

    /// True if entries trace rays for light from other entries.
    pub(super) fn needs_rays(self) -> bool {
        self != Self::ONE
    }

    /// Number of radiance levels per entry beside the total (`level_at` of `table.wesl`): one for each lower number of
    /// bounces, or two for all bounces.
    pub(super) fn levels(self) -> u32 {
        match self {
            Self::UpTo(bounces) => bounces.saturating_sub(1),
            Self::All => 2,
        }
    }

    /// Number of lights per entry whose parts of its direct light are known. In motion an entry is the mean of about
    /// six samples, of which the light of most is among these.
    pub(super) fn known_lights(self) -> u32 {
        if self == Self::All { 4 } else { 0 }
    }

    /// First level that propagation reads.
    pub(super) fn first_level(self) -> u32 {
        u32::from(matches!(self, Self::UpTo(2..)))
    }

    /// Sweeps that propagate all requested bounces along the entries' hit lists. `sweeps`: with all bounces, the number
    /// of red-black sweeps of each half of the entries.
    pub(super) fn steps(self, sweeps: u32) -> Vec<CacheSweep> {
        match self {
            Self::UpTo(bounces) => (1..bounces)
                .map(|k| CacheSweep {
                    read_level: k,
                    written_level: (k + 1) % bounces,
                    step: k - 1,
                    turn: ALL_ENTRIES,
                    ..CacheSweep::default()
                })
                .collect(),
            Self::All => (0..2 * sweeps).map(|sweep| there_and_back(sweep, sweep % 2)).collect(),
        }
    }

    /// Sweeps over the entries that are updated in this frame alone.
    pub(super) fn steps_of_some(self, sweeps: u32) -> Vec<CacheSweep> {
        match self {
            Self::UpTo(_) => self.steps(1),
            Self::All => (0..sweeps).map(|sweep| there_and_back(sweep, ALL_ENTRIES)).collect(),
        }
    }

    /// After these sweeps: the level with the total, and where it is copied. With all bounces both totals are equal
    /// then; else it is the same level.
    pub(super) fn copy_after(self, sweeps: &[CacheSweep]) -> CacheSweep {
        let total = sweeps.last().map_or(0, |sweep| sweep.written_level);
        let written_level = if self == Self::All { 2 - total } else { total };
        CacheSweep { read_level: total, written_level, ..CacheSweep::default() }
    }

    /// Number of means of earlier hits per entry: one per level that is read, or one for all bounces together.
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

/// A sweep with all bounces, from one total to the other.
fn there_and_back(sweep: u32, turn: u32) -> CacheSweep {
    let read_level = 2 * (sweep % 2);
    CacheSweep { read_level, written_level: 2 - read_level, turn, ..CacheSweep::default() }
}

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
            ("1", "One bounce"),
            ("2", "Up to two bounces, from the radiance cache"),
            ("3", "Up to three bounces"),
            ("4", "Up to four bounces"),
            ("5", "Up to five bounces"),
            ("6", "Up to six bounces"),
            ("7", "Up to seven bounces"),
            ("8", "Up to eight bounces"),
            ("all", "All bounces, from the radiance cache"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_round_trip() {
        for bounces in [Bounces::ONE, Bounces::UpTo(2), Bounces::UpTo(Bounces::MOST), Bounces::All] {
            assert_eq!(bounces.to_string().parse(), Ok(bounces));
        }
        let names = Bounces::All.names();
        let listed: Vec<Bounces> = names.iter().map(|(name, _)| name.parse().unwrap()).collect();
        let counted = (1..=Bounces::MOST).map(Bounces::UpTo);
        assert_eq!(listed, counted.chain([Bounces::All]).collect::<Vec<_>>());
        for text in ["0", "9", "-1", "every", "", "1.5"] {
            assert!(text.parse::<Bounces>().is_err_and(|error| error.contains("1 to 8")), "{text}");
        }
    }

    /// Sweeps start from direct light, or from the previous total, and end with the requested total.
    #[test]
    fn sweeps_chain_levels_to_the_total() {
        for bounces in (1..=Bounces::MOST).map(Bounces::UpTo).chain([Bounces::All]) {
            for sweeps in [1, 2, 3] {
                let (steps, of_some) = (bounces.steps(sweeps), bounces.steps_of_some(sweeps));
                for steps in [&steps, &of_some] {
                    assert!(
                        steps.windows(2).all(|pair| pair[0].written_level == pair[1].read_level),
                        "{bounces}: {steps:?}"
                    );
                }
                assert!(
                    steps
                        .iter()
                        .all(|step| step.read_level <= bounces.levels() && step.written_level <= bounces.levels())
                );
                // No sweep writes direct light, level 1.
                assert!(steps.iter().all(|step| step.written_level != 1 && step.step < bounces.earlier_steps()));
                assert_eq!(steps.last().map_or(0, |step| step.written_level), 0, "{bounces}");
                assert_eq!(steps.first().map_or(0, |step| step.read_level), bounces.first_level(), "{bounces}");
                let copy = bounces.copy_after(&of_some);
                assert_eq!(copy.read_level, of_some.last().map_or(0, |step| step.written_level));
                match bounces {
                    Bounces::UpTo(n) => {
                        assert_eq!((&of_some, copy.written_level), (&steps, 0));
                        assert_eq!(steps.len(), n as usize - 1);
                        assert!(steps.iter().all(|step| step.turn == ALL_ENTRIES));
                    }
                    // Both halves have the same number of sweeps.
                    Bounces::All => {
                        assert_eq!((of_some.len(), copy.read_level + copy.written_level), (sweeps as usize, 2));
                        assert!(of_some.iter().all(|step| step.turn == ALL_ENTRIES));
                        let taken = |turn| steps.iter().filter(|step| step.turn == turn).count();
                        assert_eq!([0, 1, ALL_ENTRIES].map(taken), [sweeps as usize, sweeps as usize, 0]);
                    }
                }
            }
        }
    }
}
