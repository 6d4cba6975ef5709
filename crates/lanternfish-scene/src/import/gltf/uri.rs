//! Resolution of URIs: embedded bytes, or a file next to the scene.

use std::path::Path;

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::fault::{Fault, Result, invalid};
use crate::import::files::Files;

/// Padding is optional, as some exporters omit it.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes that `uri` holds (`data:`) or names (a path relative to the scene's folder, percent-encoded).
///
/// Nothing is fetched from a network. Absolute paths and anything but regular files are refused.
pub(super) fn read(uri: &str, files: &Files) -> Result<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        files.budget.take(data.len() as u64, || "a data URI needs".to_owned())?;
        return read_data(data);
    }
    if has_scheme(uri) {
        return Err(Fault::Unsupported(format!("a file elsewhere, {uri}")));
    }
    let name = percent_decode_str(uri).decode_utf8().map_err(|_| invalid(format!("uri {uri}: not UTF-8")))?;
    let name = Path::new(name.as_ref());
    if name.has_root() || name.as_os_str().is_empty() {
        return Err(invalid(format!("uri {uri:?}: not a path relative to the scene's")));
    }
    files.named(name).map_err(|error| Fault::of_file(error, files.path(name)))
}

fn read_data(data: &str) -> Result<Vec<u8>> {
    let (kind, text) = data.split_once(',').ok_or_else(|| invalid("data URI: no comma"))?;
    if kind.ends_with(";base64") {
        // The base64 alphabet has no %, but its =, + and / may be percent-encoded.
        let bytes: std::borrow::Cow<[u8]> = percent_decode_str(text).into();
        BASE64.decode(bytes).map_err(|error| invalid(format!("data URI: {error}")))
    } else {
        Ok(percent_decode_str(text).collect())
    }
}

/// True if `uri` starts with `scheme:`. One letter is a drive, not a scheme.
fn has_scheme(uri: &str) -> bool {
    uri.split_once(':').is_some_and(|(scheme, _)| {
        scheme.len() > 1 && scheme.bytes().all(|c| c.is_ascii_alphanumeric() || b"+-.".contains(&c))
    })
}
