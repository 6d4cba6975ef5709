//! Tests of the window with other techniques than the library's.

/// Makes the techniques of the papers known.
pub fn know_papers() {
    lanternfish_papers::register();
}
