//! The grid in the image to which a rasterizer snaps vertices.

use crate::{GpuError, RasterPipeline, RasterState, ShaderLibrary, primitives::SHADERS, read_texture, texels};

/// Least number of subpixel bits that Vulkan allows; Direct3D demands 8.
const LEAST_SUBPIXEL_BITS: u32 = 4;
/// Width of the image of [`drawn_subpixel_bits`], pixels.
const PIXELS: u32 = 16;

/// Bits of the fraction of a vertex's position in the image, pixels: the rasterizer snaps vertices to 2ⁿ points a pixel along each axis.
///
/// Vulkan states it. On other APIs it is measured ([`drawn_subpixel_bits`]); where that fails it is the least allowed, 4.
pub(crate) fn subpixel_bits(device: &wgpu::Device, queue: &wgpu::Queue) -> u32 {
    let drawn = || drawn_subpixel_bits(device, queue).ok().flatten();
    at_least(stated(device).or_else(drawn))
}

/// Like [`subpixel_bits`], measured, for a browser, which cannot wait.
pub(crate) async fn measured_subpixel_bits(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<u32, GpuError> {
    let row = texels::<u8>(device, queue, &draw(device, queue, &SHADERS)?).await?;
    Ok(at_least(covered(&row)))
}

fn at_least(bits: Option<u32>) -> u32 {
    bits.unwrap_or(LEAST_SUBPIXEL_BITS).max(LEAST_SUBPIXEL_BITS)
}

/// `VkPhysicalDeviceLimits::subPixelPrecisionBits`; none on other APIs.
#[cfg(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd"))]
fn stated(device: &wgpu::Device) -> Option<u32> {
    // Safety: the handles are only read, while the device exists.
    unsafe {
        let device = device.as_hal::<wgpu::hal::api::Vulkan>()?;
        let instance = device.shared_instance().raw_instance();
        let properties = instance.get_physical_device_properties(device.raw_physical_device());
        Some(properties.limits.sub_pixel_precision_bits)
    }
}

#[cfg(not(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd")))]
fn stated(_: &wgpu::Device) -> Option<u32> {
    None
}

/// The subpixel bits of a device by a draw, 0 to 15: the first pixel of a row whose triangle covers its centre (`vertex_grid.wesl`). Waits
/// for the device. None if no pixel is covered, so that nothing is known.
///
/// An edge that is snapped to the nearest of 2ⁿ points a pixel covers a centre within half of 2⁻ⁿ. A grid that vertices are rounded down to
/// counts as one of n − 1 bits, which has the same greatest error.
pub fn drawn_subpixel_bits(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Option<u32>, GpuError> {
    drawn(device, queue, &SHADERS)
}

fn drawn(device: &wgpu::Device, queue: &wgpu::Queue, library: &ShaderLibrary) -> Result<Option<u32>, GpuError> {
    Ok(covered(&read_texture::<u8>(device, queue, &draw(device, queue, library)?)?))
}

/// The first covered pixel.
fn covered(row: &[u8]) -> Option<u32> {
    row.iter().position(|covered| *covered != 0).map(|bits| bits as u32)
}

/// Draws the row of pixels.
fn draw(device: &wgpu::Device, queue: &wgpu::Queue, library: &ShaderLibrary) -> Result<wgpu::Texture, GpuError> {
    let shader = library.link("vertex_grid", &[])?;
    let format = wgpu::TextureFormat::R8Unorm;
    let state = RasterState { targets: &[Some(format.into())], ..Default::default() };
    let pipeline = RasterPipeline::new(device, &shader, "vertex", "fragment", "vertex_grid", &state);
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("vertex_grid"),
        size: wgpu::Extent3d { width: PIXELS, height: 1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = texture.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    });
    pipeline.set(&mut pass);
    pass.draw(0..3 * PIXELS, 0..1);
    drop(pass);
    queue.submit([encoder.finish()]);
    Ok(texture)
}

#[cfg(all(test, feature = "testing"))]
mod tests {
    use super::*;
    use crate::testing;

    #[gpu_test]
    fn gpu_a_draw_finds_the_grid_that_the_adapter_states(gpu: &Gpu) {
        let drawn_by = |library: &ShaderLibrary| drawn(&gpu.device, &gpu.queue, library).unwrap();
        let found = drawn_by(&SHADERS).expect("the last pixel is covered");
        let stated = stated(&gpu.device);
        println!("{found} bits by a draw, {stated:?} by the adapter's limit");
        // The same without waiting: pending at first, and there when the device has drawn.
        let mut measured = std::pin::pin!(measured_subpixel_bits(&gpu.device, &gpu.queue));
        let context = &mut std::task::Context::from_waker(std::task::Waker::noop());
        assert!(measured.as_mut().poll(context).is_pending());
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        assert_eq!(pollster::block_on(measured).unwrap(), found.max(LEAST_SUBPIXEL_BITS));
        assert!(stated.is_none_or(|stated| found >= stated), "{found}, {stated:?}");
        assert_eq!(subpixel_bits(&gpu.device, &gpu.queue), stated.unwrap_or(found).max(LEAST_SUBPIXEL_BITS));
        // Coarser grids are found, whether vertices are rounded or cut off; an image without a covered pixel says nothing.
        let snapped = |by: &str| {
            let text = include_str!("vertex_grid.wesl").replace("corner.x)", &format!("{by})"));
            drawn_by(&ShaderLibrary::new(vec![("vertex_grid", &*text.leak())].leak()))
        };
        assert_eq!(snapped("round(16.0 * corner.x) / 16.0"), Some(4));
        assert_eq!(snapped("floor(16.0 * corner.x) / 16.0"), Some(3));
        assert_eq!(snapped("corner.x + 0.25"), None);
    }
}
