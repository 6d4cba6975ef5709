//! Against what others measured, and pictures that others made.

mod pairs;
mod references;
