//! Mesh deformation on the device: vertices at rest, joint influences and morph targets are uploaded once; joint transforms and weights for
//! every pose.

use glam::{Affine3A, UVec4, Vec3, Vec4};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, storage_buffer_of};
use lanternfish_scene::{
    Bounds, Scene, SceneFault,
    motion::{Deformation, DeformedMesh, Pose, Reach},
};

use super::{
    super::upload::geometry::Geometry,
    shaders::{BendParameters, BentPrimitive, DECLARED, Influence, rows},
};
use crate::{common::workgroups, error::RenderError};

/// Resources of deformation on the device; created at the first animation.
#[derive(Debug)]
pub struct Bending {
    kernel: ComputeKernel,
    parameters: BendParameters,
    /// By their names in the shader.
    lists: [(&'static str, wgpu::Buffer); 4],
    /// Size of these lists, bytes.
    pub bytes: u64,
    meshes: Vec<BentMesh>,
    reaches: Vec<PrimitiveReach>,
    /// The joints and weights of the last deformation.
    last: Bend,
}

/// A deformed mesh, and the number of weights that are uploaded for it.
#[derive(Debug)]
struct BentMesh {
    mesh: DeformedMesh,
    target_count: usize,
}

/// Bounds of a primitive's deformed vertices.
#[derive(Debug)]
struct PrimitiveReach {
    /// Index among all primitives of the scene.
    primitive: usize,
    /// Ranges of its mesh in the pose's joints and weights.
    joints: std::ops::Range<usize>,
    weights: std::ops::Range<usize>,
    reach: Reach,
}

/// Joint transforms and weights that deform all vertices at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bend {
    /// World from object at rest, for the joints of all skins, one skin after another.
    joints: Vec<Affine3A>,
    /// Weights of the morph targets of all deformed meshes, one mesh after another.
    weights: Vec<f32>,
}

/// The lists that [`Bending`] uploads.
#[derive(Default)]
struct Lists {
    primitives: Vec<BentPrimitive>,
    rest: Vec<[Vec3; 3]>,
    influences: Vec<Influence>,
    displacements: Vec<Vec3>,
}

/// The deformed meshes; the last entry for a mesh counts, as on the host.
fn bent_meshes(scene: &Scene) -> impl Iterator<Item = DeformedMesh> + '_ {
    let meshes = &scene.motion.meshes;
    let last = meshes.iter().enumerate().filter(|(i, one)| meshes[i + 1..].iter().all(|other| other.mesh != one.mesh));
    let bends = |one: &DeformedMesh| scene.meshes[one.mesh].primitives.iter().any(|p| p.deformation.is_some());
    last.map(|(_, one)| *one).filter(bends)
}

/// True if any vertex is deformed.
pub fn bends(scene: &Scene) -> bool {
    bent_meshes(scene).next().is_some()
}

impl Bending {
    /// `scene` must be valid, with the meshes of `geometry`, whose buffers the device can bind.
    pub fn new(device: &wgpu::Device, geometry: &Geometry, scene: &Scene) -> Result<Self, RenderError> {
        let (primitives, first_of_mesh) = geometry.primitives();
        let first_joints: Vec<usize> = scene
            .motion
            .skins
            .iter()
            .scan(0, |end, skin| {
                *end += skin.joints.len();
                Some(*end - skin.joints.len())
            })
            .collect();
        let (mut lists, mut meshes, mut reaches) = (Lists::default(), Vec::new(), Vec::new());
        let mut first_weight = 0;
        for mesh in bent_meshes(scene) {
            let joints = mesh
                .skin
                .map_or(0..0, |skin| first_joints[skin]..first_joints[skin] + scene.motion.skins[skin].joints.len());
            let mut target_count = 0;
            for (i, primitive) in scene.meshes[mesh.mesh].primitives.iter().enumerate() {
                let Some(deformation) = primitive.deformation.as_deref() else { continue };
                let (primitive, count) = (first_of_mesh[mesh.mesh] + i, deformation.targets.len());
                let [_, first_vertex, _] = primitives[primitive];
                lists.add(deformation, first_vertex, joints.clone(), first_weight);
                let weights = first_weight..first_weight + count;
                let reach = Reach::new(deformation, joints.len());
                reaches.push(PrimitiveReach { primitive, joints: joints.clone(), weights, reach });
                target_count = target_count.max(count);
            }
            meshes.push(BentMesh { mesh, target_count });
            first_weight += target_count;
        }
        let (label, none) = ("gpu_scene/moving/bend", wgpu::BufferUsages::empty());
        let shader = DECLARED.link(label, &[])?;
        let kernel = ComputeKernel::new(device, &shader, "bend", label);
        Ok(Self {
            kernel,
            parameters: BendParameters {
                primitive_count: lists.primitives.len() as u32,
                vertex_count: lists.rest.len() as u32,
                ..BendParameters::default()
            },
            bytes: lists.bytes(),
            lists: [
                ("bent_primitives", storage_buffer_of(device, "scene/bent_primitives", &lists.primitives, none)?),
                ("rest", storage_buffer_of(device, "scene/rest_vertices", lists.rest.as_flattened(), none)?),
                ("influences", storage_buffer_of(device, "scene/influences", &lists.influences, none)?),
                ("displacements", storage_buffer_of(device, "scene/morph_targets", &lists.displacements, none)?),
            ],
            meshes,
            reaches,
            last: Bend::default(),
        })
    }

    /// The joint transforms and weights of a pose. An error if the deformed meshes of `scene` differ from those of its creation, or if a
    /// joint is not finite.
    pub fn bend(&self, scene: &Scene, pose: &Pose) -> Result<Bend, RenderError> {
        let changed = |what: &str| Err(RenderError::NeedsUpdate { what: what.to_owned() });
        if !bent_meshes(scene).eq(self.meshes.iter().map(|bent| bent.mesh)) {
            return changed("other meshes bend than before");
        }
        let motion = &scene.motion;
        let joints: Vec<Affine3A> = (0..motion.skins.len()).flat_map(|skin| motion.joints(skin, pose)).collect();
        if self.reaches.iter().any(|reach| reach.joints.end > joints.len()) {
            return changed("skins have fewer joints than before");
        }
        let weights = self.meshes.iter().flat_map(|BentMesh { mesh, target_count }| {
            let weights = &pose.weights[mesh.node];
            (0..*target_count).map(|target| weights.get(target).copied().unwrap_or(0.0))
        });
        let weights: Vec<f32> = weights.collect();
        let entries = joints.iter().flat_map(|joint| joint.to_cols_array()).chain(weights.iter().copied());
        // False for NaN, too.
        if !entries.into_iter().all(|entry| entry.abs() <= Scene::FARTHEST) {
            let what = format!("a joint's transform or a weight is not finite, or beyond {:e}", Scene::FARTHEST);
            return Err(SceneFault::Motion { what }.into());
        }
        Ok(Bend { joints, weights })
    }

    /// True if the device's last deformation used other joints or weights.
    pub fn is_other(&self, bend: &Bend) -> bool {
        self.last != *bend
    }

    /// Indices of the deformed meshes.
    pub fn meshes(&self) -> impl Iterator<Item = usize> {
        self.meshes.iter().map(|bent| bent.mesh.mesh)
    }

    /// The index of each deformed primitive, and a box that contains its vertices, object space, m.
    pub fn bounds(&self, bend: &Bend) -> Vec<(usize, Bounds)> {
        let bounds = |of: &PrimitiveReach| {
            (of.primitive, of.reach.bounds(&bend.weights[of.weights.clone()], &bend.joints[of.joints.clone()]))
        };
        self.reaches.iter().map(bounds).collect()
    }

    /// Adds the pass that deforms the vertices of these buffers, and returns the uploaded bytes.
    pub fn record(&mut self, frame: &mut Frame<'_>, geometry: &Geometry, bend: Bend) -> Result<u64, RenderError> {
        let rows: Vec<[Vec4; 3]> = bend.joints.iter().map(rows).collect();
        let joint_rows = frame.storage_of("scene/joint_rows", rows.as_flattened())?;
        let target_weights = frame.storage_of("scene/target_weights", &bend.weights)?;
        let uniform = frame.uniform(&self.parameters);
        let mut bindings = Bindings::new()
            .part("bending", &uniform)
            .buffer("joint_rows", &joint_rows)
            .buffer("target_weights", &target_weights)
            .buffer("bent_positions", &geometry.positions)
            .buffer("bent_attributes", &geometry.attributes);
        for (name, list) in &self.lists {
            bindings = bindings.buffer(name, list);
        }
        frame.dispatch(&self.kernel, &bindings, workgroups(self.parameters.vertex_count));
        let bytes = size_of_val(rows.as_slice()) + size_of_val(bend.weights.as_slice()) + size_of::<BendParameters>();
        self.last = bend;
        Ok(bytes as u64)
    }
}

impl Lists {
    /// `joints`: range of the skin's joints among all; none: no skin.
    fn add(
        &mut self,
        deformation: &Deformation,
        first_vertex: u32,
        joints: std::ops::Range<usize>,
        first_weight: usize,
    ) {
        let Deformation { positions, normals, tangents, influences, targets, has_flat_normals } = deformation;
        if positions.is_empty() {
            return;
        }
        let (has_normals, has_tangents) =
            (targets.iter().any(|t| !t.normals.is_empty()), targets.iter().any(|t| !t.tangents.is_empty()));
        let vectors = if has_tangents { 3 } else { 1 + usize::from(has_normals) };
        let set_count = if joints.is_empty() { 0 } else { influences.len() };
        self.primitives.push(BentPrimitive {
            first: self.rest.len() as u32,
            vertex_count: positions.len() as u32,
            first_vertex,
            set_count: set_count as u32,
            first_influence: self.influences.len() as u32,
            first_joint: joints.start as u32,
            target_count: targets.len() as u32,
            first_weight: first_weight as u32,
            first_displacement: 3 * self.displacements.len() as u32,
            displacement_width: 3 * vectors as u32,
            has_flat_normals: u32::from(*has_flat_normals),
            has_tangents: u32::from(!tangents.is_empty()),
        });
        // The host's default where there are no tangents.
        let tangent = |i: usize| tangents.get(i).map_or(Vec3::X, |tangent| tangent.truncate());
        self.rest.extend((0..positions.len()).map(|i| [positions[i], normals[i], tangent(i)]));
        for i in 0..positions.len() {
            self.influences.extend(influences[..set_count].iter().map(|set| Influence {
                joints: UVec4::from_array(set.joints[i].map(u32::from)),
                weights: set.weights[i],
            }));
        }
        for target in targets {
            for i in 0..positions.len() {
                let lists = [&target.positions, &target.normals, &target.tangents];
                self.displacements.extend(lists[..vectors].iter().map(|list| list.get(i).copied().unwrap_or_default()));
            }
        }
    }

    fn bytes(&self) -> u64 {
        let Self { primitives, rest, influences, displacements } = self;
        let bytes = size_of_val(&primitives[..]) + size_of_val(&rest[..]);
        (bytes + size_of_val(&influences[..]) + size_of_val(&displacements[..])) as u64
    }
}
