//! The renderer in a browser, with WebGPU: a program for wasm32, empty on other platforms. `cargo xtask web` builds it with its page.
//!
//! A browser answers only after the program has returned to it. So nothing here waits for the device: frames are recorded and polled,
//! and between two polls the browser runs.

#![cfg(target_arch = "wasm32")]

mod canvas;
mod device;
mod session;
mod source;
mod still;
mod turn;
mod viewer;

use wasm_bindgen::prelude::*;

pub use {source::settings, still::render, viewer::Viewer};

/// Makes all techniques known, and writes panics into the browser's console.
#[wasm_bindgen(start)]
pub fn start() {
    console_error_panic_hook::set_once();
    lanternfish_cli::paper::register();
}

/// An error for JavaScript.
fn failed(what: impl ToString) -> JsValue {
    js_sys::Error::new(&what.to_string()).into()
}
