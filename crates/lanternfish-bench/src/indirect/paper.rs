//! Figures of the paper [Niessner2010, §7].

use super::cases::Brdf;

/// Scene, API and hardware of the paper.
pub const MACHINE: &str = "Sibenik, images of 512 x 512, DirectX 10 on an NVIDIA GTX 285 with 1024 MB";

/// Million secondary rays per second, shading and its shadow-map lookup included, for a BRDF, an image resolution in texels and a number of
/// directions [Niessner2010, table 1]. The table's third row, soft shadows, is in [`OTHERS`].
pub fn rate(brdf: Brdf, resolution: u32, directions: u32) -> Option<&'static str> {
    match (brdf, resolution, directions) {
        (Brdf::Diffuse, 512, 96) => Some("11–16"),
        (Brdf::Diffuse, 128, 96) => Some("37–50"),
        (Brdf::Glossy, 512, 150) => Some("63–71"),
        (Brdf::Glossy, 128, 150) => Some("151–209"),
        _ => None,
    }
}

/// The other figures of the section, one per line.
pub const OTHERS: &[&str] = &[
    "Mirror (fig. 7), 150 images: 336 frames/s at 512², 600 at 128²; no ray rate is given.",
    "Soft shadows (table 1), 384 images: 79–103 M rays/s at 512², 283–377 at 128².",
    "Building, with depth peeling and compaction on the processor, Sponza: 1 s (96 images of 128²) to 23 s (384 of 512²). Memory: 15 to \
     60 MB for 150 images of 128².",
    "Filter: diffuse light, 8 rays per pixel, an 11 x 11 Gaussian that is not edge-aware; glossy light, 16 rays per pixel, none. No separate \
     time is given (\"small extra costs\").",
    "Antialiasing (fig. 4), 4 samples per pixel, 8 diffuse rays per pixel: 17.5 frames/s without, 16.5 with.",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_papers_configurations() {
        assert_eq!(rate(Brdf::Diffuse, 128, 6 * Brdf::Diffuse.k().pow(2)), Some("37–50"));
        assert_eq!(rate(Brdf::Glossy, 512, 6 * Brdf::Glossy.k().pow(2)), Some("63–71"));
        assert_eq!(rate(Brdf::Mirror, 128, 150), None);
        assert_eq!(rate(Brdf::Diffuse, 128, 150), None);
    }
}
