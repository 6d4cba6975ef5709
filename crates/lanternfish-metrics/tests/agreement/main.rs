//! Against what others measured, and images that others made.

mod pairs;
mod references;
