//! The library's notes for Python's `logging`, under the name `lanternfish`.
//!
//! Threads that hold no interpreter lock write them, so they wait in a list until a call of Python's thread hands them
//! over.

use std::{
    fmt::{Debug, Write},
    panic,
    sync::{Mutex, PoisonError},
};

use pyo3::prelude::*;
use tracing::{
    Event, Level, Metadata, Subscriber,
    field::{Field, Visit},
    span,
};

/// Level of Python's `logging`, and text.
static WAITING: Mutex<Vec<(u8, String)>> = Mutex::new(Vec::new());

const ERROR: u8 = 40;
pub const WARNING: u8 = 30;
pub const INFO: u8 = 20;

/// Adds a note.
pub fn note(level: u8, text: String) {
    WAITING.lock().unwrap_or_else(PoisonError::into_inner).push((level, text));
}

/// Hands the notes over to Python.
pub fn tell(py: Python<'_>) -> PyResult<()> {
    let waiting = std::mem::take(&mut *WAITING.lock().unwrap_or_else(PoisonError::into_inner));
    if waiting.is_empty() {
        return Ok(());
    }
    let logger = py.import("logging")?.call_method1("getLogger", ("lanternfish",))?;
    for (level, text) in waiting {
        logger.call_method1("log", (level, "%s", text))?;
    }
    Ok(())
}

/// Collects the library's notes, and messages of panics, which become exceptions.
pub fn install() {
    // Fails if the module is loaded a second time, by another interpreter.
    let _ = tracing::subscriber::set_global_default(Collector);
    panic::set_hook(Box::new(|info| note(ERROR, format!("a bug of Lanternfish: {info}"))));
}

struct Collector;

impl Subscriber for Collector {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= Level::INFO && metadata.target().starts_with("lanternfish")
    }

    fn event(&self, event: &Event<'_>) {
        let level = match *event.metadata().level() {
            Level::ERROR => ERROR,
            Level::WARN => WARNING,
            _ => INFO,
        };
        let mut text = Text(String::new());
        event.record(&mut text);
        note(level, text.0.trim().to_owned());
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}
    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}
    fn enter(&self, _: &span::Id) {}
    fn exit(&self, _: &span::Id) {}
}

/// The fields of an event: the message first, then `name=value`.
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        match field.name() {
            "message" => self.0.insert_str(0, &format!("{value:?} ")),
            name => drop(write!(self.0, "{name}={value:?} ")),
        }
    }
}
