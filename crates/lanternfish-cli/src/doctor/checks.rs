//! The list of checks. Each uses only features that earlier checks test.

use lanternfish::{
    Settings,
    settings::{Caustics, Culling, Indirect, Occlusion, Shadows, Tracer},
    techniques::{Bounces, Sampled, SampledLights},
};

use super::{
    measure::{Kind, Limits, Reference},
    report::{Check, Group, Verdict},
    scenes::Name,
};

/// A planned check.
#[derive(Clone, Debug)]
pub struct Plan {
    pub group: Group,
    pub name: String,
    pub scene: Name,
    /// True if `--quick` includes it.
    pub is_quick: bool,
    pub kind: Kind,
}

impl Plan {
    /// True if its group, name or scene contains the text.
    pub fn matches(&self, text: &str) -> bool {
        [&*self.group.name(), &self.name, self.scene.text()].iter().any(|part| part.contains(text))
    }

    /// Its row before it runs: failed.
    pub fn check(&self) -> Check {
        let scene = match self.kind {
            Kind::Sort => "a list",
            Kind::VertexGrid => "a row of triangles",
            _ => self.scene.text(),
        };
        Check {
            group: self.group,
            name: self.name.clone(),
            scene: scene.to_owned(),
            verdict: Verdict::Failed,
            figures: Vec::new(),
            reason: None,
            seconds: 0.0,
        }
    }

    /// File name of its image.
    pub fn file_name(&self) -> String {
        let text = format!("{} {} {}", self.group.name(), self.name, self.scene.text());
        let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        words.map(str::to_lowercase).collect::<Vec<_>>().join("-")
    }
}

/// Direct light with exact light culling and without shadows, which isolates materials and lights.
fn unshadowed() -> Settings {
    Settings::direct_light().with_culling(Culling::NONE).with_shadows(Shadows::None)
}

/// All checks.
pub fn plans() -> Vec<Plan> {
    let mut plans = Vec::new();
    let mut add = |group, name: &str, scene, is_quick, kind| {
        plans.push(Plan { group, name: name.to_owned(), scene, is_quick, kind });
    };
    let against = |reference, settings: Settings, limits| Kind::Against(reference, Box::new(settings), limits);
    let direct = Settings::direct_light;

    add(Group::Primitives, "radix sort", Name::Cornell, true, Kind::Sort);
    add(Group::Primitives, "vertex grid", Name::Cornell, true, Kind::VertexGrid);
    add(
        Group::Materials,
        "BRDF, one light",
        Name::Spheres,
        true,
        against(Reference::Direct, unshadowed(), Limits::new(0.03, 0.01, 0.01)),
    );
    for culling in Culling::all() {
        let both = [unshadowed().with_culling(culling.clone()), unshadowed()];
        let is_quick = culling == Culling::default();
        add(Group::LightCulling, culling.name(), Name::Atrium, is_quick, Kind::Same(Box::new(both)));
    }
    for tracer in Tracer::all() {
        let settings = direct().with_shadows(Shadows::Traced(tracer));
        let is_exact = tracer.is_exact();
        let limits = if is_exact { Limits::new(0.03, 0.01, 0.01) } else { Limits::new(0.13, 0.04, 0.03) };
        let is_quick = tracer == Tracer::BVH;
        if is_exact {
            let masks = against(Reference::Direct, settings.clone(), Limits { energy: 0.03, ..limits });
            add(Group::Shadows, tracer.name(), Name::Masks, is_quick, masks);
        }
        let hall = against(Reference::Direct, settings, limits);
        add(Group::Shadows, tracer.name(), Name::Hall, is_quick, hall);
    }
    for (name, scene, limits) in [
        ("100 lights", Name::Atrium, Limits::new(0.12, 0.03, 0.01)),
        ("disk and rectangle", Name::AreaLights, Limits::new(0.08, 0.02, 0.01)),
        ("blended and transmitted", Name::Glass, Limits::new(0.09, 0.03, 0.01)),
        ("bent on the device", Name::Figure, Limits::new(0.03, 0.01, 0.01)),
    ] {
        add(Group::DirectLight, name, scene, false, against(Reference::Direct, direct(), limits));
    }
    let sampled = direct().with_direct(SampledLights::default()).with_accumulate(16);
    let limits = Limits::new(0.12, 0.03, 0.01);
    add(Group::DirectLight, "100 lights, sampled", Name::Atrium, false, against(Reference::Direct, sampled, limits));
    for occlusion in Occlusion::all() {
        let settings = direct().with_occlusion(occlusion.clone());
        let is_unbounded = occlusion.technique().is_some_and(|technique| technique.max_distance().is_none());
        let (reference, limits) = match is_unbounded {
            true => (Reference::Visibility, Limits::new(0.09, 0.02, 0.01)),
            false => (Reference::Obscurance, Limits::new(0.13, 0.1, 0.01)),
        };
        add(Group::Occlusion, occlusion.name(), Name::White, false, against(reference, settings, limits));
    }
    let good = Settings::default;
    add(
        Group::Environment,
        "default",
        Name::Environment,
        false,
        against(Reference::Full, good(), Limits::new(0.06, 0.03, 0.01)),
    );
    let full = |settings| against(Reference::Full, settings, Limits::new(0.07, 0.015, 0.01));
    add(Group::IndirectLight, "default", Name::Cornell, true, full(good()));
    add(Group::IndirectLight, "default", Name::Hall, false, full(good()));
    for tracer in Tracer::in_one_level() {
        let sampled = Indirect::from(Sampled { tracer: tracer.into(), ..Sampled::default() });
        let name = format!("{}, {tracer}", sampled.name());
        let limits = if !tracer.is_exact() { Limits::new(0.12, 0.05, 0.02) } else { Limits::new(0.07, 0.015, 0.01) };
        let settings = good().with_indirect(sampled);
        add(Group::IndirectLight, &name, Name::Cornell, false, against(Reference::Full, settings, limits));
    }
    for indirect in Indirect::all().into_iter().filter(|indirect| *indirect != Indirect::default()) {
        let settings = good().with_indirect(indirect.clone());
        let reference = indirect.technique().and_then(|technique| technique.bounces()).map(|bounces| match bounces {
            Bounces::UpTo(bounces) => Reference::Bounces(bounces),
            Bounces::All => Reference::Full,
        });
        let kind = match reference {
            Some(reference) => against(reference, settings, Limits::new(0.08, 0.03, 0.01)),
            None => Kind::Twice(Box::new(settings)),
        };
        add(Group::IndirectLight, indirect.name(), Name::CornellLights, false, kind);
    }
    let leaves_caustics = |of: &Indirect| of.technique().is_some_and(|technique| technique.leaves_caustics());
    let beside = Indirect::all().into_iter().find(leaves_caustics).unwrap_or(Indirect::NONE);
    for caustics in Caustics::all() {
        let settings = good().with_indirect(beside.clone()).with_caustics(caustics.clone());
        let kind = against(Reference::Bounces(1), settings, Limits::new(0.08, 0.03, 0.01));
        add(Group::IndirectLight, caustics.name(), Name::CornellLights, false, kind);
    }
    add(Group::Updates, "update, upload", Name::CornellLights, true, Kind::Update(Box::new(direct())));
    add(Group::Reproducibility, "default, twice", Name::Cornell, true, Kind::Twice(Box::new(good())));
    plans
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn every_technique_and_tracer_is_checked() {
        testing::know_papers();
        let plans = plans();
        let has = |group: Group, name: &str| plans.iter().any(|plan| plan.group == group && plan.name == name);
        for tracer in &Tracer::all() {
            assert!(has(Group::Shadows, tracer.name()), "{tracer}");
            let is_lit = Tracer::in_one_level().contains(tracer);
            assert_eq!(has(Group::IndirectLight, &format!("sampled, {tracer}")), is_lit, "{tracer}");
        }
        assert!(Culling::all().iter().all(|culling| has(Group::LightCulling, culling.name())));
        assert!(Occlusion::all().iter().all(|occlusion| has(Group::Occlusion, occlusion.name())));
        let indirect = Indirect::all();
        let others = indirect.iter().filter(|indirect| **indirect != Indirect::default());
        assert!(
            others.clone().count() + 1 == indirect.len() && others.clone().all(|i| has(Group::IndirectLight, i.name()))
        );
        assert!(Caustics::all().iter().all(|caustics| has(Group::IndirectLight, caustics.name())));
        let quick = |group| plans.iter().any(|plan| plan.is_quick && plan.group == group);
        let groups =
            [Group::Materials, Group::LightCulling, Group::Shadows, Group::IndirectLight, Group::Reproducibility];
        assert!(groups.into_iter().all(quick), "--quick looks at each kind of technique");
    }
}
