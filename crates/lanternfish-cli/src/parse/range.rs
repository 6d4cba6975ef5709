//! Ranges of integers: frames of a sequence, samples of a ground truth.

use std::{fmt, ops::RangeInclusive, str::FromStr};

/// Valid frame numbers.
pub const FRAMES: RangeInclusive<u32> = 0..=99_999;

/// Valid sample numbers of a pixel.
pub const SAMPLES: RangeInclusive<u64> = 1..=1 << 32;

/// Integers from `first` to `last`, both included; `first` is at most `last`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span<N> {
    /// The first number.
    pub first: N,
    /// The last number, included.
    pub last: N,
}

impl<N: fmt::Display> fmt::Display for Span<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.first, self.last)
    }
}

/// The frames of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frames {
    /// This many frames, numbered from 1: the first at the start of the camera track, the last at its end.
    Count(u32),
    /// The frames of these numbers, each at number / rate seconds.
    Span(Span<u32>),
}

/// Parses a number of frames, `N`, or a frame range, `A-B`.
pub fn frames(text: &str) -> Result<Frames, String> {
    let frames = match text.contains('-') {
        true => span(text).ok().map(Frames::Span),
        false => digits::<u32>(text).filter(|count| *count > 0 && FRAMES.contains(count)).map(Frames::Count),
    };
    let (first, last) = (FRAMES.start(), FRAMES.end());
    frames.ok_or_else(|| {
        format!("expected a count, 1 to {last}, or a range A-B from {first} to {last}, e.g. 48 or 1-48 (5-5 is frame 5 alone)")
    })
}

/// Parses the number of frames of a full revolution.
pub fn orbit(text: &str) -> Result<u32, String> {
    let frames = digits::<u32>(text).filter(|count| *count > 1 && FRAMES.contains(count));
    frames.ok_or_else(|| {
        let last = FRAMES.end();
        format!(
            "expected the number of frames of a full revolution, 2 to {last}, e.g. 48; a single image needs no --orbit"
        )
    })
}

/// Parses a frame range, `A-B`, or one frame, `A`.
pub fn span(text: &str) -> Result<Span<u32>, String> {
    let (first, last) = (FRAMES.start(), FRAMES.end());
    within(text, &FRAMES).ok_or_else(|| format!("expected frames A-B, or one, from {first} to {last}, e.g. 1-48"))
}

/// Parses a sample range, `A-B`, or one sample, `A`.
pub fn samples(text: &str) -> Result<Span<u64>, String> {
    let (first, last) = (SAMPLES.start(), SAMPLES.end());
    within(text, &SAMPLES).ok_or_else(|| format!("expected samples A-B from {first} to {last}, e.g. 1-256"))
}

fn within<N: FromStr + PartialOrd>(text: &str, range: &RangeInclusive<N>) -> Option<Span<N>> {
    let (first, last) = text.trim().split_once('-').unwrap_or((text, text));
    let number = |text: &str| digits(text).filter(|number| range.contains(number));
    number(first).zip(number(last)).filter(|(first, last)| first <= last).map(|(first, last)| Span { first, last })
}

/// Parses frames per second.
pub fn fps(text: &str) -> Result<f32, String> {
    super::number(text)
        .filter(|fps| (1e-3..=1e4).contains(fps))
        .ok_or_else(|| "expected frames per second, from 0.001 to 10000, e.g. 24 or 29.97".to_owned())
}

/// Parses digits without a sign, which would be part of a range.
fn digits<N: FromStr>(text: &str) -> Option<N> {
    let text = text.trim();
    text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_count_or_a_range() {
        assert_eq!(frames("48"), Ok(Frames::Count(48)));
        assert_eq!(frames("5-8"), Ok(Frames::Span(Span { first: 5, last: 8 })));
        assert_eq!(frames("0-0"), Ok(Frames::Span(Span { first: 0, last: 0 })));
        assert_eq!(span("7"), Ok(Span { first: 7, last: 7 }));
        assert_eq!(span("7-9").unwrap().to_string(), "7-9");
        for bad in ["", "-", "0", "-1", "1-", "-1-2", "8-5", "1-2-3", "1.5", "1-100000", "+1", "1-+2", "1,2"] {
            assert!(frames(bad).unwrap_err().contains("1-48"), "{bad}");
        }
        for bad in ["", "1-", "8-5", "a"] {
            assert!(span(bad).is_err(), "{bad}");
        }
        assert_eq!(samples("257-4294967296"), Ok(Span { first: 257, last: 1 << 32 }));
        assert_eq!((orbit("2"), orbit("48")), (Ok(2), Ok(48)));
        for bad in ["", "0", "1", "-4", "1-4", "1.5", "100000"] {
            assert!(orbit(bad).unwrap_err().contains("2 to 99999"), "{bad}");
        }
        assert!(samples("0-5").is_err() && samples("5-4294967297").is_err());
        assert_eq!((fps("24"), fps("29.97")), (Ok(24.0), Ok(29.97)));
        assert!(fps("0").is_err() && fps("-1").is_err() && fps("nan").is_err());
    }
}
