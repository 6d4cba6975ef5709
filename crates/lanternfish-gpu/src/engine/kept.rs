//! Compiled objects of an engine: those in use, and the most recent unused ones.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use super::PipelineKey;

/// In every clone of a pipeline: how many there are of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clones(Arc<()>);

/// A pipeline, clones of which are handed out.
pub(crate) trait Handed: Clone {
    /// In all of them.
    fn clones(&self) -> &Clones;
}

/// Pipelines of one kind by what they are made of.
#[derive(Debug)]
pub(super) struct Kept<P> {
    pipelines: HashMap<PipelineKey, (P, u64)>,
    /// Number of unused objects that are kept: the most recent ones.
    spare: usize,
    now: u64,
}

impl<P: Handed> Kept<P> {
    pub fn new(spare: usize) -> Self {
        Self { pipelines: HashMap::new(), spare, now: 0 }
    }

    pub fn get(&mut self, key: &PipelineKey) -> Option<P> {
        self.now += 1;
        let (pipeline, used) = self.pipelines.get_mut(key)?;
        *used = self.now;
        Some(pipeline.clone())
    }

    /// Keeps another, and drops those that nobody has used for longest.
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

    /// Labels of the shaders that they are made of.
    pub fn shaders(&self) -> HashSet<&str> {
        self.pipelines.keys().map(|key| key.shader.as_str()).collect()
    }

    pub fn len(&self) -> usize {
        self.pipelines.len()
    }
}
