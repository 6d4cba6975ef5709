//! Compiled shaders and pipelines of a device, shared by its renderers.

mod kept;
#[cfg(all(test, feature = "testing"))]
mod tests;

use std::{
    cell::RefCell,
    collections::{BTreeSet, HashMap, HashSet},
    hash::{DefaultHasher, Hash, Hasher},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use self::kept::Kept;
use crate::{ComputeKernel, GpuError, LinkedShader, RasterPipeline, ShaderLibrary, ShaderTexts};

pub(crate) use self::kept::{Clones, Handed};

/// Pipelines of compute that an engine keeps though nobody uses them any more. More: more settings are gone back to at once, and more
/// memory waits, on Mesa's software adapter 0.9 MiB a pipeline. A way to find indirect light takes some 20 to 30.
const SPARE_KERNELS: usize = 64;
/// The same of drawing, 2.5 MiB each there. Other settings take some 5 to 10.
const SPARE_RASTERS: usize = 24;

/// A device, its queue, and the shaders and pipelines that have been compiled for them. Clones share it.
///
/// What is linked and compiled within [`Self::within`] is looked up here first, and kept: pipelines as long as they are in use, and of
/// those that are not, the 64 of compute and the 24 of drawing that were in use last; shaders as long as a pipeline of theirs. Who goes
/// back and forth between a few settings compiles nothing, and who goes through all of them does not hold the pipelines of all.
#[derive(Clone, Debug)]
pub struct Engine {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    compiled: Arc<Mutex<Compiled>>,
}

/// How much an engine has compiled so far: what was found in it is not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compilations {
    /// Shaders linked and validated.
    pub shaders: u64,
    /// Pipelines, of compute and of drawing.
    pub pipelines: u64,
}

/// How much an engine keeps now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeptCompiled {
    /// Linked shaders.
    pub shaders: usize,
    /// Pipelines of compute.
    pub kernels: usize,
    /// Pipelines of drawing.
    pub rasters: usize,
}

#[derive(Debug)]
struct Compiled {
    shaders: HashMap<ShaderKey, Arc<LinkedShader>>,
    kernels: Kept<ComputeKernel>,
    rasters: Kept<RasterPipeline>,
    /// Texts in the place of those of a library.
    edited: HashMap<usize, Arc<ShaderTexts>>,
    count: Compilations,
}

impl Compiled {
    /// The texts that stand in the place of files of a library and of its base.
    fn edited_of(&self, libraries: [Option<usize>; 2]) -> ShaderTexts {
        let of = |library: &usize| self.edited.get(library).map(|texts| (**texts).clone());
        libraries.iter().flatten().filter_map(of).flatten().collect()
    }
}

impl Default for Compiled {
    fn default() -> Self {
        Self {
            shaders: HashMap::new(),
            kernels: Kept::new(SPARE_KERNELS),
            rasters: Kept::new(SPARE_RASTERS),
            edited: HashMap::new(),
            count: Compilations::default(),
        }
    }
}

/// Where the sources of a library and of its base lie, which are static; a module and its features.
type ShaderKey = ([Option<usize>; 2], String);

/// What a pipeline is made of: the label of its shader and a hash of the linked text, its entry points and its own label, and its
/// state as `Debug` writes it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct PipelineKey {
    shader: String,
    text: u64,
    rest: String,
}

impl PipelineKey {
    pub fn new(shader: &LinkedShader, rest: &dyn std::fmt::Debug) -> Self {
        let mut hasher = DefaultHasher::new();
        shader.source.hash(&mut hasher);
        Self { shader: shader.label.clone(), text: hasher.finish(), rest: format!("{rest:?}") }
    }
}

/// The pipelines that some work has asked an engine for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Requested(BTreeSet<PipelineKey>);

thread_local! {
    /// The engine that the calling thread compiles for, and what it has been asked for.
    static CURRENT: RefCell<Option<(Engine, Requested)>> = const { RefCell::new(None) };
}

/// Puts back the engine that was there before, also where the work panics.
struct Before(Option<(Engine, Requested)>);

impl Drop for Before {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

impl Engine {
    /// One for which nothing has been compiled yet.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self { device: device.clone(), queue: queue.clone(), compiled: Arc::default() }
    }

    /// Runs `work`. What it links, and what it compiles for this device, in the calling thread, is taken from this engine, or kept in it.
    pub fn within<R>(&self, work: impl FnOnce() -> R) -> R {
        self.requested_within(work).0
    }

    /// The same, and which pipelines the work has asked for, whether or not they were there.
    pub fn requested_within<R>(&self, work: impl FnOnce() -> R) -> (R, Requested) {
        let _before = Before(CURRENT.replace(Some((self.clone(), Requested::default()))));
        let result = work();
        let requested = CURRENT.take().map(|(_, requested)| requested).unwrap_or_default();
        (result, requested)
    }

    /// How much it has compiled so far.
    pub fn compilations(&self) -> Compilations {
        self.compiled().count
    }

    /// How much it keeps now.
    pub fn kept(&self) -> KeptCompiled {
        let compiled = self.compiled();
        let Compiled { shaders, kernels, rasters, .. } = &*compiled;
        KeptCompiled { shaders: shaders.len(), kernels: kernels.len(), rasters: rasters.len() }
    }

    /// Drops everything: after an error, something that the device refused to compile may be among it. What is in use stays.
    pub fn forget(&self) {
        let mut compiled = self.compiled();
        let (count, edited) = (compiled.count, std::mem::take(&mut compiled.edited));
        *compiled = Compiled { count, edited, ..Compiled::default() };
    }

    /// Puts texts in the place of files of a library, and returns those that were in their place before. Shaders that are linked
    /// from now on are made of them; pipelines that are in use stay.
    pub fn edit(&self, library: &ShaderLibrary, texts: ShaderTexts) -> Arc<ShaderTexts> {
        let mut compiled = self.compiled();
        let number = library.number();
        compiled.shaders.retain(|(libraries, _), _| !libraries.contains(&Some(number)));
        compiled.edited.insert(number, Arc::new(texts)).unwrap_or_default()
    }

    fn compiled(&self) -> MutexGuard<'_, Compiled> {
        self.compiled.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The engine of the calling thread.
fn current() -> Option<Engine> {
    CURRENT.with_borrow(|current| current.as_ref().map(|(engine, _)| engine.clone()))
}

/// The shader of this label in a library, which `link` links of the texts that stand in for those of the library.
pub(crate) fn linked(
    libraries: [Option<usize>; 2],
    label: &str,
    link: impl FnOnce(&ShaderTexts) -> Result<LinkedShader, GpuError>,
) -> Result<Arc<LinkedShader>, GpuError> {
    let Some(engine) = current() else { return link(&ShaderTexts::new()).map(Arc::new) };
    let key = (libraries, label.to_owned());
    if let Some(known) = engine.compiled().shaders.get(&key) {
        return Ok(known.clone());
    }
    // Not under the lock: another thread may compile meanwhile, at worst the same.
    let edited = engine.compiled().edited_of(libraries);
    let shader = Arc::new(link(&edited)?);
    let mut compiled = engine.compiled();
    compiled.count.shaders += 1;
    // Other texts may have come meanwhile.
    if compiled.edited_of(libraries) == edited {
        compiled.shaders.insert(key, shader.clone());
    }
    Ok(shader)
}

/// The pipeline of compute that `compile` makes.
pub(crate) fn kernel(
    device: &wgpu::Device,
    key: impl FnOnce() -> PipelineKey,
    compile: impl FnOnce() -> ComputeKernel,
) -> ComputeKernel {
    of_engine(device, |compiled| &mut compiled.kernels, key, compile)
}

/// The pipeline of drawing that `compile` makes.
pub(crate) fn raster(
    device: &wgpu::Device,
    key: impl FnOnce() -> PipelineKey,
    compile: impl FnOnce() -> RasterPipeline,
) -> RasterPipeline {
    of_engine(device, |compiled| &mut compiled.rasters, key, compile)
}

fn of_engine<P: Handed>(
    device: &wgpu::Device,
    kept: impl Fn(&mut Compiled) -> &mut Kept<P>,
    key: impl FnOnce() -> PipelineKey,
    compile: impl FnOnce() -> P,
) -> P {
    let Some(engine) = current().filter(|engine| engine.device == *device) else { return compile() };
    let key = key();
    CURRENT.with_borrow_mut(|current| {
        if let Some((_, requested)) = current {
            requested.0.insert(key.clone());
        }
    });
    if let Some(known) = kept(&mut engine.compiled()).get(&key) {
        return known;
    }
    let pipeline = compile();
    let mut compiled = engine.compiled();
    compiled.count.pipelines += 1;
    let dropped = kept(&mut compiled).insert(key, pipeline.clone());
    if !dropped.is_empty() {
        // A shader goes with the last pipeline that is made of it.
        let Compiled { shaders, kernels, rasters, .. } = &mut *compiled;
        let (of_kernels, of_rasters) = (kernels.shaders(), rasters.shaders());
        let gone: HashSet<_> = dropped.iter().map(|key| key.shader.as_str()).collect();
        let is_gone = |label: &str| gone.contains(label) && !of_kernels.contains(label) && !of_rasters.contains(label);
        shaders.retain(|(_, label), _| !is_gone(label));
    }
    pipeline
}
