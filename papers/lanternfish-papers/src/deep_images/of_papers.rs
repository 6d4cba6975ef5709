//! Deep images as the papers have them, and which of them a technique uses.

use lanternfish::{rays::Structure, settings::Settings};
use lanternfish_scene::named_enum;

use super::{
    directions::DirectionSet,
    settings::{DeepBuilder, DeepImageSettings, DeepSearch, DeepSort},
};

named_enum! {
    /// The deep images of a technique. A frame may hold several.
    #[derive(Default)]
    PaperImages {
        /// Those of the settings, which all techniques share.
        #[default]
        Shared = "shared": "Those of the settings, which all techniques share",
        /// [`DeepImageSettings::NIESSNER`].
        Niessner = "niessner": "Their own: 150 directions of a cube in 75 images, 128² texels",
        /// [`DeepImageSettings::AALUND`].
        Aalund = "aalund": "Their own: 512 zonal directions, 50² texels",
        /// [`DeepImageSettings::FIVE`].
        Five = "five": "Of ambient visibility and ranges at once: 169 zonal directions, 64² texels, from one draw",
        /// [`DeepImageSettings::ARCHER`].
        Archer = "archer": "Their own: 13 stacks of 13 slices, 64² texels, from one draw",
    }
}

impl DeepImageSettings {
    /// As in [Niessner2010, §3.1, §7]: 150 directions of a cube, 128² texels. One image for two opposite directions is ours. Their builder,
    /// [`DeepBuilder::DepthPeeling`], gives the same images, and takes minutes on a processor.
    pub const NIESSNER: Self = Self {
        directions: DirectionSet::Cube { k: 5 },
        resolution: 128,
        builder: DeepBuilder::PerTriangle,
        merge_texels: 0.0,
        search: DeepSearch::LinearSteps,
        tests_triangles: true,
        ..Self::ARCHER
    };

    /// As in [Aalund2015, §3, fig. 9]: 512 directions of equal area, 50² texels, a draw for each, the first fragment is hit. In arrays, which
    /// windows need; theirs are `deep-store sorted_linked_list`.
    pub const AALUND: Self = Self {
        directions: DirectionSet::ZonalEqualArea { count: 512 },
        resolution: 50,
        builder: DeepBuilder::PerDirection,
        sort: DeepSort::Selection,
        search: DeepSearch::Bisection,
        tests_triangles: false,
        ..Self::NIESSNER
    };

    /// As many and as large images as [`Self::ARCHER`], from one draw, along the directions of equal area that [Aalund2015,
    /// eq. 2] needs: one set for both.
    pub const FIVE: Self = Self { directions: DirectionSet::ZonalEqualArea { count: 169 }, ..Self::ARCHER };
}

impl PaperImages {
    /// The settings of the images.
    pub fn settings(self, settings: &Settings) -> DeepImageSettings {
        match self {
            Self::Shared => DeepImageSettings::of(&settings.structure),
            Self::Niessner => DeepImageSettings::NIESSNER,
            Self::Aalund => DeepImageSettings::AALUND,
            Self::Five => DeepImageSettings::FIVE,
            Self::Archer => DeepImageSettings::ARCHER,
        }
    }

    /// The same as a structure for tracers.
    pub(crate) fn structure(self, settings: &Settings) -> Structure {
        match self {
            Self::Shared => settings.structure.clone(),
            own => own.settings(settings).into(),
        }
    }
}
