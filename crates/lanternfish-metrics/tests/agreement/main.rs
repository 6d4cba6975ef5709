//! Comparison with other implementations, and with reference images.

mod pairs;
mod references;
