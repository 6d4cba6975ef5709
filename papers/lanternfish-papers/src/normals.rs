//! Normals from depth, as [Elagabani2025, §4.3.1] compares them: texts that replace those of the library's shaders
//! ([`lanternfish::shaders::edit`]), because no image needs them.

use lanternfish::shaders::SHADERS;
use lanternfish_gpu::ShaderTexts;

/// `ray-culling improved` culls by naive normals: from two depths along each axis, the pixel's and the next one's (at
/// the far border the one before).
pub fn naive_normals() -> ShaderTexts {
    let nearer_side = |axis| format!("extrapolation_error(at, -{axis}) < extrapolation_error(at, {axis})");
    let far_border = |axis| format!("at.{axis} + 1 >= i32(view.size.{axis})");
    edited("shadows/normals", ["x", "y"].map(|axis| (nearer_side(axis), far_border(axis))))
}

/// `debug-view normal` shows the normals from depth that `ray-culling improved` culls by.
pub fn shown_normals_from_depth() -> ShaderTexts {
    let import = "import package::view::view::";
    let with_normals = format!("import package::shadows::normals::improved_normal;\n{import}");
    let normal = ("unpack_normal(texel)".to_owned(), "improved_normal(pixel)".to_owned());
    edited("debug_views/debug", [(import.to_owned(), with_normals), normal])
}

fn edited(module: &str, changes: [(String, String); 2]) -> ShaderTexts {
    let (_, text) = SHADERS.sources().iter().find(|(path, _)| *path == module).expect("the library has it");
    let text = changes.into_iter().fold((*text).to_owned(), |text, (before, after)| {
        assert_eq!(text.matches(&before).count(), 1, "{module}: {before}");
        text.replace(&before, &after)
    });
    ShaderTexts::from([(module.to_owned(), text)])
}
