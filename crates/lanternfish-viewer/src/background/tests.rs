use lanternfish_scene::generate::demo;

use super::*;

/// What is told next, as the window would hear it.
fn hear(background: &mut Background) -> Told {
    let started = Instant::now();
    loop {
        if let Some(told) = background.poll() {
            return told;
        }
        assert!(started.elapsed() < Duration::from_secs(120), "nothing is told");
        thread::sleep(Duration::from_millis(1));
    }
}

fn rendering(background: &mut Background, samples: u64) -> Traced {
    loop {
        match hear(background) {
            Told::RenderedImage(traced) if traced.samples >= samples => return traced,
            Told::RenderedImage(_) => {}
            other => panic!("{other:?}"),
        }
    }
}

/// The image is that of the tracer by itself, whatever is asked in between; and what is given up is not heard of.
#[test]
fn a_image_grows_pixels_are_answered_and_what_is_stopped_stays_silent() {
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
    let mut film = Film::new(24, 16).unwrap();
    tracer.render(&camera, &mut film, traced.samples);
    let by_itself = display::encoded(&film.mean(), look.ev, look.tone_map);
    assert!(traced.bytes.as_chunks::<4>().0.iter().flat_map(|rgba| &rgba[..3]).eq(&by_itself));
    // A pixel, while it goes on.
    background.probe(subject.clone(), &camera, [12.0, 15.5], size);
    let found = loop {
        match hear(&mut background) {
            Told::Pixel(found) => break found,
            Told::RenderedImage(_) => {}
            Told::Failed(what) => panic!("{what}"),
        }
    };
    assert_eq!(found.place, tracer.probe(&camera, [12.0, 15.5], [24, 16]));
    assert!(found.place.is_some() && found.lights.len() == found.light_count && found.light_count > 0);
    // It goes on, and is shown otherwise at once.
    background.show_as(Look { ev: -20.0, ..look });
    let mut dark = rendering(&mut background, traced.samples);
    while dark.bytes.as_chunks::<4>().0.iter().any(|rgba| rgba[..3] != [0; 3]) {
        dark = rendering(&mut background, dark.samples);
    }
    // Another scene, from elsewhere; the first is not heard of again.
    let hall = Arc::new(demo("hall").unwrap());
    background.show_as(look);
    background.trace(Subject::new(&hall, &settings), &hall.default_camera(1.0), UVec2::new(8, 8));
    assert_eq!(rendering(&mut background, 1).size, UVec2::new(8, 8));
    background.forget();
    assert!(!background.is_working());
    thread::sleep(Duration::from_millis(50));
    assert!(background.poll().is_none(), "what was given up is told of");
}

#[test]
fn what_cannot_be_traced_is_told() {
    let mut scene = demo("cornell").unwrap();
    scene.instances[0].mesh = 1_000;
    let mut background = Background::start();
    let subject = Subject::new(&Arc::new(scene), &Settings::default());
    background.probe(subject, &demo("cornell").unwrap().default_camera(1.0), [1.0, 1.0], UVec2::new(8, 8));
    assert!(matches!(hear(&mut background), Told::Failed(what) if what.contains("1000")));
    assert!(!background.is_working());
}
