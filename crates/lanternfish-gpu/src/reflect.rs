//! Bind group layouts, reflected from the shader: bindings are declared only there.

use naga::{AddressSpace, GlobalVariable, Handle, ImageClass, ImageDimension, ScalarKind, StorageAccess, TypeInner};

use crate::{LinkedShader, shader::item_name};

/// Layouts of the resources that a pipeline uses, by group.
#[derive(Clone, Debug)]
pub(crate) struct Layouts {
    /// One layout per group, from 0 to the highest group in use. Unused groups have an empty layout.
    pub groups: Vec<wgpu::BindGroupLayout>,
    /// Name and binding number of every resource, by group.
    pub names: Vec<Vec<(String, u32)>>,
    /// The group with the dynamic uniform buffer, if it is used.
    pub dynamic_group: Option<usize>,
    /// The pipeline layout of all groups.
    pub pipeline: wgpu::PipelineLayout,
}

/// Reflects the bindings that these entry points use. `array_lengths` gives the length of each binding array by name;
/// `dynamic_uniform` is the name of a uniform buffer with a dynamic offset.
pub(crate) fn layouts(
    device: &wgpu::Device,
    shader: &LinkedShader,
    entries: &[&str],
    array_lengths: &[(&str, u32)],
    dynamic_uniform: Option<&str>,
) -> Layouts {
    let mut resources: Vec<(u32, String, wgpu::BindGroupLayoutEntry)> = Vec::new();
    let mut dynamic_group = None;
    for entry in entries {
        let index = shader.entry_index(entry);
        let stage = match shader.module.entry_points[index].stage {
            naga::ShaderStage::Vertex => wgpu::ShaderStages::VERTEX,
            naga::ShaderStage::Fragment => wgpu::ShaderStages::FRAGMENT,
            _ => wgpu::ShaderStages::COMPUTE,
        };
        for (handle, variable) in shader.module.global_variables.iter() {
            let Some(binding) = variable.binding else { continue };
            if shader.info.get_entry_point(index)[handle].is_empty() {
                continue;
            }
            let name = item_name(variable.name.as_deref().unwrap_or_default());
            if let Some((_, _, same)) =
                resources.iter_mut().find(|(group, _, e)| *group == binding.group && e.binding == binding.binding)
            {
                same.visibility |= stage;
                continue;
            }
            let (mut ty, count) = binding_type(shader, handle, name, array_lengths);
            if let wgpu::BindingType::Buffer { has_dynamic_offset, .. } = &mut ty
                && dynamic_uniform == Some(name)
            {
                *has_dynamic_offset = true;
                dynamic_group = Some(binding.group as usize);
            }
            let layout_entry = wgpu::BindGroupLayoutEntry { binding: binding.binding, visibility: stage, ty, count };
            resources.push((binding.group, name.to_owned(), layout_entry));
        }
    }

    let group_count = resources.iter().map(|(group, ..)| group + 1).max().unwrap_or(0);
    let mut groups = Vec::new();
    let mut names = Vec::new();
    for group in 0..group_count {
        let members: Vec<_> = resources.iter().filter(|(g, ..)| *g == group).collect();
        let entries: Vec<_> = members.iter().map(|(_, _, entry)| *entry).collect();
        groups.push(device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(&shader.label),
            entries: &entries,
        }));
        names.push(members.iter().map(|(_, name, entry)| (name.clone(), entry.binding)).collect());
    }
    let pipeline = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(&shader.label),
        bind_group_layouts: &groups.iter().map(Some).collect::<Vec<_>>(),
        immediate_size: 0,
    });
    Layouts { groups, names, dynamic_group, pipeline }
}

fn binding_type(
    shader: &LinkedShader,
    handle: Handle<GlobalVariable>,
    name: &str,
    array_lengths: &[(&str, u32)],
) -> (wgpu::BindingType, Option<std::num::NonZeroU32>) {
    let variable = &shader.module.global_variables[handle];
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    match variable.space {
        AddressSpace::Uniform => return (buffer(wgpu::BufferBindingType::Uniform), None),
        AddressSpace::Storage { access } => {
            let read_only = !access.contains(StorageAccess::STORE);
            return (buffer(wgpu::BufferBindingType::Storage { read_only }), None);
        }
        _ => {}
    }
    let types = &shader.module.types;
    match &types[variable.ty].inner {
        TypeInner::BindingArray { base, .. } => {
            let length = array_lengths.iter().find(|(n, _)| *n == name).map(|(_, length)| *length);
            let length = length.unwrap_or_else(|| panic!("{}: no length given for array {name}", shader.label));
            (opaque_type(&types[*base].inner, true, &shader.label, name), std::num::NonZeroU32::new(length))
        }
        inner => (opaque_type(inner, is_sampled(shader, handle), &shader.label, name), None),
    }
}

/// True if any entry point reads the texture through a sampler. If none does, its format need not be filterable.
fn is_sampled(shader: &LinkedShader, texture: Handle<GlobalVariable>) -> bool {
    let uses = |entry| shader.info.get_entry_point(entry).sampling_set.iter().any(|key| key.image == texture);
    (0..shader.module.entry_points.len()).any(uses)
}

/// The storage texture formats in use; every adapter can write them.
fn storage_format(format: naga::StorageFormat) -> Option<wgpu::TextureFormat> {
    match format {
        naga::StorageFormat::R32Uint => Some(wgpu::TextureFormat::R32Uint),
        naga::StorageFormat::R32Float => Some(wgpu::TextureFormat::R32Float),
        naga::StorageFormat::Rgba32Uint => Some(wgpu::TextureFormat::Rgba32Uint),
        naga::StorageFormat::Rg32Uint => Some(wgpu::TextureFormat::Rg32Uint),
        naga::StorageFormat::Rgba16Float => Some(wgpu::TextureFormat::Rgba16Float),
        _ => None,
    }
}

fn opaque_type(inner: &TypeInner, is_sampled: bool, label: &str, name: &str) -> wgpu::BindingType {
    match inner {
        TypeInner::Image { dim, arrayed, class } => {
            let view_dimension = match (dim, arrayed) {
                (ImageDimension::D1, _) => wgpu::TextureViewDimension::D1,
                (ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
                (ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
                (ImageDimension::D3, _) => wgpu::TextureViewDimension::D3,
                (ImageDimension::Cube, false) => wgpu::TextureViewDimension::Cube,
                (ImageDimension::Cube, true) => wgpu::TextureViewDimension::CubeArray,
            };
            match class {
                ImageClass::Sampled { kind, multi } => wgpu::BindingType::Texture {
                    sample_type: match kind {
                        ScalarKind::Uint => wgpu::TextureSampleType::Uint,
                        ScalarKind::Sint => wgpu::TextureSampleType::Sint,
                        _ => wgpu::TextureSampleType::Float { filterable: is_sampled && !multi },
                    },
                    view_dimension,
                    multisampled: *multi,
                },
                ImageClass::Depth { multi } => wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Depth,
                    view_dimension,
                    multisampled: *multi,
                },
                ImageClass::Storage { format, access: StorageAccess::STORE } => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: storage_format(*format).unwrap_or_else(|| {
                        panic!("{label}: storage texture {name} of format {format:?} cannot be bound by name yet")
                    }),
                    view_dimension,
                },
                other => panic!("{label}: texture {name} of class {other:?} cannot be bound by name yet"),
            }
        }
        TypeInner::Sampler { comparison: true } => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison),
        TypeInner::Sampler { .. } => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        TypeInner::AccelerationStructure { vertex_return } => {
            wgpu::BindingType::AccelerationStructure { vertex_return: *vertex_return }
        }
        other => panic!("{label}: {name} of type {other:?} cannot be bound by name"),
    }
}
