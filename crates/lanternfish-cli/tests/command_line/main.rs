//! Tests of the command line, from words to files, in one program, which is linked once.

mod compare;
mod doctor;
mod hostile;
mod mistakes;
mod outputs;
mod papers;
mod readme;
mod reference;
mod render;
mod replay;
mod results;
mod sequence;
mod shot;
mod support;
mod window;
