use wgpu::{DeviceType, Features};

use super::{Tracer, TracerChoice};

#[test]
fn the_automatic_tracer_is_decided_by_the_kind_of_adapter_and_can_be_overridden() {
    let ray_query = Features::EXPERIMENTAL_RAY_QUERY;
    for (kind, features, expected) in [
        (DeviceType::DiscreteGpu, ray_query, Tracer::RAY_QUERY),
        (DeviceType::IntegratedGpu, ray_query, Tracer::RAY_QUERY),
        (DeviceType::DiscreteGpu, Features::empty(), Tracer::BVH),
        (DeviceType::Cpu, ray_query, Tracer::BVH),
    ] {
        assert_eq!(Tracer::automatic(kind, features), expected, "{kind:?}");
        let resolved = |mut choice: TracerChoice| {
            choice.resolve(expected);
            choice.fixed()
        };
        assert_eq!(resolved(TracerChoice::Auto), expected);
        assert_eq!(resolved(Tracer::RAY_QUERY.into()), Tracer::RAY_QUERY, "a named tracer is not replaced");
    }
    for choice in TracerChoice::all() {
        assert_eq!(choice.name().parse(), Ok(choice));
    }
}
