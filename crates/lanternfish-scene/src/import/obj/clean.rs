//! Rewrites the text of an OBJ file in a plain form that `tobj` reads correctly.
//!
//! `tobj` 4 overruns its lists if an index is far out of range, assigns attributes to the wrong vertices if only
//! some corners have them, and reports no line numbers. Therefore this module checks every line, makes indices
//! absolute, and starts a new shape where the attributes of the corners change.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::Notes;

/// Numbers of vertices, texture coordinates and normals so far.
type Counts = [usize; 3];

/// Upper bound of the ratio of cleaned text to file text. A relative index becomes a long one (`f -1 -1 -1` at the
/// ten-millionth vertex: 11 bytes become 29), a point divided by w grows from 10 to 42 bytes, and a name is stored by its mesh and
/// by its instance.
pub(super) const MOST_GROWTH: u64 = 5;

/// The plain form of a file, and counts of its content.
#[derive(Default)]
pub(super) struct Plain {
    /// The lines that `tobj` reads.
    pub text: String,
    /// Names of materials that faces use, by `usemtl`.
    pub materials: BTreeSet<String>,
    /// Number of triangles that the faces are split into.
    pub triangles: u64,
    /// Names of the shapes that have faces. The text holds indices into this list instead of names: names may be of any
    /// length, and each change of attributes repeats the name.
    pub names: Vec<String>,
    /// True if vertices have colours: numbers after the point.
    pub is_colored: bool,
    /// Number of vertices, texture coordinates and normals together.
    points: u64,
    /// Number of lines at which `tobj` begins a model.
    models: u64,
}

impl Plain {
    /// Upper bound of the memory that reading the text takes, bytes. Each triangle: the corners of `tobj`, and three vertices
    /// with flat normals before and after tangent generation. Each model: that of `tobj` and its mesh, in lists that double as they
    /// grow.
    pub fn bytes_needed(&self) -> u64 {
        48 * self.points + 640 * self.triangles + 1024 * self.models
    }

    /// The name of a shape; `index` is its name in the text.
    pub fn name(&self, index: &str) -> &str {
        index.parse().ok().and_then(|index: usize| self.names.get(index)).map_or("unnamed", String::as_str)
    }
}

/// The plain form of the lines that are read, at most [`MOST_GROWTH`] times as long. An error describes the fault and names
/// its line.
pub(super) fn clean(text: &str, notes: &mut Notes) -> Result<Plain, String> {
    let has_color = |line: &str| matches!(split_key(line), ("v", rest) if rest.split_whitespace().count() > 5);
    let mut plain = Plain { is_colored: text.lines().any(has_color), ..Plain::default() };
    let mut used = None;
    let mut out = String::with_capacity(text.len());
    let mut counts: Counts = [0; 3];
    // Name of the next faces, if it differs from that of the last face.
    let mut next_name = Some("unnamed".to_owned());
    // Attributes that the corners of the last face had.
    let mut last: Option<[bool; 3]> = None;
    let mut joined = String::new();
    for (number, line) in text.lines().enumerate() {
        // A line that ends in \ continues in the next.
        if let Some(part) = line.trim_end().strip_suffix('\\') {
            joined.push_str(part);
            joined.push(' ');
            continue;
        }
        joined.push_str(line);
        let line = std::mem::take(&mut joined);
        let (key, rest) = split_key(&line);
        let fault = |what: String| format!("line {}: {what}", number + 1);
        match key {
            "v" | "vt" | "vn" => {
                let kind = ["v", "vt", "vn"].iter().position(|k| *k == key).unwrap_or(0);
                write_numbers(&mut out, kind, rest, plain.is_colored)
                    .map_err(|what| fault(format!("{key}: {what}")))?;
                counts[kind] += 1;
            }
            "f" => {
                let corners = corners(rest, &counts).map_err(|what| fault(format!("f: {what}")))?;
                if corners.len() < 3 {
                    notes.insert("faces of less than three corners are left out".to_owned());
                    continue;
                }
                plain.triangles += corners.len() as u64 - 2;
                plain.materials.extend(used.take());
                let has = [true, corners.iter().all(|c| c[1] > 0), corners.iter().all(|c| c[2] > 0)];
                plain.names.extend(next_name.take().inspect(|_| last = None));
                if last.replace(has) != Some(has) {
                    let _ = writeln!(out, "g {}", plain.names.len() - 1);
                    plain.models += 1;
                }
                write_face(&mut out, &corners, has);
            }
            "o" | "g" => next_name = Some(if rest.is_empty() { "unnamed" } else { rest }.to_owned()),
            "mtllib" | "usemtl" if !rest.is_empty() => {
                if key == "usemtl" {
                    used = Some(rest.to_owned());
                    plain.models += 1;
                }
                let _ = writeln!(out, "{key} {rest}");
            }
            "l" | "p" => drop(notes.insert("points and lines are left out".to_owned())),
            "curv" | "curv2" | "surf" => drop(notes.insert("curves and free-form surfaces are left out".to_owned())),
            _ => {}
        }
    }
    plain.points = counts.iter().sum::<usize>() as u64;
    plain.text = out;
    Ok(plain)
}

/// The first word of a line, and the rest, trimmed.
pub(super) fn split_key(line: &str) -> (&str, &str) {
    let line = line.trim();
    let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (key, rest.trim())
}

/// Writes a vertex (kind 0), texture coordinate (1) or normal (2). In a file with colours every vertex has one, for `tobj`: white if it has
/// none. Further numbers are dropped.
fn write_numbers(out: &mut String, kind: usize, rest: &str, is_colored: bool) -> Result<(), String> {
    let (mut numbers, mut words) = ([0.0f32; 6], [""; 6]);
    let mut count = 0;
    for (number, word) in numbers.iter_mut().zip(rest.split_whitespace()) {
        words[count] = word;
        *number = word.parse().ok().filter(|n: &f32| n.is_finite()).ok_or_else(|| format!("{word:?} is no number"))?;
        count += 1;
    }
    let (key, least) = [("v", 3), ("vt", 1), ("vn", 3)][kind];
    if count < least {
        return Err(format!("{count} numbers, {least} expected"));
    }
    let ([x, y, z, w, ..], [x_word, y_word, z_word, ..]) = (numbers, words);
    // Four numbers are a homogeneous point; six are a point and its colour.
    if kind == 0 && count == 4 && w != 1.0 {
        let [x, y, z] = [x / w, y / w, z / w];
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            return Err(format!("a point at infinity, w = {w}"));
        }
        let _ = write!(out, "{key} {x:e} {y:e} {z:e}");
    } else {
        // Numbers are copied as text: without an exponent, a short number may have fifty digits.
        let z_word = if kind == 1 { "" } else { z_word };
        out.extend([key, " ", x_word, " ", if count < 2 { "0" } else { y_word }, " ", z_word]);
    }
    if kind == 0 && is_colored {
        let [.., red, green, blue] = if count == 6 { words } else { ["1"; 6] };
        out.extend([" ", red, " ", green, " ", blue]);
    }
    out.push('\n');
    Ok(())
}

/// The corners of a face as absolute indices from 1; 0 for a missing attribute.
fn corners(rest: &str, counts: &Counts) -> Result<Vec<[usize; 3]>, String> {
    let names = ["vertices", "texture coordinates", "normals"];
    let corner = |word: &str| {
        let mut corner = [0; 3];
        for (kind, part) in word.split('/').enumerate() {
            if kind > 2 || (kind == 0 && part.is_empty()) {
                return Err(format!("{word:?} is no corner"));
            }
            if part.is_empty() {
                continue;
            }
            let index: i64 = part.parse().map_err(|_| format!("{word:?} is no corner"))?;
            let count = counts[kind];
            // Negative indices count back from the last element so far.
            let absolute = if index < 0 { index.checked_add(count as i64 + 1) } else { Some(index) };
            corner[kind] = match absolute.map(usize::try_from) {
                Some(Ok(absolute)) if (1..=count).contains(&absolute) => absolute,
                _ => return Err(format!("{index} is referred to, but there are {count} {}", names[kind])),
            };
        }
        Ok(corner)
    };
    rest.split_whitespace().map(corner).collect()
}

fn write_face(out: &mut String, corners: &[[usize; 3]], has: [bool; 3]) {
    out.push('f');
    for [v, vt, vn] in corners {
        let _ = match has {
            [_, true, true] => write!(out, " {v}/{vt}/{vn}"),
            [_, true, false] => write!(out, " {v}/{vt}"),
            [_, false, true] => write!(out, " {v}//{vn}"),
            [_, false, false] => write!(out, " {v}"),
        };
    }
    out.push('\n');
}
