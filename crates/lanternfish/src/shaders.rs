//! The library's shaders, and every variant of them that a room can ask for.

use lanternfish_gpu::ShaderLibrary;

/// Every `.wesl` file of this crate; a module's path is its file's.
pub const SHADERS: ShaderLibrary = ShaderLibrary::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs")));

/// What a constant of a shader is written as, without its suffix; for tests that compare it with the host's.
///
/// Panics when the module declares no such constant.
#[cfg(test)]
pub(crate) fn constant(module: &str, name: &str) -> f64 {
    let text = SHADERS.sources().iter().find(|(path, _)| *path == module).map(|(_, text)| *text);
    let text = text.unwrap_or_else(|| panic!("no shader {module}"));
    let start = format!("const {name} = ");
    let line = text.lines().find_map(|line| line.strip_prefix(&start));
    let value = line.and_then(|line| line.split(';').next()).unwrap_or_else(|| panic!("{module}: no constant {name}"));
    let digits = value.trim_end_matches('u');
    let number = match digits.strip_prefix("0x") {
        Some(hexadecimal) => u32::from_str_radix(hexadecimal, 16).ok().map(f64::from),
        None => digits.parse().ok(),
    };
    number.unwrap_or_else(|| panic!("{module}: {name} = {value} is not a number"))
}

#[cfg(test)]
mod tests;
