//! The command line, from words to files: one program, so that it is linked once.

mod bench_clustered;
mod bench_deep_images;
mod bench_history;
mod bench_indirect;
mod bench_moving;
mod bench_photons;
mod bench_quality;
mod bench_virtual_lights;
mod compare;
mod deep_images;
mod doctor;
mod hostile;
mod mistakes;
mod reference;
mod render;
mod replay;
mod results;
mod sequence;
mod shot;
mod support;
mod window;
