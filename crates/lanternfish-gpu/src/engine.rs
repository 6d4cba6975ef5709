//! Compiled shaders and pipelines of a device, shared by its renderers.

mod pipeline_cache;
#[cfg(all(test, feature = "testing"))]
mod tests;

use std::{
    cell::RefCell,
    collections::{BTreeSet, HashMap, HashSet},
    hash::{DefaultHasher, Hash, Hasher},
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
};

use self::pipeline_cache::PipelineCache;
use crate::{ComputeKernel, GpuError, LinkedShader, RasterPipeline, ShaderLibrary, ShaderTexts, vertex_grid};

pub(crate) use self::pipeline_cache::{CloneCount, Pipeline};

/// Maximum number of unused compute pipelines in an engine. A higher limit avoids more recompilation when settings
/// change back, and holds more memory: 0.9 MiB a pipeline on Mesa's software adapter. An indirect-light technique has
/// 20 to 30 of them.
const SPARE_KERNELS: usize = 64;
/// Maximum number of unused render pipelines: 2.5 MiB each on Mesa's software adapter. A change of settings needs 5 to
/// 10 of them.
const SPARE_RASTERS: usize = 24;

/// A device, its queue, and a cache of the shaders and pipelines compiled for them. Clones share the cache.
///
/// Work within [`Self::within`] takes shaders and pipelines from the cache and adds those that are missing. The cache
/// holds all pipelines in use, and the 64 compute and 24 render pipelines that were used last. A shader stays as long
/// as one of its pipelines. So switching between a few settings compiles nothing, and memory stays bounded when a user
/// tries all of them.
#[derive(Clone, Debug)]
pub struct Engine {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    compiled: Arc<Mutex<Compiled>>,
    subpixel_bits: Arc<OnceLock<u32>>,
}

/// Numbers of shaders and pipelines that an engine has compiled so far, without cache hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compilations {
    /// Shaders linked and validated.
    pub shaders: u64,
    /// Compute and render pipelines.
    pub pipelines: u64,
}

/// Numbers of shaders and pipelines in an engine's cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeptCompiled {
    /// Linked shaders.
    pub shaders: usize,
    /// Compute pipelines.
    pub kernels: usize,
    /// Render pipelines.
    pub rasters: usize,
}

#[derive(Debug)]
struct Compiled {
    shaders: HashMap<ShaderKey, Arc<LinkedShader>>,
    kernels: PipelineCache<ComputeKernel>,
    rasters: PipelineCache<RasterPipeline>,
    /// Edited shader texts by library number ([`ShaderLibrary::number`]).
    edited: HashMap<usize, Arc<ShaderTexts>>,
    count: Compilations,
}

impl Compiled {
    /// The edited texts of a library and of its base.
    fn edited_of(&self, libraries: [Option<usize>; 2]) -> ShaderTexts {
        let of = |library: &usize| self.edited.get(library).map(|texts| (**texts).clone());
        libraries.iter().flatten().filter_map(of).flatten().collect()
    }
}

impl Default for Compiled {
    fn default() -> Self {
        Self {
            shaders: HashMap::new(),
            kernels: PipelineCache::new(SPARE_KERNELS),
            rasters: PipelineCache::new(SPARE_RASTERS),
            edited: HashMap::new(),
            count: Compilations::default(),
        }
    }
}

/// Numbers of a library and of its base; the label of a module with its features.
type ShaderKey = ([Option<usize>; 2], String);

/// Identity of a pipeline: its shader's label, a hash of the linked text, and the `Debug` text of its entry points,
/// label and state.
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

/// The set of pipelines that some work requested from an engine.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Requested(BTreeSet<PipelineKey>);

thread_local! {
    /// The engine of the calling thread, and the pipelines requested from it.
    static CURRENT: RefCell<Option<(Engine, Requested)>> = const { RefCell::new(None) };
}

/// Restores the previous engine when dropped, so also if the work panics.
struct EngineBefore(Option<(Engine, Requested)>);

impl Drop for EngineBefore {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

impl Engine {
    /// An engine with an empty cache.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self { device: device.clone(), queue: queue.clone(), compiled: Arc::default(), subpixel_bits: Arc::default() }
    }

    /// Like [`Self::new`], for a browser: measures there what would wait for the device.
    #[doc(hidden)]
    pub async fn measured(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, GpuError> {
        let bits = vertex_grid::measured_subpixel_bits(device, queue).await?;
        Ok(Self { subpixel_bits: Arc::new(bits.into()), ..Self::new(device, queue) })
    }

    /// Runs `work` in the calling thread. Shaders that it links, and pipelines that it compiles for this device, go
    /// through the cache.
    #[doc(hidden)]
    pub fn within<R>(&self, work: impl FnOnce() -> R) -> R {
        self.requested_within(work).0
    }

    /// Like [`Self::within`], and also returns the pipelines that `work` requested, both cached and new.
    #[doc(hidden)]
    pub fn requested_within<R>(&self, work: impl FnOnce() -> R) -> (R, Requested) {
        let _restored = EngineBefore(CURRENT.replace(Some((self.clone(), Requested::default()))));
        let result = work();
        let requested = CURRENT.take().map(|(_, requested)| requested).unwrap_or_default();
        (result, requested)
    }

    /// Bits of the fraction of a vertex's position in the image, pixels, at least 4: the rasterizer snaps vertices to
    /// 2ⁿ points a pixel along each axis. Vulkan states it; on other APIs the first call draws 16 pixels to measure it,
    /// and waits for the device.
    #[doc(hidden)]
    pub fn subpixel_bits(&self) -> u32 {
        *self.subpixel_bits.get_or_init(|| vertex_grid::subpixel_bits(&self.device, &self.queue))
    }

    /// Numbers of shaders and pipelines compiled so far.
    #[doc(hidden)]
    pub fn compilations(&self) -> Compilations {
        self.compiled().count
    }

    /// Numbers of shaders and pipelines in the cache.
    #[doc(hidden)]
    pub fn kept(&self) -> KeptCompiled {
        let compiled = self.compiled();
        let Compiled { shaders, kernels, rasters, .. } = &*compiled;
        KeptCompiled { shaders: shaders.len(), kernels: kernels.len(), rasters: rasters.len() }
    }

    /// Empties the cache, for use after an error: it may hold objects that the device rejected. Objects in use stay
    /// valid. Edited texts stay.
    #[doc(hidden)]
    pub fn forget(&self) {
        let mut compiled = self.compiled();
        let (count, edited) = (compiled.count, std::mem::take(&mut compiled.edited));
        *compiled = Compiled { count, edited, ..Compiled::default() };
    }

    /// Replaces files of a library by edited texts, and returns the previous edited texts. Shaders linked from now on
    /// use them; pipelines in use stay unchanged.
    #[doc(hidden)]
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

/// The shader of this label: from the cache of the thread's engine, else from `link`, which receives the edited texts.
pub(crate) fn linked(
    libraries: [Option<usize>; 2],
    label: &str,
    link: impl FnOnce(&ShaderTexts) -> Result<LinkedShader, GpuError>,
) -> Result<Arc<LinkedShader>, GpuError> {
    let Some(engine) = current() else { return link(&ShaderTexts::new()).map(Arc::new) };
    let key = (libraries, label.to_owned());
    if let Some(cached) = engine.compiled().shaders.get(&key) {
        return Ok(cached.clone());
    }
    // The lock is not held here, so that other threads can compile; at worst two threads link the same shader.
    let edited = engine.compiled().edited_of(libraries);
    let shader = Arc::new(link(&edited)?);
    let mut compiled = engine.compiled();
    compiled.count.shaders += 1;
    // The texts may have been edited in the meantime.
    if compiled.edited_of(libraries) == edited {
        compiled.shaders.insert(key, shader.clone());
    }
    Ok(shader)
}

/// The compute pipeline of this key: from the cache of the thread's engine, else from `compile`.
pub(crate) fn kernel(
    device: &wgpu::Device,
    key: impl FnOnce() -> PipelineKey,
    compile: impl FnOnce() -> ComputeKernel,
) -> ComputeKernel {
    cached_or_compiled(device, |compiled| &mut compiled.kernels, key, compile)
}

/// The render pipeline of this key: from the cache of the thread's engine, else from `compile`.
pub(crate) fn raster(
    device: &wgpu::Device,
    key: impl FnOnce() -> PipelineKey,
    compile: impl FnOnce() -> RasterPipeline,
) -> RasterPipeline {
    cached_or_compiled(device, |compiled| &mut compiled.rasters, key, compile)
}

fn cached_or_compiled<P: Pipeline>(
    device: &wgpu::Device,
    cache: impl Fn(&mut Compiled) -> &mut PipelineCache<P>,
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
    if let Some(cached) = cache(&mut engine.compiled()).get(&key) {
        return cached;
    }
    let pipeline = compile();
    let mut compiled = engine.compiled();
    compiled.count.pipelines += 1;
    let dropped = cache(&mut compiled).insert(key, pipeline.clone());
    if !dropped.is_empty() {
        // A shader is dropped with the last of its pipelines.
        let Compiled { shaders, kernels, rasters, .. } = &mut *compiled;
        let (of_kernels, of_rasters) = (kernels.shaders(), rasters.shaders());
        let dropped: HashSet<_> = dropped.iter().map(|key| key.shader.as_str()).collect();
        let is_unused =
            |label: &str| dropped.contains(label) && !of_kernels.contains(label) && !of_rasters.contains(label);
        shaders.retain(|(_, label), _| !is_unused(label));
    }
    pipeline
}
