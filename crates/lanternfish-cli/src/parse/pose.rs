//! Cameras as calibrations and data sets state them.

use glam::{Affine3A, DMat3, Mat3A, Quat, Vec3};
use lanternfish_scene::named_enum;

use super::{near_enough, number, numbers};

named_enum! {
    /// Axes of a camera.
    #[derive(Default)]
    PoseConvention {
        #[default]
        Opengl = "opengl": "x right, y up, and it looks along -z, as in glTF, Blender and NeRF",
        Opencv = "opencv": "x right, y down, and it looks along z, as in OpenCV and COLMAP",
    }
}

impl PoseConvention {
    /// The pose of the same camera with the axes of OpenGL.
    pub fn to_opengl(self, pose: Affine3A) -> Affine3A {
        match self {
            Self::Opengl => pose,
            Self::Opencv => pose * Affine3A::from_scale(Vec3::new(1.0, -1.0, -1.0)),
        }
    }
}

/// Parses focal lengths and principal point, `fx,fy,cx,cy`, pixels.
pub fn intrinsics(text: &str) -> Result<[f32; 4], String> {
    let values = numbers(text).and_then(|values| <[f32; 4]>::try_from(values).ok());
    values.filter(|[fx, fy, ..]| *fx > 0.0 && *fy > 0.0).ok_or_else(|| {
        "expected fx,fy,cx,cy in pixels, focal lengths above 0, e.g. 600,600,320,240 for 640x480".to_owned()
    })
}

/// Parses a pose: 16 numbers row by row, or the name of a file with them, in which brackets, commas and spaces may stand between.
pub fn pose(text: &str) -> Result<Affine3A, String> {
    let is_list = text.split(',').count() == 16;
    let read = if is_list { Ok(text.to_owned()) } else { lanternfish_scene::read_text(text.as_ref()) };
    let expected = "expected 16 numbers separated by commas, or a text file with them";
    let read = read.map_err(|error| format!("{error}: {expected}"))?;
    let words = read.split(|c: char| c.is_whitespace() || ",[]()".contains(c)).filter(|word| !word.is_empty());
    let values = words.map(number).collect::<Option<Vec<_>>>().and_then(|values| <[f32; 16]>::try_from(values).ok());
    let values = values.ok_or(expected)?;
    let row = |i: usize| Vec3::from_slice(&values[4 * i..]);
    if values[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(
            "the last row: expected 0,0,0,1, of a matrix row by row that maps the camera to the world".to_owned()
        );
    }
    let rotation = Mat3A::from_cols(row(0).into(), row(1).into(), row(2).into()).transpose();
    let axes: DMat3 = glam::Mat3::from(rotation).as_dmat3();
    // Files have as few as four digits.
    if !(axes * axes.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-3) || axes.determinant() < 0.0 {
        return Err("it scales, shears or mirrors: expected a rotation and a translation".to_owned());
    }
    let position = near_enough(Vec3::new(values[3], values[7], values[11]))?;
    // Axes of length 1 stay as they are, so that a written pose is read again to the bit.
    let is_exact = (axes * axes.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-6);
    let rotation = if is_exact { rotation } else { Mat3A::from_quat(Quat::from_mat3a(&rotation).normalize()) };
    Ok(Affine3A { matrix3: rotation, translation: position.into() })
}
