//! Ambient occlusion with 512 deep images [Aalund2015, figs 8 and 9].

use lanternfish::settings::Occlusion;
use lanternfish_cli::error::CliError;
use lanternfish_papers::DeepImageSettings;

use super::{cases::papers_images, paper};
use crate::{
    ground_truths::{self, GroundTruth},
    one_bounce::Bench,
    run::{counter, ms_of},
    table::Row,
    technique,
};

/// What the table means.
pub const TEXT: &str = "White surfaces under a white sky, against the path tracer's visible fraction of the sphere with the same distance. *Within \
                        28 %*: obscurance up to 28 % of the scene's diagonal, which is what his 1,280 units are of Crytek Sponza (fig. 8); else \
                        everything occludes (fig. 9). *As in the paper*: the first fragment of one texel, weights of 2 / N, images without triangles; \
                        else images hold them, and those of near fragments are tested.";

/// One way to find occlusion.
struct Way {
    name: &'static str,
    ground_truth: GroundTruth,
    occlusion: Occlusion,
    images: DeepImageSettings,
}

/// All of them; `far`: the distance of [`GroundTruth::ObscuranceFar`], m.
fn ways(far: f32) -> Vec<Way> {
    use GroundTruth::{ObscuranceFar as Far, Occlusion as All};
    let way = |name, ground_truth, occlusion, images| Way { name, ground_truth, occlusion, images };
    let (deep, plain, far) = (technique::deep_occlusion, technique::plain_occlusion, Some(far));
    let usual = DeepImageSettings::default();
    vec![
        way("as in the paper, within 28 %, 512 x 200²", Far, plain(far), papers_images(200)),
        way("deep, within 28 %, 512 x 200²", Far, deep(far), papers_images(200)),
        way("deep, within 28 %, as usual", Far, deep(far), usual),
        way("hbao, within 28 %", Far, technique::hbao(far.unwrap_or_default()), usual),
        way("as in the paper, 512 x 50²", All, plain(None), papers_images(50)),
        way("deep, 512 x 50²", All, deep(None), papers_images(50)),
        way("as in the paper, 512 x 200²", All, plain(None), papers_images(200)),
        way("deep, 512 x 200²", All, deep(None), papers_images(200)),
        way("deep, as usual", All, deep(None), usual),
    ]
}

/// Ways to find occlusion, on white surfaces under a white sky; and those as in the paper beside its own figures.
pub fn rows(bench: &Bench) -> Result<(Vec<Row>, Vec<Row>), CliError> {
    let scene = ground_truths::white(bench.scene.clone());
    let far = GroundTruth::ObscuranceFar.max_distance(scene.bounds().size().length()).expect("it has a distance");
    let of = |ground_truth| Ok::<_, CliError>((ground_truth, bench.ground_truth_of(ground_truth, &scene)?));
    let ground_truths = [of(GroundTruth::ObscuranceFar)?, of(GroundTruth::Occlusion)?];
    let look = GroundTruth::Occlusion.seen(&bench.look);
    let (mut rows, mut beside) = (Vec::new(), paper::his(&paper::OCCLUSION));
    for Way { name, ground_truth, occlusion, images } in ways(far) {
        let settings = look.clone().with_occlusion(occlusion).with_structure(images);
        let rendered = bench.render_scene(&scene, &settings, bench.size)?;
        bench.write(&format!("occlusion, {name}"), &rendered.rendering)?;
        let (_, mean) = ground_truths.iter().find(|(known, _)| *known == ground_truth).expect("both are traced");
        let (flip, energy) = bench.against(&rendered.rendering, mean)?;
        let bytes = counter(&rendered.rendering.report, "deep_images/bytes");
        let build_ms = ms_of(&rendered.first, "deep_images/");
        let occlusion_ms = ms_of(&rendered.rendering.report.passes, "occlusion/");
        if name.starts_with("as in") {
            beside.push(paper::ours(name, images.resolution, build_ms + occlusion_ms, None, Some(bytes as f64 / 1e6)));
        }
        rows.push(
            Row::default()
                .text("name", "", name)
                .fixed("deep_images_ms", "deep images, ms", 0, build_ms)
                .count("bytes", "MB", bytes)
                .said_as(format_args!("{:.1}", bytes as f64 / 1e6))
                .fixed("occlusion_ms", "occlusion, ms", 1, occlusion_ms)
                .fixed("flip", "FLIP", 4, flip)
                .fixed("energy", "energy", 3, energy),
        );
    }
    Ok((rows, beside))
}

/// What is bounded is judged by the ground truth with the same bound.
#[test]
fn every_way_has_the_distance_of_its_ground_truth() {
    let diagonal = 40.0;
    let far = GroundTruth::ObscuranceFar.max_distance(diagonal).unwrap();
    for way in ways(far) {
        let expected = way.ground_truth.max_distance(diagonal);
        let deep = [technique::deep_occlusion(expected), technique::plain_occlusion(expected)];
        let is_hbao = expected.is_some_and(|distance| way.occlusion == technique::hbao(distance));
        assert!(deep.contains(&way.occlusion) || is_hbao, "{}", way.name);
        assert_eq!(way.name.contains("28 %"), expected.is_some(), "{}", way.name);
    }
}
