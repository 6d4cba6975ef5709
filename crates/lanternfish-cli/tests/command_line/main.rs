//! The command line, from words to files: one program, so that it is linked once.

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
