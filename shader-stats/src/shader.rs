//! A linked shader: its pipelines, their resources, and SPIR-V as wgpu writes it.

use std::collections::BTreeMap;

use ash::vk;
use naga::{
    AddressSpace, Binding, EntryPoint, GlobalVariable, Handle, ImageClass, Module, ScalarKind, ShaderStage, Type,
    TypeInner,
    back::spv,
    proc::{BoundsCheckPolicies, BoundsCheckPolicy},
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};

use crate::Error;

/// Length of each array of textures; the host's depends on the scene.
const ARRAY_LENGTH: u32 = 64;

/// The uniform buffer that draws bind with an offset: `MATERIAL_OF_DRAW` of the renderer.
const DYNAMIC_UNIFORM: &str = "material_of_draw";

/// The feature of shaders that draw with four samples a pixel.
const MULTISAMPLED: &str = "multisampled";

/// A parsed shader.
pub struct Shader {
    module: Module,
    info: ModuleInfo,
    /// Samples of a pixel.
    pub samples: u32,
}

/// Resources of a pipeline: type and count by group and binding.
pub type Resources = BTreeMap<u32, BTreeMap<u32, (vk::DescriptorType, u32)>>;

/// The fixed-function state of a pipeline, as far as the entry points' inputs and outputs tell it.
pub struct Raster {
    /// Location and format of each vertex attribute.
    pub attributes: Vec<(u32, vk::Format)>,
    /// Formats of the colour attachments.
    pub targets: Vec<vk::Format>,
}

impl Shader {
    pub fn parse(label: &str, text: &str) -> Result<Self, Error> {
        let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
        let info = validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
        let samples = if label.split('+').any(|feature| feature == MULTISAMPLED) { 4 } else { 1 };
        Ok(Self { module, info, samples })
    }

    /// The entry points of each pipeline: a compute entry point, or a fragment entry point with the shader's vertex entry point.
    pub fn pipelines(&self) -> Vec<Vec<String>> {
        let of = |stage| {
            let entries = self.module.entry_points.iter().filter(move |entry| entry.stage == stage);
            entries.map(|entry| entry.name.clone()).collect::<Vec<_>>()
        };
        let (vertices, fragments) = (of(ShaderStage::Vertex), of(ShaderStage::Fragment));
        let mut pipelines: Vec<_> = of(ShaderStage::Compute).into_iter().map(|entry| vec![entry]).collect();
        for vertex in vertices {
            pipelines.extend(fragments.iter().map(|fragment| vec![vertex.clone(), fragment.clone()]));
            if fragments.is_empty() {
                pipelines.push(vec![vertex]);
            }
        }
        pipelines
    }

    fn index(&self, entry: &str) -> usize {
        self.module.entry_points.iter().position(|e| e.name == entry).expect("one of the shader's")
    }

    pub fn entry(&self, name: &str) -> &EntryPoint {
        &self.module.entry_points[self.index(name)]
    }

    /// The resources that these entry points use.
    pub fn resources(&self, entries: &[String]) -> Result<Resources, Error> {
        let mut resources = Resources::new();
        for entry in entries {
            for (handle, variable) in self.module.global_variables.iter() {
                let Some(binding) = &variable.binding else { continue };
                if !self.info.get_entry_point(self.index(entry))[handle].is_empty() {
                    let described = self.described(variable)?;
                    resources.entry(binding.group).or_default().insert(binding.binding, described);
                }
            }
        }
        Ok(resources)
    }

    fn described(&self, variable: &GlobalVariable) -> Result<(vk::DescriptorType, u32), Error> {
        let name = variable.name.as_deref().and_then(|name| name.split("__").next());
        let (inner, count) = match &self.module.types[variable.ty].inner {
            TypeInner::BindingArray { base, .. } => (&self.module.types[*base].inner, ARRAY_LENGTH),
            inner => (inner, 1),
        };
        let ty = match (variable.space, inner) {
            (AddressSpace::Uniform, _) if name == Some(DYNAMIC_UNIFORM) => vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
            (AddressSpace::Uniform, _) => vk::DescriptorType::UNIFORM_BUFFER,
            (AddressSpace::Storage { .. }, _) => vk::DescriptorType::STORAGE_BUFFER,
            (_, TypeInner::Image { class: ImageClass::Storage { .. }, .. }) => vk::DescriptorType::STORAGE_IMAGE,
            (_, TypeInner::Image { .. }) => vk::DescriptorType::SAMPLED_IMAGE,
            (_, TypeInner::Sampler { .. }) => vk::DescriptorType::SAMPLER,
            (_, TypeInner::AccelerationStructure { .. }) => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
            (space, other) => return Err(format!("{name:?}: no resource: {space:?} {other:?}").into()),
        };
        Ok((ty, count))
    }

    /// SPIR-V of one entry point of a pipeline with these resources, whose bindings are numbered without gaps, as wgpu does.
    pub fn spirv(&self, name: &str, resources: &Resources) -> Result<Vec<u32>, Error> {
        let mut options = options();
        for (&group, bindings) in resources {
            for (number, (&binding, &(_, count))) in bindings.iter().enumerate() {
                let (descriptor_set, binding_array_size) = (group, (count > 1).then_some(count));
                let info = spv::BindingInfo { descriptor_set, binding: number as u32, binding_array_size };
                options.binding_map.insert(naga::ResourceBinding { group, binding }, info);
            }
        }
        let shader_stage = self.entry(name).stage;
        let point = Some((shader_stage, name));
        let (module, info) =
            naga::back::pipeline_constants::process_overrides(&self.module, &self.info, point, &Default::default())?;
        let pipeline = spv::PipelineOptions { shader_stage, entry_point: name.to_owned() };
        Ok(spv::write_vec(&module, &info, &options, Some(&pipeline))?)
    }

    /// State that fits the inputs of the vertex entry point and the outputs of the fragment entry point.
    pub fn raster(&self, entries: &[String]) -> Raster {
        let mut raster = Raster { attributes: Vec::new(), targets: Vec::new() };
        for function in entries.iter().map(|name| self.entry(name)) {
            if function.stage == ShaderStage::Vertex {
                let inputs = function.function.arguments.iter();
                let inputs = inputs.flat_map(|argument| self.located(argument.ty, &argument.binding));
                raster.attributes =
                    inputs.map(|(location, kind, size)| (location, vertex_format(kind, size))).collect();
            } else if let Some(result) = &function.function.result {
                let outputs = self.located(result.ty, &result.binding).into_iter();
                raster.targets = outputs.map(|(_, kind, size)| target_format(kind, size)).collect();
            }
        }
        raster
    }

    /// Location, kind of scalar, and number of components of inputs or outputs, by location.
    fn located(&self, ty: Handle<Type>, binding: &Option<Binding>) -> Vec<(u32, ScalarKind, usize)> {
        let one = |ty: Handle<Type>, binding: &Option<Binding>| {
            let Some(Binding::Location { location, .. }) = binding else { return None };
            match self.module.types[ty].inner {
                TypeInner::Scalar(scalar) => Some((*location, scalar.kind, 1)),
                TypeInner::Vector { size, scalar } => Some((*location, scalar.kind, size as usize)),
                _ => None,
            }
        };
        let mut located: Vec<_> = match &self.module.types[ty].inner {
            TypeInner::Struct { members, .. } => members.iter().filter_map(|m| one(m.ty, &m.binding)).collect(),
            _ => one(ty, binding).into_iter().collect(),
        };
        located.sort_by_key(|(location, ..)| *location);
        located
    }
}

fn vertex_format(kind: ScalarKind, size: usize) -> vk::Format {
    use vk::Format as F;
    let floats = [F::R32_SFLOAT, F::R32G32_SFLOAT, F::R32G32B32_SFLOAT, F::R32G32B32A32_SFLOAT];
    let integers = [F::R32_UINT, F::R32G32_UINT, F::R32G32B32_UINT, F::R32G32B32A32_UINT];
    if kind == ScalarKind::Float { floats[size - 1] } else { integers[size - 1] }
}

fn target_format(kind: ScalarKind, size: usize) -> vk::Format {
    use vk::Format as F;
    let floats = [F::R32_SFLOAT, F::R16G16_SFLOAT, F::R16G16B16A16_SFLOAT, F::R16G16B16A16_SFLOAT];
    let integers = [F::R32_UINT, F::R32G32_UINT, F::R32G32B32A32_UINT, F::R32G32B32A32_UINT];
    if kind == ScalarKind::Float { floats[size - 1] } else { integers[size - 1] }
}

/// What wgpu-hal 30 asks of naga on RADV: `naga_options` in its `src/vulkan/adapter.rs`, for a device of Vulkan 1.3 with robust access
/// (`robustness2`), zero-initialised workgroup memory, integer dot products, 8-bit integers and ray queries.
fn options() -> spv::Options<'static> {
    use spv::Capability as C;
    let capabilities = [
        C::Shader,
        C::Matrix,
        C::Sampled1D,
        C::Image1D,
        C::ImageQuery,
        C::DerivativeControl,
        C::StorageImageExtendedFormats,
        C::SampledCubeArray,
        C::SampleRateShading,
        C::ShaderNonUniform,
        C::RayQueryKHR,
        C::DotProductInputAllKHR,
        C::DotProductInput4x8BitKHR,
        C::DotProductInput4x8BitPackedKHR,
        C::DotProductKHR,
        C::Int8,
    ];
    spv::Options {
        lang_version: (1, 6),
        flags: spv::WriterFlags::LABEL_VARYINGS | spv::WriterFlags::FORCE_POINT_SIZE,
        capabilities: Some(capabilities.into_iter().collect()),
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Restrict,
            buffer: BoundsCheckPolicy::Unchecked,
            image_load: BoundsCheckPolicy::Unchecked,
            binding_array: BoundsCheckPolicy::Unchecked,
        },
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::Native,
        force_loop_bounding: true,
        ray_query_initialization_tracking: true,
        emit_int_div_checks: true,
        fake_missing_bindings: false,
        use_storage_input_output_16: false,
        ..Default::default()
    }
}
