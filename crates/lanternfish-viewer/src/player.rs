//! What a scene plays, its animations and light rain: which moment of it is shown.

use lanternfish_scene::Scene;

use crate::panels::Clip;

/// How long rain falls until it begins anew, s, where there is no animation to end.
const OF_RAIN: f32 = 60.0;

/// What a scene has to play; none where it has neither animations nor rain. Rain falls beside any animation.
pub fn clip_of(scene: &Scene, has_rain: bool) -> Option<Clip> {
    let animations = &scene.motion.animations;
    let name = |(i, animation): (usize, &lanternfish_scene::motion::Animation)| match animation.name.as_str() {
        "" => i.to_string(),
        name => name.to_owned(),
    };
    let is_rain_alone = animations.is_empty();
    if is_rain_alone && !has_rain {
        return None;
    }
    let names = match is_rain_alone {
        true => vec!["light rain".to_owned()],
        false => animations.iter().enumerate().map(name).collect(),
    };
    Some(Clip { is_rain_alone, names, animation: 0, duration: duration(scene, 0), time: 0.0, is_playing: false })
}

/// How long an animation is, s; else the rain.
fn duration(scene: &Scene, animation: usize) -> f32 {
    scene.motion.animations.get(animation).map_or(OF_RAIN, lanternfish_scene::motion::Animation::duration)
}

/// The same at a moment: which animation, by its index, and when, s. What the scene has not is not played.
pub fn clip_at(scene: &Scene, has_rain: bool, moment: Option<(Option<usize>, f32)>) -> Option<Clip> {
    let mut clip = clip_of(scene, has_rain)?;
    if let Some((animation, time)) = moment
        && animation.is_none_or(|animation| animation < clip.names.len())
    {
        let animation = animation.unwrap_or(0);
        let duration = duration(scene, animation);
        (clip.animation, clip.duration, clip.time) = (animation, duration, time.rem_euclid(duration.max(1e-3)));
    }
    Some(clip)
}

/// Lets `seconds` pass; says whether the moment that is shown now is another than before: the scene is to be posed so then.
pub fn play(scene: &Scene, clip: &mut Clip, shown: &mut Option<(Option<usize>, f32)>, seconds: f32) -> bool {
    clip.duration = duration(scene, clip.animation);
    if clip.is_playing {
        clip.time += seconds;
    }
    if clip.time > clip.duration {
        clip.time = clip.time.rem_euclid(clip.duration.max(1e-3));
    }
    let now = ((!clip.is_rain_alone).then_some(clip.animation), clip.time);
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
        assert_eq!(clip_of(&generate::demo("cornell").unwrap(), false), None);
        let scene = animated();
        let at = |moment| clip_at(&scene, false, moment).map(|clip| (clip.animation, clip.time, clip.is_playing));
        assert_eq!(
            (at(Some((Some(0), 2.5))), at(Some((Some(7), 1.0))), at(None)),
            (Some((0, 0.5, false)), at(None), Some((0, 0.0, false)))
        );
        let mut clip = clip_of(&scene, false).unwrap();
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

    #[test]
    fn rain_is_played_beside_animations_and_alone() {
        let still = generate::demo("cornell").unwrap();
        let mut alone = clip_at(&still, true, Some((None, 3.0))).unwrap();
        assert_eq!((alone.is_rain_alone, alone.time, alone.names.len()), (true, 3.0, 1));
        let mut shown = None;
        assert!(play(&still, &mut alone, &mut shown, 0.0) && shown == Some((None, 3.0)), "it opens at that moment");
        alone.is_playing = true;
        assert!(play(&still, &mut alone, &mut shown, 0.5) && shown == Some((None, 3.5)));
        let beside = clip_of(&animated(), true).unwrap();
        assert_eq!((beside.is_rain_alone, beside.duration), (false, 2.0));
    }
}
