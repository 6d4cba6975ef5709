//! What is measured: one list.

use lanternfish_papers::{DeepBuilder, DeepDepth, DeepImageSettings, DeepSearch, DeepStore, DirectionSet};

use crate::table::Row;

/// Rows of one table.
pub struct Group {
    pub title: &'static str,
    pub rows: Vec<DeepImageSettings>,
    /// True if the rays are traced through the exact structures as well.
    pub beside_exact: bool,
    /// True if holes are counted, against a draw for each direction.
    pub with_holes: bool,
}

/// Most bytes of lists that rays are traced through. Some machines have 8 GB, and the scene wants its share.
const MOST_BYTES: f64 = 4e9;
/// How many times the fragments of an average image the images of one chunk may have.
const UNEVEN: f64 = 3.0;

/// Names of the tables: the titles of [`groups`] in lower case, and the crossings'.
pub const TABLES: [&str; 7] =
    ["directions", "supersampling", "resolution", "stores", "searches", "builders", super::crossings::TABLE];

/// Everything that is built and traced, in this order: coarse images come before fine ones ([`fitted`]).
pub fn groups(quick: bool) -> Vec<Group> {
    let default = DeepImageSettings::default();
    let of = |count| DeepImageSettings { directions: DirectionSet::ZonalEqualArea { count }, ..default };
    let by = |builder, count| DeepImageSettings { builder, ..of(count) };
    let [few, all] = if quick { [4, 8] } else { [8, 169] };
    let finer = |builder| DeepImageSettings { resolution: 2 * default.resolution, ..by(builder, all) };
    // [Archer2019, table 2], and the default.
    let counts: &[u32] = if quick { &[4, 8] } else { &[8, 16, 32, 64, 128, 169] };
    let supersamplings: &[u32] = if quick { &[2] } else { &[1, 2, 3] };
    // [Niessner2010, table 1] has the second and the last.
    let resolutions: &[u32] = if quick { &[32, 64] } else { &[64, 128, 256, 512] };
    // Only the single-pass builder supersamples.
    let finer_samples = |n: &u32| DeepImageSettings { supersampling: *n, ..by(DeepBuilder::SinglePass, all) };
    let stored = |store, depth, payload| DeepImageSettings { store, depth, payload, ..of(all) };
    let searches = |resolution| {
        DeepSearch::ALL.iter().map(move |search| DeepImageSettings { search: *search, resolution, ..of(all) })
    };
    let group = |title, rows: Vec<DeepImageSettings>| Group {
        title,
        rows,
        beside_exact: title == "Resolution",
        with_holes: title == "Builders",
    };
    let stores = vec![
        stored(DeepStore::LinearArray, DeepDepth::Bits32, true),
        stored(DeepStore::LinearArray, DeepDepth::Bits16, true),
        stored(DeepStore::LinearArray, DeepDepth::Bits32, false),
        stored(DeepStore::LinearArray, DeepDepth::Bits16, false),
        stored(DeepStore::LinkedList, DeepDepth::Bits32, true),
        stored(DeepStore::SortedLinkedList, DeepDepth::Bits32, true),
    ];
    let builders = vec![
        by(DeepBuilder::SinglePass, few),
        by(DeepBuilder::PerTriangle, few),
        by(DeepBuilder::PerDirection, few),
        // Takes minutes for all directions.
        by(DeepBuilder::DepthPeeling, few),
        by(DeepBuilder::SinglePass, all),
        by(DeepBuilder::PerTriangle, all),
        by(DeepBuilder::PerDirection, all),
        finer(DeepBuilder::SinglePass),
        finer(DeepBuilder::PerTriangle),
    ];
    vec![
        group("Directions", counts.iter().map(|n| of(*n)).collect()),
        group("Supersampling", supersamplings.iter().map(finer_samples).collect()),
        group("Resolution", resolutions.iter().map(|n| DeepImageSettings { resolution: *n, ..default }).collect()),
        group("Stores", stores),
        group("Searches", [1, 2].into_iter().flat_map(|times| searches(times * default.resolution)).collect()),
        group("Builders", builders),
    ]
}

/// Description of what tells a configuration from others of as many directions and texels.
pub fn in_words(settings: &DeepImageSettings) -> String {
    let DeepImageSettings { builder, supersampling, store, depth, search, payload, .. } = settings;
    let mut words = builder.to_string();
    if *supersampling > 1 {
        words += &format!(", {supersampling} times finer");
    }
    if *store != DeepStore::LinearArray {
        words += &format!(", {store}");
    }
    if *depth != DeepDepth::Bits32 {
        words += &format!(", {depth} bits");
    }
    if *search != DeepSearch::Bisection {
        words += ", linear steps";
    }
    if !payload {
        words += ", no triangles";
    }
    words
}

/// Expected size of images, from others of the same supersampling: lists grow with the number of texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Bytes of one image's lists and fragments.
    pub bytes_a_direction: f64,
    /// Fragments a texel to expect when images are divided into chunks: so many that the fullest chunk fits.
    pub fragments_a_texel: u64,
}

impl Expected {
    /// Expectation from the last images that were built with the same supersampling; `None` where there are none.
    pub fn of(settings: &DeepImageSettings, built: &[Row]) -> Option<Self> {
        let last = built.iter().rfind(|last| *last.get("supersampling") == settings.supersampling)?;
        let a_texel = |key| last.f64(key) / (last.f64("directions") * last.f64("resolution").powi(2));
        Some(Self {
            bytes_a_direction: a_texel("bytes") * f64::from(settings.resolution).powi(2),
            fragments_a_texel: ((UNEVEN * a_texel("drawn")).ceil() as u64).max(1),
        })
    }

    /// Most directions whose images fit.
    pub fn most_directions(&self) -> u64 {
        (MOST_BYTES / self.bytes_a_direction) as u64
    }
}

/// The settings with as many directions as fit, at most those asked for, and images in as few chunks as they fit.
pub fn fitted(mut settings: DeepImageSettings, built: &[Row]) -> DeepImageSettings {
    let Some(expected) = Expected::of(&settings, built) else { return settings };
    let fits = expected.most_directions();
    if fits < settings.directions.count() {
        settings.directions = DirectionSet::ZonalEqualArea { count: fits.max(1) as u32 };
    }
    settings.fragments_a_texel = expected.fragments_a_texel;
    settings
}

/// Images of a size, for tests.
#[cfg(test)]
pub fn built(directions: u32, resolution: u32, bytes: u64, drawn: u64) -> Row {
    let row = Row::default().data("directions", directions).data("resolution", resolution).data("supersampling", 1);
    row.data("bytes", bytes).data("drawn", drawn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_named_by_their_titles() {
        for quick in [false, true] {
            let titles = groups(quick).iter().map(|group| group.title.to_lowercase()).collect::<Vec<_>>();
            assert_eq!([titles, vec![crate::deep_images::crossings::TABLE.to_owned()]].concat(), TABLES);
        }
    }

    /// Other builders take no samples: their rows would be one measurement several times.
    #[test]
    fn only_what_supersamples_is_in_its_table() {
        for quick in [false, true] {
            let groups = groups(quick);
            let table = groups.iter().find(|group| group.title == "Supersampling").unwrap();
            assert!(table.rows.iter().all(|row| row.builder == DeepBuilder::SinglePass));
        }
    }

    #[test]
    fn directions_are_fewer_where_all_would_not_fit() {
        let default = DeepImageSettings::default();
        let built = |bytes, drawn| [built(100, 64, bytes, drawn)];
        let at = |resolution, built: &[Row]| fitted(DeepImageSettings { resolution, ..default }, built);
        assert_eq!(at(512, &[]), DeepImageSettings { resolution: 512, ..default });
        assert_eq!(at(64, &built(1_000_000_000, 1)).directions.count(), 169);
        // Ten million bytes each, four times as many at twice the resolution.
        assert_eq!(at(128, &built(1_000_000_000, 1)).directions.count(), 100);
        assert_eq!(at(128, &built(u64::MAX, 1)).directions.count(), 1);
        // Two a texel.
        assert_eq!(at(128, &built(1, 2 * 100 * 64 * 64)).fragments_a_texel, 6);
        assert_eq!(at(128, &built(1, 0)).fragments_a_texel, 1);
        // Nothing is known of images with another supersampling.
        let finer = DeepImageSettings { supersampling: 2, ..default };
        assert_eq!(fitted(finer, &built(1_000_000_000, 1)), finer);
    }
}
