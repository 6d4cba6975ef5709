//! The measured configurations, by table.

use lanternfish_papers::{DeepBuilder, DeepImageSettings, DeepSearch, DeepSort, DeepStore, DirectionSet};

use crate::table::Row;

/// Configurations of one table.
pub struct Group {
    pub title: &'static str,
    pub rows: Vec<DeepImageSettings>,
    /// True if the rays are traced through the exact structures as well.
    pub beside_exact: bool,
    /// True if holes are counted, by comparison with a builder that draws each direction.
    pub with_holes: bool,
}

/// Most bytes of lists. Some machines have 8 GB, part of which the scene takes.
const MOST_BYTES: f64 = 4e9;
/// Most fragments of an image in a chunk, as a ratio to those of an average image.
const UNEVEN: f64 = 3.0;

/// Names of the tables: the titles of [`groups`] in lower case, and the crossings'.
pub const TABLES: [&str; 9] = [
    "directions",
    "supersampling",
    "resolution",
    "stores",
    "sorts",
    "searches",
    "tolerances",
    "builders",
    super::crossings::TABLE,
];

/// Directions of [Archer2019, table 2] and of its text (169), stacks and slices, whose numbers are stated for 169
/// alone.
const STACKS: [(u32, u32); 6] = [(2, 4), (4, 4), (4, 8), (8, 8), (8, 16), (13, 13)];
/// Images as in [Archer2019, §4], in other directions.
fn archer((stacks, slices): (u32, u32)) -> DeepImageSettings {
    let directions = DirectionSet::StacksSlices { stacks, slices };
    DeepImageSettings { directions, payload: false, ..DeepImageSettings::ARCHER }
}

/// True of images as in [Archer2019, §4] in any number of directions, and in as many chunks as it takes.
fn is_archers(settings: &DeepImageSettings) -> bool {
    let DeepImageSettings { directions, payload, fragments_a_texel, .. } = *settings;
    let of_stacks = matches!(directions, DirectionSet::StacksSlices { .. });
    of_stacks && *settings == DeepImageSettings { directions, payload, fragments_a_texel, ..DeepImageSettings::ARCHER }
}

/// All configurations in the order of their builds: coarse images before fine ones, as [`fitted`] needs.
pub fn groups(quick: bool) -> Vec<Group> {
    let default = DeepImageSettings::default();
    let of = |count| DeepImageSettings { directions: DirectionSet::ZonalEqualArea { count }, ..default };
    let by = |builder, count| DeepImageSettings { builder, ..of(count) };
    let [few, all] = if quick { [4, 8] } else { [8, 169] };
    // [Archer2019, table 2], and as many as usual, which its text has.
    let stacks: &[_] = if quick { &[(2, 2), (2, 4)] } else { &STACKS };
    let his = archer(stacks[stacks.len() - 1]);
    let each = DeepImageSettings { builder: DeepBuilder::PerDirection, ..his };
    let ours = stacks.iter().map(|(stacks, slices)| of(stacks * slices));
    // Three directions of 480² texels, which rays cross: the competitor of [Archer2019, §4].
    let texels = if quick { 32 } else { 480 };
    let three = DeepImageSettings { directions: DirectionSet::Cube { k: 1 }, resolution: texels, ..default };
    let his_three = DeepImageSettings { directions: three.directions, resolution: texels, ..his };
    let directions = stacks.iter().copied().map(archer).chain([each]).chain(ours).chain([three, his_three]).collect();
    let supersamplings: &[u32] = if quick { &[2] } else { &[1, 2, 3] };
    // The second and the last are in [Niessner2010, table 1].
    let resolutions: &[u32] = if quick { &[32, 64] } else { &[64, 128, 256, 512] };
    // Only the single-pass builder supersamples.
    let finer_samples = |n: &u32| DeepImageSettings { supersampling: *n, ..by(DeepBuilder::SinglePass, all) };
    let stored = |store, payload| DeepImageSettings { store, payload, ..of(all) };
    let searches = |resolution| {
        DeepSearch::ALL.iter().map(|search| DeepImageSettings { search: *search, resolution, ..of(all) }).collect()
    };
    let sorts = |resolution| {
        DeepSort::ALL.iter().map(|sort| DeepImageSettings { sort: *sort, resolution, ..of(all) }).collect()
    };
    // At the usual resolution and at twice that; and Archer's images, once with their own and once with another.
    let twice = |rows: &dyn Fn(u32) -> Vec<DeepImageSettings>, other| {
        [rows(default.resolution), rows(2 * default.resolution), vec![his, other]].concat()
    };
    let group = |title, rows: Vec<DeepImageSettings>| Group {
        title,
        rows,
        beside_exact: title == "Resolution",
        with_holes: title == "Builders",
    };
    let stores = vec![
        stored(DeepStore::LinearArray, true),
        stored(DeepStore::LinearArray, false),
        stored(DeepStore::LinkedList, true),
        stored(DeepStore::SortedLinkedList, true),
        // Lists against arrays [Archer2019, §3.1].
        his,
        DeepImageSettings { store: DeepStore::LinkedList, ..his },
        DeepImageSettings { store: DeepStore::SortedLinkedList, ..his },
    ];
    // ε of [Niessner2010, §3.2, fig. 3].
    let tolerances: &[f32] = if quick { &[0.25, 1.0] } else { &[0.0, 0.25, 0.5, 1.0, 2.0] };
    let tolerant = |tolerance: &f32| DeepImageSettings { tolerance: *tolerance, ..of(all) };
    let builders = vec![
        by(DeepBuilder::SinglePass, few),
        by(DeepBuilder::SinglePassLiteral, few),
        by(DeepBuilder::PerTriangle, few),
        by(DeepBuilder::PerDirection, few),
        // Takes minutes with all directions, so it is measured with few.
        by(DeepBuilder::DepthPeeling, few),
        by(DeepBuilder::SinglePass, all),
        by(DeepBuilder::SinglePassLiteral, all),
        by(DeepBuilder::PerTriangle, all),
        by(DeepBuilder::PerDirection, all),
    ];
    vec![
        group("Directions", directions),
        group("Supersampling", supersamplings.iter().map(finer_samples).collect()),
        group("Resolution", resolutions.iter().map(|n| DeepImageSettings { resolution: *n, ..default }).collect()),
        group("Stores", stores),
        group("Sorts", twice(&sorts, DeepImageSettings { sort: DeepSort::Selection, ..his })),
        group("Searches", twice(&searches, DeepImageSettings { search: DeepSearch::Bisection, ..his })),
        group("Tolerances", tolerances.iter().map(tolerant).collect()),
        group("Builders", builders),
    ]
}

/// Describes a configuration, apart from its number of directions and its resolution.
pub fn in_words(settings: &DeepImageSettings) -> String {
    let DeepImageSettings { directions, builder, supersampling, store, sort, search, payload, .. } = settings;
    if is_archers(settings) {
        return "as in Archer 2019".to_owned();
    }
    let mut words = builder.to_string();
    if !matches!(directions, DirectionSet::ZonalEqualArea { .. }) {
        words += &format!(", {}", directions);
    }
    if *supersampling > 1 {
        words += &format!(", {supersampling}x supersampling");
    }
    if *store != DeepStore::LinearArray {
        words += &format!(", {store}");
    }
    if *sort != DeepSort::Selection {
        words += &format!(", sort {sort}");
    }
    if settings.merge_texels == 0.0 {
        words += ", not merged";
    }
    if *search != DeepSearch::Bisection {
        words += ", linear steps";
    }
    if settings.tolerance != DeepImageSettings::default().tolerance {
        words += &format!(", tolerance {}", settings.tolerance);
    }
    if !payload {
        words += ", no triangles";
    }
    words
}

/// Expected size of images, scaled by the number of texels from others with the same supersampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Bytes of the lists and fragments of one image.
    pub bytes_a_direction: f64,
    /// Fragments per texel for the division into chunks: enough that the fullest chunk fits.
    pub fragments_a_texel: u64,
}

impl Expected {
    /// Estimates from the last images built with the same supersampling. `None` if there are none.
    pub fn of(settings: &DeepImageSettings, built: &[Row]) -> Option<Self> {
        let last = built.iter().rfind(|last| *last.get("supersampling") == settings.supersampling)?;
        let a_texel = |key| last.f64(key) / (last.f64("directions") * last.f64("resolution").powi(2));
        Some(Self {
            bytes_a_direction: a_texel("bytes") * f64::from(settings.resolution).powi(2),
            fragments_a_texel: ((UNEVEN * a_texel("drawn")).ceil() as u64).max(1),
        })
    }

    /// Greatest number of directions whose images fit in memory.
    pub fn most_directions(&self) -> u64 {
        (MOST_BYTES / self.bytes_a_direction) as u64
    }
}

/// The settings with as many of the requested directions as fit in memory, and the images in as few chunks as possible.
pub fn fitted(mut settings: DeepImageSettings, built: &[Row]) -> DeepImageSettings {
    let Some(expected) = Expected::of(&settings, built) else { return settings };
    let fits = expected.most_directions();
    if fits < settings.directions.count() {
        settings.directions = DirectionSet::ZonalEqualArea { count: fits.max(1) as u32 };
    }
    settings.fragments_a_texel = expected.fragments_a_texel;
    settings
}

/// A row of built images, for tests.
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
    fn the_supersampling_table_has_the_single_pass_builder_only() {
        for quick in [false, true] {
            let groups = groups(quick);
            let table = groups.iter().find(|group| group.title == "Supersampling").unwrap();
            assert!(table.rows.iter().all(|row| row.builder == DeepBuilder::SinglePass));
        }
    }

    #[test]
    fn archers_images_are_named() {
        let each = DeepImageSettings { builder: DeepBuilder::PerDirection, ..archer((13, 13)) };
        assert_eq!(in_words(&archer((8, 8))), "as in Archer 2019");
        assert_eq!(in_words(&each), "per_direction, stacks:13x13, sort blocks, not merged, linear steps, no triangles");
        let bisected = DeepImageSettings { search: DeepSearch::Bisection, ..archer((13, 13)) };
        assert_ne!(in_words(&bisected), "as in Archer 2019");
        assert_eq!(DeepImageSettings { payload: true, ..archer((13, 13)) }, DeepImageSettings::ARCHER);
    }

    #[test]
    fn directions_are_fewer_if_all_would_not_fit() {
        let default = DeepImageSettings::default();
        let built = |bytes, drawn| [built(100, 64, bytes, drawn)];
        let at = |resolution, built: &[Row]| fitted(DeepImageSettings { resolution, ..default }, built);
        assert_eq!(at(512, &[]), DeepImageSettings { resolution: 512, ..default });
        assert_eq!(at(64, &built(1_000_000_000, 1)).directions.count(), 169);
        // Ten million bytes per direction, and four times as many at twice the resolution.
        assert_eq!(at(128, &built(1_000_000_000, 1)).directions.count(), 100);
        assert_eq!(at(128, &built(u64::MAX, 1)).directions.count(), 1);
        // Two fragments per texel.
        assert_eq!(at(128, &built(1, 2 * 100 * 64 * 64)).fragments_a_texel, 6);
        assert_eq!(at(128, &built(1, 0)).fragments_a_texel, 1);
        // There is no estimate for another supersampling.
        let finer = DeepImageSettings { supersampling: 2, ..default };
        assert_eq!(fitted(finer, &built(1_000_000_000, 1)), finer);
    }
}
