//! Animations and skins.

use serde::Deserialize;

#[derive(Deserialize)]
pub(in super::super) struct Animation {
    #[serde(default)]
    pub name: String,
    #[serde(default)]
    pub channels: Vec<AnimationChannel>,
    #[serde(default)]
    pub samplers: Vec<AnimationSampler>,
}

#[derive(Deserialize)]
pub(in super::super) struct AnimationChannel {
    pub sampler: usize,
    pub target: AnimationTarget,
}

#[derive(Deserialize)]
pub(in super::super) struct AnimationTarget {
    /// The animated node; `None`: the channel animates the target of an extension.
    pub node: Option<usize>,
    pub path: String,
    #[serde(default)]
    pub extensions: AnimationTargetExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(in super::super) struct AnimationTargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub pointer: Option<AnimationPointer>,
}

#[derive(Deserialize)]
pub(in super::super) struct AnimationPointer {
    /// JSON pointer to the animated property.
    pub pointer: String,
}

#[derive(Deserialize)]
pub(in super::super) struct AnimationSampler {
    pub input: usize,
    pub output: usize,
    #[serde(default = "linear")]
    pub interpolation: String,
}

fn linear() -> String {
    "LINEAR".to_owned()
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct Skin {
    pub inverse_bind_matrices: Option<usize>,
    #[serde(default)]
    pub joints: Vec<usize>,
}
