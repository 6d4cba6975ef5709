//! The event loop of the window: system events, and the time of the next frame.
//!
//! ```text
//! system ─▶ App ─▶ Viewer: frame, news, go on     surface.rs: input, time of the next repaint
//! ```

use std::time::Instant;

use winit::{
    application::ApplicationHandler,
    error::EventLoopError,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle},
    window::WindowId,
};

use super::Viewer;
use crate::{Start, ViewerError};

/// Opens the window, and returns when it is closed.
pub fn run(start: Start) -> Result<(), ViewerError> {
    let no_display = |error: EventLoopError| ViewerError::Display(without_place(&error.to_string()).to_owned());
    let events = EventLoop::new().map_err(no_display)?;
    let mut app = App { display: events.owned_display_handle(), start: Some(start), open: None, failed: None };
    events.run_app(&mut app).map_err(no_display)?;
    app.failed.map_or(Ok(()), Err)
}

/// An error of the system without the place in winit's source that found it: `os error at FILE.rs:LINE: TEXT`.
fn without_place(error: &str) -> &str {
    let place_and_text = error.strip_prefix("os error at ").and_then(|rest| rest.split_once(".rs:"));
    place_and_text
        .and_then(|(_, line_and_text)| line_and_text.split_once(": "))
        .map_or(error, |(_, text)| text)
        .trim_end_matches('.')
}

#[cfg(test)]
#[test]
fn errors_of_the_system_name_no_file_of_the_builder() {
    let found = "os error at /home/someone/winit-0.30/src/platform_impl/linux/mod.rs:764: neither DISPLAY is set.";
    assert_eq!(without_place(found), "neither DISPLAY is set");
    assert_eq!(without_place("the event loop was created twice"), "the event loop was created twice");
}

/// The application, before and while its window is open.
struct App {
    display: OwnedDisplayHandle,
    start: Option<Start>,
    open: Option<Viewer>,
    failed: Option<ViewerError>,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match Viewer::open(events, &self.display, start) {
            Ok(open) => self.open = Some(open),
            Err(error) => {
                self.failed = Some(error);
                events.exit();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        let (surface, device) = (&mut open.surface, &open.viewport.interface().device);
        // A redraw event must not request another redraw.
        if surface.takes(&event) && event != WindowEvent::RedrawRequested {
            surface.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => surface.configure(device),
            WindowEvent::DroppedFile(path) => {
                surface.window.request_redraw();
                open.open_file(&path);
            }
            WindowEvent::RedrawRequested if open.show().close => events.exit(),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(open) = &mut self.open else { return };
        let is_news = open.has_news();
        if open.surface.is_due() | is_news {
            open.surface.window.request_redraw();
        } else {
            open.go_on();
        }
        let looks_at = open.look_again().map(|period| Instant::now() + period);
        let next = looks_at.into_iter().chain(open.surface.repaint_at()).min();
        events.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The surface must be dropped before its display.
        if let Some(Err(error)) = self.open.take().map(Viewer::close) {
            self.failed = Some(error);
        }
    }
}
