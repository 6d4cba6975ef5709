//! One image.

use js_sys::Object;
use wasm_bindgen::prelude::*;
use web_sys::ImageData;

use crate::{options::Options, session::Session};

/// Renders an image of a scene: the name of a generated one such as `demo:cornell`, the bytes of a GLB file, or a list of names and bytes
/// of files, whose first is the scene's.
///
/// Options, all of which have a default: `width`, `height` (96), `camera` (0, an index), `quality` (`good`), and every setting of the
/// library by its name: `accumulate`, `indirect`, `exposure` and so on.
#[wasm_bindgen]
pub async fn render(
    #[wasm_bindgen(unchecked_param_type = "string | Uint8Array | [string, Uint8Array][]")] source: JsValue,
    #[wasm_bindgen(unchecked_optional_param_type = "Record<string, string | number>")] options: Option<Object>,
) -> Result<ImageData, JsValue> {
    let options = Options::of(&options.unwrap_or_default())?;
    let settings = options.settings()?;
    let count = settings.image.accumulate;
    let mut session = Session::open(&source, settings, |_| ()).await?;
    let size @ [width, height] = options.size;
    let usual = || session.scene.default_camera(width as f32 / height as f32);
    let camera = session.scene.cameras.get(options.camera).cloned().unwrap_or_else(usual);
    // The lists get their capacity first, so that all frames of the mean are complete.
    session.frame(&camera, size).await?;
    if count > 1 {
        session.reset();
        for _ in 0..count {
            session.frame(&camera, size).await?;
        }
    }
    session.image().await
}
