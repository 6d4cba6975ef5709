//! The loop around a window, whichever it is: events of the system, and when the next frame is due.
//!
//! ```text
//! system ─▶ App ─▶ Program: frame, news, go on     surface.rs: what is typed, when the panels want to be painted again
//! ```

use std::{
    path::Path,
    time::{Duration, Instant},
};

use winit::{
    application::ApplicationHandler,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle},
    window::WindowId,
};

use crate::{ViewerError, surface::Surface};

/// What an open window answers.
pub trait Program: Sized {
    /// What it shows first.
    type Start;

    /// Opens it.
    fn open(events: &ActiveEventLoop, display: &OwnedDisplayHandle, start: Self::Start) -> Result<Self, ViewerError>;

    /// What it is painted on, and the device that paints.
    fn surface(&mut self) -> (&mut Surface, &wgpu::Device);

    /// Takes a file that was dropped on it. It is painted after that.
    fn dropped(&mut self, path: &Path);

    /// RepaintLimiter it: whether it is to be closed.
    fn frame(&mut self) -> bool;

    /// Asks what works for it, without waiting: whether it is to be painted because of that.
    fn has_news(&mut self) -> bool;

    /// Does what is next where it is not painted.
    fn go_on(&mut self) {}

    /// How long it is until it is requested news again; none: until something happens.
    fn look_again(&self) -> Option<Duration>;

    /// Ends it.
    fn close(self) -> Result<(), ViewerError> {
        Ok(())
    }
}

/// Opens a window, and returns when it is closed.
pub fn run<T: Program>(start: T::Start) -> Result<(), ViewerError> {
    let events = EventLoop::new().map_err(|error| ViewerError::Display(error.to_string()))?;
    let mut app = App::<T> { display: events.owned_display_handle(), start: Some(start), open: None, failed: None };
    events.run_app(&mut app).map_err(|error| ViewerError::Display(error.to_string()))?;
    app.failed.map_or(Ok(()), Err)
}

/// The program, before and while its window is open.
struct App<T: Program> {
    display: OwnedDisplayHandle,
    start: Option<T::Start>,
    open: Option<T>,
    failed: Option<ViewerError>,
}

impl<T: Program> ApplicationHandler for App<T> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match T::open(events, &self.display, start) {
            Ok(open) => self.open = Some(open),
            Err(error) => {
                self.failed = Some(error);
                events.exit();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        let (surface, device) = open.surface();
        // That it is to be painted is no reason to paint it again.
        if surface.takes(&event) && event != WindowEvent::RedrawRequested {
            surface.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => surface.configure(device),
            WindowEvent::DroppedFile(path) => {
                surface.window.request_redraw();
                open.dropped(&path);
            }
            WindowEvent::RedrawRequested if open.frame() => events.exit(),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(open) = &mut self.open else { return };
        let is_news = open.has_news();
        let (surface, _) = open.surface();
        if surface.is_due() | is_news {
            surface.window.request_redraw();
        } else {
            open.go_on();
        }
        let looks_at = open.look_again().map(|period| Instant::now() + period);
        let next = looks_at.into_iter().chain(open.surface().0.repaint_at()).min();
        events.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The surface goes before the display that it is of.
        if let Some(Err(error)) = self.open.take().map(T::close) {
            self.failed = Some(error);
        }
    }
}
