//! The materials of bodies, by their roles.

use gltf_json as json;
use json::validation::Checked::Valid;

use super::{BodyRole, PART};
use std::collections::HashMap;

/// The materials of bodies: one per role, but conductors and dielectrics take their colours in turn from a
/// list.
#[derive(Default)]
pub(in crate::export) struct Materials {
    /// The number of driven conductors so far.
    conductors: usize,
    /// The number of floating conductors so far.
    floating: usize,
    /// The number of bodies with the role [`BodyRole::Dielectric`] so far.
    dielectrics: usize,
    /// The colour of each of these bodies, by its name.
    given: HashMap<String, [u8; 3]>,
}

/// Driven conductors: vermilion, yellow, purple, black, rose, brown, peach (sRGB). They differ from the light
/// blue of the layer, and neighbours in the list differ from each other, in lightness too, for viewers with
/// colour blindness.
const DRIVEN: [[u8; 3]; 7] = [
    [0xD5, 0x5E, 0x00],
    [0xF0, 0xD0, 0x20],
    [0x5B, 0x2C, 0x83],
    [0x1E, 0x1E, 0x1E],
    [0xB8, 0x52, 0x7E],
    [0x7A, 0x43, 0x10],
    [0xF2, 0xB4, 0x8C],
];

/// Floating conductors: greens (sRGB).
const FLOATING: [[u8; 3]; 3] = [[0x00, 0x7A, 0x58], [0x6C, 0xB0, 0x3F], [0x0B, 0x4A, 0x2F]];

/// The layer (sRGB).
const LAYER: [u8; 3] = [0x56, 0xB4, 0xE9];

/// Dielectrics other than the layer, all of them pale (sRGB).
const DIELECTRICS: [[u8; 3]; 5] =
    [[0xC6, 0xB5, 0xE0], [0xBF, 0xD8, 0xA8], [0xF0, 0xC2, 0xD0], [0xA8, 0xBC, 0xE8], [0xE0, 0xD3, 0xA8]];

impl Materials {
    /// The material of the next body. `double_sided` for sheets, which are seen from both sides.
    pub(in crate::export) fn material(
        &mut self,
        name: &str,
        role: BodyRole,
        double_sided: bool,
    ) -> json::Material {
        let body = name.split(PART).next().unwrap_or(name);
        let given = &mut self.given;
        let mut next = |palette: &[[u8; 3]], count: &mut usize| {
            *given.entry(body.to_owned()).or_insert_with(|| {
                *count += 1;
                palette[(*count - 1) % palette.len()]
            })
        };
        // Only partly metallic: a pure metal is black in viewers that have no surroundings to mirror.
        let (colour, alpha, metallic, roughness) = match role {
            BodyRole::Conductor => (next(&DRIVEN, &mut self.conductors), 1.0, 0.2, 0.5),
            BodyRole::FloatingConductor => (next(&FLOATING, &mut self.floating), 1.0, 0.2, 0.5),
            BodyRole::GroundedConductor => ([0x8A, 0x8A, 0x8A], 1.0, 0.2, 0.5),
            BodyRole::Layer => (LAYER, 0.25, 0.0, 0.5),
            BodyRole::Dielectric => (next(&DIELECTRICS, &mut self.dielectrics), 0.35, 0.0, 0.5),
            BodyRole::Substrate => ([0xB8, 0xA0, 0x7A], 0.45, 0.0, 0.9),
            BodyRole::Cover => ([0xD8, 0xDC, 0xE0], 0.08, 0.0, 0.5),
            BodyRole::Wall => ([0x9A, 0xA0, 0xA8], 0.08, 0.0, 1.0),
            BodyRole::GroundedWall => ([0x3A, 0x44, 0x50], 0.2, 0.0, 1.0),
            BodyRole::Surroundings => ([0xC4, 0xD8, 0xEC], 0.05, 0.0, 1.0),
            BodyRole::Indenter => ([0x60, 0x68, 0x72], 0.4, 0.2, 0.5),
            BodyRole::ScaleBar => ([0x10, 0x10, 0x10], 1.0, 0.0, 1.0),
        };
        let [red, green, blue] = colour.map(linear);
        json::Material {
            name: Some(name.to_owned()),
            alpha_mode: Valid(if alpha < 1.0 {
                json::material::AlphaMode::Blend
            } else {
                json::material::AlphaMode::Opaque
            }),
            // Solids are not double-sided: the far faces of a translucent one would be drawn through the near
            // ones, in no order.
            double_sided,
            pbr_metallic_roughness: json::material::PbrMetallicRoughness {
                base_color_factor: json::material::PbrBaseColorFactor([red, green, blue, alpha]),
                metallic_factor: json::material::StrengthFactor(metallic),
                roughness_factor: json::material::StrengthFactor(roughness),
                ..Default::default()
            },
            ..Default::default()
        }
    }
}

/// The linear value, 0 to 1, that glTF requires, from an sRGB value, 0 to 255.
fn linear(srgb: u8) -> f32 {
    let x = f32::from(srgb) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear colour as seen without the cones for red, or without those for green: Vienot, Brettel and
    /// Mollon, Color Research and Application 24, 1999.
    fn seen_without(cones: usize, [r, g, b]: [f32; 3]) -> [f32; 3] {
        match cones {
            0 => {
                let mixed = 0.112_38 * r + 0.887_62 * g;
                [mixed, mixed, 0.004_01 * r - 0.004_01 * g + b]
            }
            _ => {
                let mixed = 0.292_75 * r + 0.707_25 * g;
                [mixed, mixed, -0.022_34 * r + 0.022_34 * g + b]
            }
        }
    }

    /// The colour as it is shown, on a scale like that of the eye.
    fn lightness(colour: [f32; 3]) -> [f32; 3] {
        colour.map(|x| x.max(0.0).powf(1.0 / 2.2))
    }

    fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
    }

    #[test]
    fn conductors_differ_from_the_layer_and_from_their_neighbours_without_red_or_green_cones_too() {
        let on_white = |colour: [u8; 3], alpha: f32| colour.map(|x| 1.0 - alpha + alpha * linear(x));
        let opaque = |colour: [u8; 3]| on_white(colour, 1.0);
        for cones in 0..3 {
            let seen = |colour| lightness(if cones < 2 { seen_without(cones, colour) } else { colour });
            // The colours of a thin and a thick layer.
            for alpha in [0.25, 1.0] {
                let layer = seen(on_white(LAYER, alpha));
                for colour in DRIVEN.iter().chain(&FLOATING) {
                    let apart = distance(seen(opaque(*colour)), layer);
                    assert!(apart > 0.3, "{colour:x?} {apart}, cones {cones}");
                }
            }
            for pair in DRIVEN.windows(2) {
                let apart = distance(seen(opaque(pair[0])), seen(opaque(pair[1])));
                assert!(apart > 0.25, "{pair:x?} {apart}, cones {cones}");
            }
            // A floating plate mostly lies between the first two driven ones.
            for driven in &DRIVEN[..2] {
                let apart = distance(seen(opaque(*driven)), seen(opaque(FLOATING[0])));
                assert!(apart > 0.15, "{driven:x?} {apart}, cones {cones}");
            }
        }
    }
}
