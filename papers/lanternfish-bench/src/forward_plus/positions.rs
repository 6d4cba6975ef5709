//! Accuracy of positions rebuilt from depth, on the processor [Elagabani2025, §4.3.2, alg. 4.1].

use glam::{DVec3, Mat4, Vec2, Vec3, Vec4};

use crate::table::Row;

/// What the table means.
pub const TEXT: &str = "In 32-bit floats. *Accuracy*: the mean of bits that are right, of 32, where u and w are any floats, as Herbie samples \
                        them; *of pixels*: of every pixel of every width up to 2,048. *Error*: of positions in view space, between 0.1 and \
                        100 m, as a part of the distance.";

const WIDEST: u32 = 2048;
/// Near and far plane, m.
const PLANES: [f32; 2] = [0.1, 100.0];
/// Image of the positions, pixels.
const SIZE: [u32; 2] = [1920, 1080];

/// One way to rebuild a position.
struct Way {
    name: &'static str,
    paper: f64,
    /// A pixel's centre in NDC, of the image's width.
    ndc: fn(f32, f32) -> f32,
    /// View space from NDC and depth.
    view: fn(&Mat4, Vec2, f32) -> Vec3,
}

const WAYS: [Way; 2] = [
    Way {
        name: "((u + 0.5) · (1 / w)) · 2 − 1, inverse matrix",
        paper: 0.996,
        ndc: |u, width| ((u + 0.5) * (1.0 / width)) * 2.0 - 1.0,
        view: |clip_from_view, ndc, depth| {
            let p = clip_from_view.inverse() * Vec4::new(ndc.x, ndc.y, depth, 1.0);
            p.truncate() / p.w
        },
    },
    Way {
        name: "fma((u + 0.5) / w, 2, −1), inlined (alg. 4.1)",
        paper: 1.0,
        ndc: |u, width| ((u + 0.5) / width).mul_add(2.0, -1.0),
        view: |clip_from_view, ndc, depth| {
            let [a, b] = [clip_from_view.x_axis.x, clip_from_view.y_axis.y];
            let [c, d] = [clip_from_view.z_axis.z, clip_from_view.w_axis.z];
            let p = Vec4::new(ndc.x / a, ndc.y / b, -1.0, (depth + c) / d);
            p.truncate() / p.w
        },
    },
];

/// A row for each way.
pub fn rows() -> Vec<Row> {
    let row = |way: &Way| {
        let error = position_error(way);
        Row::default()
            .text("name", "", way.name)
            .percent("accuracy", "accuracy", 2, accuracy(way.ndc, any_floats()))
            .percent("pixel_accuracy", "of pixels", 2, accuracy(way.ndc, pixels()))
            .data("position_error", error)
            .shown("error, 10⁻⁹", format_args!("{:.1}", 1e9 * error))
            .percent("paper_accuracy", "thesis: accuracy", 1, way.paper)
    };
    WAYS.iter().map(row).collect()
}

fn exact_ndc(u: f32, width: f32) -> f64 {
    (f64::from(u) + 0.5) / f64::from(width) * 2.0 - 1.0
}

/// Mean fraction of right bits, where the exact value is a float.
fn accuracy(ndc: fn(f32, f32) -> f32, arguments: impl Iterator<Item = (f32, f32)>) -> f64 {
    let exact = arguments.map(|(u, width)| (ndc(u, width), exact_ndc(u, width) as f32));
    let (mut wrong_bits, mut count) = (0.0, 0.0);
    for (actual, exact) in exact.filter(|(_, exact)| exact.is_finite()) {
        wrong_bits += (f64::from(floats_apart(actual, exact)) + 1.0).log2();
        count += 1.0;
    }
    1.0 - wrong_bits / count / 32.0
}

/// Every pixel of every width.
fn pixels() -> impl Iterator<Item = (f32, f32)> {
    (1..=WIDEST).flat_map(|width| (0..width).map(move |u| (u as f32, width as f32)))
}

/// Positive floats, as many of each magnitude: the R2 sequence over their bits [Roberts2018].
fn any_floats() -> impl Iterator<Item = (f32, f32)> {
    let float =
        |i: u32, ratio: f64| f32::from_bits(1 + ((f64::from(i) * ratio).fract() * f64::from(0x7f7f_fffe)) as u32);
    (1..1 << 17).map(move |i| (float(i, 0.754_877_666_246_693), float(i, 0.569_840_290_998_053)))
}

/// Number of floats between two, both ends counted once.
fn floats_apart(a: f32, b: f32) -> u32 {
    // Floats in ascending order are integers in ascending order.
    let ordered = |value: f32| {
        let bits = i64::from(value.to_bits() & 0x7fff_ffff);
        if value.is_sign_negative() { -bits } else { bits }
    };
    ordered(a).abs_diff(ordered(b)).try_into().unwrap_or(u32::MAX)
}

/// Mean distance from the exact position, as a part of its distance from the eye.
fn position_error(way: &Way) -> f64 {
    let [near, far] = PLANES;
    let (c, d) = (near / (far - near), near * far / (far - near));
    let b = 1.0 / 0.5_f32.tan();
    let a = b * SIZE[1] as f32 / SIZE[0] as f32;
    let clip_from_view = Mat4::from_cols(a * Vec4::X, b * Vec4::Y, c * Vec4::Z - Vec4::W, d * Vec4::Z);
    let mut errors = Vec::new();
    for (x, y) in (0..SIZE[0]).step_by(31).flat_map(|x| (0..SIZE[1]).step_by(29).map(move |y| (x, y))) {
        for i in 1..64 {
            // Depths of distances in equal ratios.
            let distance = near * (far / near).powf(i as f32 / 64.0);
            let depth = d / distance - c;
            let ndc = [(x, SIZE[0]), (y, SIZE[1])].map(|(u, size)| (way.ndc)(u as f32, size as f32));
            let actual = (way.view)(&clip_from_view, ndc.into(), depth).as_dvec3();
            let distance = f64::from(d) / (f64::from(depth) + f64::from(c));
            let slopes = [
                exact_ndc(x as f32, SIZE[0] as f32) / f64::from(a),
                exact_ndc(y as f32, SIZE[1] as f32) / f64::from(b),
            ];
            let exact = DVec3::new(slopes[0], slopes[1], -1.0) * distance;
            errors.push(actual.distance(exact) / exact.length());
        }
    }
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn alg_4_1_is_the_most_accurate() {
    let of = |way: &Way| [accuracy(way.ndc, any_floats()), accuracy(way.ndc, pixels()), 1.0 - position_error(way)];
    let [usual, his] = WAYS.each_ref().map(of);
    println!("{usual:?} {his:?}");
    assert!(usual.iter().zip(&his).all(|(usual, his)| his > usual), "{usual:?} {his:?}");
    // His figure, to its last digit.
    assert!((usual[0] - WAYS[0].paper).abs() < 5e-4 && his[0] > 0.998, "{usual:?} {his:?}");
    assert_eq!(
        [floats_apart(0.0, -0.0), floats_apart(1.0, 1.0 + f32::EPSILON), floats_apart(-1e-45, 1e-45)],
        [0, 1, 2]
    );
}
