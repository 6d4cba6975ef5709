//! Counters and images of a frame, which depend on the simulation and not on timing: one run of it [VanGelderen2020,
//! §6.1.1].

use std::collections::BTreeMap;

use bytemuck::cast_slice;
use lanternfish::{RenderedImage, light_culling::clustered::GridContents};
use serde::{Deserialize, Serialize};

/// Counters and image hash of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counted {
    /// A hash of every bit of its images, radiance and display, of all eyes.
    #[serde(rename = "image")]
    pub rendering: String,
    /// Counters summed over the eyes, by name.
    pub counters: BTreeMap<String, u64>,
    /// Statistics of the clusters; `None` with other light culling.
    pub clusters: Option<Clusters>,
}

/// Statistics of the clusters of all grids.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clusters {
    /// Clusters with visible fragments.
    pub visible: u64,
    /// Fragments in these clusters.
    pub fragments: u64,
    /// Lighting operations: the length of its cluster's light list, summed over all fragments.
    pub lighting_operations: u64,
    /// Fragments of the fullest cluster.
    pub most_fragments: u32,
    /// Visible clusters by the length of their light list: 0, 1, 2 to 3, 4 to 7, and so on [VanGelderen2020, fig. 6.9].
    pub by_lights: Vec<u64>,
    /// Visible clusters by their fragments, in the same bins [VanGelderen2020, fig. 6.10].
    pub by_fragments: Vec<u64>,
    /// Fragments by the length of their cluster's light list, in the same bins: lights per pixel.
    pub fragments_by_lights: Vec<u64>,
}

impl Counted {
    /// The counters of a frame's images and grids.
    pub fn of(renderings: &[RenderedImage], grids: &[GridContents]) -> Self {
        let mut counters = BTreeMap::new();
        for (eye, rendering) in renderings.iter().enumerate() {
            for (name, count) in &rendering.report.counters {
                // Counters of the scene are the same for both eyes; add them once.
                if eye == 0 || !name.starts_with("scene/") {
                    *counters.entry(name.clone()).or_insert(0) += count;
                }
            }
        }
        Self { rendering: hash(renderings), counters, clusters: (!grids.is_empty()).then(|| Clusters::of(grids)) }
    }
}

impl Clusters {
    fn of(grids: &[GridContents]) -> Self {
        let visible = || grids.iter().flat_map(|grid| &grid.visible);
        Self {
            visible: visible().count() as u64,
            fragments: grids.iter().map(GridContents::fragments).sum(),
            lighting_operations: grids.iter().map(GridContents::lighting_operations).sum(),
            most_fragments: visible().map(|cluster| cluster.fragments).max().unwrap_or(0),
            by_lights: histogram(visible().map(|cluster| (cluster.lights, 1))),
            by_fragments: histogram(visible().map(|cluster| (cluster.fragments, 1))),
            fragments_by_lights: histogram(visible().map(|cluster| (cluster.lights, cluster.fragments.into()))),
        }
    }
}

/// Histogram with bins 0, 1, 2 to 3, 4 to 7, and so on up to the largest value. Input: values and their counts.
pub fn histogram(values: impl Iterator<Item = (u32, u64)>) -> Vec<u64> {
    let mut bins = Vec::new();
    for (value, often) in values {
        let bin = (u32::BITS - value.leading_zeros()) as usize;
        bins.resize(bins.len().max(bin + 1), 0);
        bins[bin] += often;
    }
    bins
}

/// 64-bit FNV-1a over 64-bit words: every bit of the images affects it.
fn hash(renderings: &[RenderedImage]) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |word: u64| hash = (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
    for rendering in renderings {
        add(u64::from(rendering.width) << 32 | u64::from(rendering.height));
        // Add the halves of a word one after the other, so that equal changes of both do not cancel out.
        for words in [cast_slice::<_, u32>(&rendering.radiance), cast_slice::<_, u32>(&rendering.display)] {
            words.iter().for_each(|word| add(u64::from(*word)));
        }
    }
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use lanternfish::{Report, light_culling::clustered::VisibleCluster};

    use super::*;

    fn rendering(value: f32) -> RenderedImage {
        let counters = vec![("scene/draws".to_owned(), 5), ("rays".to_owned(), 7)];
        RenderedImage {
            width: 2,
            height: 1,
            radiance: vec![[1.0; 4], [1.0, 1.0, value, 1.0]],
            display: vec![[9; 4]; 2],
            exposure: None,
            report: Report { counters, ..Report::default() },
        }
    }

    #[test]
    fn histograms_double() {
        let ones = |values: &[u32]| histogram(values.iter().map(|value| (*value, 1)));
        assert_eq!(ones(&[0, 1, 2, 3, 4, 7, 8, 0]), [2, 1, 2, 2, 1]);
        assert_eq!(ones(&[]), [] as [u64; 0]);
        assert_eq!(ones(&[u32::MAX]).len(), 33);
        assert_eq!(histogram([(3, 5), (1, 2), (2, 1)].into_iter()), [0, 2, 6]);
    }

    #[test]
    fn every_bit_of_an_image_changes_its_hash() {
        let of = |renderings: &[RenderedImage]| Counted::of(renderings, &[]).rendering;
        let one = of(&[rendering(1.0)]);
        assert_eq!(one, of(&[rendering(1.0)]));
        assert_ne!(one, of(&[rendering(f32::from_bits(1.0f32.to_bits() + 1))]));
        assert_ne!(one, of(&[rendering(1.0), rendering(1.0)]));
        let mut shown = rendering(1.0);
        shown.display[1][3] = 8;
        assert_ne!(one, of(&[shown]));
    }

    #[test]
    fn counts_of_all_eyes_and_grids_are_added() {
        let cluster = |index, fragments, lights| VisibleCluster { index, fragments, lights };
        let grids = [
            GridContents { clusters: 8, visible: vec![cluster(0, 10, 3), cluster(4, 1, 0)], ..GridContents::default() },
            GridContents { clusters: 8, visible: vec![cluster(2, 4, 2)], ..GridContents::default() },
        ];
        let counted = Counted::of(&[rendering(1.0), rendering(2.0)], &grids);
        assert_eq!((counted.counters["scene/draws"], counted.counters["rays"]), (5, 14));
        let clusters = counted.clusters.unwrap();
        assert_eq!((clusters.visible, clusters.fragments, clusters.lighting_operations), (3, 15, 38));
        assert_eq!(clusters.most_fragments, 10);
        assert_eq!((clusters.by_lights, clusters.fragments_by_lights), (vec![1, 0, 2], vec![1, 0, 14]));
        assert_eq!(Counted::of(&[rendering(1.0)], &[]).clusters, None);
    }
}
