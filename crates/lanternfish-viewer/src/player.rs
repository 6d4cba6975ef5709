//! The scene's animation: which moment of it is shown.

use lanternfish_scene::Scene;

use crate::panels::Clip;

/// What a scene has to play; none where it has no animation.
pub fn clip_of(scene: &Scene) -> Option<Clip> {
    let animations = &scene.motion.animations;
    let name = |(i, animation): (usize, &lanternfish_scene::motion::Animation)| match animation.name.as_str() {
        "" => i.to_string(),
        name => name.to_owned(),
    };
    let first = animations.first()?;
    let names = animations.iter().enumerate().map(name).collect();
    Some(Clip { names, animation: 0, duration: first.duration(), time: 0.0, is_playing: false })
}

/// The same at a moment: which animation, by its index, and when in it, s. What the scene has not is not played.
pub fn clip_at(scene: &Scene, moment: Option<(usize, f32)>) -> Option<Clip> {
    let mut clip = clip_of(scene)?;
    if let Some((animation, time)) = moment
        && let Some(chosen) = scene.motion.animations.get(animation)
    {
        let duration = chosen.duration();
        (clip.animation, clip.duration, clip.time) = (animation, duration, time.rem_euclid(duration.max(1e-3)));
    }
    Some(clip)
}

/// Lets `seconds` pass; says whether the moment that is shown now is another than before: the scene is to be posed so then.
pub fn play(scene: &Scene, clip: &mut Clip, shown: &mut Option<(usize, f32)>, seconds: f32) -> bool {
    clip.duration = scene.motion.animations[clip.animation].duration();
    if clip.is_playing {
        clip.time += seconds;
    }
    if clip.time > clip.duration {
        clip.time = clip.time.rem_euclid(clip.duration.max(1e-3));
    }
    let now = (clip.animation, clip.time);
    if *shown == Some(now) || (shown.is_none() && clip.time == 0.0 && !clip.is_playing) {
        return false;
    }
    *shown = Some(now);
    true
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::{
        Scene, generate,
        motion::{Animation, Channel, Interpolation, Node, Property, Sampler},
    };

    use super::*;

    fn animated() -> Scene {
        let mut scene = generate::demo("cornell").unwrap();
        scene.motion.nodes.push(Node::default());
        let (times, values) = (vec![0.0, 2.0], vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        let sampler = Sampler { times, values, interpolation: Interpolation::Linear };
        let channels = vec![Channel { node: 0, property: Property::Translation, sampler }];
        scene.motion.animations.push(Animation { name: String::new(), channels });
        scene
    }

    #[test]
    fn time_passes_and_begins_anew() {
        assert_eq!(clip_of(&generate::demo("cornell").unwrap()), None);
        let scene = animated();
        let at = |moment| clip_at(&scene, moment).map(|clip| (clip.animation, clip.time, clip.is_playing));
        assert_eq!(
            (at(Some((0, 2.5))), at(Some((7, 1.0))), at(None)),
            (Some((0, 0.5, false)), at(None), at(Some((0, 0.0))))
        );
        let mut clip = clip_of(&scene).unwrap();
        assert_eq!((clip.names.as_slice(), clip.duration), (&["0".to_owned()][..], 2.0));
        let mut shown = None;
        assert!(!play(&scene, &mut clip, &mut shown, 0.5), "it rests");
        clip.is_playing = true;
        assert!(play(&scene, &mut clip, &mut shown, 0.5) && clip.time == 0.5);
        assert!(play(&scene, &mut clip, &mut shown, 1.75) && clip.time == 0.25);
        clip.is_playing = false;
        assert!(!play(&scene, &mut clip, &mut shown, 9.0));
        clip.time = 1.0;
        assert!(play(&scene, &mut clip, &mut shown, 0.0), "it was moved by hand");
    }
}
