//! The geometry of one primitive: attributes, topology, normals, tangents.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3, Vec4};

use super::accessor::{Accessors, MAX_ZERO_COUNT};
use super::draco::{self, Decoded};
use super::fault::{Place, Result, invalid};
use super::schema::Root;
use super::topology::Topology;
use super::{deformation, normals, schema, tangents, thin, vertices};
use crate::{Primitive, SceneError};

/// Result of reading a primitive.
pub(super) enum Outcome {
    /// A triangle list, without a material yet.
    Read(Primitive),
    /// Nothing to draw; names the omitted content, in the plural.
    LeftOut(&'static str),
}

/// Reads a primitive. `thin_radius`: of points and lines, in object space. `normal_map_uv_set`: index of the texture
/// coordinates of its material's normal map, if any. Without a normal map the primitive gets no tangents.
pub(super) fn read(
    accessors: &Accessors,
    source: &schema::Primitive,
    thin_radius: f32,
    normal_map_uv_set: Option<u32>,
) -> Result<Outcome> {
    let mode = source.mode.unwrap_or(4);
    let topology = Topology::new(mode).ok_or_else(|| invalid(format!("mode {mode} is not one of the format's")))?;
    let Some(positions) = source.attributes.get("POSITION") else {
        return Ok(Outcome::LeftOut("primitives without positions"));
    };
    let decoded = match compressed(accessors.root, source) {
        Some(draco) => {
            let bytes = accessors.buffers.view(draco.buffer_view)?.1;
            draco::decode(accessors.root, source, draco, bytes)
                .place(|| format!("bufferViews[{}]", draco.buffer_view))?
        }
        None => Decoded::new(),
    };
    // What is compressed is a list of triangles.
    let topology = if decoded.is_empty() { topology } else { Topology::List };
    let accessors = &accessors.with(&decoded);
    let mut primitive = Primitive { positions: read_positions(accessors, *positions)?, ..Default::default() };
    let vertex_count = primitive.positions.len();
    let indices = match source.indices {
        Some(indices) => read_indices(accessors, indices, vertex_count).place(|| "indices".into())?,
        None => (0..u32::try_from(vertex_count).map_err(|_| invalid("more vertices than indices reach"))?).collect(),
    };
    let corners = topology.most_corners(indices.len() as u64);
    if u32::try_from(corners).is_err() {
        return Err(invalid(format!("{corners} triangle corners; at most 2^32 - 1 are read")));
    }
    read_attributes(accessors, source, &mut primitive, normal_map_uv_set.is_some())?;
    primitive.deformation = deformation::read(accessors, source, vertex_count)?;
    if topology.is_thin() {
        thin::solidify(&mut primitive, topology, &indices, thin_radius);
    } else {
        primitive.indices = topology.triangles(indices);
        vertices::drop_unused(&mut primitive);
    }
    if primitive.indices.is_empty() {
        return Ok(Outcome::LeftOut("primitives without triangles"));
    }

    // The format requires readers to ignore tangents without normals: they do not match generated normals.
    if !source.attributes.contains_key("NORMAL") {
        primitive.tangents.clear();
    }
    let has_flat_normals = primitive.normals.is_empty();
    complete(&mut primitive, normal_map_uv_set)?;
    deformation::keep_rest(&mut primitive, has_flat_normals);
    Ok(Outcome::Read(primitive))
}

impl Primitive {
    /// Gives it flat normals if it has none, and tangents along texture coordinates `tangent_uv_set`
    /// ([`Material::tangent_uv_set`](crate::Material::tangent_uv_set)), as files get them; repairs those that it has.
    #[doc(hidden)]
    pub fn complete(&mut self, tangent_uv_set: Option<u32>) -> std::result::Result<(), SceneError> {
        complete(self, tangent_uv_set).map_err(|fault| fault.at("mesh".as_ref()))
    }
}

/// Gives a primitive flat normals if it has none, and tangents along these texture coordinates; repairs those that it has.
fn complete(primitive: &mut Primitive, tangent_uv_set: Option<u32>) -> Result<()> {
    match primitive.normals.is_empty() {
        true => normals::make_flat(primitive),
        false => normals::repair(primitive),
    }
    match tangent_uv_set {
        Some(uv_set) if primitive.tangents.is_empty() => tangents::generate(primitive, uv_set)?,
        Some(_) => tangents::repair(primitive),
        None => {}
    }
    Ok(())
}

/// Memory that reading a primitive takes.
#[derive(Clone, Copy, Default)]
pub(super) struct Need {
    /// Upper bound of the stored primitive, bytes.
    pub kept: u64,
    /// Upper bound of temporary memory while reading, bytes.
    pub transient: u64,
    /// Number of triangle corners.
    pub corners: u64,
}

/// The memory that [`read`] will take, from the counts in the file. Zero for primitives that will be refused or left out,
/// such as those with counts beyond the available bytes.
pub(super) fn need(root: &Root, source: &schema::Primitive, has_normal_map: bool) -> Need {
    let draco = compressed(root, source);
    let count = |index: usize| {
        let Some(accessor) = root.accessors.get(index) else { return 0 };
        let most = match accessor.buffer_view {
            Some(view) => root.buffer_views.get(view).map_or(0, |view| match view.extensions.compressed() {
                Some(compressed) => compressed.count.saturating_mul(compressed.byte_stride),
                None => view.byte_length,
            }),
            // The compressed size bounds no count.
            None if draco.is_some() => usize::MAX,
            None => MAX_ZERO_COUNT,
        };
        if accessor.count <= most { accessor.count as u64 } else { 0 }
    };
    let Some(vertices) = source.attributes.get("POSITION").map(|index| count(*index)) else { return Need::default() };
    let has = |name: &str| source.attributes.contains_key(name);
    let indices = source.indices.map_or(vertices, count);
    let Some(topology) = Topology::new(source.mode.unwrap_or(4)) else { return Need::default() };
    let corners = topology.most_corners(indices);
    // Bytes: position and normal, tangent, texture coordinates, colour.
    let attributes =
        [(true, 24), (has_normal_map, 16), (has("TEXCOORD_0"), 8), (has("TEXCOORD_1"), 8), (has("COLOR_0"), 16)];
    let vertex: u64 = attributes.iter().filter(|(has, _)| *has).map(|(_, bytes)| bytes).sum();
    let vertex = vertex + deformation::bytes_per_vertex(source, has_normal_map);
    // Flat normals and generated tangents split vertices; unused vertices are dropped.
    let kept_vertices = match (topology.is_thin(), has("NORMAL")) {
        _ if has_normal_map => corners,
        (true, _) => corners / thin::CORNERS_PER_VERTEX as u64,
        (false, true) => vertices.min(corners),
        (false, false) => corners,
    };
    let kept = kept_vertices.saturating_mul(vertex).saturating_add(corners.saturating_mul(4));
    // Tangent generation takes 100 bytes per corner.
    let scratch = corners.saturating_mul(if has_normal_map { 108 } else { 8 });
    let decoding = draco.map_or(0, |draco| draco::need(draco, vertices, indices));
    let transient = vertices.saturating_mul(vertex + 4).saturating_add(kept).saturating_add(scratch);
    let transient = transient.saturating_add(decoding);
    Need { kept, transient, corners }
}

/// The Draco-compressed data of a primitive, unless it has an uncompressed fallback.
fn compressed<'a>(root: &Root, source: &'a schema::Primitive) -> Option<&'a schema::Draco> {
    let is_empty = |index: &usize| {
        let accessor = root.accessors.get(*index);
        accessor.is_some_and(|accessor| accessor.buffer_view.is_none() && accessor.sparse.is_none())
    };
    let draco = source.extensions.draco.as_ref()?;
    source.attributes.values().chain(&source.indices).any(is_empty).then_some(draco)
}

fn read_positions(accessors: &Accessors, accessor: usize) -> Result<Vec<Vec3>> {
    let positions: Vec<Vec3> =
        accessors.vectors(accessor).place(|| "POSITION".into())?.into_iter().map(Vec3::from).collect();
    match positions.iter().position(|p| !p.is_finite()) {
        Some(at) => Err(invalid(format!("POSITION: accessors[{accessor}]: element {at} is not finite"))),
        None => Ok(positions),
    }
}

fn read_indices(accessors: &Accessors, accessor: usize, vertex_count: usize) -> Result<Vec<u32>> {
    let indices = accessors.indices(accessor)?;
    match indices.iter().position(|index| *index as usize >= vertex_count) {
        Some(at) => Err(invalid(format!(
            "accessors[{accessor}]: element {at} is {}, but there are {vertex_count} vertices",
            indices[at]
        ))),
        None => Ok(indices),
    }
}

/// Reads the attributes other than positions.
fn read_attributes(
    accessors: &Accessors,
    source: &schema::Primitive,
    primitive: &mut Primitive,
    with_tangents: bool,
) -> Result<()> {
    let vertex_count = primitive.positions.len();
    primitive.normals = read_attribute(&source.attributes, "NORMAL", vertex_count, |index| accessors.vectors(index))?;
    if with_tangents {
        primitive.tangents =
            read_attribute(&source.attributes, "TANGENT", vertex_count, |index| accessors.vectors(index))?;
    }
    primitive.uv0 = read_attribute(&source.attributes, "TEXCOORD_0", vertex_count, |index| accessors.vectors(index))?;
    primitive.uv1 = read_attribute(&source.attributes, "TEXCOORD_1", vertex_count, |index| accessors.vectors(index))?;
    primitive.colors = read_attribute(&source.attributes, "COLOR_0", vertex_count, |index| accessors.colors(index))?;
    for uv in primitive.uv0.iter_mut().chain(&mut primitive.uv1) {
        if !uv.is_finite() {
            *uv = Vec2::ZERO;
        }
    }
    for color in &mut primitive.colors {
        let clamp = |c: f32| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) };
        *color = Vec4::from_array(color.to_array().map(clamp));
    }
    Ok(())
}

/// An attribute with one element per vertex; empty if the primitive lacks it.
pub(super) fn read_attribute<T: From<[f32; N]>, const N: usize>(
    attributes: &BTreeMap<String, usize>,
    name: &str,
    vertex_count: usize,
    read: impl Fn(usize) -> Result<Vec<[f32; N]>>,
) -> Result<Vec<T>> {
    let Some(accessor) = attributes.get(name) else { return Ok(Vec::new()) };
    let elements = read(*accessor).place(|| name.to_owned())?;
    if elements.len() != vertex_count {
        return Err(invalid(format!("{name}: {} elements, but there are {vertex_count} vertices", elements.len())));
    }
    Ok(elements.into_iter().map(T::from).collect())
}
