//! What is measured.

use lanternfish::settings::{DeepBuilder, DeepImageSettings, DirectionSet};

use super::build::Built;

/// Rows of one table.
pub struct Group {
    pub title: &'static str,
    pub rows: Vec<DeepImageSettings>,
}

/// Texels across the images that rays are traced through, ascending.
pub const RESOLUTIONS: &[u32] = &[64, 128, 256, 512];
pub const QUICK_RESOLUTIONS: &[u32] = &[32, 64];

/// Most bytes of lists that rays are traced through. Some machines have 8 GB, and the scene wants its share.
const MOST_BYTES: f64 = 4e9;

fn of(count: u32) -> DeepImageSettings {
    DeepImageSettings { directions: DirectionSet::ZonalEqualArea { count }, ..DeepImageSettings::default() }
}

/// What is built; what rays are traced through as well comes after it.
pub fn groups(quick: bool, single_pass_only: bool) -> Vec<Group> {
    let [few, all] = if quick { [4, 8] } else { [8, 169] };
    let counts: &[u32] = if quick { &[4, 8] } else { &[8, 16, 32, 64, 128, 169] };
    let supersamplings: &[u32] = if quick { &[2] } else { &[1, 2, 3] };
    let by = |builder, count| DeepImageSettings { builder, ..of(count) };
    let mut groups = vec![
        Group { title: "Directions", rows: counts.iter().map(|count| of(*count)).collect() },
        Group {
            title: "Supersampling",
            rows: supersamplings.iter().map(|n| DeepImageSettings { supersampling: *n, ..of(all) }).collect(),
        },
    ];
    if !single_pass_only {
        groups.push(Group {
            title: "Builders",
            // Depth peeling takes minutes for all directions.
            rows: vec![
                by(DeepBuilder::SinglePass, few),
                by(DeepBuilder::PerDirection, few),
                by(DeepBuilder::DepthPeeling, few),
                by(DeepBuilder::SinglePass, all),
                by(DeepBuilder::PerDirection, all),
            ],
        });
    }
    groups
}

/// The default's number of directions, or as many as fit where those of a coarser raster (`last`) foretell too many bytes: lists
/// grow with the number of texels.
pub fn directions_that_fit(last: Option<&Built>, resolution: u32) -> u32 {
    let count = DeepImageSettings::default().directions.count() as u32;
    let Some(last) = last else { return count };
    let finer = f64::from(resolution) / f64::from(last.resolution);
    let bytes_a_direction = last.bytes as f64 / last.directions as f64 * finer * finer;
    count.min((MOST_BYTES / bytes_a_direction) as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_fewer_where_all_would_not_fit() {
        let built = |bytes| Built { directions: 100, resolution: 64, bytes, ..Built::default() };
        assert_eq!(directions_that_fit(None, 512), 169);
        assert_eq!(directions_that_fit(Some(&built(1_000_000_000)), 64), 169);
        // Ten million bytes each, four times as many at twice the resolution.
        assert_eq!(directions_that_fit(Some(&built(1_000_000_000)), 128), 100);
        assert_eq!(directions_that_fit(Some(&built(u64::MAX)), 128), 1);
    }
}
