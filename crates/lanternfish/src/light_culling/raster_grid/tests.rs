use crate::shaders::constant;

#[test]
fn the_shaders_have_a_bit_and_an_invocation_a_layer() {
    assert_eq!(constant("light_culling/raster_grid/sort", "WORKGROUP"), f64::from(super::MOST_LAYERS));
}
