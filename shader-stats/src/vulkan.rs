//! RADV's null device: compiles pipelines and tells the compiler's statistics.

use std::{
    collections::BTreeMap,
    ffi::{CStr, CString},
};

use ash::{ext, khr, vk};
use naga::ShaderStage;

use crate::{
    Error,
    shader::{Raster, Resources, Shader},
};

/// Bytes of a vertex in the assumed vertex buffer, and of an attribute.
const VERTEX_BYTES: [u32; 2] = [128, 16];

/// A device that executes nothing.
pub struct Device {
    _entry: ash::Entry,
    device: ash::Device,
    executables: khr::pipeline_executable_properties::Device,
    /// Name and version of the driver.
    pub driver: String,
}

/// What the compiler tells of one stage of a pipeline.
pub struct Stage {
    pub stage: ShaderStage,
    /// Lanes of a wave.
    pub wave: u32,
    pub statistics: BTreeMap<String, u64>,
}

impl Device {
    /// Opens the first device that the loader lists, with what wgpu turns on.
    pub fn open() -> Result<Self, Error> {
        // Safety: `Entry` outlives what is made of it, and each structure the call that reads it.
        unsafe {
            let entry = ash::Entry::load()?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let instance_info = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&instance_info, None)?;
            let physical = *instance.enumerate_physical_devices()?.first().ok_or("no Vulkan device")?;
            let mut driver = vk::PhysicalDeviceDriverProperties::default();
            let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
            instance.get_physical_device_properties2(physical, &mut properties);
            if driver.driver_id != vk::DriverId::MESA_RADV {
                return Err(format!("not RADV: {:?}", driver.driver_name_as_c_str()?).into());
            }
            let driver = driver.driver_info_as_c_str()?.to_string_lossy().into_owned();

            let wanted = [
                ext::robustness2::NAME,
                khr::pipeline_executable_properties::NAME,
                khr::acceleration_structure::NAME,
                khr::ray_query::NAME,
                khr::deferred_host_operations::NAME,
            ];
            let there = instance.enumerate_device_extension_properties(physical)?;
            let is_there = |name: &CStr| there.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
            if let Some(missing) = wanted.iter().find(|name| !is_there(name)) {
                return Err(format!("the device has no {}", missing.to_string_lossy()).into());
            }
            let names = wanted.map(CStr::as_ptr);
            let mut robustness = vk::PhysicalDeviceRobustness2FeaturesEXT::default()
                .robust_buffer_access2(true)
                .robust_image_access2(true);
            let mut executable =
                vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
            let mut structure =
                vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
            let mut query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
            let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
                .descriptor_indexing(true)
                .shader_sampled_image_array_non_uniform_indexing(true)
                .shader_int8(true)
                .buffer_device_address(true);
            let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
                .dynamic_rendering(true)
                .shader_integer_dot_product(true)
                .shader_zero_initialize_workgroup_memory(true)
                .robust_image_access(true)
                .maintenance4(true);
            let features = vk::PhysicalDeviceFeatures::default()
                .robust_buffer_access(true)
                .sample_rate_shading(true)
                .image_cube_array(true)
                .independent_blend(true)
                .fragment_stores_and_atomics(true)
                .vertex_pipeline_stores_and_atomics(true)
                .shader_sampled_image_array_dynamic_indexing(true)
                .shader_storage_image_extended_formats(true)
                .shader_storage_image_write_without_format(true);
            let queue = [vk::DeviceQueueCreateInfo::default().queue_family_index(0).queue_priorities(&[1.0])];
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queue)
                .enabled_extension_names(&names)
                .enabled_features(&features)
                .push_next(&mut robustness)
                .push_next(&mut executable)
                .push_next(&mut structure)
                .push_next(&mut query)
                .push_next(&mut v12)
                .push_next(&mut v13);
            let device = instance.create_device(physical, &info, None)?;
            let executables = khr::pipeline_executable_properties::Device::new(&instance, &device);
            Ok(Self { _entry: entry, device, executables, driver })
        }
    }

    /// Compiles the pipeline of these entry points.
    pub fn compile(&self, shader: &Shader, entries: &[String]) -> Result<Vec<Stage>, Error> {
        let resources = shader.resources(entries)?;
        // Safety: SPIR-V is naga's, of a valid module; what the pipeline is made of is destroyed after it.
        unsafe {
            let (sets, layout) = self.layout(&resources)?;
            let names = entries.iter().map(|name| CString::new(name.as_str())).collect::<Result<Vec<_>, _>>()?;
            let mut stages = Vec::new();
            for (entry, name) in entries.iter().zip(&names) {
                let code = shader.spirv(entry, &resources)?;
                let info = vk::ShaderModuleCreateInfo::default().code(&code);
                let module = self.device.create_shader_module(&info, None)?;
                let stage = vk::PipelineShaderStageCreateInfo::default().module(module).name(name);
                stages.push(stage.stage(flag(shader.entry(entry).stage)));
            }
            let pipeline = if stages[0].stage == vk::ShaderStageFlags::COMPUTE {
                self.compute_pipeline(layout, stages[0])?
            } else {
                self.raster_pipeline(layout, &stages, &shader.raster(entries), shader.samples)?
            };
            let told = self.told(pipeline);
            self.device.destroy_pipeline(pipeline, None);
            stages.iter().for_each(|stage| self.device.destroy_shader_module(stage.module, None));
            self.device.destroy_pipeline_layout(layout, None);
            sets.iter().for_each(|set| self.device.destroy_descriptor_set_layout(*set, None));
            told
        }
    }

    /// # Safety
    ///
    /// The caller destroys the layouts.
    unsafe fn layout(
        &self,
        resources: &Resources,
    ) -> Result<(Vec<vk::DescriptorSetLayout>, vk::PipelineLayout), Error> {
        let groups = resources.keys().max().map_or(0, |group| group + 1);
        let set = |group| {
            let bindings = resources.get(&group).into_iter().flatten().enumerate();
            let bindings: Vec<_> = bindings
                .map(|(number, (_, (ty, count)))| {
                    let binding = vk::DescriptorSetLayoutBinding::default().binding(number as u32);
                    binding.descriptor_type(*ty).descriptor_count(*count).stage_flags(vk::ShaderStageFlags::ALL)
                })
                .collect();
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            // Safety: the structures outlive the call.
            unsafe { self.device.create_descriptor_set_layout(&info, None) }
        };
        let sets = (0..groups).map(set).collect::<Result<Vec<_>, _>>()?;
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        // Safety: the layouts are the device's.
        let layout = unsafe { self.device.create_pipeline_layout(&info, None)? };
        Ok((sets, layout))
    }

    /// # Safety
    ///
    /// The caller destroys the pipeline; the layout fits the stage.
    unsafe fn compute_pipeline(
        &self,
        layout: vk::PipelineLayout,
        stage: vk::PipelineShaderStageCreateInfo<'_>,
    ) -> Result<vk::Pipeline, vk::Result> {
        let flags = vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR;
        let info = vk::ComputePipelineCreateInfo::default().flags(flags).layout(layout).stage(stage);
        // Safety: as the caller's.
        let made = unsafe { self.device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None) };
        made.map(|pipelines| pipelines[0]).map_err(|(_, error)| error)
    }

    /// # Safety
    ///
    /// As [`Self::compute_pipeline`].
    unsafe fn raster_pipeline(
        &self,
        layout: vk::PipelineLayout,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
        raster: &Raster,
        samples: u32,
    ) -> Result<vk::Pipeline, vk::Result> {
        let [stride, attribute_bytes] = VERTEX_BYTES;
        let attribute = |&(location, format): &(u32, vk::Format)| {
            let attribute = vk::VertexInputAttributeDescription::default().location(location).format(format);
            attribute.offset(attribute_bytes * location)
        };
        let attributes: Vec<_> = raster.attributes.iter().map(attribute).collect();
        let buffers = [vk::VertexInputBindingDescription::default().stride(stride)];
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_attribute_descriptions(&attributes)
            .vertex_binding_descriptions(&buffers[..usize::from(!attributes.is_empty())]);
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(samples));
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::GREATER_OR_EQUAL);
        let attachment =
            vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let attachments = vec![attachment; raster.targets.len()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&raster.targets)
            .depth_attachment_format(vk::Format::D32_SFLOAT);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
            .layout(layout)
            .stages(stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .push_next(&mut rendering);
        // Safety: as the caller's.
        let made = unsafe { self.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
        made.map(|pipelines| pipelines[0]).map_err(|(_, error)| error)
    }

    /// # Safety
    ///
    /// The pipeline is the device's and captures statistics.
    unsafe fn told(&self, pipeline: vk::Pipeline) -> Result<Vec<Stage>, Error> {
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // Safety: as the caller's.
        let executables = unsafe { self.executables.get_pipeline_executable_properties(&info)? };
        let mut told = Vec::new();
        for (index, properties) in executables.iter().enumerate() {
            let which = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(index as u32);
            let mut statistics = BTreeMap::new();
            // Safety: the index is one of the pipeline's.
            for statistic in unsafe { self.executables.get_pipeline_executable_statistics(&which)? } {
                if statistic.format == vk::PipelineExecutableStatisticFormatKHR::UINT64 {
                    let name = statistic.name_as_c_str()?.to_string_lossy().into_owned();
                    // Safety: the format says which it is.
                    statistics.insert(name, unsafe { statistic.value.u64 });
                }
            }
            let all = [ShaderStage::Compute, ShaderStage::Fragment, ShaderStage::Vertex];
            let stage = all.into_iter().find(|stage| properties.stages.contains(flag(*stage)));
            told.push(Stage { stage: stage.ok_or("an unknown stage")?, wave: properties.subgroup_size, statistics });
        }
        Ok(told)
    }
}

fn flag(stage: ShaderStage) -> vk::ShaderStageFlags {
    match stage {
        ShaderStage::Vertex => vk::ShaderStageFlags::VERTEX,
        ShaderStage::Fragment => vk::ShaderStageFlags::FRAGMENT,
        _ => vk::ShaderStageFlags::COMPUTE,
    }
}
