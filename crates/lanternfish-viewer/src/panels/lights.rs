//! The scene's lights: search, add, move, colour, delete.

use egui::{DragValue, Ui};
use glam::Vec3;
use lanternfish_scene::{Light, LightKind};

use super::{Facts, State, pixel::named};

/// Maximum number of listed lights.
const MOST: usize = 20;
/// Illuminance of an added sun, lx, equal to the built-in one's.
const SUN: f32 = 3.0;

/// State of the list of lights.
#[derive(Clone, Debug, Default)]
pub struct Listing {
    /// Search text: part of a name or `#index`, or a kind.
    pub search: String,
    /// True to sort by distance to the clicked surface.
    pub is_by_distance: bool,
}

/// An edit of the lights.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Replaces the light of this index.
    Set(usize, Light),
    /// Adds a light.
    Add(Light),
    /// Removes the light of this index.
    Remove(usize),
}

impl Edit {
    /// The index of the changed light, and true if it is removed; `None` for an added light.
    pub fn changed(&self) -> Option<(usize, bool)> {
        match self {
            Self::Set(index, _) => Some((*index, false)),
            Self::Remove(index) => Some((*index, true)),
            Self::Add(_) => None,
        }
    }

    /// The lights after the edit.
    pub fn applied(self, lights: &[Light]) -> Vec<Light> {
        let mut lights = lights.to_vec();
        match self {
            Self::Set(index, light) => lights[index] = light,
            Self::Add(light) => lights.push(light),
            Self::Remove(index) => drop(lights.remove(index)),
        }
        lights
    }
}

pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>) -> Option<Edit> {
    let (lights, mut edit) = (&facts.scene.lights, None);
    let place = state.pointed.as_ref().and_then(|pointed| pointed.place().copied());
    ui.horizontal(|ui| {
        let at = ui.add_enabled(place.is_some(), egui::Button::new("Add a light there"));
        let at = at.on_hover_text("A point light in front of the clicked surface");
        if let Some(place) = place.filter(|_| at.clicked()) {
            edit = Some(Edit::Add(light_in_front(place.p, place.geometric_normal, place.distance)));
        }
        if ui.button("Add a sun").clicked() {
            edit = Some(Edit::Add(Light::directional(towards(0.7, 0.8), Vec3::splat(SUN))));
        }
    });
    let listing = &mut state.listing;
    ui.horizontal(|ui| {
        let label = ui.label("Search");
        ui.add(egui::TextEdit::singleline(&mut listing.search).desired_width(90.0)).labelled_by(label.id);
        ui.add_enabled(place.is_some(), egui::Checkbox::new(&mut listing.is_by_distance, "nearest to the pixel"));
    });
    let (listed, match_count) = listed(lights, listing, place.map(|place| place.p));
    if match_count > listed.len() || match_count < lights.len() {
        ui.label(format!("{} of {match_count} matches, {} lights in total", listed.len(), lights.len()));
    }
    for index in listed {
        let light = &lights[index];
        let title = format!("{} ({})", named(index, &light.name), kind(light));
        let header = egui::CollapsingHeader::new(title).id_salt(("light", index));
        header.show(ui, |ui| edit = one(ui, index, light).or(edit.take()));
    }
    edit
}

/// Indices of the listed lights in order, and the number of matches.
fn listed(lights: &[Light], listing: &Listing, place: Option<Vec3>) -> (Vec<usize>, usize) {
    let search = listing.search.trim().to_lowercase();
    let is_match = |index: &usize| {
        let name = named(*index, &lights[*index].name).to_lowercase();
        search.is_empty() || name.contains(&search) || kind(&lights[*index]) == search
    };
    let mut listed: Vec<usize> = (0..lights.len()).filter(is_match).collect();
    let match_count = listed.len();
    if let Some(p) = place.filter(|_| listing.is_by_distance) {
        let distance = |index: &usize| match lights[*index].kind {
            LightKind::Directional => f32::INFINITY,
            _ => lights[*index].position.distance(p),
        };
        listed.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    }
    listed.truncate(MOST);
    (listed, match_count)
}

fn kind(light: &Light) -> &'static str {
    match light.kind {
        LightKind::Point => "point",
        LightKind::Spot { .. } => "spot",
        LightKind::Directional => "sun",
        LightKind::Disk { .. } => "disk",
        LightKind::Rectangle { .. } => "rectangle",
    }
}

/// A point light in front of a surface at `p`, a tenth of the viewing `distance` away, 1 mm to 1 m. A white diffuse
/// sheet at that distance from the light has a luminance of about 1 nit.
fn light_in_front(p: Vec3, normal: Vec3, distance: f32) -> Light {
    let away = (0.1 * distance).clamp(1e-3, 1.0);
    Light::point(p + away * normal, Vec3::splat(std::f32::consts::PI * away * away))
}

/// Direction of light from an azimuth and an elevation, radians.
fn towards(azimuth: f32, elevation: f32) -> Vec3 {
    let (sin, cos) = elevation.sin_cos();
    -Vec3::new(cos * azimuth.sin(), sin, -cos * azimuth.cos())
}

/// Azimuth (clockwise from −z, seen from above) and elevation of the light's origin, radians.
fn angles(direction: Vec3) -> (f32, f32) {
    let from = -direction;
    (from.x.atan2(-from.z), from.y.clamp(-1.0, 1.0).asin())
}

/// Draws a light's widgets. Returns its edit, if any.
fn one(ui: &mut Ui, index: usize, light: &Light) -> Option<Edit> {
    let mut now = light.clone();
    let mut is_changed = false;
    if light.kind == LightKind::Directional {
        let (azimuth, elevation) = angles(light.direction);
        let (mut azimuth, mut elevation) = (azimuth.to_degrees(), elevation.to_degrees());
        let is_rotated =
            number(ui, "azimuth", DragValue::new(&mut azimuth).range(-180.0..=180.0).suffix("°").speed(0.5))
                | number(ui, "elevation", DragValue::new(&mut elevation).range(-90.0..=90.0).suffix("°").speed(0.5));
        if is_rotated {
            (now.direction, is_changed) = (towards(azimuth.to_radians(), elevation.to_radians()), true);
        }
    } else {
        for (name, axis) in [("x", 0), ("y", 1), ("z", 2)] {
            is_changed |= number(ui, name, DragValue::new(&mut now.position[axis]).suffix(" m").speed(0.02));
        }
    }
    let (mut strength, mut color) = of_intensity(light.intensity);
    let (name, unit) = match light.kind {
        LightKind::Point | LightKind::Spot { .. } => ("intensity", " cd"),
        LightKind::Directional => ("illuminance", " lx"),
        LightKind::Disk { .. } | LightKind::Rectangle { .. } => ("radiance", " nits"),
    };
    let speed = f64::from(0.01 * strength.max(1e-3));
    let mut is_recoloured =
        number(ui, name, DragValue::new(&mut strength).range(0.0..=1e9).suffix(unit).speed(speed).max_decimals(6));
    ui.horizontal(|ui| {
        let label = ui.label("colour");
        is_recoloured |= ui.color_edit_button_rgb(&mut color).labelled_by(label.id).changed();
    });
    if is_recoloured {
        (now.intensity, is_changed) = (strength * Vec3::from(color), true);
    }
    if ui.button("Delete").clicked() {
        return Some(Edit::Remove(index));
    }
    is_changed.then_some(Edit::Set(index, now))
}

/// Draws a number with its label. Returns true if it was changed.
fn number(ui: &mut Ui, name: &str, value: DragValue<'_>) -> bool {
    let row = ui.horizontal(|ui| {
        let label = ui.label(name);
        ui.add(value).labelled_by(label.id).changed()
    });
    row.inner
}

/// Splits an intensity into its largest channel and a colour with largest channel 1; white for zero.
fn of_intensity(intensity: Vec3) -> (f32, [f32; 3]) {
    let strength = intensity.max_element();
    (strength, if strength > 0.0 { (intensity / strength).to_array() } else { [1.0; 3] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_of_a_sun_round_trip() {
        for direction in [Vec3::new(0.3, -1.0, 0.2), Vec3::new(-1.0, -0.1, 0.0), Vec3::new(0.0, 0.5, -1.0)] {
            let direction = direction.normalize();
            let (azimuth, elevation) = angles(direction);
            assert!(towards(azimuth, elevation).abs_diff_eq(direction, 1e-6));
        }
        // From the east at 30°: +x is to the right of −z.
        let east = -towards(90f32.to_radians(), 30f32.to_radians());
        assert!(east.abs_diff_eq(Vec3::new(0.75f32.sqrt(), 0.5, 0.0), 1e-6), "{east}");
    }

    #[test]
    fn lights_are_listed_by_name_kind_number_and_distance() {
        let at = |x: f32, name: &str| Light { name: name.to_owned(), ..Light::point(Vec3::X * x, Vec3::ONE) };
        let mut lights: Vec<_> = (0..50).map(|i| at(i as f32, "bulb")).collect();
        lights.push(at(7.2, "Lantern"));
        lights.push(Light::directional(Vec3::NEG_Y, Vec3::ONE));
        let actual = |search: &str, is_by_distance: bool| {
            let listing = Listing { search: search.to_owned(), is_by_distance };
            listed(&lights, &listing, Some(Vec3::X * 7.3))
        };
        assert_eq!(actual("", false), ((0..MOST).collect(), 52));
        assert_eq!(actual(" lantern", false), (vec![50], 1));
        assert_eq!(actual("sun", false), (vec![51], 1));
        assert_eq!(actual("#17", true), (vec![17], 1));
        assert_eq!(actual("", true).0[..4], [50, 7, 8, 6]);
        assert_eq!(actual("nothing like it", false), (Vec::new(), 0));
    }

    #[test]
    fn edits_change_the_lights() {
        let lights = [Light::point(Vec3::ZERO, Vec3::ONE), Light::point(Vec3::X, Vec3::ONE)];
        let lamp = Light::point(Vec3::Y, Vec3::splat(2.0));
        assert_eq!(Edit::Add(lamp.clone()).applied(&lights), [&lights[..], std::slice::from_ref(&lamp)].concat());
        assert_eq!(Edit::Set(0, lamp.clone()).applied(&lights), [lamp, lights[1].clone()]);
        assert_eq!(Edit::Remove(0).applied(&lights), lights[1..]);
        let (strength, color) = of_intensity(Vec3::new(2.0, 4.0, 0.0));
        assert_eq!((strength, color), (4.0, [0.5, 1.0, 0.0]));
    }
}
