//! Checks that a scene satisfies the invariants that its types document.

use glam::Vec3;

use crate::{Light, LightKind, Material, Primitive, Scene, SceneFault};

/// Tolerance of unit lengths: two orders of magnitude above the error of normalising in f32, and below visible errors of shading.
pub(crate) const UNIT_TOLERANCE: f32 = 1e-3;

impl Scene {
    /// Maximum distance of surfaces, lights and cameras from the origin, along each axis, m. Products of three such lengths,
    /// such as volumes, are finite floats.
    #[doc(hidden)]
    pub const FARTHEST: f32 = 1e12;

    /// Checks that everything is within [`Scene::FARTHEST`]; the error names the first object that is not. Indices must be in range. Takes
    /// time linear in the vertices.
    #[doc(hidden)]
    pub fn check_reach(&self) -> Result<(), SceneFault> {
        let within = |p: glam::Vec3| p.abs().max_element() <= Self::FARTHEST && !p.is_nan();
        let fault = |p: glam::Vec3| {
            format!("{:e} m from the origin, farther than {:e} m", p.abs().max_element(), Self::FARTHEST)
        };
        let boxes = self.boxes();
        for (index, instance) in self.instances.iter().enumerate() {
            for bounds in boxes[instance.mesh].iter().filter(|bounds| !bounds.is_empty()) {
                // Checks each corner, since the box of NaN corners would be empty.
                let corners = bounds.corners().map(|corner| instance.world_from_object.transform_point3(corner));
                if let Some(corner) = corners.into_iter().find(|corner| !within(*corner)) {
                    return Err(SceneFault::Instance { index, name: instance.name.clone(), what: fault(corner) });
                }
            }
        }
        if let Some((index, light)) = self.lights.iter().enumerate().find(|(_, light)| !within(light.position)) {
            return Err(SceneFault::Light { index, name: light.name.clone(), what: fault(light.position) });
        }
        if let Some((index, camera)) = self.cameras.iter().enumerate().find(|(_, camera)| !within(camera.eye())) {
            return Err(SceneFault::Camera { index, name: camera.name.clone(), what: fault(camera.eye()) });
        }
        Ok(())
    }

    /// Checks that every index, length and unit vector is as the types document, and that everything is within
    /// [`Scene::FARTHEST`]. The error gives the first fault and its location. Takes time linear in the scene. Not checked: that
    /// surfaces are closed, and that windings agree with normals (see [`Primitive::winding_faults`]).
    pub fn validate(&self) -> Result<(), SceneFault> {
        for (index, mesh) in self.meshes.iter().enumerate() {
            for (primitive, content) in mesh.primitives.iter().enumerate() {
                let fault = |what| SceneFault::Mesh { index, name: mesh.name.clone(), primitive, what };
                content.validate(self.materials.len()).map_err(fault)?;
            }
        }
        for (index, instance) in self.instances.iter().enumerate() {
            let fault = |what| Err(SceneFault::Instance { index, name: instance.name.clone(), what });
            if instance.mesh >= self.meshes.len() {
                return fault(format!("mesh {} of {}", instance.mesh, self.meshes.len()));
            }
            if !instance.world_from_object.is_finite() {
                return fault("its transform is not finite".to_owned());
            }
        }
        for (index, material) in self.materials.iter().enumerate() {
            let fault = |what| SceneFault::Material { index, name: material.name.clone(), what };
            material.validate(self.textures.len()).map_err(fault)?;
        }
        self.validate_textures()?;
        self.validate_lights()?;
        self.validate_cameras()?;
        self.motion.validate(self).map_err(|what| SceneFault::Motion { what })?;
        self.check_reach()?;
        if !self.sky.is_finite() || self.sky.min_element() < 0.0 {
            return Err(SceneFault::Sky { what: format!("{} is not a radiance", self.sky) });
        }
        if let Some(environment) = &self.environment {
            environment.validate().map_err(|what| SceneFault::Environment { what })?;
        }
        Ok(())
    }

    fn validate_textures(&self) -> Result<(), SceneFault> {
        for (index, texture) in self.textures.iter().enumerate() {
            if texture.image >= self.images.len() || texture.sampler >= self.samplers.len() {
                let (images, samplers) = (self.images.len(), self.samplers.len());
                let what = format!("{texture:?} with {images} images, {samplers} samplers");
                return Err(SceneFault::Texture { index, what });
            }
        }
        for (index, image) in self.images.iter().enumerate() {
            let (bytes, expected) = (image.rgba.len(), 4 * image.width as usize * image.height as usize);
            if expected == 0 || bytes != expected {
                let what = format!("{bytes} bytes for {} × {} pixels", image.width, image.height);
                return Err(SceneFault::Image { index, name: image.name.clone(), what });
            }
        }
        Ok(())
    }

    fn validate_lights(&self) -> Result<(), SceneFault> {
        for (index, light) in self.lights.iter().enumerate() {
            let fault = |what: &str| SceneFault::Light { index, name: light.name.clone(), what: what.to_owned() };
            light.validate().map_err(fault)?;
        }
        Ok(())
    }

    fn validate_cameras(&self) -> Result<(), SceneFault> {
        for (index, camera) in self.cameras.iter().enumerate() {
            let fault = |what| SceneFault::Camera { index, name: camera.name.clone(), what };
            camera.validate().map_err(fault)?;
        }
        Ok(())
    }
}

impl Light {
    /// Checks that the light is as the type documents; the error is the first fault.
    #[doc(hidden)]
    pub fn validate(&self) -> Result<(), &'static str> {
        if !self.position.is_finite() {
            return Err("its position is not finite");
        }
        if !is_unit(self.direction) {
            return Err("its direction is not of unit length");
        }
        if !self.intensity.is_finite() || self.intensity.min_element() < 0.0 {
            return Err("its intensity is negative or not finite");
        }
        if self.range.is_some_and(|range| range.is_nan() || range <= 0.0) {
            return Err("its range is not positive");
        }
        if let LightKind::Spot { inner_angle, outer_angle } = self.kind
            && !(0.0 <= inner_angle && inner_angle < outer_angle && outer_angle <= std::f32::consts::FRAC_PI_2)
        {
            return Err("its cone breaks 0 <= inner < outer <= π/2");
        }
        area_fault(self).map_or(Ok(()), Err)
    }
}

/// The first fault of the shape of a disk or rectangle.
fn area_fault(light: &Light) -> Option<&'static str> {
    let (sides, right) = match light.kind {
        LightKind::Disk { radius } => ([radius, radius], None),
        LightKind::Rectangle { half_width, half_height, right } => ([half_width, half_height], Some(right)),
        LightKind::Point | LightKind::Spot { .. } | LightKind::Directional => return None,
    };
    let is_across = |right: Vec3| is_unit(right) && right.dot(light.direction).abs() < 1e-3;
    if !sides.iter().all(|side| *side > 0.0 && *side <= Scene::FARTHEST) {
        Some("its size is not positive, or too large")
    } else if !right.is_none_or(is_across) {
        Some("its width does not go across its direction, or is not of unit length")
    } else if !(light.area() > Some(0.0) && light.greatest_intensity().is_finite()) {
        Some("its area is too small or too bright for numbers")
    } else {
        None
    }
}

impl Primitive {
    /// Number of triangles that face away from the mean of their vertex normals: clockwise instead of counter-clockwise.
    /// Zero for generated scenes; imported files may have some.
    #[doc(hidden)]
    pub fn winding_faults(&self) -> usize {
        let is_flipped = |t: &&[u32]| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| i as usize);
            let p = &self.positions;
            let face = (p[b] - p[a]).cross(p[c] - p[a]);
            face.dot(self.normals[a] + self.normals[b] + self.normals[c]) <= 0.0
        };
        self.indices.chunks_exact(3).filter(is_flipped).count()
    }

    fn validate(&self, material_count: usize) -> Result<(), String> {
        let count = self.positions.len();
        if self.material >= material_count {
            return Err(format!("material {} of {material_count}", self.material));
        }
        if !self.indices.len().is_multiple_of(3) {
            return Err(format!("{} indices are no whole triangles", self.indices.len()));
        }
        if let Some(index) = self.indices.iter().find(|i| **i as usize >= count) {
            return Err(format!("index {index} of {count} vertices"));
        }
        if self.normals.len() != count {
            return Err(format!("{} normals for {count} vertices", self.normals.len()));
        }
        let optional = [
            ("tangents", self.tangents.len()),
            ("uv0", self.uv0.len()),
            ("uv1", self.uv1.len()),
            ("colors", self.colors.len()),
        ];
        if let Some((name, length)) = optional.iter().find(|(_, length)| *length != 0 && *length != count) {
            return Err(format!("{length} {name} for {count} vertices"));
        }
        if let Some(i) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(format!("position {i} is {}", self.positions[i]));
        }
        if let Some(i) = self.normals.iter().position(|n| !is_unit(*n)) {
            return Err(format!("normal {i} is {}, not of unit length", self.normals[i]));
        }
        if let Some(i) = self.tangents.iter().position(|t| !is_unit(t.truncate()) || t.w.abs() != 1.0) {
            return Err(format!("tangent {i} is {}", self.tangents[i]));
        }
        if let Some(i) = self.uv0.iter().chain(&self.uv1).position(|uv| !uv.is_finite()) {
            return Err(format!("texture coordinate {i} is not finite"));
        }
        if let Some(i) = self.colors.iter().position(|c| !(c.min_element() >= 0.0 && c.max_element() <= 1.0)) {
            return Err(format!("colour {i} is {}, outside 0..=1", self.colors[i]));
        }
        Ok(())
    }
}

impl Material {
    /// Checks that the material is as the type documents, in a scene with `texture_count` textures; the error is the first fault.
    #[doc(hidden)]
    pub fn validate(&self, texture_count: usize) -> Result<(), String> {
        for texture in self.textures().into_iter().flatten() {
            if texture.texture >= texture_count || texture.uv_set > 1 || !texture.texture_from_uv.is_finite() {
                return Err(format!("{texture:?} with {texture_count} textures"));
            }
        }
        let in_unit = |x: f32| (0.0..=1.0).contains(&x);
        if !self.base_color.to_array().into_iter().all(in_unit) {
            return Err(format!("base colour {}, outside 0..=1", self.base_color));
        }
        if ![self.metallic, self.perceptual_roughness, self.occlusion_strength].into_iter().all(in_unit) {
            return Err("metallic, roughness or occlusion strength outside 0..=1".to_owned());
        }
        if !in_unit(self.specular) || !in_unit(self.transmission) {
            return Err("specular or transmission outside 0..=1".to_owned());
        }
        let scattered_through =
            [self.diffuse_transmission].into_iter().chain(self.diffuse_transmission_color.to_array());
        if !scattered_through.into_iter().all(in_unit) {
            return Err("diffuse transmission or its colour outside 0..=1".to_owned());
        }
        let lobes = [self.clearcoat, self.clearcoat_roughness, self.sheen_roughness, self.anisotropy, self.iridescence];
        if !lobes.into_iter().chain(self.sheen_color.to_array()).all(in_unit) {
            return Err("clear coat, sheen, anisotropy, iridescence or a roughness of them outside 0..=1".to_owned());
        }
        let thicknesses = [self.iridescence_thickness, self.iridescence_thickness_minimum];
        let has_thickness = thicknesses.into_iter().all(|nm| nm >= 0.0 && nm.is_finite());
        if !(has_thickness && self.iridescence_ior >= 1.0 && self.iridescence_ior.is_finite()) {
            return Err("film without an index of refraction of at least 1 or a thickness".to_owned());
        }
        if !(self.ior == 0.0 || (self.ior >= 1.0 && self.ior.is_finite())) {
            return Err(format!("index of refraction {}, neither 0 nor at least 1", self.ior));
        }
        if !(self.specular_color.is_finite() && self.specular_color.min_element() >= 0.0) {
            return Err(format!("specular colour {} is not finite, or negative", self.specular_color));
        }
        if !(self.thickness >= 0.0 && self.thickness.is_finite() && self.attenuation_distance > 0.0) {
            return Err("thickness is negative or not finite, or attenuation distance is not positive".to_owned());
        }
        if !(self.dispersion >= 0.0 && self.dispersion.is_finite()) {
            return Err(format!("dispersion {}, negative or not finite", self.dispersion));
        }
        if !self.attenuation_color.to_array().into_iter().all(in_unit) {
            return Err(format!("attenuation colour {}, outside 0..=1", self.attenuation_color));
        }
        if !self.clearcoat_normal_scale.is_finite() || !self.anisotropy_rotation.is_finite() {
            return Err("normal scale of the clear coat or direction of the grain is not finite".to_owned());
        }
        if !self.normal_scale.is_finite() || !self.emissive.is_finite() || self.emissive.min_element() < 0.0 {
            return Err("normal scale or emission is not finite, or negative".to_owned());
        }
        Ok(())
    }
}

fn is_unit(v: Vec3) -> bool {
    (v.length() - 1.0).abs() < UNIT_TOLERANCE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, Environment, Image, Instance, Light, Mesh, Projection, Texture, TextureRef};

    fn triangle() -> Scene {
        let primitive = Primitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        };
        Scene {
            meshes: vec![Mesh { name: "triangle".to_owned(), primitives: vec![primitive] }],
            instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: Default::default() }],
            materials: vec![Material::default()],
            images: vec![Image { name: String::new(), width: 1, height: 1, rgba: vec![0; 4] }],
            lights: vec![Light::point(Vec3::ONE, Vec3::ONE)],
            cameras: vec![Camera::look_at(Vec3::Z, Vec3::ZERO, Projection::Perspective { fov_y: 1.0, near: 0.1 })],
            ..Scene::default()
        }
    }

    /// The error for a valid scene after `damage`.
    fn fault(damage: impl Fn(&mut Scene)) -> String {
        let mut scene = triangle();
        damage(&mut scene);
        scene.validate().expect_err("the damage is not detected").to_string()
    }

    #[test]
    fn a_valid_scene_passes() {
        assert_eq!(triangle().validate(), Ok(()));
        assert_eq!(triangle().meshes[0].primitives[0].winding_faults(), 0);
    }

    #[test]
    fn every_damage_is_named() {
        let primitive = |scene: &mut Scene, f: &dyn Fn(&mut Primitive)| f(&mut scene.meshes[0].primitives[0]);
        assert!(fault(|s| primitive(s, &|p| p.indices[2] = 3)).contains("index 3 of 3"));
        assert!(fault(|s| primitive(s, &|p| p.indices.truncate(2))).contains("2 indices are no whole triangles"));
        assert!(fault(|s| primitive(s, &|p| p.normals.clear())).contains("0 normals for 3"));
        assert!(fault(|s| primitive(s, &|p| p.colors = vec![Default::default(); 2])).contains("2 colors for 3"));
        assert!(fault(|s| s.instances[0].world_from_object.translation.x = f32::NAN).contains("is not finite"));
        assert!(fault(|s| s.instances[0].world_from_object.matrix3 *= f32::INFINITY).contains("is not finite"));
        assert!(fault(|s| s.textures = vec![Texture { image: 1, sampler: 0 }]).contains("texture 0"));
        assert!(fault(|s| s.textures = vec![Texture { image: 0, sampler: 0 }]).contains("texture 0"));
        assert!(fault(|s| s.materials[0].perceptual_roughness = f32::NAN).contains("metallic, roughness"));
        assert!(fault(|s| s.images[0] = Image::default()).contains("image 0"));
        assert!(fault(|s| s.lights[0].position.x = f32::NAN).contains("light 0 (): its position"));
        assert!(fault(|s| s.lights[0].intensity.y = f32::INFINITY).contains("light 0 (): its intensity"));
        assert!(fault(|s| primitive(s, &|p| p.normals[1] *= 1.01)).contains("normal 1"));
        assert!(fault(|s| primitive(s, &|p| p.positions[0].y = f32::NAN)).contains("position 0"));
        assert!(fault(|s| primitive(s, &|p| p.uv0.push(Default::default()))).contains("1 uv0"));
        assert!(fault(|s| primitive(s, &|p| p.material = 1)).contains("material 1 of 1"));
        assert!(fault(|s| s.instances[0].mesh = 4).contains("mesh 4 of 1"));
        assert!(fault(|s| s.materials[0].normal_texture = Some(TextureRef::new(0))).contains("material 0"));
        assert!(fault(|s| s.materials[0].ior = 0.5).contains("refraction 0.5"));
        assert!(fault(|s| s.materials[0].specular = 1.5).contains("specular"));
        assert!(fault(|s| s.materials[0].specular_color.y = -1.0).contains("specular colour"));
        assert!(fault(|s| s.materials[0].thickness = -1.0).contains("thickness"));
        assert!(fault(|s| s.materials[0].thickness = f32::INFINITY).contains("thickness"));
        assert!(fault(|s| s.materials[0].attenuation_distance = 0.0).contains("attenuation distance"));
        assert!(fault(|s| s.materials[0].attenuation_distance = f32::NAN).contains("attenuation distance"));
        assert!(fault(|s| s.materials[0].attenuation_color.z = 1.5).contains("attenuation colour"));
        assert!(fault(|s| s.images[0].height = 2).contains("4 bytes"));
        assert!(fault(|s| s.lights[0].range = Some(0.0)).contains("range"));
        assert!(fault(|s| s.lights[0].direction = Vec3::ZERO).contains("direction"));
        for radius in [0.0, -1.0, f32::NAN, f32::INFINITY, 2e12] {
            assert!(fault(|s| s.lights[0].kind = LightKind::Disk { radius }).contains("its size"), "{radius}");
        }
        let rectangle = |half_height, right| LightKind::Rectangle { half_width: 1.0, half_height, right };
        let across = triangle().lights[0].direction.any_orthonormal_vector();
        assert!(fault(|s| s.lights[0].kind = rectangle(0.0, across)).contains("its size"));
        assert!(fault(|s| s.lights[0].kind = rectangle(1.0, 2.0 * across)).contains("its width"));
        assert!(fault(|s| s.lights[0].kind = rectangle(1.0, s.lights[0].direction)).contains("its width"));
        assert!(fault(|s| s.lights[0].kind = LightKind::Disk { radius: 1e-30 }).contains("its area"));
        let bright = |s: &mut Scene| s.lights[0] = Light::disk(Vec3::ZERO, Vec3::X, 1e10, Vec3::splat(1e30));
        assert!(fault(bright).contains("its area"));
        let mut rectangular = triangle();
        rectangular.lights[0].kind = rectangle(1.0, across);
        assert_eq!(rectangular.validate(), Ok(()));
        assert!(fault(|s| s.cameras[0].world_from_camera.matrix3 *= 2.0).contains("camera 0"));
        assert!(fault(|s| s.sky.x = -1.0).contains("sky"));
        let pixels = |pixels: Vec<Vec3>| Some(Environment { width: 2, height: 1, pixels, rotation: 0.0 });
        assert!(fault(|s| s.environment = pixels(vec![Vec3::ONE])).contains("environment: 1 pixels for 2 × 1"));
        assert!(fault(|s| s.environment = pixels(vec![Vec3::ONE, Vec3::NAN])).contains("environment: pixel 1, 0"));
        assert!(fault(|s| s.environment = pixels(vec![Vec3::NEG_X; 2])).contains("environment: pixel 0, 0"));
        let rotated = |s: &mut Scene| {
            s.environment = pixels(vec![Vec3::ONE; 2]);
            s.environment.as_mut().expect("set above").rotation = f32::INFINITY;
        };
        assert!(fault(rotated).contains("environment: its rotation is inf"));
    }

    #[test]
    fn distant_objects_are_named() {
        let moved = |scene: &mut Scene, by: f32| scene.instances[0].world_from_object.translation.x = by;
        assert!(fault(|s| moved(s, 1.1e12)).contains("instance 0 (): 1.1e12 m from the origin"));
        assert!(fault(|s| s.lights[0].position.y = -2e12).contains("light 0 (): 2e12 m"));
        let camera = fault(|s| s.cameras[0].world_from_camera.translation.z = 1e13);
        assert!(camera.starts_with("camera 0 ()") && camera.contains("1e12 m"), "{camera}");
        // Corners whose transforms are NaN.
        let spun = |s: &mut Scene| {
            s.meshes[0].primitives[0].positions = vec![Vec3::splat(-3e38), Vec3::splat(3e38), Vec3::X];
            s.instances[0].world_from_object.matrix3 =
                glam::Mat3A::from_cols_array(&[2., 2., 2., -2., -2., -2., 2., -2., 2.]);
        };
        assert!(fault(spun).contains("instance 0"));
        let mut far = triangle();
        moved(&mut far, 9e11);
        assert_eq!(far.validate(), Ok(()));
    }

    #[test]
    fn a_flipped_triangle_is_counted() {
        let mut primitive = triangle().meshes.remove(0).primitives.remove(0);
        primitive.indices.swap(0, 1);
        assert_eq!(primitive.winding_faults(), 1);
    }
}
