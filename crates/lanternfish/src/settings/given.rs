//! Values that flags, a shot or a program give, on top of a preset.

use lanternfish_scene::Value;

use super::{Caustics, Culling, Direct, Indirect, Occlusion, Preset, Samples, Settings};

/// Values of some settings, by name: each of the setting's own type. A later value of a name replaces an earlier one.
///
/// ```
/// # use lanternfish::settings::{GivenSettings, Preset};
/// let given = GivenSettings::read([("light-samples", "8")])?;
/// assert_eq!(given.over(Preset::Realtime).get("light-samples").as_deref(), Some("8"));
/// # Ok::<_, String>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct GivenSettings(Vec<(&'static str, Value)>);

/// Choices of techniques: they come before the parameters.
const CHOICES: [&str; 5] = [Direct::FLAG, Culling::FLAG, Indirect::FLAG, Caustics::FLAG, Occlusion::FLAG];

impl GivenSettings {
    /// Every value of the chosen techniques and of all other settings.
    pub fn of(settings: &Settings) -> Self {
        let value = |name| settings.value(name).flatten().filter(|value| value.text().is_some());
        let names = Settings::parameters().into_iter().map(|entry| entry.info.name);
        Self(names.filter_map(|name| Some((name, value(name)?))).collect())
    }

    /// Reads values, by name, or returns the name and the expected values of the first that is wrong.
    pub fn read<'a>(values: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self, String> {
        let (known, mut given) = (Settings::parameters(), Self::default());
        for (name, text) in values {
            let named = known.iter().find(|entry| entry.info.name == name);
            let entry = named.ok_or_else(|| format!("there is no setting {name}"))?;
            given.give(entry.info.name, entry.read(text).map_err(|what| format!("{name}: {what}"))?);
        }
        Ok(given)
    }

    /// Gives a value, of one of [`Settings::parameters`], that was read for it.
    pub fn give(&mut self, name: &'static str, value: Value) {
        self.0.retain(|(other, _)| *other != name);
        self.0.push((name, value));
    }

    /// The value of this name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.iter().find(|(other, _)| *other == name).map(|(_, value)| value)
    }

    /// All names and values.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    /// All names, and their values as text.
    pub fn texts(&self) -> impl Iterator<Item = (&'static str, String)> {
        self.iter().map(|(name, value)| (name, value.text().unwrap_or_else(|| "none".to_owned())))
    }

    /// The values of names of which this is true.
    pub fn only(&self, is_kept: impl Fn(&str) -> bool) -> Self {
        Self(self.0.iter().filter(|(name, _)| is_kept(name)).cloned().collect())
    }

    /// These values on top of others.
    pub fn above(self, mut others: Self) -> Self {
        self.0.into_iter().for_each(|(name, value)| others.give(name, value));
        others
    }

    /// The number of frames of a mean.
    pub fn frames(&self) -> u32 {
        self.get("accumulate").and_then(Value::get).copied().unwrap_or(1)
    }

    /// The settings of a preset with these values. A technique that is given has the effort of the preset.
    pub fn over(&self, preset: Preset) -> Settings {
        let mut settings = self.techniques_over(preset, self.frames());
        self.set(&mut settings);
        settings
    }

    /// The settings of a preset with the given techniques, for a mean of `frames`, without other values.
    #[doc(hidden)]
    pub fn techniques_over(&self, preset: Preset, frames: u32) -> Settings {
        let (mut settings, quality) = (Settings::of_preset(preset), preset.quality());
        for (name, value) in self.iter().filter(|(name, _)| CHOICES.contains(name)) {
            settings.take(name, value);
            if name == Indirect::FLAG {
                settings.indirect = settings.indirect.of_quality(quality);
            }
        }
        // Averaged frames jitter the sample position, so edges are smooth without multisampling; with multisampling
        // too, edges smear over neighbouring pixels.
        settings.image.samples = match settings.indirect.is_none() {
            _ if frames >= SMOOTH_FRAMES => Samples::One,
            true => Settings::direct_light().image.samples,
            false => quality.samples(),
        };
        settings.with_accumulate(frames)
    }

    /// Sets all values but choices of techniques.
    #[doc(hidden)]
    pub fn set(&self, settings: &mut Settings) {
        self.iter().filter(|(name, _)| !CHOICES.contains(name)).for_each(|(name, value)| settings.take(name, value));
    }
}

/// Least number of averaged frames at which one sample per pixel gives edges as accurate as four, at lower cost. More
/// frames give more accurate edges.
const SMOOTH_FRAMES: u32 = 32;
