//! Nießner's own figures [Niessner2010, §7].

use super::cases::Brdf;

/// What they were measured on.
pub const MACHINE: &str = "Sibenik, images of 512 x 512, DirectX 10 on an NVIDIA GTX 285 with 1024 MB";

/// Million secondary rays a second, shading and its look into a shadow map included, by BRDF, texels of an image and their
/// number [Niessner2010, table 1]. His third row is soft shadows: 79–103 and 283–377 with 384 images.
pub fn rate(brdf: Brdf, resolution: u32, directions: u32) -> Option<&'static str> {
    match (brdf, resolution, directions) {
        (Brdf::Diffuse, 512, 96) => Some("11–16"),
        (Brdf::Diffuse, 128, 96) => Some("37–50"),
        (Brdf::Glossy, 512, 150) => Some("63–71"),
        (Brdf::Glossy, 128, 150) => Some("151–209"),
        _ => None,
    }
}

/// The rest of his section, a line each.
pub const OTHERS: &[&str] = &[
    "Mirror (fig. 7), 150 images: 336 frames a second at 512², 600 at 128²; no rays a second are given.",
    "Soft shadows (table 1), 384 images: 79–103 M rays a second at 512², 283–377 at 128².",
    "Building, with depth peeling and compaction on the processor, Sponza: 1 s (96 images of 128²) to 23 s (384 of 512²). Memory: 15 to \
     60 MB for 150 images of 128².",
    "Filter: diffuse light, 8 rays a pixel, an 11 x 11 Gaussian that does not stop at edges; glossy light, 16 rays a pixel, none. No time \
     of its own is given (\"small extra costs\").",
    "Antialiasing (fig. 4), 4 samples a pixel, 8 diffuse rays a pixel: 17.5 frames a second without, 16.5 with.",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn his_figures_stand_where_he_measured() {
        assert_eq!(rate(Brdf::Diffuse, 128, 6 * Brdf::Diffuse.k().pow(2)), Some("37–50"));
        assert_eq!(rate(Brdf::Glossy, 512, 6 * Brdf::Glossy.k().pow(2)), Some("63–71"));
        assert_eq!(rate(Brdf::Mirror, 128, 150), None);
        assert_eq!(rate(Brdf::Diffuse, 128, 150), None);
    }
}
