//! Moving parts of a scene other than the camera: light rain, and the animations of the file.

use lanternfish_scene::{Bounds, Scene, generate::Rain};

use crate::{args::TrackArgs, error::CliError};

/// Note for a requested time in a scene without motion.
pub const NOTHING_MOVES: &str =
    "neither the camera nor anything in the scene moves: the image is the same at every time";

/// Moments of an animation, after its first, at which its bounds are found.
const MOMENTS: u32 = 8;

/// The moving parts of a scene.
#[derive(Debug)]
pub struct Motion {
    rain: Option<Rain>,
    /// Index of the animation to play.
    animation: Option<usize>,
}

impl Motion {
    /// The motion that these flags and the scene define; `None` if nothing moves. If a time is requested without an animation,
    /// the file's first one plays.
    pub fn of(scene: &Scene, flags: &TrackArgs, rain: Option<Rain>) -> Result<Option<Self>, CliError> {
        let has_time = flags.time.is_some() || flags.is_sequence();
        let animation = match &flags.animation {
            Some(wanted) => Some(named(scene, wanted)?),
            None => (has_time && !scene.motion.animations.is_empty()).then_some(0),
        };
        Ok((rain.is_some() || animation.is_some()).then_some(Self { rain, animation }))
    }

    /// Index of the animation to play.
    pub fn animation(&self) -> Option<usize> {
        self.animation
    }

    /// The light rain.
    pub fn rain(&self) -> Option<&Rain> {
        self.rain.as_ref()
    }

    /// Light rain without an animation.
    pub fn of_rain(rain: Rain) -> Self {
        Self { rain: Some(rain), animation: None }
    }

    /// The bounds of all that an animation moves through, by nine moments of it; empty without one. `scene` is in its state at 0 s, and is left so.
    pub fn bounds(&self, scene: &mut Scene) -> Result<Bounds, CliError> {
        let Some(animation) = self.animation else { return Ok(Bounds::EMPTY) };
        let duration = scene.motion.animations[animation].duration();
        let mut bounds = scene.bounds();
        for moment in 1..=MOMENTS {
            // A moment at which something goes too far is an error only if it is rendered.
            if self.at_time(scene, duration * moment as f32 / MOMENTS as f32).is_ok() {
                bounds.add_bounds(&scene.bounds());
            }
        }
        self.at_time(scene, 0.0)?;
        Ok(bounds)
    }

    /// Sets everything in `scene` to its state at `time`, s.
    ///
    /// **All motion over time happens here**, for `render` and for `reference`. The result depends on `time` and on the scene
    /// as it was loaded, never on earlier times: frames come in any order.
    ///
    /// Returns an error if an animation moves something beyond the distance that scenes may have.
    pub fn at_time(&self, scene: &mut Scene, time: f32) -> Result<(), CliError> {
        if let Some(rain) = &self.rain {
            rain.fall(&mut scene.lights, time);
        }
        if let Some(animation) = self.animation {
            scene.pose(animation, time);
            scene.check_reach().map_err(|fault| {
                let name = &scene.motion.animations[animation].name;
                let what =
                    format!("{}: its animation {animation} ({name}) goes too far at {time} s: {fault}", scene.name);
                CliError::new(what, "correct the animation in the file, or choose another --time or --animation")
            })?;
        }
        Ok(())
    }
}

/// Index of an animation by name, else by index.
fn named(scene: &Scene, wanted: &str) -> Result<usize, CliError> {
    let animations = &scene.motion.animations;
    let by_name = animations.iter().position(|animation| animation.name == wanted);
    let by_index = || wanted.parse().ok().filter(|index: &usize| *index < animations.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let what = format!("--animation {wanted}: {} has no such animation", scene.name);
        if animations.is_empty() {
            return CliError::new(what, "the file has none: leave --animation out");
        }
        let available: Vec<_> = animations.iter().enumerate().map(|(i, a)| format!("{i} {:?}", a.name)).collect();
        CliError::new(what, format!("there are {}", available.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;
    use lanternfish_scene::motion::{Animation, Bound, Channel, Interpolation, Node, Property, Sampler};

    use super::*;

    #[test]
    fn an_animation_that_goes_too_far_is_a_fault_of_the_file() {
        let mut scene = lanternfish_scene::generate::demo("cornell").unwrap();
        let sampler = Sampler {
            interpolation: Interpolation::Linear,
            times: vec![0.0, 1.0],
            values: vec![0.0, 0.0, 0.0, 1e13, 0.0, 0.0],
        };
        let channel = Channel { node: 0, property: Property::Translation, sampler: sampler.into() };
        scene.name = "far".to_owned();
        scene.motion.nodes = vec![Node::default()];
        scene.motion.instances = vec![Bound { index: 0, node: 0, node_from_object: Affine3A::IDENTITY }];
        scene.motion.animations = vec![Animation { name: "fly".to_owned(), channels: vec![channel] }];
        let motion = Motion { rain: None, animation: Some(0) };
        motion.at_time(&mut scene, 0.0).unwrap();
        // Of nine moments the first is the only one within reach.
        let at_start = scene.bounds();
        assert_eq!(motion.bounds(&mut scene).unwrap(), at_start);
        let error = motion.at_time(&mut scene, 0.9).unwrap_err().to_string();
        for word in ["far: its animation 0 (fly)", "0.9 s", "instance 0", "m from the origin", "in the file", "--time"]
        {
            assert!(error.contains(word), "{word:?} is not in: {error}");
        }
    }

    #[test]
    fn bounds_hold_all_moments_of_an_animation() {
        let mut scene = lanternfish_scene::generate::demo("cornell").unwrap();
        let sampler = Sampler {
            interpolation: Interpolation::Linear,
            times: vec![0.0, 1.0, 2.0],
            values: vec![0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        };
        let channel = Channel { node: 0, property: Property::Translation, sampler: sampler.into() };
        scene.motion.nodes = vec![Node::default()];
        scene.motion.instances = vec![Bound { index: 0, node: 0, node_from_object: Affine3A::IDENTITY }];
        scene.motion.animations = vec![Animation { name: String::new(), channels: vec![channel] }];
        let at_start = scene.bounds();
        let bounds = Motion { rain: None, animation: Some(0) }.bounds(&mut scene).unwrap();
        assert!(bounds.min == at_start.min && bounds.max.x > at_start.max.x + 3.0, "{bounds:?}");
        assert_eq!(scene.bounds(), at_start);
        assert!(Motion { rain: None, animation: None }.bounds(&mut scene).unwrap().is_empty());
    }

    #[test]
    fn animations_are_selected_by_name_and_by_index() {
        let animation = |name: &str| Animation { name: name.to_owned(), ..Animation::default() };
        let mut scene = Scene { name: "fox".to_owned(), ..Scene::default() };
        assert!(named(&scene, "0").unwrap_err().to_string().contains("the file has none"));
        scene.motion.animations = vec![animation("walk"), animation("0"), animation("run")];
        assert_eq!(["walk", "0", "2"].map(|wanted| named(&scene, wanted).ok()), [Some(0), Some(1), Some(2)]);
        let error = named(&scene, "3").unwrap_err().to_string();
        assert!(error.contains("there are 0 \"walk\", 1 \"0\", 2 \"run\""), "{error}");
    }
}
