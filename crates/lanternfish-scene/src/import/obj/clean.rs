//! The text of an OBJ file, made plain for the reader behind.
//!
//! `tobj` 4 counts past the end of its lists where an index is far out of range, puts attributes beside the wrong
//! vertices where only some corners have them, and names no lines. So every line is checked here, indices become
//! absolute, and a shape ends where its corners' attributes change.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::Notes;

/// Vertices, texture coordinates and normals so far.
type Counts = [usize; 3];

/// A file made plain.
#[derive(Default)]
pub(super) struct Plain {
    /// The lines that are read.
    pub text: String,
    /// What `usemtl` names before a face.
    pub materials: BTreeSet<String>,
    /// That polygons fall into.
    pub triangles: u64,
    /// Vertices, texture coordinates and normals.
    points: u64,
}

impl Plain {
    /// Bytes that reading the text takes, at most: of each triangle the reader's corners, and three vertices of flat normals
    /// before and after tangents.
    pub fn bytes_needed(&self) -> u64 {
        48 * self.points + 640 * self.triangles
    }
}

/// The lines that are read, each in its plainest form; or what is wrong, with the line.
pub(super) fn clean(text: &str, notes: &mut Notes) -> Result<Plain, String> {
    let mut plain = Plain::default();
    let mut used = None;
    let mut out = String::with_capacity(text.len());
    let mut counts: Counts = [0; 3];
    let mut name = "unnamed".to_owned();
    // Which attributes the corners of the last face had.
    let mut last: Option<[bool; 3]> = None;
    let mut joined = String::new();
    for (number, line) in text.lines().enumerate() {
        // A line that ends in \ goes on in the next.
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
                write_numbers(&mut out, kind, rest).map_err(|what| fault(format!("{key}: {what}")))?;
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
                if last.replace(has).is_some_and(|last| last != has) {
                    let _ = writeln!(out, "g {name}");
                }
                write_face(&mut out, &corners, has);
            }
            "o" | "g" => {
                name = if rest.is_empty() { "unnamed".to_owned() } else { rest.to_owned() };
                let _ = writeln!(out, "g {name}");
            }
            "mtllib" | "usemtl" if !rest.is_empty() => {
                if key == "usemtl" {
                    used = Some(rest.to_owned());
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

/// The first word of a line, and what follows, trimmed.
pub(super) fn split_key(line: &str) -> (&str, &str) {
    let line = line.trim();
    let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (key, rest.trim())
}

/// Writes a vertex (kind 0), texture coordinate (1) or normal (2). Numbers that follow are dropped: colours, depth.
fn write_numbers(out: &mut String, kind: usize, rest: &str) -> Result<(), String> {
    let mut numbers = [0.0f32; 4];
    let mut count = 0;
    for (number, word) in numbers.iter_mut().zip(rest.split_whitespace()) {
        *number = word.parse().ok().filter(|n: &f32| n.is_finite()).ok_or_else(|| format!("{word:?} is no number"))?;
        count += 1;
    }
    let (key, least) = [("v", 3), ("vt", 1), ("vn", 3)][kind];
    if count < least {
        return Err(format!("{count} numbers, {least} expected"));
    }
    let [mut x, mut y, mut z, w] = numbers;
    // Four numbers are homogeneous; six are a point and its colour.
    if kind == 0 && rest.split_whitespace().count() == 4 && w != 1.0 {
        [x, y, z] = [x / w, y / w, z / w];
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            return Err(format!("a point at infinity, w = {w}"));
        }
    }
    let _ = if kind == 1 { writeln!(out, "{key} {x} {y}") } else { writeln!(out, "{key} {x} {y} {z}") };
    Ok(())
}

/// The corners of a face as absolute indices from 1; 0 where there is none.
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
            // Negative ones count back from the last so far.
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
