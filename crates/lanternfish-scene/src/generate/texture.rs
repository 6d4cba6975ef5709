//! Procedural textures. All repeat; sizes are powers of two.

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::hash::{fractal, noise, unit};
use super::surface::rgba;
use crate::Image;

/// An image of `size`² pixels from `color(x, y)`, x and y in 0..1 from the top left, sRGB-encoded RGBA in 0..=1.
fn paint(name: &str, size: u32, color: impl Fn(f32, f32) -> Vec4 + Sync) -> Image {
    let mut pixels = vec![0; 4 * (size * size) as usize];
    pixels.par_chunks_exact_mut(4 * size as usize).enumerate().for_each(|(row, pixels)| {
        for (column, pixel) in pixels.chunks_exact_mut(4).enumerate() {
            let [x, y] = [column, row].map(|i| (i as f32 + 0.5) / size as f32);
            pixel.copy_from_slice(&rgba(color(x, y)));
        }
    });
    Image { name: name.to_owned(), width: size, height: size, rgba: pixels }
}

/// The normal map of `height(x, y)`, with heights in widths of the image.
fn emboss(name: &str, size: u32, height: impl Fn(f32, f32) -> f32 + Sync) -> Image {
    let count = size as usize;
    let mut heights = vec![0.0; count * count];
    heights.par_chunks_exact_mut(count).enumerate().for_each(|(row, heights)| {
        for (column, value) in heights.iter_mut().enumerate() {
            *value = height((column as f32 + 0.5) / size as f32, (row as f32 + 0.5) / size as f32);
        }
    });
    paint(name, size, |x, y| {
        let at = |dx: usize, dy: usize| {
            let [column, row] = [x, y].map(|c| (c * size as f32) as usize);
            heights[(row + dy) % count * count + (column + dx) % count]
        };
        // Central differences over two texels. y runs down the image, the map's green up.
        let slope = 0.5 * size as f32 * Vec2::new(at(1, 0) - at(count - 1, 0), at(0, 1) - at(0, count - 1));
        (Vec3::new(-slope.x, slope.y, 1.0).normalize() * 0.5 + 0.5).extend(1.0)
    })
}

/// A brick pattern: distance to the nearest joint (in widths of the image) and the brick's number.
fn bricks(x: f32, y: f32, columns: u32, rows: u32, staggered: bool) -> (f32, u32) {
    let row = (y * rows as f32) as u32 % rows;
    let shift = if staggered && row % 2 == 1 { 0.5 } else { 0.0 };
    let along = x * columns as f32 + shift;
    let column = along as u32 % columns;
    let (s, t) = (along.fract(), (y * rows as f32).fract());
    let distance = (s.min(1.0 - s) / columns as f32).min(t.min(1.0 - t) / rows as f32);
    (distance, row * columns + column)
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn srgb(r: f32, g: f32, b: f32) -> Vec3 {
    Vec3::new(r, g, b)
}

/// Cream limestone: clouds, veins and pores.
pub(super) fn stone() -> Image {
    paint("stone", 512, |x, y| {
        let clouds = fractal(x, y, 4, 5, 11);
        let vein = (1.0 - (fractal(x, y, 3, 4, 29) - 0.5).abs() * 14.0).max(0.0);
        let pores = smoothstep(0.74, 0.86, noise(x * 128.0, y * 128.0, 128, 5));
        let color = srgb(0.93, 0.87, 0.77).lerp(srgb(0.80, 0.71, 0.59), smoothstep(0.3, 0.75, clouds));
        (color * (1.0 - 0.10 * vein - 0.09 * pores)).extend(1.0)
    })
}

/// Relief of [`stone`].
pub(super) fn stone_normal() -> Image {
    emboss("stone normal", 512, |x, y| {
        let pores = smoothstep(0.74, 0.86, noise(x * 128.0, y * 128.0, 128, 5));
        0.004 * fractal(x, y, 16, 4, 17) - 0.0005 * pores
    })
}

/// Blocks of a wall, 2 across and 4 high, in running bond.
pub(super) fn ashlar() -> Image {
    paint("ashlar", 512, |x, y| {
        let (joint, block) = bricks(x, y, 2, 4, true);
        let mortar = 1.0 - smoothstep(0.002, 0.005, joint);
        let tone = unit(&[block, 3]);
        let stone = srgb(0.90, 0.81, 0.66).lerp(srgb(0.79, 0.66, 0.50), 0.75 * tone);
        let clouds = 0.78 + 0.36 * fractal(x + 0.37 * tone, y, 8, 5, 41);
        let dirt = 1.0 - 0.18 * (1.0 - smoothstep(0.0, 0.025, joint)) * fractal(x, y, 6, 3, 77);
        (stone * clouds * dirt).lerp(srgb(0.62, 0.56, 0.47), 0.8 * mortar).extend(1.0)
    })
}

/// Relief of [`ashlar`].
pub(super) fn ashlar_normal() -> Image {
    emboss("ashlar normal", 512, |x, y| {
        let (joint, _) = bricks(x, y, 2, 4, true);
        0.006 * smoothstep(0.001, 0.009, joint) + 0.006 * fractal(x, y, 24, 4, 43)
    })
}

/// Lime plaster with faint stains.
pub(super) fn plaster() -> Image {
    paint("plaster", 512, |x, y| {
        let stains = smoothstep(0.35, 0.75, fractal(x, y, 3, 6, 51));
        let grain = fractal(x, y, 64, 2, 57) - 0.5;
        (Vec3::splat(0.95) - 0.16 * stains * Vec3::new(0.7, 0.9, 1.2) + 0.05 * grain).extend(1.0)
    })
}

/// Polished tiles in two colours, four by four. The pattern is axis-aligned; only instances rotate it.
pub(super) fn tiles() -> Image {
    paint("tiles", 512, |x, y| {
        let (joint, tile) = bricks(x, y, 4, 4, false);
        let dark = (tile / 4 + tile % 4) % 2 == 1;
        let tone = unit(&[tile, 9]);
        let vein = (1.0 - (fractal(x + 0.31 * tone, y + tone, 3, 5, 61) - 0.5).abs() * 12.0).max(0.0);
        let color = if dark {
            srgb(0.46, 0.22, 0.17).lerp(srgb(0.60, 0.33, 0.25), 0.6 * tone + 0.4 * vein)
        } else {
            srgb(0.90, 0.85, 0.76).lerp(srgb(0.72, 0.64, 0.55), 0.35 * tone + 0.45 * vein)
        };
        color.lerp(srgb(0.36, 0.32, 0.28), 1.0 - smoothstep(0.001, 0.003, joint)).extend(1.0)
    })
}

/// Relief of [`tiles`]: joints, and slightly tilted tiles.
pub(super) fn tiles_normal() -> Image {
    emboss("tiles normal", 512, |x, y| {
        let (joint, tile) = bricks(x, y, 4, 4, false);
        let tilt = Vec2::new(unit(&[tile, 1]) - 0.5, unit(&[tile, 2]) - 0.5);
        let level = tilt.dot(Vec2::new((4.0 * x).fract() - 0.5, (4.0 * y).fract() - 0.5));
        smoothstep(0.0, 0.005, joint) * (0.003 + 0.003 * level) + 0.0006 * fractal(x, y, 16, 3, 63)
    })
}

/// Planks along u, four of them.
pub(super) fn wood() -> Image {
    paint("wood", 512, |x, y| {
        let plank = (4.0 * y) as u32;
        let tone = unit(&[plank, 21]);
        let bend = 0.5 * fractal(x, y, 2, 3, 71);
        let grain = fractal(0.125 * x + tone, y + 0.05 * bend, 32, 3, 73 + plank);
        let gap = smoothstep(0.0, 0.012, (4.0 * y).fract().min(1.0 - (4.0 * y).fract()));
        let color = srgb(0.40, 0.25, 0.14).lerp(srgb(0.66, 0.45, 0.27), grain * 0.8 + 0.3 * tone);
        (color * (0.3 + 0.7 * gap)).extend(1.0)
    })
}

/// Threads of a woven cloth, near white: the material's colour dyes it.
pub(super) fn cloth() -> Image {
    paint("cloth", 256, |x, y| {
        let (over, under) = weave(x, y);
        let wear = 0.86 + 0.14 * fractal(x, y, 4, 4, 81);
        Vec3::splat((0.72 + 0.28 * over.max(under)) * wear).extend(1.0)
    })
}

/// Relief of [`cloth`].
pub(super) fn cloth_normal() -> Image {
    emboss("cloth normal", 256, |x, y| {
        let (over, under) = weave(x, y);
        0.006 * over.max(under)
    })
}

/// Heights of the two threads of a plain weave, 0..=1, 32 threads per image.
fn weave(x: f32, y: f32) -> (f32, f32) {
    let (u, v) = (32.0 * x, 32.0 * y);
    let arch = |t: f32| (std::f32::consts::PI * t.fract()).sin();
    let raised = (u as u32 + v as u32).is_multiple_of(2);
    let [high, low] = if raised { [1.0, 0.55] } else { [0.55, 1.0] };
    (high * arch(v) * (0.5 + 0.5 * arch(u)), low * arch(u) * (0.5 + 0.5 * arch(v)))
}

/// Painted tiles, two by two: blue stars on white, ochre centres.
pub(super) fn painted_tiles() -> Image {
    paint("painted tiles", 256, |x, y| {
        let p = Vec2::new((2.0 * x).fract() - 0.5, (2.0 * y).fract() - 0.5);
        let (radius, angle) = (p.length(), p.y.atan2(p.x));
        let star = 0.30 + 0.10 * (8.0 * angle).cos();
        let corner = (p.abs() - 0.5).length();
        let white = srgb(0.93, 0.92, 0.86);
        let blue = srgb(0.10, 0.24, 0.58);
        let mut color = if radius < star { blue } else { white };
        if radius < 0.17 {
            color = if radius < 0.10 { srgb(0.83, 0.55, 0.14) } else { white };
        }
        if corner < 0.24 {
            color = if corner < 0.15 { srgb(0.12, 0.42, 0.36) } else { blue };
        }
        let edge = 0.5 - p.abs().max_element();
        let glaze = 0.93 + 0.14 * (fractal(x, y, 8, 3, 91) - 0.5);
        (color * glaze).lerp(srgb(0.5, 0.47, 0.42), 1.0 - smoothstep(0.008, 0.02, edge)).extend(1.0)
    })
}

/// Asphalt: dark binder, lighter grit, and patches.
pub(super) fn asphalt() -> Image {
    paint("asphalt", 512, |x, y| {
        let grit = smoothstep(0.55, 0.8, noise(x * 192.0, y * 192.0, 192, 101));
        let patch = smoothstep(0.4, 0.65, fractal(x, y, 2, 5, 103));
        let color = srgb(0.21, 0.21, 0.22).lerp(srgb(0.30, 0.30, 0.30), 0.7 * patch);
        (color + 0.16 * grit * srgb(1.0, 0.97, 0.92)).extend(1.0)
    })
}

/// Relief of [`asphalt`]: grit that is half covered by water.
pub(super) fn asphalt_normal() -> Image {
    emboss("asphalt normal", 512, |x, y| {
        let dry = smoothstep(0.35, 0.7, fractal(x, y, 2, 5, 103));
        0.0006 * (0.25 + 0.75 * dry) * noise(x * 96.0, y * 96.0, 96, 107) + 0.002 * fractal(x, y, 4, 3, 109)
    })
}

/// A palm frond, its stem along the middle from the bottom up; alpha is the mask.
pub(super) fn frond() -> Image {
    paint("frond", 512, |x, y| {
        let (side, along) = ((x - 0.5).abs() * 2.0, 1.0 - y);
        // Leaflets leave the stem at 50° and get shorter to the tip; their number is a compromise with mip levels.
        let leaflet = (along - 0.42 * side) * 20.0 + if x < 0.5 { 0.5 } else { 0.0 };
        let reach = (1.0 - along.powi(3)).sqrt() * (0.55 + 0.45 * (along * 4.0).min(1.0));
        let width = 0.35 * (1.0 - (side / reach.max(1e-3)).powi(3)).max(0.0);
        let blade = side < reach && (leaflet.fract() - 0.5).abs() < width && along - 0.42 * side > 0.03;
        let stem = side < 0.045 * (1.2 - along);
        let shade = 0.75 + 0.5 * (leaflet.fract() - 0.5).abs() + 0.2 * fractal(x, y, 8, 3, 97);
        let green = if stem { srgb(0.45, 0.47, 0.20) } else { srgb(0.34, 0.55, 0.20) * shade };
        green.extend(if blade || stem { 1.0 } else { 0.0 })
    })
}

/// A twig with pointed leaves; alpha is the mask.
pub(super) fn leaves() -> Image {
    paint("leaves", 256, |x, y| {
        let p = Vec2::new(x - 0.5, 0.92 - y);
        let mut best: Option<f32> = None;
        for i in 0..9u32 {
            // Pairs along the twig, one leaf at its end: from `foot`, `angle` away from upright.
            let foot = Vec2::new(0.0, 0.08 + 0.13 * (i / 2) as f32);
            let angle = if i == 8 { 0.0 } else { (0.95 - 0.08 * (i / 2) as f32) * if i % 2 == 0 { 1.0 } else { -1.0 } };
            let local = Vec2::from_angle(angle).rotate(p - foot);
            let t = local.y / 0.30;
            if (0.0..1.0).contains(&t) && local.x.abs() < 0.085 * (std::f32::consts::PI * t.powf(0.8)).sin() {
                best = Some(1.0 - local.x.abs() * 5.0 - 0.06 * i as f32 / 9.0);
            }
        }
        let twig = p.x.abs() < 0.010 && (-0.08..0.65).contains(&p.y);
        match best {
            Some(shade) => (srgb(0.42, 0.62, 0.24) * (0.7 + 0.4 * shade)).extend(1.0),
            None if twig => srgb(0.34, 0.26, 0.15).extend(1.0),
            None => srgb(0.42, 0.60, 0.24).extend(0.0),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_embosses_to_a_tilted_normal() {
        // Away from the seam, a slope of 1 along +x leans the normal to −x by 45°.
        let image = emboss("ramp", 16, |x, _| x);
        let pixel = &image.rgba[4 * (8 * 16 + 8)..][..3];
        let diagonal = ((0.5 - 0.5 * 0.5f32.sqrt()) * 255.0).round() as u8;
        assert_eq!(pixel, [diagonal, 128, 255 - diagonal]);
        // y runs down the image and green up it.
        let image = emboss("ramp", 16, |_, y| y);
        assert!(image.rgba[4 * (8 * 16 + 8) + 1] > 200);
    }

    #[test]
    fn masks_have_leaf_and_gap() {
        for image in [frond(), leaves()] {
            let solid = image.rgba.chunks_exact(4).filter(|p| p[3] == 255).count();
            let fraction = solid as f32 / (image.width * image.height) as f32;
            assert!((0.15..0.8).contains(&fraction), "{}: {fraction} is leaf", image.name);
        }
    }
}
