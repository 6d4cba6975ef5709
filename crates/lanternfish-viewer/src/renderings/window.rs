//! The window of image files.

use std::{path::Path, time::Duration};

use egui::Vec2;
use lanternfish_gpu::Gpu;
use winit::{
    event_loop::{ActiveEventLoop, OwnedDisplayHandle},
    window::Window,
};

use super::{
    ImageReader, RenderedImages,
    panel::{self, Difference, Requested, State},
    shown::Look,
};
use crate::{
    ViewerError, difference,
    events::{self, Program},
    surface::{self, Registered, Surface},
    texture::{texture, write},
    wipe::Textures,
};

/// Period of polls while a comparison is in progress.
const POLL_PERIOD: Duration = Duration::from_millis(30);

/// Opens a window on at least one image, and returns when it is closed.
pub fn run(start: RenderedImages) -> Result<(), ViewerError> {
    events::run::<Shown>(start)
}

/// An open window.
struct Shown {
    surface: Surface,
    gpu: Gpu,
    state: State,
    read: ImageReader,
    /// A, B, and their difference map, registered with egui.
    registered: [Registered; 3],
    /// The textures of A and B, with their image's index and look.
    sides: [Option<(wgpu::TextureView, (usize, Look))>; 2],
    difference: difference::Difference,
    /// The last compared pair.
    compared: Option<[(usize, Look); 2]>,
    /// The difference map and mean of the last compared pair.
    result: Option<(wgpu::TextureView, f32)>,
}

impl Program for Shown {
    type Start = RenderedImages;

    fn open(
        events: &ActiveEventLoop,
        display: &OwnedDisplayHandle,
        start: RenderedImages,
    ) -> Result<Self, ViewerError> {
        let RenderedImages { renderings, exposure, tone_map, size: [width, height], adapter, read } = start;
        let attributes = Window::default_attributes()
            .with_title(format!("{} – Lanternfish", renderings.first().map_or("", |rendering| &rendering.name)))
            .with_inner_size(winit::dpi::LogicalSize::new(width, height));
        let (surface, gpu) = surface::open(events, display, attributes, &adapter)?;
        Ok(Self {
            surface,
            gpu,
            state: State::new(renderings, exposure, tone_map),
            read,
            registered: [const { None }; 3],
            sides: [const { None }; 2],
            difference: difference::Difference::default(),
            compared: None,
            result: None,
        })
    }

    fn surface(&mut self) -> (&mut Surface, &wgpu::Device) {
        (&mut self.surface, &self.gpu.device)
    }

    fn dropped(&mut self, path: &Path) {
        match (self.read)(path) {
            Ok(renderings) => {
                self.state.add(renderings);
                self.state.message.clear();
            }
            Err(what) => self.state.message = what,
        }
    }

    fn frame(&mut self) -> bool {
        self.show().close
    }

    fn has_news(&mut self) -> bool {
        self.poll()
    }

    fn look_again(&self) -> Option<Duration> {
        self.difference.is_working().then_some(POLL_PERIOD)
    }
}

impl Shown {
    /// Polls the comparison. Returns true if it has ended.
    fn poll(&mut self) -> bool {
        let Some(compared) = self.difference.poll() else { return false };
        match compared {
            Ok(compared) => {
                let map = texture(&self.gpu.device, compared.size);
                write(&self.gpu.queue, &map, &compared.map);
                self.result = Some((map, compared.mean));
            }
            Err(what) => self.state.message = what,
        }
        true
    }

    /// The requested image index and look of each side.
    fn requested(&self) -> [Option<(usize, Look)>; 2] {
        let State { renderings, a, b, look, .. } = &self.state;
        // Exposure affects only radiance images.
        let of = |index: usize| (index, if renderings[index].is_radiance { *look } else { Look::PLAIN });
        [Some(of(*a)), b.map(of)]
    }

    /// Uploads the requested images, and starts their comparison.
    fn upload(&mut self) {
        let requested = self.requested();
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        for (side, requested) in self.sides.iter_mut().zip(requested) {
            if side.as_ref().map(|(_, of)| *of) == requested {
                continue;
            }
            *side = None;
            let Some((index, look)) = requested else { continue };
            let rendering = &self.state.renderings[index];
            if rendering.size().max_element() > most {
                self.state.message =
                    format!("{}: this adapter supports images of at most {most} pixels per side", rendering.name);
                continue;
            }
            let view = texture(&self.gpu.device, rendering.size());
            write(&self.gpu.queue, &view, rendering.bytes(look).as_flattened());
            *side = Some((view, (index, look)));
        }
        let two = match requested {
            [Some(a), Some(b)] if self.are_comparable() => Some([a, b]),
            _ => None,
        };
        if two == self.compared {
            return;
        }
        self.compared = two;
        self.result = None;
        self.difference.stop();
        if let Some([a, b]) = two {
            let bytes = |(index, look): (usize, Look)| self.state.renderings[index].bytes(look);
            self.difference.compare(bytes(a), bytes(b), self.state.renderings[a.0].size());
        }
    }

    fn are_comparable(&self) -> bool {
        let State { renderings, a, b, .. } = &self.state;
        b.is_some_and(|b| renderings[b].size() == renderings[*a].size())
    }

    fn show(&mut self) -> Requested {
        self.poll();
        self.upload();
        let ratio = self.surface.context().pixels_per_point();
        let size = self.state.renderings[self.state.a].size().as_vec2();
        let viewport = self.surface.context().content_rect();
        // Enlarged pixels are shown as squares.
        let filter = match ratio * self.state.place.zoom(viewport, Vec2::new(size.x, size.y)) > 1.0 {
            true => wgpu::FilterMode::Nearest,
            false => wgpu::FilterMode::Linear,
        };
        let map = self.result.as_ref().map(|(map, _)| map);
        let [a, b] = self.sides.each_ref().map(|side| side.as_ref().map(|(view, _)| view));
        for (registered, texture) in self.registered.iter_mut().zip([a, b, map]) {
            self.surface.register(&self.gpu.device, registered, texture, filter);
        }
        let [a, b, map] = self.registered.each_ref().map(|registered| registered.as_ref().map(|(id, ..)| *id));
        let difference = match (&self.result, self.state.b) {
            (_, None) => Difference::OfOne,
            (Some((_, mean)), _) => Difference::Mean(*mean),
            _ if self.are_comparable() => Difference::Pending,
            _ => Difference::Sizes,
        };
        let Self { state, surface, gpu, .. } = self;
        let mut requested = Requested::default();
        let output = surface.panels(|ui| {
            let now = panel::show(ui, state, &Textures { a, b, map }, difference);
            requested.close |= now.close;
        });
        surface.paint(gpu, output);
        requested
    }
}
