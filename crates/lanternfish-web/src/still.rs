//! One image.

use js_sys::Object;
use lanternfish_cli::opened::exposed;
use wasm_bindgen::prelude::*;
use web_sys::ImageData;

use crate::{
    session::{Session, Side},
    source::{Flags, Source},
};

/// Renders an image of a scene: the name of a generated one such as `demo:cornell`, the bytes of a GLB file, or a list of names and bytes
/// of files, whose first is the scene's or a shot's.
///
/// Options, all of which have a default: `width` and `height`, and every flag of `lanternfish render` that defines an image, by its name:
/// `quality`, `accumulate`, `indirect`, `lights`, `sun`, `eye`, `target` and so on.
#[wasm_bindgen]
pub async fn render(
    #[wasm_bindgen(unchecked_param_type = "string | Uint8Array | [string, Uint8Array][]")] source: JsValue,
    #[wasm_bindgen(unchecked_optional_param_type = "Record<string, string | number>")] options: Option<Object>,
) -> Result<ImageData, JsValue> {
    let shot = Source::of(&source)?.shot(&Flags::of(&options.unwrap_or_default())?)?;
    let (settings, size) = (shot.args.settings(), shot.args.output.size);
    let size = [size.width, size.height];
    let session = Session::open(shot, |_| ()).await?;
    let settings = exposed(settings, session.loaded.exposure);
    let count = settings.image.accumulate;
    let mut side = Side::new(&session, settings)?;
    let camera = &session.loaded.camera;
    // The lists get their capacity first, so that all frames of the mean are complete.
    side.frame(&session, camera, size).await?;
    if count > 1 {
        side.renderer.reset();
        for _ in 0..count {
            side.frame(&session, camera, size).await?;
        }
    }
    side.image(&session).await
}
