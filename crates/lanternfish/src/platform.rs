//! What differs in a browser (wasm32), where the program has one thread.

/// Runs `work` on another thread; in a browser at once.
pub fn in_background(work: impl FnOnce() + Send + 'static) {
    match cfg!(target_arch = "wasm32") {
        false => rayon::spawn(work),
        true => work(),
    }
}
