//! Compiles the shaders of `hot.txt` on RADV, Mesa's driver for AMD's graphics cards, for `cargo xtask shader-stats`, which
//! sets:
//!
//! - `RADV_FORCE_FAMILY`: the card, such as `navi21`. RADV then compiles with its null device, without a card;
//! - `RADV_DEBUG=shaderstats`: RADV then writes statistics of each shader to standard error;
//! - `VK_LOADER_DRIVERS_SELECT`: so that no other driver answers.
//!
//! Writes to standard error, too: the driver, and before the statistics of each pass `@ LANES NAME`, with the lanes of a wave.
//! Exits with 2 and the reason if there is no such device.

use std::{collections::BTreeSet, error::Error, process::ExitCode};

use lanternfish::{
    techniques,
    testing::every_shader::{EveryShader, all_settings},
};
use lanternfish_gpu::{AdapterChoice, ComputeKernel, Gpu, LinkedShader, RasterPipeline, RasterState};
use lanternfish_papers::{FOLDERS, register, shaders::SHADERS};
use wgpu::naga::TypeInner;

/// The passes that take most of a frame's time, in the variants of usual settings: `NAME = FILE ENTRY FEATURE…`. The name is the
/// pass's label in reports, and what tells this variant from others; it stays when features change. All trace through the BVH,
/// which every card can.
const HOT: &str = include_str!("hot.txt");

/// Length of each array of textures; the renderer's depends on the scene.
const ARRAY_LENGTH: u32 = 64;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let gpu = match Gpu::open(&AdapterChoice::Name("RADV".to_owned())) {
        Ok(gpu) => gpu,
        Err(error) => {
            eprintln!("{error}");
            return Ok(ExitCode::from(2));
        }
    };
    eprintln!("{}", gpu.description.driver);
    let hot: Vec<_> = HOT.lines().map(|line| variant(line).expect("a line is NAME = FILE ENTRY FEATURE…")).collect();
    let wanted: BTreeSet<_> = hot.iter().map(|(.., shader)| shader).collect();
    let linked = every_shader().map(|every| {
        every.link(|root, features| {
            let features = features.iter().map(|feature| feature.name());
            wanted.contains(&[root.module].into_iter().chain(features).collect())
        })
    });
    for (name, entry, wanted) in &hot {
        let shader = linked.iter().flatten().find(|shader| shader.label.split('+').collect::<BTreeSet<_>>() == *wanted);
        let shader = shader.ok_or_else(|| format!("{name}: no such variant: {wanted:?}"))?;
        compile(&gpu.device, shader, entry, name);
    }
    Ok(ExitCode::SUCCESS)
}

/// The name, the entry point, and the file with its features.
fn variant(line: &str) -> Option<(&str, &str, BTreeSet<&str>)> {
    let (name, variant) = line.split_once(" = ")?;
    let mut words = variant.split(' ');
    let (file, entry) = (words.next()?, words.next()?);
    Some((name, entry, words.chain([file]).collect()))
}

/// The shaders of the library as its own settings request them, then those of this crate.
fn every_shader() -> [EveryShader; 2] {
    let library = EveryShader::new(vec![&lanternfish::shaders::SHADERS], techniques::shaders(), &all_settings());
    register();
    let own: BTreeSet<_> = SHADERS.sources().iter().map(|(path, _)| *path).collect();
    let folders = techniques::shaders().into_iter().chain(FOLDERS.iter().copied());
    let folders = folders.filter(|folder| folder.roots.iter().all(|root| own.contains(root.module)));
    [library, EveryShader::new(vec![&SHADERS], folders.collect(), &[])]
}

fn compile(device: &wgpu::Device, shader: &LinkedShader, entry: &str, name: &str) {
    if entry != "fragment" {
        // RADV chooses 32 lanes for small workgroups alone.
        let is_small = shader.workgroup_size(entry).iter().product::<u32>() <= 32;
        eprintln!("@ {} {name}", if is_small { 32 } else { 64 });
        ComputeKernel::new(device, shader, entry, name);
        return;
    }
    // The state matters little to a fragment shader: every attribute has four components, and every target is that of radiance.
    let attribute = |location| wgpu::VertexAttribute {
        format: wgpu::VertexFormat::Float32x4,
        offset: 16 * u64::from(location),
        shader_location: location,
    };
    let attributes: Vec<_> = shader.vertex_locations("vertex").into_iter().map(attribute).collect();
    let step_mode = wgpu::VertexStepMode::Vertex;
    let buffer = wgpu::VertexBufferLayout { array_stride: 128, step_mode, attributes: &attributes };
    let depth = wgpu::DepthStencilState {
        format: wgpu::TextureFormat::Depth32Float,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
        stencil: Default::default(),
        bias: Default::default(),
    };
    let variables = shader.module.global_variables.iter().map(|(_, variable)| variable);
    let is_array = |ty| matches!(shader.module.types[ty].inner, TypeInner::BindingArray { .. });
    let arrays = variables.filter(|variable| is_array(variable.ty)).filter_map(|variable| variable.name.as_deref());
    let arrays: Vec<_> = arrays.map(|name| (name.split("__").next().unwrap_or(name), ARRAY_LENGTH)).collect();
    let state = RasterState {
        vertex_buffers: &[Some(buffer)][..usize::from(!attributes.is_empty())],
        depth: Some(depth),
        targets: &[Some(wgpu::TextureFormat::Rgba16Float.into())],
        array_lengths: &arrays,
        dynamic_uniform: Some("material_of_draw"),
        samples: if shader.label.contains("+multisampled") { 4 } else { 1 },
        ..Default::default()
    };
    eprintln!("@ 64 {name}");
    RasterPipeline::new(device, shader, "vertex", entry, name, &state);
}
