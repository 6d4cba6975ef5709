//! Light culling with a raster grid.

pub mod raster_grid;
#[cfg(test)]
mod tests;
