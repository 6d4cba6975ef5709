//! The list of what this crate is made of: the one place that names every technique.

use crate::{indirect::Indirect, light_culling::Culling, occlusion::Occlusion, shaders::Shaders};

/// The shaders of every folder, by what declares them.
pub const FOLDERS: &[&[Shaders]] = &[
    &[
        crate::view::DECLARED,
        crate::gpu_scene::DECLARED,
        crate::gpu_scene::moving::DECLARED,
        crate::lights::DECLARED,
        crate::prepass::DECLARED,
        crate::light_culling::DECLARED,
        crate::deep_images::DECLARED,
        crate::indirect::radiance_cache::DECLARED,
        crate::rays::DECLARED,
        crate::environment_light::DECLARED,
        crate::indirect::light_views::DECLARED,
        crate::indirect::smoothing::DECLARED,
        crate::indirect::history::DECLARED,
        crate::occlusion::DECLARED,
        crate::shadows::DECLARED,
        crate::shading::DECLARED,
        crate::sky::DECLARED,
        crate::progressive::DECLARED,
        crate::output::DECLARED,
        crate::debug_views::DECLARED,
    ],
    Culling::SHADERS,
    Indirect::SHADERS,
    Occlusion::SHADERS,
];
