//! Pipeline cache of an engine: pipelines in use, and the most recently used of the others.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use super::PipelineKey;

/// Reference count, shared by all clones of a pipeline.
#[derive(Clone, Debug, Default)]
pub(crate) struct CloneCount(Arc<()>);

/// A pipeline whose clones are counted.
pub(crate) trait Pipeline: Clone {
    /// The count of its clones.
    fn clones(&self) -> &CloneCount;
}

/// Pipelines of one kind by key, with the time of their last use.
#[derive(Debug)]
pub(super) struct PipelineCache<P> {
    pipelines: HashMap<PipelineKey, (P, u64)>,
    /// Maximum number of unused pipelines.
    spare: usize,
    now: u64,
}

impl<P: Pipeline> PipelineCache<P> {
    pub fn new(spare: usize) -> Self {
        Self { pipelines: HashMap::new(), spare, now: 0 }
    }

    pub fn get(&mut self, key: &PipelineKey) -> Option<P> {
        self.now += 1;
        let (pipeline, used) = self.pipelines.get_mut(key)?;
        *used = self.now;
        Some(pipeline.clone())
    }

    /// Adds a pipeline, drops the least recently used of the unused ones above the limit, and returns their keys.
    pub fn insert(&mut self, key: PipelineKey, pipeline: P) -> Vec<PipelineKey> {
        self.now += 1;
        let mut unused = Vec::new();
        for (key, (pipeline, used)) in &mut self.pipelines {
            if Arc::strong_count(&pipeline.clones().0) > 1 {
                *used = self.now;
            } else {
                unused.push((*used, key.clone()));
            }
        }
        self.pipelines.insert(key, (pipeline, self.now));
        unused.sort();
        unused.truncate(unused.len().saturating_sub(self.spare));
        let dropped: Vec<_> = unused.into_iter().map(|(_, key)| key).collect();
        for key in &dropped {
            self.pipelines.remove(key);
        }
        dropped
    }

    /// Labels of their shaders.
    pub fn shaders(&self) -> HashSet<&str> {
        self.pipelines.keys().map(|key| key.shader.as_str()).collect()
    }

    pub fn len(&self) -> usize {
        self.pipelines.len()
    }
}
