//! Opacity of a part of a triangle, by all texels that a ray there may read.

use glam::{DVec2, DVec3};

use super::{
    super::shaders::{MaskHeader, MaskRecord},
    masks::HEADER_WORDS,
    opacity::coordinates,
};

/// Opacity of a subtriangle, as in `mask.wesl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Opacity {
    /// The texture must be read.
    Unknown = 0,
    /// No point reaches the cutoff.
    Empty = 1,
    /// All points reach the cutoff.
    Solid = 2,
}

/// Error of a shader's interpolated texture coordinate, relative to the largest of the corners' coordinates: 32 units in the last place,
/// for the weights, three products, two sums and the scale.
const COORDINATE_ERROR: f64 = 32.0 * f32::EPSILON as f64;
/// Error of a shader's filtered alpha times its factor, relative to the greatest factor: about 80 units in the last place.
const ALPHA_ERROR: f64 = 1e-5;
/// Largest texel coordinate for which the error is below a texel.
const FARTHEST: f64 = (1u32 << 18) as f64;

/// Alpha of an image, and how it is read.
pub(super) struct Mask<'a> {
    header: MaskHeader,
    texels: &'a [u8],
    /// Least and greatest alpha of all texels.
    range: (u8, u8),
}

impl<'a> Mask<'a> {
    /// The mask whose header is at this address of the masks.
    pub fn new(words: &'a [u32], header: u32) -> Self {
        let header: MaskHeader = bytemuck::cast_slice(&words[header as usize..header as usize + HEADER_WORDS])[0];
        let texels: &[u8] = bytemuck::cast_slice(&words[header.texels as usize..]);
        let texels = &texels[..header.size.x as usize * header.size.y as usize];
        let range = texels.iter().fold((255, 0), |(least, most), texel| (least.min(*texel), most.max(*texel)));
        Self { header, texels, range }
    }

    /// True for a pane, whose coverage rays read everywhere.
    pub fn is_pane(&self) -> bool {
        self.header.pane > 0
    }

    /// Number of texels below a triangle, and some around it: the cost of its map.
    pub fn area(&self, record: &MaskRecord) -> f64 {
        let [a, b, c] = coordinates(record).map(|uv| uv * self.header.size.as_dvec2());
        let (across, size) = ((b - a).perp_dot(c - a).abs() / 2.0, a.max(b).max(c) - a.min(b).min(c));
        let area = across + 2.0 * (size.x + size.y) + 4.0;
        if area.is_finite() { area } else { f64::MAX }
    }

    /// The opacity of a complete triangle, if it is the same for every texel of the image.
    pub fn of_everything(&self, record: &MaskRecord) -> Option<Opacity> {
        let [solid_from, empty_to] = self.thresholds(record, [DVec3::X, DVec3::Y, DVec3::Z])?;
        match self.range {
            (least, _) if i32::from(least) >= solid_from => Some(Opacity::Solid),
            (_, most) if i32::from(most) <= empty_to => Some(Opacity::Empty),
            _ => None,
        }
    }

    /// The opacity between these points, barycentric coordinates.
    pub fn opacity(&self, record: &MaskRecord, corners: [DVec3; 3]) -> Opacity {
        self.uniform(record, corners).unwrap_or(Opacity::Unknown)
    }

    /// Bounds of a texel's alpha, 0 to 255: from the first on, the surface is solid; up to the second, it is empty.
    fn thresholds(&self, record: &MaskRecord, corners: [DVec3; 3]) -> Option<[i32; 2]> {
        let factors = DVec3::new(record.alpha_a.into(), record.alpha_b.into(), record.alpha_c.into());
        let cutoff = f64::from(self.header.cutoff);
        if !(factors.is_finite() && factors.min_element() >= 0.0 && cutoff.is_finite()) {
            return None;
        }
        let error = ALPHA_ERROR * factors.max_element();
        let at = corners.map(|corner| corner.dot(factors));
        let (least, most) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
        let (solid, empty) = (255.0 * (cutoff + error) / least, 255.0 * (cutoff - error) / most);
        // Without alpha at any corner, a division by zero gives infinities or NaN, which no texel reaches.
        let solid_from = if solid <= 255.0 { solid.ceil() as i32 } else { 256 };
        let empty_to = if empty > 0.0 { (empty.ceil() - 1.0).min(255.0) as i32 } else { -1 };
        Some([solid_from, empty_to])
    }

    /// None: some points reach the cutoff and others do not, or rounding may decide it.
    fn uniform(&self, record: &MaskRecord, corners: [DVec3; 3]) -> Option<Opacity> {
        let [solid_from, empty_to] = self.thresholds(record, corners)?;
        let size = self.header.size.as_dvec2();
        let of_record = coordinates(record);
        let largest = of_record.iter().fold(DVec2::ZERO, |largest, uv| largest.max(uv.abs())) * size;
        if !(largest.max_element() < FARTHEST && of_record.iter().all(|uv| uv.is_finite())) {
            return None;
        }
        // Around a point, nearest-texel filtering reads one texel, and bilinear filtering those up to half a texel away.
        let reach = if self.header.linear_filter == 0 { 0.0 } else { 0.5 };
        let reach = reach + COORDINATE_ERROR * (largest + 1.0);
        let [a, b, c] = of_record.map(|uv| uv * size);
        let points = corners.map(|w| w.x * a + w.y * b + w.z * c);
        let (low, high) = (points[0].min(points[1]).min(points[2]), points[0].max(points[1]).max(points[2]));
        let rows = (low.y - reach.y).floor() as i32..=(high.y + reach.y).floor() as i32;
        if rows.end() - rows.start() > 2 * self.header.size.y as i32 + 8 {
            return None;
        }
        let (mut least, mut most) = (255, 0);
        for row in rows {
            let band = (f64::from(row) - reach.y, f64::from(row) + 1.0 + reach.y);
            let Some((left, right)) = extent(&points, band) else { continue };
            let columns = ((left - reach.x).floor() as i32, (right + reach.x).floor() as i32);
            let start = wrapped(row, self.header.size.y as i32, self.header.wrap.y) * self.header.size.x as usize;
            let texels = &self.texels[start..start + self.header.size.x as usize];
            for (first, last) in spans(columns, self.header.size.x as i32, self.header.wrap.x) {
                for texel in &texels[first..=last] {
                    (least, most) = (least.min(i32::from(*texel)), most.max(i32::from(*texel)));
                }
            }
            if least < solid_from && most > empty_to {
                return None;
            }
        }
        if least >= solid_from { Some(Opacity::Solid) } else { Some(Opacity::Empty) }
    }
}

/// Corners of the subtriangles of a triangle at a level, barycentric coordinates, in the order of a map: rows along the weight of the third
/// corner; in a row, the weight of the second corner grows.
pub(super) fn subtriangles(level: u32) -> impl Iterator<Item = [DVec3; 3]> {
    let n = 1 << level;
    let point = move |i: i32, j: i32| DVec3::new((n - i - j).into(), i.into(), j.into()) / f64::from(n);
    let of_row = move |j: i32| {
        (0..2 * (n - j) - 1).map(move |k| match (k / 2, k % 2) {
            (i, 0) => [point(i, j), point(i + 1, j), point(i, j + 1)],
            (i, _) => [point(i + 1, j + 1), point(i, j + 1), point(i + 1, j)],
        })
    };
    (0..n).flat_map(of_row)
}

/// The least and greatest x of a triangle's points with y in the band.
fn extent(points: &[DVec2; 3], (low, high): (f64, f64)) -> Option<(f64, f64)> {
    let mut range: Option<(f64, f64)> = None;
    let mut add = |x: f64| range = Some(range.map_or((x, x), |(least, most)| (least.min(x), most.max(x))));
    for i in 0..3 {
        let (a, b) = (points[i], points[(i + 1) % 3]);
        if a.y >= low && a.y <= high {
            add(a.x);
        }
        for y in [low, high] {
            if (a.y < y) != (b.y < y) {
                // The edge's own ends bound the rounding error.
                add((a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y))).clamp(a.x.min(b.x), a.x.max(b.x)));
            }
        }
    }
    range
}

const REPEAT: u32 = 0;
const MIRRORED_REPEAT: u32 = 1;

/// A texel coordinate after wrapping.
fn wrapped(at: i32, size: i32, wrap: u32) -> usize {
    let at = match wrap {
        REPEAT => at.rem_euclid(size),
        MIRRORED_REPEAT => {
            let at = at.rem_euclid(2 * size);
            at.min(2 * size - 1 - at)
        }
        _ => at.clamp(0, size - 1),
    };
    at as usize
}

/// The texels of a row, first and last, between two coordinates.
fn spans((first, last): (i32, i32), size: i32, wrap: u32) -> impl Iterator<Item = (usize, usize)> {
    let all = wrap <= MIRRORED_REPEAT && last - first >= size;
    let mut next = if all { None } else { Some(first) };
    let rest = std::iter::from_fn(move || {
        let from = next?;
        // The coordinates up to the next multiple of the size are consecutive texels.
        let to = if wrap <= MIRRORED_REPEAT { last.min(from.div_euclid(size) * size + size - 1) } else { last };
        next = (to < last).then_some(to + 1);
        let (a, b) = (wrapped(from, size, wrap), wrapped(to, size, wrap));
        Some((a.min(b), a.max(b)))
    });
    all.then_some((0, size as usize - 1)).into_iter().chain(rest)
}
