//! The atrium's materials.

use glam::Vec3;

use crate::{
    AlphaMode,
    generate::{
        surface::{Finish, Surface, Workshop},
        texture,
    },
};

/// The materials of the atrium.
pub(super) struct Materials {
    pub limestone: Surface,
    pub ashlar: Surface,
    pub red_stone: Surface,
    pub flagstones: [Surface; 3],
    pub tiles: Surface,
    pub plaster: Surface,
    pub ochre_plaster: Surface,
    pub red_plaster: Surface,
    pub blue_plaster: Surface,
    pub wood: Surface,
    pub roof: Surface,
    pub painted_tiles: Surface,
    /// Red, green, blue, ochre.
    pub cloths: [Surface; 4],
    pub frond: Surface,
    pub leaves: Surface,
    pub bark: Surface,
    pub orange: Surface,
    pub terracotta: Surface,
    pub soil: Surface,
    pub bronze: Surface,
    pub gold: Surface,
    pub water: Surface,
    pub glass: Surface,
    pub flame: Surface,
}

impl Materials {
    /// Adds the materials to the scene.
    pub fn new(workshop: &mut Workshop) -> Self {
        let stone = Some(workshop.texture(texture::stone()));
        let stone_normal = Some(workshop.texture(texture::stone_normal()));
        let ashlar = Some(workshop.texture(texture::ashlar()));
        let ashlar_normal = Some(workshop.texture(texture::ashlar_normal()));
        let plaster = Some(workshop.texture(texture::plaster()));
        let tiles = Some(workshop.texture(texture::tiles()));
        let tiles_normal = Some(workshop.texture(texture::tiles_normal()));
        let wood = Some(workshop.texture(texture::wood()));
        let cloth = Some(workshop.texture(texture::cloth()));
        let cloth_normal = Some(workshop.texture(texture::cloth_normal()));
        let painted = Some(workshop.texture(texture::painted_tiles()));
        let frond = Some(workshop.texture(texture::frond()));
        let leaves = Some(workshop.texture(texture::leaves()));

        let mut stone_like = |name, color, roughness, texture_size| {
            let plain = Finish::new(name, color, roughness);
            workshop.surface(Finish { color_texture: stone, normal_texture: stone_normal, texture_size, ..plain })
        };
        let limestone = stone_like("limestone", [0.92, 0.88, 0.80], 0.7, 1.5);
        let red_stone = stone_like("red sandstone", [0.62, 0.24, 0.16], 0.75, 1.5);
        let flagstones = [
            stone_like("flagstone, light", [0.78, 0.74, 0.68], 0.45, 2.3),
            stone_like("flagstone, warm", [0.70, 0.61, 0.52], 0.5, 2.3),
            stone_like("flagstone, dark", [0.58, 0.54, 0.50], 0.4, 2.3),
        ];
        let roof = stone_like("roof tile", [0.62, 0.27, 0.15], 0.85, 1.0);
        let terracotta = stone_like("terracotta", [0.66, 0.30, 0.17], 0.8, 1.0);
        let mut plastered = |name, color| {
            let plain = Finish::new(name, color, 0.9);
            workshop.surface(Finish { color_texture: plaster, texture_size: 3.0, ..plain })
        };
        let white = plastered("plaster", [0.86, 0.83, 0.77]);
        let ochre = plastered("ochre plaster", [0.83, 0.58, 0.28]);
        let red = plastered("red plaster", [0.55, 0.13, 0.09]);
        let blue = plastered("blue plaster", [0.22, 0.38, 0.55]);
        let mut dyed = |name, color| {
            let plain = Finish { double_sided: true, ..Finish::new(name, color, 0.85) };
            workshop.surface(Finish { color_texture: cloth, normal_texture: cloth_normal, texture_size: 0.25, ..plain })
        };
        let cloths = [
            dyed("red cloth", [0.72, 0.03, 0.03]),
            dyed("green cloth", [0.04, 0.36, 0.10]),
            dyed("blue cloth", [0.03, 0.10, 0.55]),
            dyed("ochre cloth", [0.85, 0.46, 0.04]),
        ];
        let masked = |name, texture| Finish {
            alpha_mode: Some(AlphaMode::Mask { cutoff: 0.5 }),
            color_texture: texture,
            double_sided: true,
            ..Finish::new(name, [1.0; 3], 0.6)
        };
        let frond = workshop.surface(masked("palm frond", frond));
        let leaves = workshop.surface(masked("leaves", leaves));
        let textured = |name, color, roughness, color_texture, normal_texture, texture_size| Finish {
            color_texture,
            normal_texture,
            texture_size,
            ..Finish::new(name, color, roughness)
        };
        let metal = |name, color, roughness| Finish { metallic: 1.0, ..Finish::new(name, color, roughness) };
        let mut plain = |finish| workshop.surface(finish);
        Self {
            limestone,
            ashlar: plain(textured("ashlar", [0.95, 0.92, 0.87], 0.8, ashlar, ashlar_normal, 2.0)),
            red_stone,
            flagstones,
            tiles: plain(textured("polished tiles", [0.95; 3], 0.22, tiles, tiles_normal, 2.4)),
            plaster: white,
            ochre_plaster: ochre,
            red_plaster: red,
            blue_plaster: blue,
            wood: plain(textured("wood", [0.8; 3], 0.6, wood, None, 1.2)),
            roof,
            painted_tiles: plain(textured("painted tiles", [1.0; 3], 0.15, painted, None, 0.6)),
            cloths,
            frond,
            leaves,
            bark: plain(Finish::new("bark", [0.16, 0.10, 0.06], 0.9)),
            orange: plain(Finish::new("orange", [0.90, 0.32, 0.02], 0.4)),
            terracotta,
            soil: plain(Finish::new("soil", [0.07, 0.05, 0.035], 1.0)),
            bronze: plain(metal("bronze", [0.55, 0.36, 0.18], 0.38)),
            gold: plain(metal("gold", [1.0, 0.77, 0.34], 0.12)),
            water: plain(Finish::new("water", [0.03, 0.10, 0.10], 0.04)),
            glass: plain(Finish {
                alpha: 0.35,
                alpha_mode: Some(AlphaMode::Blend),
                double_sided: true,
                ..Finish::new("blue glass", [0.08, 0.25, 0.65], 0.05)
            }),
            flame: plain(Finish { emissive: Vec3::new(24.0, 11.0, 3.0), ..Finish::new("flame", [1.0; 3], 1.0) }),
        }
    }
}
