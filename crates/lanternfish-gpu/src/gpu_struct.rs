//! Structs that host and shader share, checked by reflection.

use naga::TypeInner;

use crate::{LinkedShader, shader::item_name};

/// A field of a [`GpuStruct`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name, in Rust and WGSL.
    pub name: &'static str,
    /// Offset in the struct, bytes.
    pub offset: usize,
    /// Size, bytes.
    pub size: usize,
    /// The name of its type in WGSL.
    pub wgsl: &'static str,
}

/// A struct with the same layout in Rust and WGSL; declared with [`gpu_struct!`](crate::gpu_struct!).
pub trait GpuStruct: bytemuck::Pod {
    /// The struct's name, in Rust and WGSL.
    const NAME: &'static str;
    /// Its fields, without padding.
    const FIELDS: &'static [Field];
}

/// A Rust type with an equivalent in WGSL.
pub trait WgslType {
    /// Name of the type in WGSL.
    const WGSL: &'static str;
}

macro_rules! wgsl_types {
    ($($rust:ty = $wgsl:literal),+ $(,)?) => { $(impl WgslType for $rust { const WGSL: &'static str = $wgsl; })+ };
}
wgsl_types! {
    f32 = "f32", u32 = "u32", i32 = "i32",
    glam::Vec2 = "vec2<f32>", glam::Vec3 = "vec3<f32>", glam::Vec4 = "vec4<f32>",
    glam::UVec2 = "vec2<u32>", glam::UVec3 = "vec3<u32>", glam::UVec4 = "vec4<u32>",
    glam::Mat4 = "mat4x4<f32>",
    [glam::Vec4; 3] = "array<vec4<f32>, 3>", [glam::Vec4; 9] = "array<vec4<f32>, 9>", [glam::UVec4; 9] = "array<vec4<u32>, 9>",
}

/// Declares a struct that shaders read too. Fields must leave no gaps: add explicit padding fields whose names start with `_pad`. The
/// layout check skips their names but includes their size.
///
/// ```
/// lanternfish_gpu::gpu_struct! {
///     /// A sphere, world space.
///     pub struct Sphere {
///         /// Centre, m.
///         center: glam::Vec3,
///         /// m, > 0.
///         radius: f32,
///     }
/// }
/// assert_eq!(size_of::<Sphere>(), 16);
/// ```
#[macro_export]
macro_rules! gpu_struct {
    ($(#[$meta:meta])* $vis:vis struct $name:ident { $($(#[$doc:meta])* $field:ident : $ty:ty),+ $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, $crate::bytemuck::Pod, $crate::bytemuck::Zeroable)]
        #[bytemuck(crate = "::lanternfish_gpu::bytemuck")]
        $vis struct $name { $($(#[$doc])* pub $field: $ty),+ }

        impl $crate::GpuStruct for $name {
            const NAME: &'static str = stringify!($name);
            const FIELDS: &'static [$crate::Field] = &[$($crate::Field {
                name: stringify!($field),
                offset: std::mem::offset_of!($name, $field),
                size: size_of::<$ty>(),
                wgsl: <$ty as $crate::WgslType>::WGSL,
            }),+];
        }
    };
}

/// Declares constants that shaders read too. They must be numbers of types that WGSL has (`usize` maps to `u32`), one per line, in syntax
/// that is valid in both languages.
///
/// ```
/// lanternfish_gpu::gpu_constants! {
///     /// Invocations of a workgroup.
///     pub const WORKGROUP: u32 = 64;
/// }
/// assert_eq!(WORKGROUP, 64);
/// ```
#[macro_export]
macro_rules! gpu_constants {
    ($($constants:item)+) => { $($constants)+ };
}

/// The layouts of a struct in Rust and in a shader differ.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} in {shader}: host has {host}, shader has {shader_has}")]
pub struct LayoutError {
    name: String,
    shader: String,
    host: String,
    shader_has: String,
}

/// A list entry for a [`GpuStruct`]: its name and its layout check.
#[derive(Clone, Copy, Debug)]
pub struct SharedStruct {
    /// The struct's name, in Rust and WGSL.
    pub name: &'static str,
    /// [`check_layout`] for the struct.
    pub check: fn(&LinkedShader) -> Result<(), LayoutError>,
}

impl SharedStruct {
    /// The entry for `T`.
    pub const fn of<T: GpuStruct>() -> Self {
        Self { name: T::NAME, check: check_layout::<T> }
    }
}

/// Compares names, types, offsets and size of `T` with the struct of the same name in a linked shader.
pub fn check_layout<T: GpuStruct>(shader: &LinkedShader) -> Result<(), LayoutError> {
    let fail = |host: String, shader_has: String| {
        Err(LayoutError { name: T::NAME.to_owned(), shader: shader.label.clone(), host, shader_has })
    };
    let types = &shader.module.types;
    let item = types.iter().find(|(_, ty)| ty.name.as_deref().map(item_name) == Some(T::NAME));
    let Some((handle, ty)) = item else {
        return fail("it".to_owned(), "no such struct".to_owned());
    };
    let TypeInner::Struct { members, span } = &ty.inner else {
        return fail("a struct".to_owned(), format!("{:?}", ty.inner));
    };
    // The array stride is compared, because it includes the padding up to the alignment.
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(shader.module.to_ctx()).expect("the shader is valid");
    let stride = layouter[handle].to_stride();
    if stride as usize != size_of::<T>() {
        return fail(format!("size {}", size_of::<T>()), format!("size {stride} (span {span})"));
    }
    let host: Vec<String> = T::FIELDS
        .iter()
        .filter(|f| !f.name.starts_with("_pad"))
        .map(|f| format!("{}: {} @{}", f.name, f.wgsl, f.offset))
        .collect();
    let context = shader.module.to_ctx();
    let shader_has: Vec<String> = members
        .iter()
        .map(|m| (m.name.clone().unwrap_or_default(), type_name(context, m.ty), m.offset))
        .filter(|(name, ..)| !name.starts_with("_pad"))
        .map(|(name, ty, offset)| format!("{name}: {ty} @{offset}"))
        .collect();
    if host != shader_has { fail(host.join(", "), shader_has.join(", ")) } else { Ok(()) }
}

fn type_name(context: naga::proc::GlobalCtx<'_>, ty: naga::Handle<naga::Type>) -> String {
    let scalar = |s: naga::Scalar| match s.kind {
        naga::ScalarKind::Float => "f32",
        naga::ScalarKind::Uint => "u32",
        naga::ScalarKind::Sint => "i32",
        _ => "?",
    };
    match &context.types[ty].inner {
        TypeInner::Scalar(s) | TypeInner::Atomic(s) => scalar(*s).to_owned(),
        TypeInner::Vector { size, scalar: s } => format!("vec{}<{}>", *size as u32, scalar(*s)),
        TypeInner::Matrix { columns, rows, scalar: s } => {
            format!("mat{}x{}<{}>", *columns as u32, *rows as u32, scalar(*s))
        }
        TypeInner::Array { base, size: naga::ArraySize::Constant(n), .. } => {
            format!("array<{}, {n}>", type_name(context, *base))
        }
        TypeInner::Struct { .. } => item_name(context.types[ty].name.as_deref().unwrap_or_default()).to_owned(),
        other => format!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ShaderLibrary;

    crate::gpu_struct! {
        /// A sphere.
        pub struct Sphere {
            /// Centre, m.
            center: glam::Vec3,
            /// Radius, m.
            radius: f32,
        }
    }

    fn linked(fields: &'static str) -> std::sync::Arc<LinkedShader> {
        let text = format!(
            "struct Sphere {{ {fields} }}\n@group(0) var<storage, read_write> s: array<Sphere>;\n\
             @compute @workgroup_size(1) fn main() {{ s[0] = s[1]; }}"
        );
        let sources: &'static [crate::ShaderSource] = vec![("test", text.leak() as &'static str)].leak();
        ShaderLibrary::new(sources).link("test", &[]).unwrap()
    }

    #[test]
    fn equal_layouts_pass_and_every_difference_is_detected() {
        assert_eq!(check_layout::<Sphere>(&linked("center: vec3f, radius: f32")), Ok(()));
        for wrong in [
            "radius: f32, center: vec3f",
            "center: vec3f, radius: u32",
            "center: vec3f, radios: f32",
            "center: vec3f, radius: f32, more: f32",
            "center: vec4f",
        ] {
            assert!(check_layout::<Sphere>(&linked(wrong)).is_err(), "undetected: {wrong}");
        }
    }
}
