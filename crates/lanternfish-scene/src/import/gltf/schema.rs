//! The supported parts of a file's JSON, with the defaults and field names of the format.
//!
//! Indices are unchecked.

mod material;
mod motion;
mod variants;

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Deserialize;

pub(super) use self::material::{
    Material, MaterialExtensions, MetallicRoughness, SpecularGlossiness, TextureInfo, TextureTransform,
};
pub(super) use self::motion::{Animation, AnimationSampler, AnimationTarget, Skin};
use self::variants::{VariantMappings, Variants};

/// Text, borrowed from the JSON if it has no escapes: data URIs are long.
#[derive(Deserialize)]
pub(super) struct Text<'a>(#[serde(borrow)] pub Cow<'a, str>);

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Root<'a> {
    pub asset: Asset,
    #[serde(default)]
    pub animations: Vec<Animation>,
    #[serde(default)]
    pub extensions_used: Vec<String>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default, borrow)]
    pub buffers: Vec<Buffer<'a>>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub cameras: Vec<Camera>,
    #[serde(default, borrow)]
    pub images: Vec<Image<'a>>,
    #[serde(default)]
    pub materials: Vec<Material>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub samplers: Vec<Sampler>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    pub scene: Option<usize>,
    #[serde(default)]
    pub skins: Vec<Skin>,
    #[serde(default)]
    pub textures: Vec<Texture>,
    #[serde(default)]
    pub extensions: RootExtensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

#[derive(Default, Deserialize)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Option<Lights>,
    #[serde(rename = "EXT_lights_area")]
    pub area_lights: Option<AreaLights>,
    #[serde(default, rename = "KHR_materials_variants")]
    pub variants: Variants,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub count: usize,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer<'a> {
    #[serde(borrow)]
    pub uri: Option<Text<'a>>,
    pub byte_length: usize,
    #[serde(default)]
    pub extensions: BufferExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct BufferExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub ext_meshopt: Option<FallbackBuffer>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub khr_meshopt: Option<FallbackBuffer>,
}

#[derive(Deserialize)]
pub(super) struct FallbackBuffer {
    #[serde(default)]
    pub fallback: bool,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
    #[serde(default)]
    pub extensions: BufferViewExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct BufferViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    ext_meshopt: Option<CompressedView>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr_meshopt: Option<CompressedView>,
}

impl BufferViewExtensions {
    /// The compressed form of the view, if any; both extensions have the same layout.
    pub fn compressed(&self) -> Option<&CompressedView> {
        self.ext_meshopt.as_ref().or(self.khr_meshopt.as_ref())
    }
}

#[derive(Deserialize, PartialEq, Eq, Hash)]
#[serde(rename_all = "camelCase")]
pub(super) struct CompressedView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: usize,
    pub count: usize,
    pub mode: String,
    #[serde(default = "no_filter")]
    pub filter: String,
}

fn no_filter() -> String {
    "NONE".to_owned()
}

#[derive(Deserialize)]
pub(super) struct Camera {
    #[serde(default)]
    pub name: String,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
pub(super) struct Perspective {
    pub yfov: f32,
    pub znear: f32,
}

#[derive(Deserialize)]
pub(super) struct Orthographic {
    pub ymag: f32,
    pub znear: f32,
    pub zfar: f32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image<'a> {
    #[serde(default)]
    pub name: String,
    #[serde(borrow)]
    pub uri: Option<Text<'a>>,
    pub buffer_view: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    #[serde(default)]
    pub name: String,
    pub primitives: Vec<Primitive>,
    /// Weights of the morph targets.
    #[serde(default)]
    pub weights: Vec<f32>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    pub mode: Option<u32>,
    /// Morph targets: accessors by attribute.
    #[serde(default)]
    pub targets: Vec<BTreeMap<String, usize>>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: VariantMappings,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Draco {
    pub buffer_view: usize,
    /// Unique ids of the compressed attributes.
    pub attributes: BTreeMap<String, u32>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub name: String,
    pub children: Vec<usize>,
    pub matrix: Option<[f32; 16]>,
    pub translation: Option<[f32; 3]>,
    pub rotation: Option<[f32; 4]>,
    pub scale: Option<[f32; 3]>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub weights: Vec<f32>,
    pub camera: Option<usize>,
    pub extensions: NodeExtensions,
    pub extras: Extras,
}

/// What an application says about a node: any JSON.
#[derive(Default)]
pub(super) struct Extras {
    /// Its `semantic`, if it is an integer that fits.
    pub semantic: Option<u32>,
}

impl<'de> Deserialize<'de> for Extras {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let any = serde_json::Value::deserialize(deserializer)?;
        let semantic = any.get("semantic").and_then(serde_json::Value::as_u64);
        Ok(Self { semantic: semantic.and_then(|class| u32::try_from(class).ok()) })
    }
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<NodeLight>,
    #[serde(rename = "EXT_lights_area")]
    pub area_light: Option<NodeLight>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
    #[serde(rename = "KHR_node_visibility")]
    pub visibility: NodeVisibility,
}

#[derive(Deserialize)]
#[serde(default)]
pub(super) struct NodeVisibility {
    /// False: neither the node nor its descendants are drawn.
    pub visible: bool,
}

impl Default for NodeVisibility {
    fn default() -> Self {
        Self { visible: true }
    }
}

#[derive(Deserialize)]
pub(super) struct Instancing {
    #[serde(default)]
    pub attributes: BTreeMap<String, usize>,
}

#[derive(Deserialize)]
pub(super) struct NodeLight {
    pub light: usize,
}

#[derive(Deserialize)]
pub(super) struct Lights {
    #[serde(default)]
    pub lights: Vec<Light>,
}

#[derive(Deserialize)]
pub(super) struct Light {
    #[serde(default)]
    pub name: String,
    #[serde(rename = "type")]
    pub kind: String,
    pub color: Option<[f32; 3]>,
    pub intensity: Option<f32>,
    pub range: Option<f32>,
    pub spot: Option<Spot>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Spot {
    pub inner_cone_angle: Option<f32>,
    pub outer_cone_angle: Option<f32>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Sampler {
    pub mag_filter: Option<u32>,
    pub min_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub name: String,
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Texture {
    pub sampler: Option<usize>,
    pub source: Option<usize>,
    #[serde(default)]
    pub extensions: TextureExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    pub webp: Option<TextureSource>,
    #[serde(rename = "KHR_texture_basisu")]
    pub basisu: Option<TextureSource>,
}

#[derive(Deserialize)]
pub(super) struct TextureSource {
    pub source: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct AreaLights {
    #[serde(default)]
    pub lights: Vec<AreaLight>,
}

#[derive(Deserialize)]
pub(super) struct AreaLight {
    #[serde(default)]
    pub name: String,
    #[serde(rename = "type")]
    pub kind: String,
    pub color: Option<[f32; 3]>,
    /// Nits.
    pub intensity: Option<f32>,
    /// Height of a rectangle or diameter of a disk, m, before the node's scale.
    pub size: Option<f32>,
    pub rect: Option<Rect>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Rect {
    /// Width over height.
    pub aspect: Option<f32>,
}
