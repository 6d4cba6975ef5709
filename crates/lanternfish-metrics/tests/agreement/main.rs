//! Comparison with other implementations.

mod pairs;
