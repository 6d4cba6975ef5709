//! Settings that the renderer recommends.

use lanternfish_scene::named_enum;

use super::{Antialiasing, Direct, History, Settings};
use crate::indirect::{Indirect, Quality};

named_enum! {
    /// Complete settings for a purpose: `lanternfish render --quality`.
    #[derive(Default)]
    Preset {
        /// Single images that are seen soon.
        Draft = "draft": "Screen probes: about one ray per pixel, through the BVH; one to four shadow rays",
        /// Single images: the default.
        #[default]
        Good = "good": "8 diffuse and 4 glossy rays per pixel, 16 and 4 in an image's first frame, through the BVH",
        /// Single images with little noise.
        Best = "best": "64 diffuse and 16 glossy rays per pixel, through the BVH, and 128 samples per cache entry",
        /// Frames of a moving view: draft, accumulation over frames, temporal antialiasing. Its first frame is a noisy
        /// draft.
        Realtime = "realtime": "For moving views, and in windows: draft, history, temporal antialiasing",
    }
}

impl Preset {
    /// The effort of its indirect light.
    pub const fn quality(self) -> Quality {
        match self {
            Self::Draft | Self::Realtime => Quality::Draft,
            Self::Good => Quality::Good,
            Self::Best => Quality::Best,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::of_preset(Preset::default())
    }
}

impl Settings {
    /// The settings of a preset. `Settings::default()` is [`Preset::Good`].
    pub fn of_preset(preset: Preset) -> Self {
        let quality = preset.quality();
        let mut settings = Self { indirect: Indirect::preset(quality), ..Self::direct_light() };
        settings.image.samples = quality.samples();
        if matches!(preset, Preset::Draft | Preset::Realtime) {
            settings.direct = Direct::sampled();
        }
        if preset == Preset::Realtime {
            settings.history = History::On;
            settings.image.antialiasing = Antialiasing::Temporal;
        }
        settings
    }
}

/// All that the preset for moving views names is on, and the other presets differ from direct light in what they name.
#[cfg(test)]
#[test]
fn presets_are_complete() {
    let realtime = Settings::of_preset(Preset::Realtime);
    assert!(realtime.direct.is_some() && realtime.indirect.is_some());
    assert_eq!((realtime.history, realtime.image.antialiasing), (History::On, Antialiasing::Temporal));
    for preset in [Preset::Draft, Preset::Good, Preset::Best] {
        let settings = Settings::of_preset(preset);
        let (indirect, samples) = (settings.indirect.clone(), settings.image.samples);
        let direct = if preset == Preset::Draft { Direct::sampled() } else { Direct::default() };
        let expected = Settings::direct_light().with_direct(direct).with_indirect(indirect).with_samples(samples);
        assert_eq!(settings, expected);
    }
}
