//! What an upload makes of a scene: geometry, materials, textures and lights, and the requirements that choose among them.

pub mod cost;
pub mod geometry;
pub mod light_unit;
pub mod lights;
pub mod lobes;
pub mod materials;
pub mod mips;
pub mod needs;
pub mod parts;
pub mod textures;
