//! Points and lines as triangles: the renderer draws nothing else. A point becomes an octahedron, a segment of a line a
//! closed prism of three sides.

use std::collections::BTreeMap;
use std::f32::consts::TAU;

use glam::Vec3;

use super::accessor::Accessors;
use super::hierarchy::Placed;
use super::topology::Topology;
use super::{normals, schema, vertices};
use crate::{Bounds, Primitive};

/// Radius of points and lines: a fraction of the diagonal of the box about all of them. In an image of 1280 × 720
/// pixels that frames the box, the diagonal has 800 pixels for a square and up to 1150 for a wide box. Points are then
/// 1.6 to 2.3 pixels wide, and lines, of 1.5 to √3 radii, 1.2 to 2.
const RADIUS: f32 = 1e-3;
/// Number of vertices of a point or a segment.
const VERTICES: usize = 6;
/// Number of triangle corners of a point or a segment.
pub(super) const CORNERS: usize = 24;
/// Number of triangle corners that share a vertex.
pub(super) const CORNERS_PER_VERTEX: usize = CORNERS / VERTICES;

/// The vertices of an octahedron, and its triangles, counter-clockwise seen from outside.
const OCTAHEDRON: [Vec3; VERTICES] = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
const OCTAHEDRON_CORNERS: [u32; CORNERS] = [0, 1, 2, 1, 3, 2, 3, 4, 2, 4, 0, 2, 1, 0, 5, 3, 1, 5, 4, 3, 5, 0, 4, 5];
/// The triangles of a prism, counter-clockwise seen from outside. Vertices 0, 1 and 2 are at its start and 3, 4 and 5
/// at its end, counter-clockwise seen from its end.
const PRISM_CORNERS: [u32; CORNERS] = [0, 2, 1, 3, 4, 5, 0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 2, 0, 3, 2, 3, 5];

/// Radius of points and lines in the object space of each of the file's meshes in use. In the world it is the same for
/// all, but smaller where a node has a smaller scale than another node of its mesh. Instances of
/// `EXT_mesh_gpu_instancing`, joints and morph targets do not count.
pub(super) fn radii(accessors: &Accessors, nodes: &[Placed]) -> BTreeMap<usize, f32> {
    let mut objects: BTreeMap<usize, Bounds> = BTreeMap::new();
    let mut scales: BTreeMap<usize, f32> = BTreeMap::new();
    let mut world = Bounds::EMPTY;
    for (at, index) in nodes.iter().filter(|at| at.is_visible).filter_map(|at| Some((at, at.node.mesh?))) {
        let object = objects.entry(index).or_insert_with(|| bounds(accessors, &accessors.root.meshes[index]));
        world.add_bounds(&object.transformed(&at.world_from_node));
        let axes = at.world_from_node.matrix3.to_cols_array_2d().map(|axis| Vec3::from(axis).length());
        let scale = scales.entry(index).or_default();
        *scale = axes.into_iter().fold(*scale, f32::max);
    }
    let is_usable = |length: &f32| *length > 0.0 && length.is_finite();
    // A single point has no extent; 1 m, the format's unit, is a guess.
    let diagonal = Some(world.size().length()).filter(is_usable).unwrap_or(1.0);
    let radius = |scale: f32| Some(RADIUS * diagonal / scale).filter(is_usable).unwrap_or(RADIUS);
    scales.into_iter().map(|(mesh, scale)| (mesh, radius(scale))).collect()
}

/// Object-space box about the points and lines of a mesh. Positions that cannot be read do not count: reading the
/// primitive reports why.
fn bounds(accessors: &Accessors, mesh: &schema::Mesh) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    let is_thin =
        |primitive: &&schema::Primitive| primitive.mode.and_then(Topology::new).is_some_and(Topology::is_thin);
    for position in mesh.primitives.iter().filter(is_thin).filter_map(|primitive| primitive.attributes.get("POSITION"))
    {
        let positions = accessors.vectors::<3>(*position).unwrap_or_default();
        positions.iter().for_each(|p| bounds.add_point(Vec3::from(*p)));
    }
    bounds
}

/// Replaces the vertices of `primitive`, points or lines of a file, by those of thin triangle meshes. `indices`: the
/// file's; `radius`: in object space. Each new vertex has the attributes of its point or end of a segment. Without
/// normals in the file they point away from the point or the segment. Segments without length are dropped.
pub(super) fn solidify(primitive: &mut Primitive, topology: Topology, indices: &[u32], radius: f32) {
    let has_normals = !primitive.normals.is_empty();
    let corner_count = topology.most_corners(indices.len() as u64) as usize;
    let mut sources = Vec::with_capacity(corner_count / CORNERS_PER_VERTEX);
    let mut offsets = Vec::with_capacity(corner_count / CORNERS_PER_VERTEX);
    let mut corners = Vec::with_capacity(corner_count);
    let mut add = |ends: [u32; 2], directions: [Vec3; VERTICES], shape: &[u32; CORNERS]| {
        let first = sources.len() as u32;
        sources.extend([[ends[0]; 3], [ends[1]; 3]].concat());
        offsets.extend(directions);
        corners.extend(shape.map(|corner| first + corner));
    };
    if topology == Topology::Points {
        indices.iter().for_each(|index| add([*index; 2], OCTAHEDRON, &OCTAHEDRON_CORNERS));
    }
    for ends in topology.segments(indices) {
        let [from, to] = ends.map(|end| primitive.positions[end as usize]);
        if let Some(axis) = normals::direction(to - from) {
            add(ends, prism(axis), &PRISM_CORNERS);
        }
    }
    vertices::select(primitive, &sources);
    primitive.indices = corners;
    primitive.positions.iter_mut().zip(&offsets).for_each(|(p, offset)| *p += radius * *offset);
    if !has_normals {
        primitive.normals = offsets;
    }
}

/// Directions of a prism's vertices from the ends of its axis.
fn prism(axis: Vec3) -> [Vec3; VERTICES] {
    let (u, v) = axis.any_orthonormal_pair();
    std::array::from_fn(|i| {
        let (sin, cos) = (TAU / 3.0 * (i % 3) as f32).sin_cos();
        cos * u + sin * v
    })
}
