//! Figures of the paper [Niessner2010, §7].

use super::cases::Brdf;

/// Scene, API and hardware of the paper.
pub const MACHINE: &str = "Sibenik, images of 512 x 512, DirectX 10 on an NVIDIA GTX 285 with 1024 MB";

/// Million secondary rays a second, shading and its look into a shadow map included, by BRDF, texels of an image and their
/// number [Niessner2010, table 1].
pub fn rate(brdf: Brdf, resolution: u32, directions: u32) -> Option<&'static str> {
    match (brdf, resolution, directions) {
        (Brdf::Diffuse, 512, 96) => Some("11–16"),
        (Brdf::Diffuse, 128, 96) => Some("37–50"),
        (Brdf::Glossy, 512, 150) => Some("63–71"),
        (Brdf::Glossy, 128, 150) => Some("151–209"),
        _ => None,
    }
}

/// The same of soft shadows, the table's third row.
pub fn soft_rate(resolution: u32, directions: u32) -> Option<&'static str> {
    match (resolution, directions) {
        (512, 384) => Some("79–103"),
        (128, 384) => Some("283–377"),
        _ => None,
    }
}

/// A figure of indirect light with its frames a second.
pub struct Figure {
    pub name: &'static str,
    pub shows: &'static str,
    /// What surfaces are made of; none: diffuse and glossy light added.
    pub brdf: Option<Brdf>,
    pub directions: u32,
    pub resolution: u32,
    pub samples: u32,
    pub frames_a_second: &'static str,
}

/// His figures with indirect light that have frames a second. Where a figure does not say how many images there are and of how
/// many texels, they are those of the section (96, and 128²).
pub const FIGURES: &[Figure] = &[
    figure("1", "objects in the Cornell box, diffuse and glossy", None, 150, 128, 1, "27.0"),
    figure("4, left", "Sibenik, diffuse", Some(Brdf::Diffuse), 96, 128, 1, "17.5"),
    figure("4, right", "Sibenik, diffuse, 4 samples a pixel", Some(Brdf::Diffuse), 96, 128, 4, "16.5"),
    figure("7, left", "a mirror", Some(Brdf::Mirror), 150, 512, 1, "336"),
    figure("7, right", "a mirror", Some(Brdf::Mirror), 150, 128, 1, "600"),
    figure("9, top left", "Lucy in Sibenik, glossy", Some(Brdf::Glossy), 150, 128, 1, "45.0"),
    figure("9, top right", "the floor of Sponza, glossy", Some(Brdf::Glossy), 96, 128, 1, "52.5"),
    figure("9, bottom left", "Sponza, diffuse", Some(Brdf::Diffuse), 96, 128, 1, "19.0"),
    figure("9, bottom right", "an enhanced Sponza, diffuse", Some(Brdf::Diffuse), 96, 128, 1, "15.5"),
];

const fn figure(
    name: &'static str,
    shows: &'static str,
    brdf: Option<Brdf>,
    directions: u32,
    resolution: u32,
    samples: u32,
    frames_a_second: &'static str,
) -> Figure {
    Figure { name, shows, brdf, directions, resolution, samples, frames_a_second }
}

/// The rest of his section, a line each.
pub const OTHERS: &[&str] = &[
    "Building, with depth peeling and compaction on the processor, Sponza: 1 s (96 images of 128²) to 23 s (384 of 512²). Memory: 15 to \
     60 MB for 150 images of 128².",
    "Filter: diffuse light, 8 rays a pixel, an 11 x 11 Gaussian that does not stop at edges; glossy light, 16 rays a pixel, none. No time \
     of its own is given (\"small extra costs\").",
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
        assert_eq!(
            [soft_rate(512, 384), soft_rate(128, 384), soft_rate(128, 96)],
            [Some("79–103"), Some("283–377"), None]
        );
        assert!(FIGURES.iter().all(|figure| figure.frames_a_second.parse::<f64>().is_ok_and(|frames| frames > 15.0)));
    }
}
