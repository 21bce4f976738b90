//! The animation "load steps": morph weights for bodies that deform, or nodes shown one after the other.

use gltf_json as json;
use json::Index;
use json::accessor::{ComponentType, Type};
use json::validation::Checked::Valid;

use super::buffers::{KEYFRAMES, accessor, append};
use super::document::File;

/// The key frames that all moving bodies share: times, s, and weights of the morph targets.
#[derive(Clone, Copy)]
pub(super) struct Clock {
    /// The time of each step.
    times: Index<json::Accessor>,
    /// The weights of all targets at the first step, then at the second, and so on.
    weights: Index<json::Accessor>,
}

impl File {
    /// Writes the key frames, one second per step. At each step the weight of the target of that step is 1,
    /// and all others are 0; step 0 has no target.
    pub(super) fn clock(&mut self, steps: usize) -> Clock {
        let times = self.seconds(steps);
        let weight = |step: usize, target: usize| if step == target { 1.0_f32 } else { 0.0 };
        let weights = append(
            &mut self.keyframes,
            (0..steps).flat_map(|s| (1..steps).map(move |t| weight(s, t).to_le_bytes())),
        );
        let weights = self.root.push(accessor(KEYFRAMES, weights, ComponentType::F32, Type::Scalar));
        Clock { times, weights }
    }

    /// The times of the steps, one second apart.
    pub(in crate::export) fn seconds(&mut self, steps: usize) -> Index<json::Accessor> {
        let times = append(&mut self.keyframes, (0..steps).map(|s| (s as f32).to_le_bytes()));
        let mut input = accessor(KEYFRAMES, times, ComponentType::F32, Type::Scalar);
        input.min = Some(vec![0.0_f32].into());
        input.max = Some(vec![steps.saturating_sub(1) as f32].into());
        self.root.push(input)
    }

    /// Shows a node at one of the steps and scales it to nothing at the others; `times` are those of all
    /// steps.
    pub(in crate::export) fn show_at(
        &mut self,
        node: Index<json::Node>,
        times: Index<json::Accessor>,
        step: usize,
        steps: usize,
    ) {
        let size = |s: usize| if s == step { 1.0_f32 } else { 0.0 };
        let scales = append(&mut self.keyframes, (0..steps).flat_map(|s| [size(s).to_le_bytes(); 3]));
        let output = self.root.push(accessor(KEYFRAMES, scales, ComponentType::F32, Type::Vec3));
        self.channels.push(json::animation::Channel {
            sampler: Index::new(self.samplers.len() as u32),
            target: json::animation::Target {
                extensions: None,
                extras: None,
                node,
                path: Valid(json::animation::Property::Scale),
            },
            extensions: None,
            extras: None,
        });
        self.samplers.push(json::animation::Sampler {
            extensions: None,
            extras: None,
            input: times,
            interpolation: Valid(json::animation::Interpolation::Step),
            output,
        });
    }

    /// Lets a node with morph targets follow the clock.
    pub(super) fn animate(&mut self, node: Index<json::Node>, clock: Clock) {
        if self.samplers.is_empty() {
            self.samplers.push(json::animation::Sampler {
                extensions: None,
                extras: None,
                input: clock.times,
                interpolation: Valid(json::animation::Interpolation::Linear),
                output: clock.weights,
            });
        }
        self.channels.push(json::animation::Channel {
            sampler: Index::new(0),
            target: json::animation::Target {
                extensions: None,
                extras: None,
                node,
                path: Valid(json::animation::Property::MorphTargetWeights),
            },
            extensions: None,
            extras: None,
        });
    }
}
