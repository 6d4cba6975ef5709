//! The street's materials.

use glam::Vec3;

use crate::{
    AlphaMode,
    generate::{
        surface::{Finish, Surface, Workshop},
        texture,
    },
};

/// The materials of the street.
pub(super) struct Materials {
    pub asphalt: Surface,
    pub puddle: Surface,
    pub paint: Surface,
    pub paving: Surface,
    pub kerb: Surface,
    pub trim: Surface,
    /// One per kind of house.
    pub walls: [Surface; 4],
    pub roof: Surface,
    pub wood: Surface,
    pub iron: Surface,
    pub thin_dielectric: Surface,
    /// Curtains with light behind them.
    pub lit_thin_dielectric: Surface,
    /// Warm, cold, pink.
    pub shop_windows: [Surface; 3],
    pub awning: Surface,
    pub bark: Surface,
    pub leaves: Surface,
    pub soil: Surface,
    pub lamp: Surface,
    pub bulb: Surface,
    /// Paint of the cars.
    pub cars: [Surface; 4],
    pub chrome: Surface,
    pub rubber: Surface,
    pub car_glass: Surface,
    pub tail_light: Surface,
}

impl Materials {
    /// Adds the materials to the scene.
    pub fn new(workshop: &mut Workshop) -> Self {
        let stone = Some(workshop.texture(texture::stone()));
        let stone_normal = Some(workshop.texture(texture::stone_normal()));
        let ashlar = Some(workshop.texture(texture::ashlar()));
        let ashlar_normal = Some(workshop.texture(texture::ashlar_normal()));
        let plaster = Some(workshop.texture(texture::plaster()));
        let asphalt = Some(workshop.texture(texture::asphalt()));
        let asphalt_normal = Some(workshop.texture(texture::asphalt_normal()));
        let wood = Some(workshop.texture(texture::wood()));
        let leaves = Some(workshop.texture(texture::leaves()));

        let textured = |name, color, roughness, color_texture, normal_texture, texture_size| Finish {
            color_texture,
            normal_texture,
            texture_size,
            ..Finish::new(name, color, roughness)
        };
        let glowing =
            |name, emissive: [f32; 3]| Finish { emissive: emissive.into(), ..Finish::new(name, [0.5; 3], 0.2) };
        let metal = |name, color, roughness| Finish { metallic: 1.0, ..Finish::new(name, color, roughness) };
        let mut add = |finish| workshop.surface(finish);
        Self {
            // Wet, not flooded: smooth enough for long reflections of the lamps.
            asphalt: add(textured("wet asphalt", [0.85; 3], 0.28, asphalt, asphalt_normal, 2.0)),
            puddle: add(Finish::new("puddle", [0.012, 0.013, 0.015], 0.03)),
            paint: add(textured("road paint", [0.75, 0.75, 0.70], 0.4, plaster, None, 1.0)),
            paving: add(textured("paving", [0.42, 0.40, 0.38], 0.4, ashlar, ashlar_normal, 1.6)),
            kerb: add(textured("kerb", [0.50, 0.50, 0.50], 0.45, stone, stone_normal, 1.0)),
            trim: add(textured("trim", [0.80, 0.75, 0.66], 0.7, stone, stone_normal, 1.5)),
            walls: [
                add(textured("ashlar wall", [0.80, 0.77, 0.72], 0.8, ashlar, ashlar_normal, 2.0)),
                add(textured("ochre wall", [0.70, 0.50, 0.26], 0.9, plaster, None, 3.0)),
                add(textured("red wall", [0.48, 0.20, 0.14], 0.9, plaster, None, 3.0)),
                add(textured("grey wall", [0.46, 0.50, 0.54], 0.9, plaster, None, 3.0)),
            ],
            roof: add(textured("slate", [0.16, 0.17, 0.20], 0.5, ashlar, ashlar_normal, 1.2)),
            wood: add(textured("painted wood", [0.30, 0.42, 0.36], 0.5, wood, None, 1.2)),
            iron: add(metal("iron", [0.12, 0.12, 0.13], 0.45)),
            thin_dielectric: add(Finish::new("thin_dielectric", [0.02, 0.025, 0.03], 0.05)),
            lit_thin_dielectric: add(glowing("lit window", [1.9, 1.15, 0.52])),
            shop_windows: [
                add(glowing("shop window, warm", [5.0, 3.3, 1.6])),
                add(glowing("shop window, cold", [2.6, 3.6, 4.6])),
                add(glowing("shop window, pink", [4.6, 1.3, 2.6])),
            ],
            awning: add(Finish { double_sided: true, ..Finish::new("awning", [0.45, 0.05, 0.05], 0.8) }),
            bark: add(Finish::new("bark", [0.14, 0.10, 0.07], 0.9)),
            leaves: add(Finish {
                alpha_mode: Some(AlphaMode::Mask { cutoff: 0.5 }),
                color_texture: leaves,
                double_sided: true,
                ..Finish::new("leaves", [0.9; 3], 0.5)
            }),
            soil: add(Finish::new("soil", [0.06, 0.045, 0.03], 1.0)),
            lamp: add(glowing("street lamp", [34.0, 23.0, 12.0])),
            bulb: add(glowing("bulb", [12.0, 8.0, 4.0])),
            cars: [
                add(Finish::new("car, blue", [0.02, 0.06, 0.20], 0.15)),
                add(Finish::new("car, red", [0.35, 0.02, 0.02], 0.15)),
                add(Finish::new("car, silver", [0.45, 0.46, 0.48], 0.2)),
                add(Finish::new("car, black", [0.015; 3], 0.12)),
            ],
            chrome: add(metal("chrome", [0.85; 3], 0.1)),
            rubber: add(Finish::new("rubber", [0.02; 3], 0.9)),
            car_glass: add(Finish::new("car window", [0.01, 0.012, 0.014], 0.03)),
            tail_light: add(Finish {
                emissive: Vec3::new(0.8, 0.02, 0.01),
                ..Finish::new("tail light", [0.4, 0.02, 0.02], 0.2)
            }),
        }
    }
}
