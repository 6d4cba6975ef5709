//! Creation and readback of buffers and textures.

use std::{
    future::poll_fn,
    sync::{Arc, Mutex, PoisonError},
    task::{Poll, Waker},
};

use wgpu::util::DeviceExt;

use crate::{
    GpuError, made,
    platform::{CAN_WAIT, ErrorScope},
};

/// Usages of every storage buffer: shaders, uploads, clears, copies.
pub(crate) const STORAGE: wgpu::BufferUsages =
    wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_DST).union(wgpu::BufferUsages::COPY_SRC);

/// A zeroed storage buffer of at least `bytes`, rounded up to a multiple of 16 and at least 16.
///
/// Fails if the size exceeds the device's limit for a binding.
pub fn storage_buffer(device: &wgpu::Device, label: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
    let size = bytes.max(16).next_multiple_of(16);
    let limits = device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if size > limit {
        return Err(GpuError::TooLarge { what: label.to_owned(), needed: size, limit });
    }
    made::count(|made| made.buffers += 1);
    Ok(device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: STORAGE,
        mapped_at_creation: false,
    }))
}

/// A storage buffer with this content; `usage` is added to the usual ones. An empty slice gives one zeroed element (at least 16
/// bytes), because bindings cannot be empty. Fails if the content exceeds the device's limit for a binding.
pub fn storage_buffer_of<T: bytemuck::NoUninit>(
    device: &wgpu::Device,
    label: &str,
    content: &[T],
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    let bytes: &[u8] = bytemuck::cast_slice(content);
    let limits = device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if bytes.len() as u64 > limit {
        return Err(GpuError::TooLarge { what: label.to_owned(), needed: bytes.len() as u64, limit });
    }
    made::count(|made| made.buffers += 1);
    let zeros = vec![0; size_of::<T>().max(16)];
    let contents = if bytes.is_empty() { &zeros } else { bytes };
    Ok(device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents,
        usage: STORAGE | usage,
    }))
}

/// A storage buffer of three u32, zero at first, that [`Frame::dispatch_indirect`](crate::Frame::dispatch_indirect) can read.
pub fn indirect_buffer(device: &wgpu::Device, label: &str) -> wgpu::Buffer {
    made::count(|made| made.buffers += 1);
    let usage = STORAGE | wgpu::BufferUsages::INDIRECT;
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size: 16, usage, mapped_at_creation: false })
}

/// A uniform buffer with this content.
pub fn uniform_buffer_of<T: bytemuck::NoUninit>(device: &wgpu::Device, label: &str, content: &T) -> wgpu::Buffer {
    made::count(|made| made.buffers += 1);
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents: bytemuck::bytes_of(content),
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
    })
}

/// A view of all levels and layers of a new texture.
pub fn texture_of(device: &wgpu::Device, wanted: &wgpu::TextureDescriptor<'_>) -> wgpu::TextureView {
    made::count(|made| made.textures += 1);
    device.create_texture(wanted).create_view(&Default::default())
}

/// Waits for the device and copies the first `count` elements of a buffer.
pub fn read_back<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
    count: usize,
) -> Result<Vec<T>, GpuError> {
    let bytes = (count * size_of::<T>()) as u64;
    if bytes == 0 {
        return Ok(Vec::new());
    }
    made::count(|made| made.buffers += 1);
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read_back"),
        size: bytes.next_multiple_of(4),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes.next_multiple_of(4));
    queue.submit([encoder.finish()]);
    with_mapped(device, &staging, |data| bytemuck::pod_collect_to_vec(&data[..bytes as usize]))
}

/// Maximum size of the staging buffer for texture readback, bytes; it always holds at least one row.
const READ_BYTES: u64 = 64 << 20;

/// Waits for the device and copies level 0 of a 2D texture, rows tightly packed.
///
/// `texture` must allow `COPY_SRC`, and a texel must have the size of `T`.
pub fn read_texture<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
) -> Result<Vec<T>, GpuError> {
    let size = texture.size();
    let row = size.width * size_of::<T>() as u32;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    made::count(|made| made.buffers += 1);
    let chunk_rows = ((READ_BYTES / u64::from(padded)).max(1) as u32).min(size.height);
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read_texture"),
        size: u64::from(padded) * u64::from(chunk_rows),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut texels = Vec::with_capacity(size.width as usize * size.height as usize);
    for first in (0..size.height).step_by(chunk_rows as usize) {
        let rows = chunk_rows.min(size.height - first);
        let mut encoder = device.create_command_encoder(&Default::default());
        let origin = wgpu::Origin3d { x: 0, y: first, z: 0 };
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo { origin, ..texture.as_image_copy() },
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None },
            },
            wgpu::Extent3d { height: rows, ..size },
        );
        queue.submit([encoder.finish()]);
        with_mapped(device, &staging, |data| {
            for padded_row in data.chunks_exact(padded as usize).take(rows as usize) {
                texels.extend(bytemuck::pod_collect_to_vec::<u8, T>(&padded_row[..row as usize]));
            }
        })?;
        staging.unmap();
    }
    Ok(texels)
}

/// Like [`read_texture`], without waiting: the texels come once the device has them, and the program runs meanwhile, in a browser or
/// where something else polls the device.
pub async fn texels<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
) -> Result<Vec<T>, GpuError> {
    let row = texture.width() * size_of::<T>() as u32;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    made::count(|made| made.buffers += 1);
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("texels"),
        size: u64::from(padded) * u64::from(texture.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &staging, layout };
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
    queue.submit([encoder.finish()]);
    // What the device said, and whom to wake then.
    let told = Arc::new(Mutex::new((None, None::<Waker>)));
    let teller = told.clone();
    staging.map_async(wgpu::MapMode::Read, .., move |result| {
        let mut told = teller.lock().unwrap_or_else(PoisonError::into_inner);
        told.0 = Some(result);
        told.1.take().into_iter().for_each(Waker::wake);
    });
    let mapped = poll_fn(|context| {
        let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
        told.1 = Some(context.waker().clone());
        told.0.take().map_or(Poll::Pending, Poll::Ready)
    });
    let fail = |source: Box<dyn std::error::Error + Send + Sync>| GpuError::ReadBack { what: "texels".into(), source };
    mapped.await.map_err(|error| fail(error.into()))?;
    let data = staging.get_mapped_range(..).map_err(|error| fail(error.into()))?;
    let rows = data.chunks_exact(padded as usize);
    Ok(rows.flat_map(|padded| bytemuck::pod_collect_to_vec::<u8, T>(&padded[..row as usize])).collect())
}

/// Runs `work` and turns validation and out-of-memory errors of the device into a `Result` instead of a panic. In a browser, which
/// cannot wait for them, they go to the handler of uncaptured errors.
pub fn checked<R, E: From<GpuError>>(
    device: &wgpu::Device,
    what: &str,
    work: impl FnOnce() -> Result<R, E>,
) -> Result<R, E> {
    let validation = ErrorScope::new(device, wgpu::ErrorFilter::Validation);
    let memory = ErrorScope::new(device, wgpu::ErrorFilter::OutOfMemory);
    let result = work();
    let memory = memory.end();
    let validation = validation.end();
    match memory.or(validation) {
        Some(source) => Err(GpuError::Refused { what: what.to_owned(), source: Box::new(source) }.into()),
        None => result,
    }
}

/// True if two handles refer to the same device.
///
/// wgpu numbers devices per instance, so handles of two instances' devices may compare equal. This function provokes an error on one
/// device and checks whose error scope receives it. A lost device reports no errors and counts as the same; the next call on it reports
/// the loss.
pub fn is_same_device(a: &wgpu::Device, b: &wgpu::Device) -> bool {
    if a != b || !CAN_WAIT {
        return a == b;
    }
    let of_a = ErrorScope::new(a, wgpu::ErrorFilter::Validation);
    let of_b = ErrorScope::new(b, wgpu::ErrorFilter::Validation);
    let usage = wgpu::BufferUsages::empty();
    let refused = wgpu::BufferDescriptor { label: Some("of no use"), size: 4, usage, mapped_at_creation: false };
    let _ = a.create_buffer(&refused);
    of_b.end();
    of_a.end().is_none()
}

/// True if a device is lost. A lost device silently ignores commands, so this function provokes an error and checks that none is reported.
/// A browser tells it later, in the report of a frame; this function is false there.
pub fn is_lost(device: &wgpu::Device) -> bool {
    if !CAN_WAIT {
        return false;
    }
    let scope = ErrorScope::new(device, wgpu::ErrorFilter::Validation);
    let usage = wgpu::BufferUsages::empty();
    let refused = wgpu::BufferDescriptor { label: Some("of no use"), size: 4, usage, mapped_at_creation: false };
    let _ = device.create_buffer(&refused);
    scope.end().is_none()
}

/// Waits for the device, maps a buffer, and passes its content to `read`.
pub(crate) fn with_mapped<R>(
    device: &wgpu::Device,
    staging: &wgpu::Buffer,
    read: impl FnOnce(&[u8]) -> R,
) -> Result<R, GpuError> {
    let fail = |source: Box<dyn std::error::Error + Send + Sync>| GpuError::ReadBack { what: "buffer".into(), source };
    if !CAN_WAIT {
        return Err(GpuError::Waits { what: "a buffer" });
    }
    let (sender, receiver) = std::sync::mpsc::channel();
    staging.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver is dropped only if polling failed, which is reported below.
        let _ = sender.send(result);
    });
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| fail(e.into()))?;
    receiver.recv().map_err(|e| fail(e.into()))?.map_err(|e| fail(e.into()))?;
    let data = staging.get_mapped_range(..).map_err(|e| fail(e.into()))?;
    Ok(read(&data))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AdapterChoice, Gpu, testing};

    #[gpu_test]
    fn gpu_devices_are_distinguished_even_when_lost(gpu: &Gpu) {
        // A device of another instance. The first device of every instance has the same number.
        let other = Gpu::open(&AdapterChoice::Auto).unwrap();
        assert!(
            is_same_device(&gpu.device, &gpu.device.clone()) && is_same_device(&other.device, &other.device.clone())
        );
        assert!(!is_same_device(&gpu.device, &other.device) && !is_same_device(&other.device, &gpu.device));
        assert!(!is_lost(&other.device));
        other.device.destroy();
        assert!(is_lost(&other.device) && !is_lost(&gpu.device));
        assert!(is_same_device(&other.device, &other.device.clone()), "a lost device differs from itself");
        assert!(!is_same_device(&gpu.device, &other.device), "a lost device equals another one");
    }
}
