//! Lists of a chunk from depth peeling: the scene is drawn once for every layer of surfaces in any texel [Niessner2010, §3.1].

use glam::UVec2;
use lanternfish::{RenderError, common::workgroups, texture::target};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, RasterPipeline, RasterState, storage_buffer};

use super::{
    super::{
        settings::DeepImageSettings,
        shaders::{DECLARED, DeepGrid},
        store::put_features,
    },
    shared::PeeledFragment,
};

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Format of a layer: triangle and depth.
const LAYER: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;

/// The passes.
#[derive(Debug)]
pub(super) struct DepthPeeling {
    draw: RasterPipeline,
    keep: ComputeKernel,
    put: ComputeKernel,
}

/// The fragments of one layer, on the device.
#[derive(Debug)]
struct Layer {
    fragments: wgpu::Buffer,
    count_buffer: wgpu::Buffer,
    count: u32,
}

/// Render targets of a layer: every image is a tile.
struct Atlas {
    depth: wgpu::TextureView,
    layer: wgpu::TextureView,
}

impl Atlas {
    /// All zero, which is before every surface.
    fn new(device: &wgpu::Device, size: UVec2) -> Self {
        let texture = |label, format| target(device, label, size, format, wgpu::TextureUsages::empty());
        Self { depth: texture("deep_images/peeled_depth", DEPTH), layer: texture("deep_images/peeled_layer", LAYER) }
    }
}

impl DepthPeeling {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let draw = DECLARED.link("deep_images/build/depth_peeling", &[])?;
        let put = DECLARED.link("deep_images/build/peeled", &put_features(settings))?;
        let state = RasterState {
            depth: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Less),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            targets: &[Some(LAYER.into())],
            ..RasterState::default()
        };
        Ok(Self {
            draw: RasterPipeline::new(device, &draw, "vertex", "fragment", "deep_images/gather/draw", &state),
            keep: ComputeKernel::new(device, &put, "keep", "deep_images/gather/keep"),
            put: ComputeKernel::new(device, &put, "put", "deep_images/gather/put"),
        })
    }

    /// Number of images whose tiles fit one texture, and whose first layer fits one binding; at least one.
    pub fn most_images(device: &wgpu::Device, resolution: u32) -> u32 {
        let limits = device.limits();
        let columns = u64::from(limits.max_texture_dimension_2d / resolution);
        let fragments = limits.max_storage_buffer_binding_size / size_of::<PeeledFragment>() as u64;
        let texels = u64::from(resolution).pow(2);
        (columns * columns).min(fragments / texels).clamp(1, 1 << 16) as u32
    }

    /// Puts every fragment of a chunk's images, once, into its list.
    pub fn gather(&self, frame: &mut Frame<'_>, grid: &DeepGrid, bindings: &Bindings<'_>) -> Result<(), RenderError> {
        for layer in self.peel(frame, grid, bindings)?.iter().rev() {
            let putting = bindings
                .clone()
                .buffer("peeled_fragments", &layer.fragments)
                .buffer("peeled_count", &layer.count_buffer);
            frame.dispatch(&self.put, &putting, workgroups(layer.count));
        }
        Ok(())
    }

    /// Draws layer after layer until one is empty, and returns them: 12 bytes per fragment of the previous layer.
    fn peel(&self, frame: &mut Frame<'_>, grid: &DeepGrid, bindings: &Bindings<'_>) -> Result<Vec<Layer>, RenderError> {
        let device = frame.device;
        // As square as possible.
        let columns = f64::from(grid.image_count).sqrt().ceil() as u32;
        let size = grid.resolution * UVec2::new(columns, grid.image_count.div_ceil(columns));
        let (mut atlas, mut before) = (Atlas::new(device, size), Atlas::new(device, size));
        let lists = grid.image_count * grid.resolution * grid.resolution;
        let mut capacity = lists;
        let mut layers = Vec::new();
        loop {
            self.draw(frame, grid, &atlas, &before, bindings);
            let bytes = size_of::<PeeledFragment>() as u64 * u64::from(capacity);
            let fragments = storage_buffer(device, "deep_images/peeled_fragments", bytes)?;
            let count_buffer = storage_buffer(device, "deep_images/peeled_count", 4)?;
            let keeping = bindings
                .clone()
                .texture("peeled_layer", &atlas.layer)
                .buffer("peeled_fragments", &fragments)
                .buffer("peeled_count", &count_buffer);
            frame.dispatch(&self.keep, &keeping, workgroups(lists));
            let count = frame.read_now::<u32>(&count_buffer, 1)?[0];
            if count == 0 {
                return Ok(layers);
            }
            layers.push(Layer { fragments, count_buffer, count });
            capacity = count;
            std::mem::swap(&mut atlas, &mut before);
        }
    }

    fn draw(&self, frame: &mut Frame<'_>, grid: &DeepGrid, atlas: &Atlas, before: &Atlas, bindings: &Bindings<'_>) {
        let color = wgpu::RenderPassColorAttachment {
            view: &atlas.layer,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &atlas.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        let bindings = bindings.clone().texture("peeled_depth", &before.depth).texture("peeled_layer", &before.layer);
        frame.render("deep_images/gather/draw", &[Some(color)], Some(depth), |groups, pass| {
            self.draw.set(pass);
            self.draw.bind(groups, pass, &bindings, 4);
            pass.draw(0..3 * grid.triangle_count, 0..grid.image_count);
        });
    }
}
