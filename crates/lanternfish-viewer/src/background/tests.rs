use lanternfish_scene::generate::demo;

use super::*;

/// Polls until the next report, as the window does.
fn next_report(background: &mut Background) -> Report {
    let started = Instant::now();
    loop {
        if let Some(report) = background.poll() {
            return report;
        }
        assert!(started.elapsed() < Duration::from_secs(120), "no report");
        thread::sleep(Duration::from_millis(1));
    }
}

fn rendering(background: &mut Background, samples: u64) -> Traced {
    loop {
        match next_report(background) {
            Report::RenderedImage(traced) if traced.samples >= samples => return traced,
            Report::RenderedImage(_) => {}
            other => panic!("{other:?}"),
        }
    }
}

/// Probes in between do not change the traced image, and a cancelled image is not reported.
#[test]
fn an_image_accumulates_probes_are_answered_and_a_cancelled_image_is_not_reported() {
    let scene = Arc::new(demo("cornell").unwrap());
    let (camera, settings) = (scene.default_camera(1.5), Settings::default());
    let (size, subject) = (UVec2::new(24, 16), Subject::new(&scene, &settings));
    let mut background = Background::start();
    assert!(!background.is_working() && background.poll().is_none());
    let look = Look { ev: 0.5, tone_map: ToneMap::Reinhard };
    background.show_as(look);
    background.trace(subject.clone(), &camera, size);
    assert!(background.is_working());
    let traced = rendering(&mut background, 3);
    let tracer = Tracer::new(&scene, subject.transport.clone()).unwrap();
    let mut film = Film::new([24, 16]).unwrap();
    tracer.render(&camera, &mut film, traced.samples);
    let expected = display::encoded(&film.mean(), look.ev, look.tone_map);
    assert!(traced.bytes.as_chunks::<4>().0.iter().flat_map(|rgba| &rgba[..3]).eq(&expected));
    // A probe while the image is in progress.
    background.probe(subject.clone(), &camera, [12.0, 15.5], size);
    let actual = loop {
        match next_report(&mut background) {
            Report::Pixel(actual) => break actual,
            Report::RenderedImage(_) => {}
            Report::Failed(what) => panic!("{what}"),
        }
    };
    assert_eq!(actual.place, tracer.probe(&camera, [12.0, 15.5], [24, 16]));
    assert!(actual.place.is_some() && actual.lights.len() == actual.light_count && actual.light_count > 0);
    // A new exposure applies at once, and tracing continues.
    background.show_as(Look { ev: -20.0, ..look });
    let mut dark = rendering(&mut background, traced.samples);
    while dark.bytes.as_chunks::<4>().0.iter().any(|rgba| rgba[..3] != [0; 3]) {
        dark = rendering(&mut background, dark.samples);
    }
    // Another scene and camera: the first image is not reported again.
    let hall = Arc::new(demo("hall").unwrap());
    background.show_as(look);
    background.trace(Subject::new(&hall, &settings), &hall.default_camera(1.0), UVec2::new(8, 8));
    assert_eq!(rendering(&mut background, 1).size, UVec2::new(8, 8));
    background.forget();
    assert!(!background.is_working());
    thread::sleep(Duration::from_millis(50));
    assert!(background.poll().is_none(), "a cancelled image is reported");
}

#[test]
fn a_scene_that_cannot_be_traced_is_reported() {
    let mut scene = demo("cornell").unwrap();
    scene.instances[0].mesh = 1_000;
    let mut background = Background::start();
    let subject = Subject::new(&Arc::new(scene), &Settings::default());
    background.probe(subject, &demo("cornell").unwrap().default_camera(1.0), [1.0, 1.0], UVec2::new(8, 8));
    assert!(matches!(next_report(&mut background), Report::Failed(what) if what.contains("1000")));
    assert!(!background.is_working());
}
