//! The surface at a hit, with its geometry and material. CPU reference of `gpu_scene/surface.wesl`.

use glam::{DVec3, FloatExt, Vec2, Vec3, Vec3A, Vec4};
use lanternfish_scene::{Material, TextureRef, shading::Materials};

use crate::{
    brdf::{Behind, Bsdf, Grain, Reflector, ScattersThrough},
    layers::{Coat, Layers, Sheen, ThinFilm},
    texture::{self, Encoding},
    world::{Hit, World},
};

/// A surface at a hit point, world space.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    pub p: Vec3A,
    /// Shading normal, unit, on the hit side.
    pub normal: DVec3,
    /// The triangle's normal, unit, on the side of the ray's origin.
    pub geometric_normal: Vec3A,
    /// Emitted radiance of the hit side, nits.
    pub emissive: Vec3,
    /// `None` if the surface does not scatter (unlit).
    pub bsdf: Option<Bsdf>,
    /// Of a boundary that disperses light: [`Behind::Volume`]'s `eta` for red, green and blue.
    pub channel_etas: Option<[f64; 3]>,
    /// Transmittance per metre of the ray segment to this hit, if it was inside a volume.
    pub volume: Option<Vec3>,
}

impl Surface {
    pub fn new(world: &World, hit: &Hit, direction: Vec3A, materials: Materials) -> Self {
        let source = &world.sources[hit.triangle as usize];
        let (primitive, corners) = (world.primitive(source), world.corners(source));
        let material = world.material(source);
        let triangle = &world.triangles[hit.triangle as usize];
        let [u, v, w] = hit.weights;
        let p = triangle.v0 * u + triangle.v1 * v + triangle.v2 * w;
        let geometric = (triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0).normalize();
        let geometric_normal = if geometric.dot(direction) > 0.0 { -geometric } else { geometric };
        let textured = |reference: &_, encoding| {
            let uv = texture::coordinates(reference, primitive, corners, hit.weights);
            texture::sample(world.scene, &world.srgb, reference, encoding, uv)
        };

        // The shading normal: interpolated, perturbed by the normal map, flipped to the hit side.
        let mix =
            |list: &[Vec3]| (0..3).map(|i| Vec3A::from(list[corners[i] as usize]) * hit.weights[i]).sum::<Vec3A>();
        let matrix = &world.normal_matrices[source.instance as usize];
        let side = if hit.front { 1.0 } else { -1.0 };
        let n = unit_or(*matrix * mix(&primitive.normals), side * geometric_normal);
        // The tangent, world space, of any length, and the handedness.
        let tangent = || {
            let linear = world.scene.instances[source.instance as usize].world_from_object.matrix3;
            let tangent: Vec4 = (0..3).map(|i| primitive.tangents[corners[i] as usize] * hit.weights[i]).sum();
            let handedness = primitive.tangents[corners[0] as usize].w * linear.determinant().signum();
            (linear * Vec3A::from(tangent.truncate()), handedness)
        };
        let perturbed = |reference: &Option<TextureRef>, scale: f32| {
            let reference =
                reference.as_ref().filter(|_| materials == Materials::File && !primitive.tangents.is_empty());
            let Some(reference) = reference else { return (side * n).as_dvec3().normalize() };
            let (t, handedness) = tangent();
            let texel = 2.0 * textured(reference, Encoding::Linear) - 1.0;
            let local = Vec3A::new(texel.x * scale, texel.y * scale, texel.z);
            let t = (t - n * n.dot(t)).normalize_or_zero();
            let b = handedness * n.cross(t);
            (side * unit_or(local.x * t + local.y * b + local.z * n, n)).as_dvec3().normalize()
        };
        let normal = perturbed(&material.normal_texture, material.normal_scale);

        let mut base_color = material.base_color;
        if !primitive.colors.is_empty() {
            base_color *= (0..3).map(|i| primitive.colors[corners[i] as usize] * hit.weights[i]).sum::<Vec4>();
        }
        if let Some(reference) = &material.base_color_texture {
            base_color *= textured(reference, Encoding::Srgb);
        }
        let mut emissive = material.emissive;
        if let Some(reference) = &material.emissive_texture {
            emissive *= textured(reference, Encoding::Srgb).truncate();
        }
        // The back of a single-sided surface does not emit.
        if !hit.front && !material.double_sided {
            emissive = Vec3::ZERO;
        }

        let mut surface = Self { p, normal, geometric_normal, emissive, bsdf: None, channel_etas: None, volume: None };
        let color = base_color.truncate().as_dvec3();
        match materials {
            Materials::Lambert => surface.bsdf = Some(Bsdf::Lambert(color)),
            Materials::File if material.unlit => surface.emissive = base_color.truncate(),
            Materials::File => {
                let (mut metallic, mut roughness) = (material.metallic, material.perceptual_roughness);
                if let Some(reference) = &material.metallic_roughness_texture {
                    let texel = textured(reference, Encoding::Linear);
                    metallic *= texel.z;
                    roughness *= texel.y;
                }
                let linear = |texture: &Option<_>| {
                    texture.as_ref().map_or(Vec4::ONE, |reference| textured(reference, Encoding::Linear))
                };
                let tint = material.specular_color_texture.as_ref();
                let tint = tint.map_or(Vec4::ONE, |reference| textured(reference, Encoding::Srgb));
                let dielectric = Dielectric {
                    specular: (material.specular * linear(&material.specular_texture).w).into(),
                    specular_color: (material.specular_color * tint.truncate()).as_dvec3(),
                    transmission: (material.transmission * linear(&material.transmission_texture).x).into(),
                };
                let mut reflector =
                    reflector_of(material, dielectric, color, metallic.into(), roughness.into(), hit.front);
                if material.diffuse_transmission > 0.0 {
                    let tint = material.diffuse_transmission_color_texture.as_ref();
                    let tint = tint.map_or(Vec4::ONE, |reference| textured(reference, Encoding::Srgb));
                    // As the shaders read it, whose layered variant has no place for this texture.
                    let texture = material.diffuse_transmission_texture.filter(|_| !material.is_layered());
                    let fraction = material.diffuse_transmission * linear(&texture).w;
                    let albedo = (material.diffuse_transmission_color * tint.truncate()).as_dvec3();
                    reflector.through =
                        ScattersThrough { fraction: fraction.into(), albedo: (1.0 - f64::from(metallic)) * albedo };
                }
                let textures = material.layer_textures();
                let iridescence = material.iridescence * linear(&textures.iridescence).x;
                if iridescence > 0.0 {
                    let (least, most) = (material.iridescence_thickness_minimum, material.iridescence_thickness);
                    let thickness = textures
                        .iridescence_thickness
                        .map_or(most, |reference| least.lerp(most, textured(&reference, Encoding::Linear).y));
                    let film = ThinFilm { ior: material.iridescence_ior.into(), thickness: thickness.into() };
                    let of_film = film.f0(reflector.f0, -normal.dot(direction.as_dvec3()));
                    reflector.f0 = reflector.f0.lerp(of_film, iridescence.into());
                }
                // Of the texture red and green are the direction, blue the strength.
                let turn = textures.anisotropy.map_or(Vec2::X, |reference| {
                    let texel = textured(&reference, Encoding::Linear);
                    (texel.z * (2.0 * texel.truncate().truncate() - 1.0)).clamp_length_max(1.0)
                });
                let anisotropy = material.anisotropy * turn.length();
                if anisotropy > 0.0 {
                    let has_tangents = !primitive.tangents.is_empty();
                    let (t, handedness) = if has_tangents { tangent() } else { (Vec3A::ZERO, 1.0) };
                    let t = t.as_dvec3() - normal * normal.dot(t.as_dvec3());
                    // Without tangents the direction is arbitrary, and that of the shaders.
                    let t = t.try_normalize().unwrap_or_else(|| normal.any_orthonormal_pair().0);
                    let (sin, cos) = f64::from(material.anisotropy_rotation + turn.to_angle()).sin_cos();
                    let along = cos * t + f64::from(handedness) * sin * normal.cross(t);
                    let grain = Grain::new(along, reflector.perceptual_roughness, anisotropy.into());
                    reflector.perceptual_roughness = grain.mean_roughness();
                    reflector.grain = Some(grain);
                }
                let coat = material.clearcoat * linear(&material.clearcoat_texture).x;
                let coat = (coat > 0.0).then(|| {
                    let roughness = material.clearcoat_roughness * linear(&material.clearcoat_roughness_texture).y;
                    let normal = perturbed(&material.clearcoat_normal_texture, material.clearcoat_normal_scale);
                    Coat { weight: coat.into(), perceptual_roughness: roughness.into(), normal }
                });
                let tint = textures.sheen_color.map_or(Vec4::ONE, |reference| textured(&reference, Encoding::Srgb));
                let color = material.sheen_color * tint.truncate();
                let sheen = (color != Vec3::ZERO).then(|| Sheen {
                    color: color.as_dvec3(),
                    perceptual_roughness: (material.sheen_roughness * linear(&textures.sheen_roughness).w).into(),
                });
                let layers = Layers { sheen, coat };
                surface.bsdf = Some(match layers == Layers::default() {
                    true => Bsdf::MetallicRoughness(reflector),
                    false => Bsdf::Layered(layers, reflector),
                });
                if let Behind::Volume { .. } = reflector.behind
                    && material.dispersion > 0.0
                {
                    let etas = material.channel_iors().map(f64::from);
                    surface.channel_etas = Some(etas.map(|ior| if hit.front { ior } else { 1.0 / ior }));
                }
                if !hit.front && material.transmission > 0.0 && material.thickness > 0.0 {
                    let per_metre = 1.0 / material.attenuation_distance;
                    surface.volume = Some(material.attenuation_color.powf(per_metre));
                }
            }
        }
        surface
    }
}

/// `v` normalized, or `otherwise` if it is too short.
fn unit_or(v: Vec3A, otherwise: Vec3A) -> Vec3A {
    if v.length_squared() > 1e-30 { v.normalize() } else { otherwise }
}

/// Parameters of a material's dielectric part, with textures applied.
struct Dielectric {
    specular: f64,
    specular_color: DVec3,
    transmission: f64,
}

/// The reflector of a glTF material without its textures. CPU reference of the packing in `gpu_scene/upload/materials.rs`.
pub fn reflector(
    material: &Material,
    base_color: DVec3,
    metallic: f64,
    perceptual_roughness: f64,
    front: bool,
) -> Reflector {
    let dielectric = Dielectric {
        specular: material.specular.into(),
        specular_color: material.specular_color.as_dvec3(),
        transmission: material.transmission.into(),
    };
    reflector_of(material, dielectric, base_color, metallic, perceptual_roughness, front)
}

fn reflector_of(
    material: &Material,
    Dielectric { specular, specular_color, transmission }: Dielectric,
    base_color: DVec3,
    metallic: f64,
    perceptual_roughness: f64,
    front: bool,
) -> Reflector {
    let ior = f64::from(material.ior);
    let r = (ior - 1.0) / (ior + 1.0);
    // KHR_materials_specular: the tint is clamped to one before the weight applies.
    let dielectric_f0 = (r * r * specular_color).min(DVec3::ONE) * specular;
    // Without a change of index there are no refracting microfacets.
    let behind = match material.thickness > 0.0 && ior > 1.001 {
        true => Behind::Volume { eta: if front { ior } else { 1.0 / ior } },
        false if material.is_thin_dielectric() => Behind::ThinDielectric,
        false => Behind::Thin,
    };
    Reflector {
        albedo: (1.0 - metallic) * base_color,
        f0: dielectric_f0.lerp(base_color, metallic),
        f90: specular + (1.0 - specular) * metallic,
        perceptual_roughness,
        grain: None,
        transmission,
        behind,
        through: ScattersThrough::default(),
    }
}

/// Transmittance of a thin dielectric at a hit.
pub(crate) fn thin_dielectric_transmittance(world: &World, hit: &Hit, direction: Vec3A) -> Vec3 {
    let surface = Surface::new(world, hit, direction, Materials::File);
    surface.passes_straight(-direction.as_dvec3())
}

impl Surface {
    /// Refracts as light of one channel is.
    pub fn refract_channel(&mut self, channel: usize) {
        if let (Some(etas), Some(Bsdf::MetallicRoughness(reflector) | Bsdf::Layered(_, reflector))) =
            (self.channel_etas, &mut self.bsdf)
        {
            reflector.behind = Behind::Volume { eta: etas[channel] };
        }
    }

    /// Transmittance per channel of light that passes straight through towards `wo`.
    pub fn passes_straight(&self, wo: DVec3) -> Vec3 {
        let (fraction, reflector) = match self.bsdf {
            Some(Bsdf::MetallicRoughness(reflector)) => (1.0, reflector),
            Some(Bsdf::Layered(layers, reflector)) => (layers.fraction_below(self.normal, wo), reflector),
            _ => return Vec3::ZERO,
        };
        if reflector.behind != Behind::ThinDielectric {
            return Vec3::ZERO;
        }
        let passes =
            fraction * (1.0 - reflector.fresnel(self.normal.dot(wo).abs())) * reflector.albedo * reflector.transmission;
        passes.clamp(DVec3::ZERO, DVec3::ONE).as_vec3()
    }
}
