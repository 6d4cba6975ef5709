//! Texts in an image's file that say how it was made. They name no date, path or machine: the same command gives the same bytes.

use lanternfish::settings::{Antialiasing, History, Settings};

/// The program and its version. PNG reserves the name.
pub const SOFTWARE: &str = "Software";
/// Technique of indirect light.
pub const INDIRECT: &str = "lanternfish.indirect";
/// Whether images may have light of earlier ones.
pub const HISTORY: &str = "lanternfish.history";
/// Number of images that the same run rendered before and whose light this one may have. If it is 0, the image does not depend on others.
pub const HISTORY_FRAMES: &str = "lanternfish.history-frames";
/// Number of frames whose mean the image is.
pub const ACCUMULATE: &str = "lanternfish.accumulate";
/// Seed of the light rain.
pub const SEED: &str = "lanternfish.seed";

/// The texts of an image by name. `before` counts the images that this run rendered before it.
pub fn texts(settings: &Settings, seed: u32, before: u32) -> Vec<(&'static str, String)> {
    let is_antialiased = settings.image.antialiasing == Antialiasing::Temporal && settings.image.accumulate == 1;
    let history_frames = if settings.history == History::On || is_antialiased { before } else { 0 };
    vec![
        (SOFTWARE, concat!("lanternfish ", env!("CARGO_PKG_VERSION")).to_owned()),
        (INDIRECT, settings.indirect.name().to_owned()),
        (HISTORY, settings.history.to_string()),
        (HISTORY_FRAMES, history_frames.to_string()),
        (ACCUMULATE, settings.image.accumulate.to_string()),
        (SEED, seed.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::Indirect;

    use super::*;

    #[test]
    fn without_history_an_image_has_no_frames_before_it() {
        let of = |history| {
            let settings = Settings::default().with_history(history).with_accumulate(4).with_indirect(Indirect::NONE);
            texts(&settings, 7, 2)
        };
        let value = |texts: &[(&str, String)], name| texts.iter().find(|text| text.0 == name).unwrap().1.clone();
        let (on, off) = (of(History::On), of(History::Off));
        assert_eq!([HISTORY, HISTORY_FRAMES].map(|name| value(&on, name)), ["on", "2"]);
        assert_eq!([HISTORY, HISTORY_FRAMES].map(|name| value(&off, name)), ["off", "0"]);
        assert_eq!([INDIRECT, ACCUMULATE, SEED].map(|name| value(&on, name)), ["none", "4", "7"]);
        assert_eq!(value(&on, SOFTWARE), format!("lanternfish {}", env!("CARGO_PKG_VERSION")));
    }
}
