//! How bodies look: a material for each, by its role.

use gltf_json as json;
use json::validation::Checked::Valid;

use super::BodyRole;

/// Hands out materials: every role has its look, and each conductor and dielectric a colour of its own.
#[derive(Default)]
pub(in crate::export) struct Materials {
    conductors: usize,
    dielectrics: usize,
}

/// Metals that can be told apart: copper, silver, gold, rose, gunmetal, brass, verdigris, bronze (sRGB).
const METALS: [[u8; 3]; 8] = [
    [0xC8, 0x75, 0x33],
    [0xB4, 0xBC, 0xC8],
    [0xE6, 0xB4, 0x22],
    [0xC4, 0x5A, 0x6A],
    [0x54, 0x60, 0x6E],
    [0x9C, 0xA8, 0x2E],
    [0x3E, 0x8E, 0x7E],
    [0x7A, 0x4A, 0x2A],
];

/// Dielectrics other than the layer (sRGB).
const DIELECTRICS: [[u8; 3]; 5] =
    [[0x8E, 0x6C, 0xC0], [0x5F, 0xA8, 0x5B], [0xC8, 0x6F, 0xA0], [0x5B, 0x7F, 0xC8], [0xB0, 0x98, 0x60]];

impl Materials {
    /// The material of the next body. `double_sided` for sheets, which are seen from both sides.
    pub(in crate::export) fn material(
        &mut self,
        name: &str,
        role: BodyRole,
        double_sided: bool,
    ) -> json::Material {
        let next = |palette: &[[u8; 3]], count: &mut usize| {
            let colour = palette[*count % palette.len()];
            *count += 1;
            colour
        };
        // Only partly metallic: a pure metal is black in viewers that have no surroundings to mirror.
        let (colour, alpha, metallic, roughness) = match role {
            BodyRole::Conductor => (next(&METALS, &mut self.conductors), 1.0, 0.3, 0.4),
            BodyRole::Layer => ([0x5A, 0xB4, 0xD6], 0.3, 0.0, 0.4),
            BodyRole::Dielectric => (next(&DIELECTRICS, &mut self.dielectrics), 0.4, 0.0, 0.5),
            BodyRole::Substrate => ([0x9A, 0xA0, 0xA6], 1.0, 0.0, 0.9),
            BodyRole::Cover => ([0xD8, 0xDC, 0xE0], 0.2, 0.0, 0.3),
            BodyRole::Wall => ([0x9A, 0xA0, 0xA8], 0.12, 0.0, 1.0),
            BodyRole::Surroundings => ([0xC4, 0xD8, 0xEC], 0.06, 0.0, 1.0),
        };
        let [red, green, blue] = colour.map(linear);
        json::Material {
            name: Some(name.to_owned()),
            alpha_mode: Valid(if alpha < 1.0 {
                json::material::AlphaMode::Blend
            } else {
                json::material::AlphaMode::Opaque
            }),
            // The far faces of a translucent solid would be drawn through the near ones, in no order.
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

/// From an sRGB value, 0 to 255, to the linear one that glTF asks for, 0 to 1.
fn linear(srgb: u8) -> f32 {
    let x = f32::from(srgb) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}
