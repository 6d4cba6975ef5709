//! The techniques of the papers, for tests of the window with other techniques than the library's.

/// Makes them known.
pub fn know_papers() {
    lanternfish_papers::register();
}
