//! Rows of one bounce with every technique of indirect light but `sampled`, which has separate rows: one row with the defaults, and one for
//! every other value of each parameter with named values.

use lanternfish::{
    settings::{Indirect, Materials, Settings},
    techniques::Sampled,
};
use lanternfish_papers::DeepImageSettings;

use super::techniques::Technique;
use crate::ground_truths::GroundTruth;

/// The rows, with base colours as diffuse albedos, and with the file's materials.
pub fn bounces(default: &Settings) -> Vec<Technique> {
    let techniques = Indirect::all().into_iter().filter(|technique| !technique.is::<Sampled>());
    techniques.flat_map(|technique| of_technique(technique, default)).collect()
}

fn of_technique(technique: Indirect, default: &Settings) -> Vec<Technique> {
    let deep_images = DeepImageSettings { resolution: 64, ..DeepImageSettings::of(&default.structure) };
    let row = |name: String, ground_truth: GroundTruth, indirect| {
        let materials = if ground_truth == GroundTruth::OneBounce { Materials::Lambert } else { Materials::File };
        let settings = default.clone().with_indirect(indirect).with_materials(materials).with_structure(deep_images);
        Technique { name: format!("{ground_truth} {name}"), settings, ground_truth }
    };
    let name = technique.name().to_owned();
    let mut rows = vec![
        row(name.clone(), GroundTruth::OneBounce, technique.clone()),
        row(name.clone(), GroundTruth::OneBounceFile, technique.clone()),
    ];
    for (parameter, values) in technique.technique().expect("it is one").parameters() {
        for (value, _) in values {
            let mut other = technique.clone();
            other.technique_mut().expect("it is one").set(parameter.name, value).expect("it is one of its values");
            if other != technique {
                rows.push(row(format!("{name}, {} {value}", parameter.name), GroundTruth::OneBounce, other));
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_has_a_row() {
        lanternfish_papers::register();
        let rows = bounces(&Settings::direct_light());
        for name in [
            "one-bounce virtual-lights",
            "one-bounce-file virtual-lights",
            "one-bounce virtual-lights, vpl-ranges random",
        ] {
            assert_eq!(rows.iter().filter(|row| row.name == name).count(), 1, "{name}");
        }
        let settings: Vec<_> = rows.iter().map(|row| (&row.settings, row.ground_truth)).collect();
        for (i, row) in settings.iter().enumerate() {
            assert!(!settings[..i].contains(row), "{} twice", rows[i].name);
        }
    }
}
