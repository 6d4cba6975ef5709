//! The program around a window: events of the system, and when the next frame is due.

use std::time::Instant;

use winit::{
    application::ApplicationHandler,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle},
    window::WindowId,
};

use super::Viewer;
use crate::{Start, ViewerError, record::Recorder, source_tree};

/// Opens the window, and returns when it is closed.
pub fn run(start: Start) -> Result<(), ViewerError> {
    let events = EventLoop::new().map_err(|error| ViewerError::Display(error.to_string()))?;
    let mut app = App { display: events.owned_display_handle(), start: Some(start), open: None, failed: None };
    events.run_app(&mut app).map_err(|error| ViewerError::Display(error.to_string()))?;
    app.failed.map_or(Ok(()), Err)
}

/// The program, before and while its window is open.
struct App {
    display: OwnedDisplayHandle,
    start: Option<Start>,
    open: Option<Viewer>,
    failed: Option<ViewerError>,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match Viewer::new(events, &self.display, start) {
            Ok(viewer) => self.open = Some(viewer),
            Err(error) => {
                self.failed = Some(error);
                events.exit();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(viewer) = &mut self.open else { return };
        let response = viewer.input.on_window_event(&viewer.surface.window, &event);
        // That it is to be painted is no reason to paint it again.
        if response.repaint && event != WindowEvent::RedrawRequested {
            viewer.surface.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                viewer.surface.configure(&viewer.seen.gpu.device)
            }
            WindowEvent::DroppedFile(path) => viewer.open_file(&path),
            WindowEvent::RedrawRequested if viewer.frame().close => events.exit(),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(viewer) = &mut self.open else { return };
        let is_news = viewer.read_shaders() | viewer.poll();
        let only_gets_better = viewer.only_gets_better();
        let is_asked_for = viewer.repaint_at.take_if(|at| *at <= Instant::now()).is_some();
        if is_news || is_asked_for || viewer.has_more() && !only_gets_better {
            viewer.surface.window.request_redraw();
        } else if only_gets_better {
            viewer.look_from_above();
            viewer.draw_both(0.0);
        }
        let works = viewer.has_more() || viewer.is_busy() || viewer.beside.is_working();
        let looks =
            if works { Some(viewer.look_again()) } else { viewer.shaders.as_ref().map(|_| source_tree::PERIOD) };
        let looks_at = looks.map(|period| Instant::now() + period);
        let next = looks_at.into_iter().chain(viewer.repaint_at).min();
        events.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        self.open.iter().for_each(Viewer::leave);
        // The surface goes before the display that it is of.
        let recorder = self.open.take().and_then(|viewer| viewer.recorder);
        if let Some(Err(what)) = recorder.map(Recorder::end) {
            self.failed = Some(ViewerError::Record(what));
        }
    }
}
