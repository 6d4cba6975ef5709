use glam::Vec3;

use super::{super::ShotFrame, shot};

#[test]
fn a_recording_is_a_shot_with_a_camera_for_every_moment() {
    let recording = "recording = 1\nscene = \"demo:cornell\"\nflags = [[\"sun\", \"0,-1,0,3\"], [\"sky\", \"1,1,1\"]]\n\
                     step = 0.1\nspeed = 1\nreach = 2\nsteps = [[], [[\"fly\", 0, 0, 1, 0.1]], 1]\n\
                     first = [\"perspective\", 0.8, 0.05, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 3.4]";
    let eyes = |flags: &str| {
        let eye = |frame: ShotFrame| frame.view.recorded.map(|camera| (camera.eye().z * 1e3).round());
        shot(recording, flags).unwrap().frames().into_iter().map(eye).collect::<Vec<_>>()
    };
    // Its own flags count, and those of the command line go before them.
    let lights = shot(recording, "--sky 0,0,1").unwrap().args.lights;
    assert!(lights.sun.is_some() && lights.sky == Some(Vec3::Z));
    assert_eq!(eyes(""), [Some(3400.0)]);
    assert_eq!(eyes("--frames 0-4 --fps 20"), [3400.0, 3350.0, 3300.0, 3250.0, 3200.0].map(Some));
    assert_eq!(eyes("--frames 3"), [3400.0, 3300.0, 3200.0].map(Some));
    assert_eq!(eyes("--time 0.2"), [Some(3200.0)]);
    // Another camera replaces it.
    assert_eq!(eyes("--time 0.2 --view top"), [None]);
    assert!(shot(recording, "--time 0.3").unwrap_err().contains("from 0 to 0.2 s"));
    let error = shot(&recording.replace("\"sun\"", "\"son\""), "").unwrap_err();
    assert!(error.contains("\"son\": there is none") && error.contains("\"sun\""), "{error}");
}
