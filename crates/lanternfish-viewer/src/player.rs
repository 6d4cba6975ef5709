//! Playback of animations and light rain: the time that is shown.

use lanternfish_scene::{
    Scene,
    motion::{Animation, Moment},
};

use crate::panels::Clip;

/// Range of the time slider for light rain without an animation, s.
const RAIN_DURATION: f32 = 60.0;

/// The clip of a scene; `None` without animations and rain. Rain plays along with any animation.
pub fn clip_of(scene: &Scene, has_rain: bool) -> Option<Clip> {
    let animations = &scene.motion.animations;
    let name = |(i, animation): (usize, &Animation)| match animation.name.as_str() {
        "" => i.to_string(),
        name => name.to_owned(),
    };
    let names = animations.iter().enumerate().map(name).collect();
    let animation = (!animations.is_empty()).then_some(0);
    let duration = duration(scene, animation);
    (animation.is_some() || has_rain).then_some(Clip {
        names,
        animation,
        duration,
        has_rain,
        time: 0.0,
        is_playing: false,
    })
}

/// The clip of a scene at a moment. A moment with a missing animation is ignored.
pub fn clip_at(scene: &Scene, has_rain: bool, moment: Option<Moment>) -> Option<Clip> {
    let mut clip = clip_of(scene, has_rain)?;
    if let Some(Moment { animation, time }) = moment
        && animation.is_none_or(|animation| animation < clip.names.len())
    {
        (clip.animation, clip.duration) = (animation, duration(scene, animation));
        clip.go_on(time);
    }
    Some(clip)
}

/// Duration of an animation, or [`RAIN_DURATION`] for light rain alone, s.
fn duration(scene: &Scene, animation: Option<usize>) -> f32 {
    animation.map_or(RAIN_DURATION, |animation| scene.motion.animations[animation].duration())
}

/// Advances the time by `seconds` while playing. Returns true if the moment has changed, and the scene must be updated.
pub fn play(scene: &Scene, clip: &mut Clip, shown: &mut Option<Moment>, seconds: f32) -> bool {
    clip.duration = duration(scene, clip.animation);
    if clip.is_playing {
        clip.go_on(seconds);
    } else if clip.time > clip.duration {
        // Another animation was chosen.
        clip.go_on(0.0);
    }
    let now = Moment { animation: clip.animation, time: clip.time };
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
        motion::{Channel, Interpolation, Node, Property, Sampler},
    };

    use super::*;

    fn animated() -> Scene {
        let mut scene = generate::demo("cornell").unwrap();
        scene.motion.nodes.push(Node::default());
        let (times, values) = (vec![0.0, 2.0], vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        let sampler = Sampler { times, values, interpolation: Interpolation::Linear };
        let channels = vec![Channel { node: 0, property: Property::Translation, sampler: sampler.into() }];
        scene.motion.animations.push(Animation { name: String::new(), channels });
        scene
    }

    fn of(animation: Option<usize>, time: f32) -> Option<Moment> {
        Some(Moment { animation, time })
    }

    #[test]
    fn time_advances_and_loops() {
        assert_eq!(clip_of(&generate::demo("cornell").unwrap(), false), None);
        let scene = animated();
        let at = |moment| clip_at(&scene, false, moment).map(|clip| (clip.animation, clip.time, clip.is_playing));
        assert_eq!(
            (at(of(Some(0), 2.5)), at(of(Some(7), 1.0)), at(None)),
            (Some((Some(0), 0.5, false)), at(None), Some((Some(0), 0.0, false)))
        );
        let mut clip = clip_of(&scene, false).unwrap();
        assert_eq!((clip.names.as_slice(), clip.duration), (&["0".to_owned()][..], 2.0));
        let mut shown = None;
        assert!(!play(&scene, &mut clip, &mut shown, 0.5), "playback is paused");
        clip.is_playing = true;
        assert!(play(&scene, &mut clip, &mut shown, 0.5) && clip.time == 0.5);
        assert!(play(&scene, &mut clip, &mut shown, 1.75) && clip.time == 0.25);
        clip.is_playing = false;
        assert!(!play(&scene, &mut clip, &mut shown, 9.0));
        clip.time = 1.0;
        assert!(play(&scene, &mut clip, &mut shown, 0.0), "the time was set by the user");
    }

    #[test]
    fn rain_plays_along_with_animations_and_alone() {
        let still = generate::demo("cornell").unwrap();
        let mut alone = clip_at(&still, true, of(None, 100.0)).unwrap();
        assert_eq!((alone.animation, alone.time), (None, 100.0), "rain has no end");
        let mut shown = of(None, 0.0);
        assert!(play(&still, &mut alone, &mut shown, 0.0) && shown == of(None, 100.0), "it starts at that moment");
        alone.is_playing = true;
        assert!(play(&still, &mut alone, &mut shown, 0.5) && shown == of(None, 100.5));
        assert_eq!(alone.without_rain(), None);

        let scene = animated();
        let both = clip_at(&scene, true, of(Some(0), 2.5)).unwrap();
        assert_eq!((both.animation, both.duration, both.time), (Some(0), 2.0, 2.5), "rain does not loop");
        // An animation that is not selected does not play.
        let mut resting = clip_at(&scene, true, of(None, 0.0)).unwrap();
        assert!(!play(&scene, &mut resting, &mut of(None, 0.0), 0.0) && resting.animation.is_none());
        assert_eq!(both.without_rain().map(|clip| clip.has_rain), Some(false));
    }
}
