//! Transient textures that frames reuse.

use std::collections::HashMap;

use super::HostMemory;
use crate::texture_of;

/// The requested descriptor, with its label.
type Key = wgpu::wgt::TextureDescriptor<Option<String>, Vec<wgpu::TextureFormat>>;

#[derive(Debug)]
struct Slot {
    view: wgpu::TextureView,
    /// The last frame that used it.
    last_frame: u64,
    /// The rest of that frame does not need it.
    is_released: bool,
}

#[derive(Debug, Default)]
pub(crate) struct Textures {
    slots: HashMap<Key, Vec<Slot>>,
    frame: u64,
}

impl Textures {
    /// A view of all levels and layers of a texture with undefined content at first. `memory` counts a new one.
    pub fn get(
        &mut self,
        device: &wgpu::Device,
        memory: &mut HostMemory,
        wanted: &wgpu::TextureDescriptor<'_>,
    ) -> wgpu::TextureView {
        let key = wanted.map_label_and_view_formats(|label| label.map(str::to_owned), |formats| formats.to_vec());
        let bytes = bytes_of(&key);
        let slots = self.slots.entry(key).or_default();
        if let Some(slot) = slots.iter_mut().find(|slot| slot.last_frame < self.frame || slot.is_released) {
            slot.last_frame = self.frame;
            slot.is_released = false;
            return slot.view.clone();
        }
        // The frame fails before it runs ([`HostMemory::check`]), and until then a texture takes no memory.
        let _ = memory.take(wanted.label.unwrap_or_default(), bytes);
        let view = texture_of(device, wanted);
        slots.push(Slot { view: view.clone(), last_frame: self.frame, is_released: false });
        view
    }

    pub fn release(&mut self, view: &wgpu::TextureView) {
        let slot = self.slots.values_mut().flatten().find(|slot| slot.view == *view);
        slot.expect("a texture of the pool").is_released = true;
    }

    pub fn begin(&mut self, frame: u64, oldest: u64) {
        self.frame = frame;
        self.slots.retain(|_, slots| {
            slots.retain(|slot| slot.last_frame >= oldest);
            !slots.is_empty()
        });
    }

    pub fn bytes(&self) -> u64 {
        self.slots.iter().map(|(key, slots)| bytes_of(key) * slots.len() as u64).sum()
    }
}

fn bytes_of(texture: &Key) -> u64 {
    let texel = texture.format.block_copy_size(None).unwrap_or(0);
    let wgpu::Extent3d { width, height, depth_or_array_layers } = texture.size;
    let texels = u64::from(width) * u64::from(height) * u64::from(depth_or_array_layers);
    texels * u64::from(texel) * u64::from(texture.sample_count)
}
