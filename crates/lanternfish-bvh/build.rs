//! See `lanternfish-build`.

fn main() {
    lanternfish_build::write_shaders();
}
