//! Position of the sun by location and time.

use egui::{DragValue, Ui};
use glam::Vec3;

use super::lights::number;
use crate::sun::PlaceAndHour;

/// Greenwich, noon UTC, 21 June 2025.
impl Default for PlaceAndHour {
    fn default() -> Self {
        let (latitude, longitude) = (51.48, 0.0);
        Self { latitude, longitude, year: 2025, month: 6, day: 21, hour: 12.0, ahead_of_utc: 0.0 }
    }
}

/// Draws the widgets. Returns the direction of the sunlight, unit vector, if something was changed.
pub fn show(ui: &mut Ui, at: &mut PlaceAndHour) -> Option<Vec3> {
    let degrees = |value, most: f64| DragValue::new(value).range(-most..=most).suffix("°").speed(0.1);
    let mut is_changed = number(ui, "latitude, north", degrees(&mut at.latitude, 90.0));
    is_changed |= number(ui, "longitude, east", degrees(&mut at.longitude, 180.0));
    is_changed |= number(ui, "year", DragValue::new(&mut at.year).range(1900..=2100).speed(0.05));
    is_changed |= number(ui, "month", DragValue::new(&mut at.month).range(1..=12).speed(0.05));
    is_changed |= number(ui, "day", DragValue::new(&mut at.day).range(1..=31).speed(0.1));
    is_changed |= number(ui, "hour", DragValue::new(&mut at.hour).range(0.0..=24.0).suffix(" h").speed(0.02));
    let ahead = DragValue::new(&mut at.ahead_of_utc).range(-12.0..=14.0).suffix(" h").speed(0.05);
    is_changed |= number(ui, "UTC offset", ahead);
    let sun = at.sun();
    let (azimuth, elevation) = (sun.azimuth.to_degrees(), sun.elevation.to_degrees());
    ui.weak(match elevation < 0.0 {
        true => "Night: the sun is below the horizon".to_owned(),
        false => format!("azimuth {azimuth:.1}° (clockwise from north, −z), elevation {elevation:.1}°"),
    });
    is_changed |= ui.button("Place the sun").clicked();
    is_changed.then(|| sun.direction())
}
