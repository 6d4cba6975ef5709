//! The scene's lights, by hand: found, added, moved, coloured, deleted.

use egui::{DragValue, Ui};
use glam::Vec3;
use lanternfish_scene::{Light, LightKind};

use super::{Facts, State, pixel::named, sun};
use crate::sun::PlaceAndHour;

/// Lights that are listed, at most.
const MOST: usize = 20;
/// Illuminance of a sun that is added, lx: what the built-in one has.
const SUN: f32 = 3.0;

/// What is listed of the lights.
#[derive(Clone, Debug, Default)]
pub struct Listing {
    /// What their names or numbers contain.
    pub search: String,
    /// Where and when the sun stands as a light is put.
    pub sun: PlaceAndHour,
    /// Those first that are next to the pixel that was clicked.
    pub is_by_distance: bool,
}

/// What becomes of a light.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Another in the place of the one of this index.
    Set(usize, Light),
    /// One more.
    Add(Light),
    /// The one of this index goes.
    Remove(usize),
}

impl Edit {
    /// The index of the light that it changes, and whether that one goes; none where one comes.
    pub fn changed(&self) -> Option<(usize, bool)> {
        match self {
            Self::Set(index, _) => Some((*index, false)),
            Self::Remove(index) => Some((*index, true)),
            Self::Add(_) => None,
        }
    }

    /// The lights afterwards.
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
            edit = Some(Edit::Add(before(place.p, place.geometric_normal, place.distance)));
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
    let (listed, found) = listed(lights, listing, place.map(|place| place.p));
    if found > listed.len() || found < lights.len() {
        ui.label(format!("{} of {found} found, {} in all", listed.len(), lights.len()));
    }
    for index in listed {
        let light = &lights[index];
        let title = format!("{} ({})", named(index, &light.name), kind(light));
        let header = egui::CollapsingHeader::new(title).id_salt(("light", index));
        header.show(ui, |ui| edit = one(ui, index, light, &mut listing.sun).or(edit.take()));
    }
    edit
}

/// Which are listed, in order; and how many there are that are looked for.
fn listed(lights: &[Light], listing: &Listing, place: Option<Vec3>) -> (Vec<usize>, usize) {
    let wanted = listing.search.trim().to_lowercase();
    let is_wanted = |index: &usize| {
        let name = named(*index, &lights[*index].name).to_lowercase();
        wanted.is_empty() || name.contains(&wanted) || kind(&lights[*index]) == wanted
    };
    let mut listed: Vec<usize> = (0..lights.len()).filter(is_wanted).collect();
    let found = listed.len();
    if let Some(p) = place.filter(|_| listing.is_by_distance) {
        let distance = |index: &usize| match lights[*index].kind {
            LightKind::Directional => f32::INFINITY,
            _ => lights[*index].position.distance(p),
        };
        listed.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    }
    listed.truncate(MOST);
    (listed, found)
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

/// A light before a surface at `p` that is seen from so far: as bright as makes a white sheet at its distance about 1 nit bright.
fn before(p: Vec3, normal: Vec3, distance: f32) -> Light {
    let away = (0.1 * distance).clamp(1e-3, 1.0);
    Light::point(p + away * normal, Vec3::splat(std::f32::consts::PI * away * away))
}

/// Direction of light that comes from an azimuth and an elevation, radians.
fn towards(azimuth: f32, elevation: f32) -> Vec3 {
    let (sin, cos) = elevation.sin_cos();
    -Vec3::new(cos * azimuth.sin(), sin, -cos * azimuth.cos())
}

/// Azimuth (clockwise from −z, seen from above) and elevation of where light comes from, radians.
fn angles(direction: Vec3) -> (f32, f32) {
    let from = -direction;
    (from.x.atan2(-from.z), from.y.clamp(-1.0, 1.0).asin())
}

/// A light's widgets; what becomes of it.
fn one(ui: &mut Ui, index: usize, light: &Light, at: &mut PlaceAndHour) -> Option<Edit> {
    let mut now = light.clone();
    let mut is_other = false;
    if light.kind == LightKind::Directional {
        let (azimuth, elevation) = angles(light.direction);
        let (mut azimuth, mut elevation) = (azimuth.to_degrees(), elevation.to_degrees());
        let turned = number(ui, "azimuth", DragValue::new(&mut azimuth).range(-180.0..=180.0).suffix("°").speed(0.5))
            | number(ui, "elevation", DragValue::new(&mut elevation).range(-90.0..=90.0).suffix("°").speed(0.5));
        if turned {
            (now.direction, is_other) = (towards(azimuth.to_radians(), elevation.to_radians()), true);
        }
        ui.collapsing("By place and hour", |ui| {
            if let Some(direction) = sun::show(ui, at) {
                (now.direction, is_other) = (direction, true);
            }
        });
    } else {
        for (name, axis) in [("x", 0), ("y", 1), ("z", 2)] {
            is_other |= number(ui, name, DragValue::new(&mut now.position[axis]).suffix(" m").speed(0.02));
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
        (now.intensity, is_other) = (strength * Vec3::from(color), true);
    }
    if ui.button("Delete").clicked() {
        return Some(Edit::Remove(index));
    }
    is_other.then_some(Edit::Set(index, now))
}

/// A number and its name; whether it is another now.
pub fn number(ui: &mut Ui, name: &str, value: DragValue<'_>) -> bool {
    let row = ui.horizontal(|ui| {
        let label = ui.label(name);
        ui.add(value).labelled_by(label.id).changed()
    });
    row.inner
}

/// How much it is, and the colour that scales it, whose greatest channel is 1; white where there is nothing.
fn of_intensity(intensity: Vec3) -> (f32, [f32; 3]) {
    let strength = intensity.max_element();
    (strength, if strength > 0.0 { (intensity / strength).to_array() } else { [1.0; 3] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sun_by_its_angles_is_where_it_was() {
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
    fn lights_are_found_by_name_kind_number_and_distance() {
        let at = |x: f32, name: &str| Light { name: name.to_owned(), ..Light::point(Vec3::X * x, Vec3::ONE) };
        let mut lights: Vec<_> = (0..50).map(|i| at(i as f32, "bulb")).collect();
        lights.push(at(7.2, "Lantern"));
        lights.push(Light::directional(Vec3::NEG_Y, Vec3::ONE));
        let found = |search: &str, is_by_distance: bool| {
            let listing = Listing { search: search.to_owned(), is_by_distance, ..Listing::default() };
            listed(&lights, &listing, Some(Vec3::X * 7.3))
        };
        assert_eq!(found("", false), ((0..MOST).collect(), 52));
        assert_eq!(found(" lantern", false), (vec![50], 1));
        assert_eq!(found("sun", false), (vec![51], 1));
        assert_eq!(found("#17", true), (vec![17], 1));
        assert_eq!(found("", true).0[..4], [50, 7, 8, 6]);
        assert_eq!(found("nothing like it", false), (Vec::new(), 0));
    }

    #[test]
    fn edits_are_what_they_say() {
        let lights = [Light::point(Vec3::ZERO, Vec3::ONE), Light::point(Vec3::X, Vec3::ONE)];
        let lamp = Light::point(Vec3::Y, Vec3::splat(2.0));
        assert_eq!(Edit::Add(lamp.clone()).applied(&lights), [&lights[..], std::slice::from_ref(&lamp)].concat());
        assert_eq!(Edit::Set(0, lamp.clone()).applied(&lights), [lamp, lights[1].clone()]);
        assert_eq!(Edit::Remove(0).applied(&lights), lights[1..]);
        let (strength, color) = of_intensity(Vec3::new(2.0, 4.0, 0.0));
        assert_eq!((strength, color), (4.0, [0.5, 1.0, 0.0]));
    }
}
